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

constexpr double kDeadTimes[] = {-0.002, 0.0, 0.002};             // beside the plant's [s]
constexpr double kSettlingBands[] = {0.04, kSettlingBand, 0.06};  // of the final value

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

/// One row on a plant without noise.
RunResult runOn(const ComparedRow& row, PlantParameters plant, double dead_time) {
  LoopSetup setup = row.setup;
  plant.dead_time = dead_time;
  plant.noise_scale = 0.0;
  setup.plant = plant;
  return runThesisStep(setup, row.thesis);
}

/// The rows on a plant against those of the thesis.
std::vector<Residual> residuals(const std::vector<ComparedRow>& rows, const PlantParameters& plant, unsigned jobs) {
  std::vector<Residual> list(rows.size());
  parallelFor(rows.size(), jobs, [&](std::size_t i) {
    const ResultRow row = runOn(rows[i], plant, plant.dead_time).row;
    list[i] = {rows[i].thesis, rows[i].integrator, row.settling_s, row.rise_s};
  });
  return list;
}

/// As residuals(), once for each of kDeadTimes and kSettlingBands.
std::vector<std::vector<Residual>> spreadResiduals(const std::vector<ComparedRow>& rows, const PlantParameters& plant,
                                                   unsigned jobs) {
  constexpr std::size_t kBands = std::size(kSettlingBands);
  std::vector<std::vector<Residual>> lists(std::size(kDeadTimes) * kBands, std::vector<Residual>(rows.size()));
  parallelFor(rows.size(), jobs, [&](std::size_t i) {
    for (std::size_t d = 0; d < std::size(kDeadTimes); ++d) {
      const std::vector<Sample> samples = runOn(rows[i], plant, plant.dead_time + kDeadTimes[d]).samples;
      for (std::size_t b = 0; b < kBands; ++b) {
        const ResponseMetrics metrics = assess(samples, thesisProfile(rows[i].thesis), kSettlingBands[b]);
        lists[d * kBands + b][i] = {rows[i].thesis, rows[i].integrator, metrics.settling, metrics.rise};
      }
    }
  });
  return lists;
}

/// Those of the rows that stand in one of these tables.
std::vector<Residual> ofTables(const std::vector<Residual>& all, const std::vector<std::string>& tables) {
  std::vector<Residual> some;
  std::copy_if(all.begin(), all.end(), std::back_inserter(some), [&](const Residual& row) {
    return std::find(tables.begin(), tables.end(), row.thesis.table) != tables.end();
  });
  return some;
}

/// Parameters in the unit cube, logarithmic in their ranges.
class Fit {
 public:
  Fit(const PackageFiles& files, const CalibrationTask& task, unsigned jobs,
      const std::function<void(int, double)>& progress)
      : rows_(readRows(files, task.tables)), task_(task), jobs_(jobs), progress_(progress) {}

  /// The first candidate, from which comes what is not fitted.
  void start(const PlantParameters& plant) {
    start_ = best_.plant = plant;
    evaluate(position(start_));
  }

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
    const double cost = spreadCost(plant);
    if (cost < best_cost_) {
      best_cost_ = cost;
      best_.plant = plant;
      best_x_ = x;
    }
    if (progress_) progress_(++evaluations_, best_cost_);
    return cost;
  }

  double spreadCost(const PlantParameters& plant) const {
    const auto lists = spreadResiduals(rows_, plant, jobs_);
    double sum = 0.0;
    for (const auto& list : lists) sum += meanError(list) + trendError(ofTables(list, task_.trends));
    return sum / static_cast<double>(lists.size());
  }

  std::vector<ComparedRow> rows_;
  const CalibrationTask& task_;
  unsigned jobs_;
  std::function<void(int, double)> progress_;
  PlantParameters start_;
  Calibration best_;
  std::vector<double> best_x_;
  double best_cost_ = HUGE_VAL;
  int evaluations_ = 0;
  std::exception_ptr failure_;
};

/// The row before the i-th of its table: in the same column, else in the same line; null if there is none.
const Residual* previousOf(const std::vector<Residual>& residuals, std::size_t i) {
  for (const auto member : {&ThesisStep::column, &ThesisStep::row}) {
    for (std::size_t k = i; k-- > 0;) {
      const ThesisStep &a = residuals[k].thesis, &b = residuals[i].thesis;
      if (a.table == b.table && a.*member == b.*member) return &residuals[k];
    }
  }
  return nullptr;
}

}  // namespace

const std::vector<CalibrationTask>& calibrationTasks() {
  static const std::vector<CalibrationTask> tasks{
      {"box",
       "plant_box.yaml",
       {"5-1", "5-2", "5-4", "5-5", "5-6", "5-9"},
       {"5-4", "5-5", "5-9"},
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

double trendError(const std::vector<Residual>& residuals) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 1; i < residuals.size(); ++i) {
    const Residual *slow = previousOf(residuals, i), *fast = &residuals[i];
    if (slow == nullptr || !slow->thesis.settling || !fast->thesis.settling) continue;
    if (*slow->thesis.settling < *fast->thesis.settling) std::swap(slow, fast);
    const bool both = slow->settling.value_or(0.0) > 0.0 && fast->settling.value_or(0.0) > 0.0;
    const auto fall = [](const auto& a, const auto& b) { return std::log(*a / *b); };
    const double thesis = fall(slow->thesis.settling, fast->thesis.settling);
    sum += both ? std::max(0.0, thesis - fall(slow->settling, fast->settling)) : kMissing;
    ++count;
  }
  return count > 0 ? sum / count : 0.0;
}

Calibration calibrate(const PackageFiles& files, const CalibrationTask& task, int evaluations, unsigned jobs,
                      const std::function<void(int, double)>& progress) {
  Fit fit(files, task, jobs, progress);
  fit.start(loadSetup(files, "diff_drive", task.plant, {}).plant);
  fit.search(nlopt::GN_DIRECT_L, evaluations);
  fit.search(nlopt::LN_SBPLX, evaluations);
  return fit.best();
}

double leaveOneOutError(const PackageFiles& files, CalibrationTask task, const std::string& table,
                        const PlantParameters& start, int evaluations, unsigned jobs) {
  task.tables.erase(std::remove(task.tables.begin(), task.tables.end(), table), task.tables.end());
  Fit fit(files, task, jobs, {});
  fit.start(start);
  fit.search(nlopt::LN_SBPLX, evaluations);
  return meanError(residuals(files, {table}, fit.best().plant, jobs));
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
