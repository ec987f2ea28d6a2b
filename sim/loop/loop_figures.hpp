#pragma once

/// @file
/// Robustness and performance of any controller on a linear robot, measured by driving it.
///
/// Two wheels of a drive train without its acceleration limit, samples and actions every 20 ms, the sample right before
/// the action. From one sample to the next the loop is linear and time-invariant, so that the answer y to an impulse
/// n that is added to one sample has the sensitivity S = 1 / (1 + L) as its transform, which gives the loop L.

#include <functional>
#include <memory>

#include "jackal_aic/aic/velocity_controller.hpp"
#include "jackal_aic/model/geometry.hpp"
#include "jackal_aic/model/plant_model.hpp"

namespace jackal_aic::sim {

/// Makes a controller, every call the same.
using ControllerMaker = std::function<std::unique_ptr<VelocityController>()>;

/// Figures of a loop; those of an unstable one are infinite, its margins zero.
struct LoopFigures {
  bool stable = false;      ///< the wheel comes to a steady speed, and what an impulse leaves fades
  double peak_sensitivity;  ///< Ms, the largest |S| up to half the rate of the samples
  double gain_margin;       ///< least factor above 1 on the gain at which L passes -1; else infinity
  double delay_margin;      ///< least time by which a delay of the samples makes L pass -1 [s]
  double iae;    ///< integral of the absolute error after a step d of the motors' input between two samples, per d [s]
  double noise;  ///< standard deviation of the command per that of white noise of the encoders
};

/// A drive train without an effective acceleration limit. The assessed controller needs such a model, too, because a
/// limit in its model makes it nonlinear.
PlantModel withoutLimit(PlantModel model);

/// Figures of a controller of 50 Hz at 0.5 m/s. @param robot drive train that it drives, whose acceleration limit does
/// not count; @param geometry for the set point of the wheels.
LoopFigures loopFigures(const ControllerMaker& make, const PlantModel& robot, const GeometryParameters& geometry);

/// The least iae of any controller on this robot (sim/lab/bounds.py), without an acceleration limit [s].
double leastLinearIae(const PlantModel& robot, const GeometryParameters& geometry);

}  // namespace jackal_aic::sim
