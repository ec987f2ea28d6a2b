#include "comparison.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>

#include "kalman_filter.hpp"
#include "perturbation.hpp"
#include "plant_limit.hpp"
#include "yaml_fields.hpp"

namespace jackal_aic::sim {
namespace {

using Words = std::vector<std::string>;

constexpr const char* kPredictive = "predictive";
constexpr const char* kKalmanFilter = "kalman_filter";

void refuseUnknownKeys(const YAML::Node& node, const char* what, const Words& known) {
  for (const auto& entry : node) {
    const auto key = entry.first.as<std::string>();
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      throw ParameterError(std::string(what) + ": unknown key '" + key + "'");
    }
  }
}

/// The loop of a controller on a plant; that of kPlantLimit has the plant alone.
LoopSetup loadLoop(const PackageFiles& files, const std::string& controller, const std::string& plant,
                   const Overrides& overrides = {}) {
  LoopSetup setup = loadSetup(files, controller == kPlantLimit ? kDifferentialDrive : controller, plant, overrides);
  setup.controller_name = controller;
  return setup;
}

/// One run of a loop, with a label.
RunResult runLoop(const LoopSetup& setup, const SetPointProfile& profile, const std::string& label) {
  RunResult result = setup.controller_name == kPlantLimit ? runPlantLimit(setup.plant_name, setup.plant, profile)
                                                          : runSetup(setup, profile);
  result.row.label = label;
  if (result.row.bounded) describeErrors(result.samples, profile, result.row);
  return result;
}

/// Calls add(controller, plant) for every pair, plant by plant.
void forEachLoop(const YAML::Node& node, const YAML::Node& specific,
                 const std::function<void(const std::string&, const std::string&)>& add) {
  const auto words = [&](const char* key) { return (specific[key] ? specific : node)[key].as<Words>(); };
  for (const auto& plant : words("plants")) {
    for (const auto& controller : words("controllers")) add(controller, plant);
  }
}

/// What the Kalman filter makes of the commands and measurements of a run: its estimate in the place of the belief.
RunResult filtered(RunResult run, const DriveParameters& drive, const SetPointProfile& profile) {
  SteadyStateKalmanFilter filter(std::get<PredictiveParameters>(drive.controller), drive.geometry, *drive.plant_model);
  WheelCommand applied;
  for (Sample& sample : run.samples) {
    if (sample.time > 0.0) filter.predict(applied);
    if (sample.observation) filter.correct(*sample.observation);
    applied = sample.command;
    sample.belief = filter.velocity();
  }
  run.row.controller = kKalmanFilter;
  describeErrors(run.samples, profile, run.row);
  return run;
}

}  // namespace

SetPointProfile readProfile(const YAML::Node& node) {
  refuseUnknownKeys(node, "profile",
                    {"forward", "yaw_rate", "duration", "assess", "low", "high", "period", "cycles", "cycle",
                     "segments", "shortest", "longest", "friction_changes"});
  SetPointProfile profile;
  if (node["low"]) {
    profile = squareProfile(
        {node["low"].as<double>(), node["high"].as<double>(), node["period"].as<double>(), node["cycles"].as<int>()});
  } else if (node["cycle"]) {
    DrivingCycle cycle;
    cycle.seed = node["cycle"].as<std::uint64_t>();
    cycle.segments = node["segments"].as<int>();
    cycle.shortest = node["shortest"].as<double>(cycle.shortest);
    cycle.longest = node["longest"].as<double>(cycle.longest);
    profile = cycleProfile(cycle);
  } else {
    profile = stepProfile(node["forward"].as<double>(0.0), node["yaw_rate"].as<double>(0.0),
                          node["duration"].as<double>(kStepDuration));
    if (node["assess"]) profile.assessed = node["assess"].as<std::string>() == "yaw_rate" ? kYaw : kForward;
  }
  for (const YAML::Node& change : node["friction_changes"]) {
    profile.friction_changes.push_back({change["time"].as<double>(), change["friction"].as<double>()});
  }
  return profile;
}

std::vector<Run> comparisonRuns(const PackageFiles& files, const YAML::Node& node) {
  std::vector<Run> runs;
  for (const YAML::Node& entry : node["cases"]) {
    refuseUnknownKeys(entry, "case", {"label", "profile", "set", "set_for", "controllers", "plants"});
    const SetPointProfile profile = readProfile(entry["profile"] ? entry["profile"] : node["profile"]);
    forEachLoop(node, entry, [&](const std::string& controller, const std::string& plant) {
      Overrides overrides = readOverrides(entry["set"], "");
      if (const YAML::Node own = entry["set_for"]) {
        for (auto& override : readOverrides(own[controller], "")) overrides.push_back(std::move(override));
      }
      runs.emplace_back([setup = loadLoop(files, controller, plant, overrides), profile,
                         label = entry["label"].as<std::string>("")] { return runLoop(setup, profile, label); });
    });
  }
  return runs;
}

std::vector<Run> perturbationRuns(const PackageFiles& files, const YAML::Node& node) {
  const SetPointProfile profile = readProfile(node["profile"]);
  std::vector<Run> runs;
  forEachLoop(node, node, [&](const std::string& controller, const std::string& plant) {
    const LoopSetup nominal = loadLoop(files, controller, plant);
    runs.emplace_back([nominal, profile] { return runLoop(nominal, profile, "as the model"); });
    for (const Perturbation& kind : perturbations()) {
      for (const double value : kind.extremes) {
        LoopSetup setup = nominal;
        perturb(setup, {&kind, value});
        runs.emplace_back([setup, profile, label = kind.label(value)] { return runLoop(setup, profile, label); });
      }
    }
  });
  return runs;
}

std::vector<Run> pairRuns(const PackageFiles& files, const YAML::Node& node) {
  const SetPointProfile profile = readProfile(node["profile"]);
  const auto pairs = drawPairs(node["count"].as<std::size_t>(), node["seed"].as<std::uint64_t>());
  std::vector<Run> runs;
  forEachLoop(node, node, [&](const std::string& controller, const std::string& plant) {
    const LoopSetup nominal = loadLoop(files, controller, plant);
    for (const PerturbationPair& pair : pairs) {
      LoopSetup setup = nominal;
      perturb(setup, pair.first);
      perturb(setup, pair.second);
      setup.plant.seed = pair.seed;
      runs.emplace_back([setup, profile, label = pair.label()] {
        RunResult result = runLoop(setup, profile, label);
        result.samples.clear();
        return result;
      });
    }
  });
  return runs;
}

std::vector<Run> beliefAccuracyRuns(const PackageFiles& files, const YAML::Node& node) {
  const SetPointProfile profile = readProfile(node["profile"]);
  std::vector<Run> runs;
  forEachLoop(node, node, [&](const std::string& controller, const std::string& plant) {
    const LoopSetup setup = loadLoop(files, controller, plant, readOverrides(node["set"], ""));
    runs.emplace_back([setup, profile] { return runLoop(setup, profile, ""); });
    if (controller != kPredictive) return;
    DriveParameters told = setup.drive;
    if (!told.plant_model->on_box) told.plant_model->effective_track = node["kalman_filter_track"].as<double>();
    runs.emplace_back([setup, profile, told] { return filtered(runLoop(setup, profile, ""), told, profile); });
  });
  return runs;
}

}  // namespace jackal_aic::sim
