#include "jackal_aic/safety/loop_odometry.hpp"

namespace jackal_aic {
namespace {

/// Process noise of wheels and body beyond their models, about that of a Jackal in a driving cycle.
constexpr double kUnknownWheel = 1.0;  // (rad/s)^2/s
constexpr double kUnknownYaw = 0.1;    // (rad/s)^2/s

/// A belief for another controller gets that controller's commands. Each of them starts a motion, so it does not learn
/// the dead time.
PredictiveParameters ofItsOwn() {
  PredictiveParameters parameters;
  parameters.learn_drive_train = false;
  return parameters;
}

/// Without a plant model the belief follows the measurements.
Odometry byMeasurements(const GeometryParameters& geometry) {
  PredictiveParameters parameters = ofItsOwn();
  parameters.speed_process_noise = kUnknownWheel;
  parameters.yaw_process_noise = kUnknownYaw;
  return Odometry(parameters, geometry, PlantModel{});
}

}  // namespace

Odometry makeOdometry(const DriveParameters& parameters, const DriveLoop& loop) {
  if (!parameters.plant_model) return byMeasurements(parameters.geometry);
  if (loop.predictive() != nullptr) return Odometry(*loop.predictive());
  return Odometry(ofItsOwn(), parameters.geometry, drivenModel(*parameters.plant_model));
}

Observation asCounted(Observation observation, const DriveLoop& loop) {
  observation.valid = observation.valid & loop.counted();
  observation.yaw_rate = loop.imuAtRest().withoutBias(observation.yaw_rate);
  return observation;
}

}  // namespace jackal_aic
