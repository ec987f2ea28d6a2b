#include "calibration.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <nlopt.hpp>
#include <regex>

#include "jackal_aic/config/yaml_text.hpp"
#include "parallel.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kDeadTimeSpread = 0.002;  // s

std::string written(double value) { return yamlNumber(value, 3); }

double rounded(double value, double resolution) {
  if (resolution > 0.0) value = resolution * std::round(value / resolution);
  return std::strtod(written(value).c_str(), nullptr);
}

/// A row of the thesis and the loop that is compared with it.
struct ComparedRow {
  ThesisStep thesis;
  Integrator integrator;
  LoopSetup setup;
};

std::vector<ComparedRow> readRows(const PackageFiles& files, const std::vector<std::string>& tables) {
  const ThesisTables thesis(files.path("sim/thesis/tables.yaml"));
  std::vector<ComparedRow> rows;
  for (const auto& table : tables) {
    for (const ThesisStep& step : thesis.steps(table)) {
      const Integrator integrator = comparableIntegrator(files, step);
      rows.push_back({step, integrator, thesisSetup(files, step, integrator)});
    }
  }
  return rows;
}

/// The rows on a plant without noise against those of the thesis.
std::vector<Residual> residuals(const std::vector<ComparedRow>& rows, const PlantParameters& plant, unsigned jobs) {
  std::vector<Residual> list(rows.size());
  parallelFor(rows.size(), jobs, [&](std::size_t i) {
    LoopSetup setup = rows[i].setup;
    setup.plant = plant;
    setup.plant.noise_scale = 0.0;
    const ResultRow row = runThesisStep(setup, rows[i].thesis).row;
    list[i] = {rows[i].thesis, rows[i].integrator, row.settling_s, row.rise_s};
  });
  return list;
}

/// Parameters in the unit cube, logarithmic in their ranges.
class Fit {
 public:
  Fit(const PackageFiles& files, const CalibrationTask& task, unsigned jobs,
      const std::function<void(int, double)>& progress)
      : rows_(readRows(files, task.fitted)), task_(task), jobs_(jobs), progress_(progress) {
    best_.plant = loadSetup(files, "diff_drive", task.plant, {}).plant;
    start_ = best_.plant;
  }

  /// Takes the plant as it is as the first candidate.
  void start() { evaluate(position(start_)); }

  void search(nlopt::algorithm algorithm, int evaluations) {
    const std::size_t n = task_.parameters.size();
    nlopt::opt optimizer(algorithm, static_cast<unsigned>(n));
    optimizer.set_lower_bounds(0.0);
    optimizer.set_upper_bounds(1.0);
    optimizer.set_initial_step(0.05);
    optimizer.set_maxeval(evaluations);
    optimizer.set_xtol_abs(1e-4);
    optimizer.set_min_objective(&Fit::objective, this);
    std::vector<double> x = best_x_;
    double error = 0.0;
    try {
      optimizer.optimize(x, error);
    } catch (const nlopt::roundoff_limited&) {  // as good as it gets
    } catch (const nlopt::forced_stop&) {
      std::rethrow_exception(failure_);
    }
  }

  Calibration best() {
    best_.error = meanError(residuals(rows_, best_.plant, jobs_));
    return best_;
  }

 private:
  static double objective(const std::vector<double>& x, std::vector<double>&, void* self) {
    Fit& fit = *static_cast<Fit*>(self);
    try {
      return fit.evaluate(x);
    } catch (...) {  // NLopt would replace the message by its own
      fit.failure_ = std::current_exception();
      throw nlopt::forced_stop();
    }
  }

  /// Where the plant lies in the unit cube; outside of it, on its face.
  std::vector<double> position(const PlantParameters& plant) const {
    std::vector<double> x;
    for (const FitParameter& p : task_.parameters) {
      const double value = std::clamp(plant.*p.member, p.low, p.high);
      x.push_back(std::log(value / p.low) / std::log(p.high / p.low));
    }
    return x;
  }

