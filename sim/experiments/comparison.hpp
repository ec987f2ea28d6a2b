#pragma once

/// @file
/// Experiments in which several controllers drive the same plants along the same profile, beyond the thesis.

#include <yaml-cpp/yaml.h>

#include <vector>

#include "experiment_table.hpp"

namespace jackal_aic::sim {

/// Kind `comparison`: each case by each controller on each plant; the controller plant_limit is the plant's own limit
/// (see plant_limit.hpp). A case has a `label`, a `profile` (see readProfile()), overrides (`set`), overrides of single
/// controllers (`set_for`), and may name its own `controllers` and `plants`.
std::vector<Run> comparisonRuns(const PackageFiles& files, const YAML::Node& node);

/// Kind `perturbations`: the undisturbed plant and every perturbation at its extremes, by each controller on each
/// plant.
std::vector<Run> perturbationRuns(const PackageFiles& files, const YAML::Node& node);

/// Kind `perturbation_pairs`: `count` pairs drawn from `seed`, by each controller on each plant; no traces.
std::vector<Run> pairRuns(const PackageFiles& files, const YAML::Node& node);

/// Kind `belief_accuracy`: each controller drives a profile on each plant; the row of the predictive controller is
/// followed by that of the Kalman filter (controller kalman_filter) on the same commands and measurements.
std::vector<Run> beliefAccuracyRuns(const PackageFiles& files, const YAML::Node& node);

/// A profile: a step {forward, yaw_rate, duration, assess: forward | yaw_rate}, a square wave {low, high, period,
/// cycles} or a driving cycle {cycle: seed, segments, shortest, longest}; each with friction_changes: [{time,
/// friction}] if wanted.
/// @throws ParameterError for an unknown key or a profile that cannot be assessed.
SetPointProfile readProfile(const YAML::Node& node);

}  // namespace jackal_aic::sim
