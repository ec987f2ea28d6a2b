#include "experiment_table.hpp"

#include <yaml-cpp/yaml.h>

#include <cmath>

#include "comparison.hpp"
#include "jackal_aic/aic/belief_update.hpp"
#include "jackal_aic/certificate/state_space_model.hpp"
#include "jackal_aic/config/text.hpp"
#include "usable_range.hpp"
#include "yaml_fields.hpp"

namespace jackal_aic::sim {
namespace {

constexpr const char* kStateSpace = "state_space";
constexpr Integrator kIntegrators[] = {Integrator::euler, Integrator::exact};

Overrides withIntegrator(Overrides overrides, Integrator integrator) {
  overrides.emplace_back("controller.integrator", kIntegratorNames[static_cast<std::size_t>(integrator)]);
  return overrides;
}

/// A run of a loop, once per integrator if the controller has one.
void addLoopRuns(const PackageFiles& files, const std::string& controller, const std::string& plant,
                 const Overrides& overrides, const SetPointProfile& profile, std::vector<Run>& runs) {
  const auto add = [&](const Overrides& all) {
    runs.emplace_back(
        [setup = loadPrintedSetup(files, controller, plant, all), profile] { return runSetup(setup, profile); });
  };
  if (controller == kDifferentialDrive) return add(overrides);
  for (const Integrator integrator : kIntegrators) add(withIntegrator(overrides, integrator));
}

/// The point mass model of chapter 4 as a run: its output is the velocity, its belief the belief.
RunResult runStateSpace(const std::string& controller, const ThesisSetup& setup, double set_point) {
  const StateSpaceModel model = stateSpaceModel(setup.controller);
  StateSpaceRun run;
  run.dt = setup.controller.beliefStep();
  run.duration = kStepDuration;
  run.set_point = set_point;
  const StateSpaceResponse response = simulate(model, run);

  const SetPointProfile profile = stepProfile(set_point, 0.0, kStepDuration);
  RunResult result;
  for (std::size_t k = 0; k < response.time.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    const double velocity = response.output(column);
    const double wheel = velocity / setup.geometry.wheel_radius;
    Sample sample{};
    sample.time = kRestTime + response.time[k];
    sample.set_point = profile.at(sample.time);
    sample.velocity = sample.measured_velocity = velocity;
    sample.belief = BodyVector(response.states(0, column), 0.0, 0.0);
    sample.command = {wheel, wheel};
    result.samples.push_back(sample);
  }
  result.row.controller = controller;
  result.row.plant = kStateSpace;
  describeController(setup.controller, result.row);
  describeStep(profile, result.row);
  describeResponse(assess(result.samples, profile), result.row);
  return result;
}

Run comparedRun(const PackageFiles& files, const ThesisStep& step, Integrator integrator) {
  return [setup = thesisSetup(files, step, integrator), step] { return runThesisStep(setup, step); };
}

std::vector<Run> thesisStepRuns(const PackageFiles& files, const ThesisTables& thesis, const YAML::Node& node) {
  std::vector<Run> runs;
  for (const ThesisStep& step : thesis.steps(node["table"].as<std::string>())) {
    if (step.controller == kDifferentialDrive) {
      runs.emplace_back(comparedRun(files, step, Integrator::exact));
      continue;
    }
    for (const Integrator integrator : kIntegrators) runs.emplace_back(comparedRun(files, step, integrator));
  }
  return runs;
}

std::vector<Run> stepRuns(const PackageFiles& files, const YAML::Node& node) {
  std::vector<Run> runs;
  for (const YAML::Node& entry : node["runs"]) {
    const auto controller = entry["controller"].as<std::string>();
    const auto plant = entry["plant"].as<std::string>();
    const auto step = entry["step"].as<double>();
    const Overrides overrides = readOverrides(entry["set"], "");
    const std::size_t first = runs.size();
    if (plant == kStateSpace) {
      const ThesisSetup setup = loadThesis(files, controller, withIntegrator(overrides, Integrator::euler));
      runs.emplace_back([controller, setup, step] { return runStateSpace(controller, setup, step); });
    } else {
      addLoopRuns(files, controller, plant, overrides, stepProfile(step, 0.0, kStepDuration), runs);
    }
    const auto label = entry["label"].as<std::string>("");
    for (std::size_t i = first; i < runs.size(); ++i) {
      runs[i] = [run = runs[i], label] {
        RunResult result = run();
        result.row.label = label;
        return result;
      };
    }
  }
  return runs;
}

std::vector<Run> squareRuns(const PackageFiles& files, const ThesisTables& thesis, const YAML::Node& node) {
  std::vector<Run> runs;
  for (const ThesisSquare& square : thesis.squares(node["table"].as<std::string>())) {
    const SetPointProfile profile =
        squareProfile({square.minimum, square.maximum, node["period"].as<double>(), node["cycles"].as<int>()});
    for (const YAML::Node& controller : node["controllers"]) {
      addLoopRuns(files, controller.as<std::string>(), node["plant"].as<std::string>(), {}, profile, runs);
    }
  }
  return runs;
}

std::vector<Run> rangeRuns(const PackageFiles& files, const ThesisTables& thesis, const YAML::Node& node) {
  std::vector<Run> runs;
  for (const ThesisLimit& limit : thesis.limits(node["table"].as<std::string>())) {
    for (const Integrator integrator : kIntegrators) {
      for (Run& run : usableRangeRuns(files, limit, integrator)) runs.push_back(std::move(run));
    }
  }
  return runs;
}

std::vector<Run> runsOf(const PackageFiles& files, const YAML::Node& node) {
  const ThesisTables thesis(files.path("sim/thesis/tables.yaml"));
  const auto kind = node["kind"].as<std::string>();
  if (kind == "thesis_steps") return thesisStepRuns(files, thesis, node);
  if (kind == "steps") return stepRuns(files, node);
  if (kind == "squares") return squareRuns(files, thesis, node);
  if (kind == "usable_range") return rangeRuns(files, thesis, node);
  if (kind == "comparison") return comparisonRuns(files, node);
  if (kind == "perturbations") return perturbationRuns(files, node);
  if (kind == "perturbation_pairs") return pairRuns(files, node);
  if (kind == "belief_accuracy") return beliefAccuracyRuns(files, node);
  throw ParameterError("kind = '" + kind +
                       "': unknown; known: thesis_steps, steps, squares, usable_range, comparison, " +
                       "perturbations, perturbation_pairs, belief_accuracy");
}

/// The run with the name of its experiment in the row.
Run named(Run run, const std::string& experiment) {
  return [run = std::move(run), experiment] {
    RunResult result = run();
    result.row.experiment = experiment;
    return result;
  };
}

}  // namespace

ExperimentTable::ExperimentTable(const PackageFiles& files)
    : files_(files), path_(files.path("sim/experiments/experiments.yaml")) {}

std::vector<ExperimentSummary> ExperimentTable::list() const {
  return guardYaml(path_, [&] {
    std::vector<ExperimentSummary> list;
    for (const YAML::Node& node : YAML::LoadFile(path_)["experiments"]) {
      ExperimentSummary summary{node["name"].as<std::string>(), node["title"].as<std::string>(), {}};
      for (const YAML::Node& figure : node["figures"]) {
        const auto id = figure["figure"].as<std::string>();
        if (summary.figures.empty() || summary.figures.back() != id) summary.figures.push_back(id);
      }
      list.push_back(summary);
    }
    return list;
  });
}

std::vector<Run> ExperimentTable::runs(const std::string& name) const {
  return guardYaml(path_, [&] {
    std::string names;
    for (const YAML::Node& node : YAML::LoadFile(path_)["experiments"]) {
      const auto known = node["name"].as<std::string>();
      names += (names.empty() ? "" : ", ") + known;
      if (known != name) continue;
      std::vector<Run> runs;
      for (Run& run : runsOf(files_, node)) runs.push_back(named(std::move(run), name));
      return runs;
    }
    throw ParameterError("experiment = " + quoted(name) + ": unknown; known: all, " + names);
  });
}

LoopSetup thesisSetup(const PackageFiles& files, const ThesisStep& step, Integrator integrator) {
  const bool open_loop = step.controller == kDifferentialDrive;
  return loadPrintedSetup(files, step.controller, step.plant,
                          open_loop ? step.overrides : withIntegrator(step.overrides, integrator));
}

SetPointProfile thesisProfile(const ThesisStep& step) { return stepProfile(step.step, 0.0, kStepDuration); }

RunResult runThesisStep(const LoopSetup& setup, const ThesisStep& step) {
  RunResult result = runSetup(setup, thesisProfile(step));
  result.row.thesis_settling_s = step.settling;
  result.row.thesis_rise_s = step.rise;
  return result;
}

RunResult runThesisStep(const PackageFiles& files, const ThesisStep& step, Integrator integrator) {
  return runThesisStep(thesisSetup(files, step, integrator), step);
}

Integrator comparableIntegrator(const PackageFiles& files, const ThesisStep& step) {
  if (step.controller == kDifferentialDrive) return Integrator::exact;
  const ThesisSetup setup = loadThesis(files, step.controller, step.overrides);
  return beliefConverges(setup, Integrator::euler) ? Integrator::euler : Integrator::exact;
}

bool beliefConverges(ThesisSetup setup, Integrator integrator) {
  setup.controller.integrator = integrator;
  const BeliefUpdate update(GenerativeModel(setup.controller, setup.geometry), setup.controller.kappa_mu,
                            setup.controller.beliefStep(), integrator);
  return update.spectralRadius() < 1.0;
}

}  // namespace jackal_aic::sim
