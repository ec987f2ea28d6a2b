#include "baseline_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <nlopt.hpp>
#include <optional>

#include "bounds.hpp"
#include "campaign.hpp"
#include "parallel.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kLimits[] = {1.3, 1.4, 1.5, 1.6, 1.8, 2.0};  // of Ms
constexpr double kDriven = 1.6;                               // Ms of those that are driven
constexpr int kEvaluations = 200;                             // of a search from one start
constexpr double kViolation = 1e3;                            // of the logarithm of the IAE, per that of a bound missed
constexpr double kUnstable = 5.0;                             // logarithm in the place of an infinite one
constexpr double kReserve = 1e-3;                             // by which the search keeps the bounds
constexpr double kDeadTimeFactors[] = {0.5, 1.5};             // of the robot / of the model
const char* const kDrivenCases[] = {"0.5 m/s", "gain 0.8", "gain 1.2", "load of 0.5 rad/s"};

/// Logarithms of bound and figure that are to be negative: of Ms, gain and delay margin.
std::array<double, 3> excess(const LoopFigures& figures, const RobustnessBounds& bounds) {
  if (!figures.stable) return {kUnstable, kUnstable, kUnstable};
  const auto log = [](double ratio) { return std::clamp(std::log(ratio), -kUnstable, kUnstable) + kReserve; };
  return {log(figures.peak_sensitivity / bounds.peak_sensitivity), log(bounds.margins.gain / figures.gain_margin),
          log(bounds.margins.delay / figures.delay_margin)};
}

/// A search in the logarithms of what is tuned.
class Search {
 public:
  Search(const Baseline& structure, const PlantModel& model, const GeometryParameters& geometry,
         const RobustnessBounds& bounds)
      : structure_(structure), model_(withoutLimit(model)), geometry_(geometry), bounds_(bounds) {}

  /// Goes on from some values. @returns the best so far.
  const TunedBaseline& from(const std::vector<double>& start) {
    evaluate(logarithmsOf(start));
    if (structure_.tuned.empty()) return best_;
    descend(nlopt::LN_SBPLX, start);          // finds its way into the bounds
    descend(nlopt::LN_COBYLA, best_.values);  // and along them
    return best_;
  }

 private:
  static std::vector<double> logarithmsOf(std::vector<double> values) {
    for (double& value : values) value = std::log(value);
    return values;
  }

  std::vector<double> bounds(double Tunable::*member) const {
    std::vector<double> values;
    for (const Tunable& tunable : structure_.tuned) values.push_back(tunable.*member);
    return logarithmsOf(values);
  }

  void descend(nlopt::algorithm algorithm, const std::vector<double>& start) {
    nlopt::opt optimizer(algorithm, static_cast<unsigned>(structure_.tuned.size()));
    optimizer.set_lower_bounds(bounds(&Tunable::low));
    optimizer.set_upper_bounds(bounds(&Tunable::high));
    optimizer.set_initial_step(0.5);
    optimizer.set_xtol_abs(1e-3);
    optimizer.set_maxeval(kEvaluations);
    penalised_ = algorithm != nlopt::LN_COBYLA;
    if (!penalised_) optimizer.add_inequality_mconstraint(&Search::constraints, this, std::vector<double>(3, 1e-6));
    optimizer.set_min_objective(&Search::objective, this);
    std::vector<double> x = logarithmsOf(start);
    double cost = 0.0;
    try {
      optimizer.optimize(x, cost);
    } catch (const nlopt::roundoff_limited&) {  // as good as it gets
    }
  }

  static double objective(const std::vector<double>& x, std::vector<double>&, void* self) {
    Search& search = *static_cast<Search*>(self);
    const LoopFigures figures = search.evaluate(x);
    return search.penalised_ ? search.cost(figures) : logarithm(figures.iae);
  }

  static void constraints(unsigned count, double* result, unsigned size, const double* x, double*, void* self) {
    Search& search = *static_cast<Search*>(self);
    const auto values = excess(search.evaluate({x, x + size}), search.bounds_);
    std::copy_n(values.begin(), count, result);
  }

  static double logarithm(double iae) { return std::min(kUnstable, std::log(iae)); }