  double evaluate(const std::vector<double>& x) {
    PlantParameters plant = start_;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const FitParameter& p = task_.parameters[i];
      plant.*p.member = rounded(p.low * std::pow(p.high / p.low, x[i]), p.resolution);
    }
    const double cost = robustCost(plant);
    if (cost < best_cost_) {
      best_cost_ = cost;
      best_.plant = plant;
      best_x_ = x;
    }
    if (progress_) progress_(++evaluations_, best_cost_);
    return cost;
  }

  double robustCost(PlantParameters plant) const {
    const double dead_time = plant.dead_time;
    double sum = 0.0;
    for (const double offset : {-kDeadTimeSpread, 0.0, kDeadTimeSpread}) {
      plant.dead_time = dead_time + offset;
      sum += meanError(residuals(rows_, plant, jobs_));
    }
    return sum / 3.0;
  }

  std::vector<ComparedRow> rows_;
  const CalibrationTask& task_;
  unsigned jobs_;
  const std::function<void(int, double)>& progress_;
  PlantParameters start_;
  Calibration best_;
  std::vector<double> best_x_;
  double best_cost_ = HUGE_VAL;
  int evaluations_ = 0;
  std::exception_ptr failure_;
};

}  // namespace

const std::vector<CalibrationTask>& calibrationTasks() {
  static const std::vector<CalibrationTask> tasks{
      {"box",
       "plant_box.yaml",
       {"5-2", "5-4", "5-6", "5-9"},
       {"5-5", "5-1"},
       {{"dead_time", &PlantParameters::dead_time, 0.03, 0.16, JackalPlant::kStep},
        {"motor_lag", &PlantParameters::motor_lag, 0.01, 0.12},
        {"velocity_loop_integral", &PlantParameters::velocity_loop_integral, 1.0, 30.0}}},
      {"ground",
       "plant.yaml",
       {"3-1a", "3-1b"},
       {},
       {{"dead_time", &PlantParameters::dead_time, 0.03, 0.2, JackalPlant::kStep},
        {"motor_lag", &PlantParameters::motor_lag, 0.002, 0.12},
        {"velocity_loop_integral", &PlantParameters::velocity_loop_integral, 0.1, 30.0},
        {"acceleration_limit", &PlantParameters::acceleration_limit, 0.8, 10.0}}}};
  return tasks;
}

std::vector<double> Residual::errors() const {
  std::vector<double> list;
  const auto add = [&](const std::optional<double>& ours, const std::optional<double>& theirs) {
    if (!theirs) return;
    list.push_back(ours && *ours > 0.0 ? std::min(kMissing, std::abs(std::log(*ours / *theirs))) : kMissing);
  };
  add(settling, thesis.settling);
  add(rise, thesis.rise);
  return list;
}

std::vector<Residual> residuals(const PackageFiles& files, const std::vector<std::string>& tables,
                                const PlantParameters& plant, unsigned jobs) {
  return residuals(readRows(files, tables), plant, jobs);
}

double meanError(const std::vector<Residual>& residuals) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const Residual& residual : residuals) {
    for (const double error : residual.errors()) {
      sum += error;
      ++count;
    }
  }
  if (count == 0) throw ParameterError("tables: no settling or rise time to compare with");
  return sum / static_cast<double>(count);
}

Calibration calibrate(const PackageFiles& files, const CalibrationTask& task, int evaluations, unsigned jobs,
                      const std::function<void(int, double)>& progress) {
  Fit fit(files, task, jobs, progress);
  fit.start();
  fit.search(nlopt::GN_DIRECT_L, evaluations);
  fit.search(nlopt::LN_SBPLX, evaluations);
  return fit.best();
}

std::string withFittedValues(std::string yaml, const CalibrationTask& task, const PlantParameters& plant) {
  for (const FitParameter& parameter : task.parameters) {
    const std::regex line("(\\n +" + std::string(parameter.name) + ": )([^ \\n]+ *)");
    std::smatch match;
    if (!std::regex_search(yaml, match, line)) throw ParameterError(task.file + ": has no key " + parameter.name);
    std::string value = written(plant.*parameter.member);
    value.resize(std::max(value.size() + 1, static_cast<std::size_t>(match.length(2))), ' ');
    yaml = match.prefix().str() + match.str(1) + value + match.suffix().str();
  }
  return yaml;
}

}  // namespace jackal_aic::sim
