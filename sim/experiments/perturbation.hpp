#pragma once

/// @file
/// How the simulated robot differs from the model its controller was given: alone to the extremes, and as pairs of
/// drawn values.

#include <cstdint>
#include <string>
#include <vector>

#include "loop_setup.hpp"

namespace jackal_aic::sim {

/// One way in which the plant may differ.
struct Perturbation {
  const char* name;              ///< in words
  const char* unit;              ///< of its values
  double low, high;              ///< between which pairs draw their values
  bool logarithmic;              ///< drawn evenly in the logarithm, for factors
  std::vector<double> extremes;  ///< values it is tried with alone
  void (*apply)(PlantParameters& plant, double value);

  /// Name, value and unit.
  std::string label(double value) const;
};

/// Wheel gain, dead time, motor lag, payload, friction, slope, sensor noise and lost measurements.
const std::vector<Perturbation>& perturbations();

/// A perturbation with its value.
struct DrawnPerturbation {
  const Perturbation* kind;
  double value;
};

/// A plant with two different perturbations and noise of its own.
struct PerturbationPair {
  DrawnPerturbation first, second;
  std::uint64_t seed;  ///< of the plant's noise

  /// Both labels.
  std::string label() const;
};

/// Draws pairs; the same seed gives the same ones.
std::vector<PerturbationPair> drawPairs(std::size_t count, std::uint64_t seed);

/// A robot like that of plant_real.yaml, with everything drawn in which a real one may differ: wheels, battery, load,
/// ground, sensors and network, each evenly within what its sources tell, and the seed of all noise. The motors' dead
/// time, lag and limit are left as they are. Equal seeds give equal robots.
Overrides drawReality(std::uint64_t seed);

/// A turn in place by a robot of plant.yaml whose motors are softer than its model says.
struct SoftMotorTurn {
  double yaw_rate;  ///< [rad/s]
  Overrides robot;
};

/// Draws such a turn: the torque of each wheel is a PI controller's of 3..4 N m s/rad and 25..30 N m/rad, and torque
/// limit, friction, dead time, load and encoders are drawn too. Equal seeds give equal ones.
SoftMotorTurn drawSoftMotorTurn(std::uint64_t seed);

/// Applies a perturbation to the plant of a loop. The differential drive is told a changed wheel gain, which makes it
/// the plant's own limit.
void perturb(LoopSetup& setup, const DrawnPerturbation& perturbation);

}  // namespace jackal_aic::sim