  double cost(const LoopFigures& figures) const {
    double cost = logarithm(figures.iae);
    for (const double value : excess(figures, bounds_)) cost += kViolation * std::max(0.0, value);
    return cost;
  }

  /// Figures of the values with these logarithms.
  const LoopFigures& evaluate(const std::vector<double>& x) {
    if (x == x_) return figures_;
    x_ = x;
    std::vector<double> values;
    std::transform(x.begin(), x.end(), std::back_inserter(values), [](double log) { return std::exp(log); });
    figures_ = loopFigures([&] { return structure_.make(values, model_, geometry_); }, model_, geometry_);
    if (best_.values.size() < values.size() || cost(figures_) < cost(best_.figures)) best_ = {values, figures_};
    if (values.empty()) best_.figures = figures_;
    return figures_;
  }

  const Baseline& structure_;
  PlantModel model_;
  const GeometryParameters& geometry_;
  const RobustnessBounds& bounds_;
  bool penalised_ = true;                 // the cost holds the bounds, else the constraints do
  std::optional<std::vector<double>> x_;  // of figures_
  LoopFigures figures_{};
  TunedBaseline best_{};
};

/// A case that is driven, and its bound.
struct DrivenCase {
  BoundedCase bounded;
  double bound;
};

/// A structure on a plant.
struct Case {
  const Baseline* structure;
  const char* plant;
  const std::vector<DrivenCase>* driven;
};

/// What is written of it.
struct Lines {
  std::string front, driven;
};

/// The predictive preset's setup with another controller on it.
LoopSetup setupOf(const PackageFiles& files, const Case& c, const std::vector<double>& values) {
  LoopSetup setup = loadSetup(files, "predictive", c.plant, {{"plant.noise_scale", "0"}});
  const DriveParameters& drive = setup.drive;
  setup.structure = [structure = c.structure, values, model = *drive.plant_model, geometry = drive.geometry] {
    return structure->make(values, model, geometry);
  };
  return setup;
}

std::string valuesOf(const Case& c, const TunedBaseline& tuned) {
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < tuned.values.size(); ++i) {
    texts.push_back(fmt::format("{}={:.3g}", c.structure->tuned[i].name, tuned.values[i]));
  }
  return fmt::format("{}", fmt::join(texts, " "));
}

std::string lineOf(const Case& c, const LoopSetup& setup, double limit, const TunedBaseline& tuned) {
  const PlantModel model = withoutLimit(*setup.drive.plant_model);
  const GeometryParameters& geometry = setup.drive.geometry;
  const LoopFigures& f = tuned.figures;
  std::string line = fmt::format("{},{},{},{:d},{:.3f},{:.3g},{:.3f},{:.3f},{:.3f}", c.structure->name, c.plant, limit,
                                 keeps(f, {limit}), f.peak_sensitivity, f.gain_margin, f.delay_margin,
                                 f.iae / leastLinearIae(model, geometry), f.noise);
  for (const double factor : kDeadTimeFactors) {
    PlantModel robot = model;
    robot.dead_time *= factor;
    const LoopFigures wrong =
        loopFigures([&] { return c.structure->make(tuned.values, model, geometry); }, robot, geometry);
    line += fmt::format(",{:.3f},{:.3f}", wrong.peak_sensitivity, wrong.iae / leastLinearIae(robot, geometry));
  }
  return line + fmt::format(",{}\n", valuesOf(c, tuned));
}

/// Cases on a plant, the same for all structures.
std::vector<DrivenCase> drivenCases(const PackageFiles& files, const std::string& plant) {
  const LoopSetup open_loop = loadSetup(files, "diff_drive", plant, {{"plant.noise_scale", "0"}});
  std::vector<DrivenCase> cases;
  for (const BoundedCase& bounded : boundedCases()) {
    const auto found = std::find(std::begin(kDrivenCases), std::end(kDrivenCases), std::string(bounded.name));
    if (found != std::end(kDrivenCases)) cases.push_back({bounded, boundOf(open_loop, bounded)});
  }
  return cases;
}

std::string drivenLine(const PackageFiles& files, const Case& c, const TunedBaseline& tuned) {
  const LoopSetup setup = setupOf(files, c, tuned.values);
  std::string line = fmt::format("{},{}", c.structure->name, c.plant);
  for (const auto& [bounded, bound] : *c.driven) {
    line += fmt::format(",{:.3f}", BoundedFigure{figureOf(setup, bounded), bound}.ofBound());
  }
  return line + "\n";
}

/// From the strictest limit of Ms to the widest, each beginning with what was found for the one before.
Lines linesOf(const PackageFiles& files, const Case& c) {
  const LoopSetup setup = loadSetup(files, "predictive", c.plant, {});
  std::vector<double> neighbour = c.structure->start();
  Lines lines;
  for (const double limit : kLimits) {
    if (neighbour.empty() && limit != kDriven) continue;  // there is nothing to tune
    const TunedBaseline tuned = tune(*c.structure, *setup.drive.plant_model, setup.drive.geometry, {limit}, neighbour);
    neighbour = tuned.values;
    lines.front += lineOf(c, setup, limit, tuned);
    if (limit == kDriven) lines.driven = drivenLine(files, c, tuned);
  }
  return lines;
}

}  // namespace

std::vector<Baseline> comparedStructures(const PredictiveParameters& preset) {
  std::vector<Baseline> list = controlBaselines();
  const auto predictive = [preset](const std::vector<double>& values, const PlantModel& model,
                                   const GeometryParameters& geometry) {
    PredictiveParameters parameters = preset;
    parameters.learn_drive_train = false;  // margins are those of the model as it was told, as of all structures
    if (!values.empty()) {
      parameters.speed_process_noise = values[0];
      parameters.disturbance_process_noise = values[1];
      parameters.action_learning_rate = values[2];
    }
    return std::make_unique<PredictiveController>(parameters, geometry, model);
  };
  list.push_back({"predictive",
                  "predictive active inference",
                  {{"speed_process_noise", preset.speed_process_noise, 1e-4, 1.0},
                   {"disturbance_process_noise", preset.disturbance_process_noise, 1e-5, 100.0},
                   {"action_learning_rate", preset.action_learning_rate, 0.05, 1.0}},
                  predictive});
  list.push_back({"predictive_preset", "the same as its preset has it", {}, predictive});
  return list;
}

bool keeps(const LoopFigures& figures, const RobustnessBounds& bounds) {
  return figures.stable && figures.peak_sensitivity <= bounds.peak_sensitivity &&
         figures.gain_margin >= bounds.margins.gain && figures.delay_margin >= bounds.margins.delay;
}

TunedBaseline tune(const Baseline& structure, const PlantModel& model, const GeometryParameters& geometry,
                   const RobustnessBounds& bounds, const std::vector<double>& start) {
  Search search(structure, model, geometry, bounds);
  search.from(structure.start());
  return search.from(start);
}

void writeBaselineTables(const PackageFiles& files, const std::string& directory, unsigned jobs) {
  const LoopSetup preset = loadSetup(files, "predictive", "ground", {});
  const auto structures = comparedStructures(std::get<PredictiveParameters>(preset.drive.controller));
  std::vector<Case> cases;
  const auto driven_cases = parallelResults("bounds", std::size(kCalibratedPlants), jobs,
                                            [&](std::size_t i) { return drivenCases(files, kCalibratedPlants[i]); });
  for (std::size_t i = 0; i < driven_cases.size(); ++i) {
    for (const Baseline& structure : structures) cases.push_back({&structure, kCalibratedPlants[i], &driven_cases[i]});
  }
  // The last structures take longest: they begin first, so that no one of them is left alone at the end.
  const std::size_t last = cases.size() - 1;
  auto lines =
      parallelResults("baselines", cases.size(), jobs, [&](std::size_t i) { return linesOf(files, cases[last - i]); });
  std::reverse(lines.begin(), lines.end());
  std::string front =
      "structure,plant,ms_limit,kept,ms,gain_margin,delay_margin_s,iae_of_bound,noise_gain,ms_half_dead_time,"
      "iae_half_dead_time,ms_longer_dead_time,iae_longer_dead_time,values\n";
  std::string driven = "structure,plant,step_of_bound,gain_0.8_of_bound,gain_1.2_of_bound,load_of_bound\n";
  for (const Lines& some : lines) {
    front += some.front;
    driven += some.driven;
  }
  writeTable(directory, "baselines.csv", front);
  writeTable(directory, "baselines_driven.csv", driven);
}

}  // namespace jackal_aic::sim
