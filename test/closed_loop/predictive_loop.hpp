#pragma once

/// @file
/// The predictive controller as configured on the simulated robot, without the drive loop, so that a test sees its
/// beliefs and changes its robot.

#include <cmath>
#include <string>

#include "../repository.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"
#include "jackal_plant.hpp"
#include "plant_conversion.hpp"

namespace jackal_aic::sim {

template <class Parameters>
Parameters configured(const std::string& file, const std::string& prefix) {
  ParameterMap map;
  addYamlText(textOf(file), file, map);
  return readParameters<Parameters>(map, prefix);
}

/// True speeds of the body, averaged.
struct Motion {
  double forward = 0.0;   ///< [m/s]
  double yaw_rate = 0.0;  ///< [rad/s]
};

/// Root mean square of what is believed minus what is true.
struct BeliefError {
  double forward = 0.0;   ///< [m/s]
  double yaw_rate = 0.0;  ///< [rad/s]
};

/// The predictive controller as configured on the simulated robot on its ground.
class PredictiveLoop {
 public:
  /// @param robot simulated; the controller's model is the robot's nominal drive train.
  explicit PredictiveLoop(const GeometryParameters& geometry = {}, const PredictiveParameters& parameters = preset(),
                          const PlantParameters& robot = ground())
      : plant_(textOf("sim/urdf/jackal.urdf"), robot),
        controller(parameters, geometry, linearModel(robot)),
        belief_ticks_(std::lround(1000.0 / parameters.belief_rate)) {}

  static PredictiveParameters preset() {
    return configured<PredictiveParameters>("config/predictive.yaml", "predictive");
  }
  static PlantParameters ground() { return configured<PlantParameters>("config/plant.yaml", "plant"); }

  /// Drives with a set point for a time [s]; the mean motion of the last half second.
  Motion drive(const SetPoint& set_point, double seconds) {
    controller.setSetPoint(set_point);
    Motion mean;
    const long ticks = std::lround(1000.0 * seconds);
    for (long k = 1; k <= ticks; ++k) {
      tick();
      if (ticks - k >= 500) continue;
      mean.forward += plant_.truth().linear_velocity.x() / 500.0;
      mean.yaw_rate += plant_.truth().angular_velocity.z() / 500.0;
    }
    return mean;
  }

  /// Error of the belief over all drives since the last call.
  BeliefError beliefError() {
    const auto count = static_cast<double>(ticks_);
    const BeliefError error{std::sqrt(squares_.forward / count), std::sqrt(squares_.yaw_rate / count)};
    squares_ = {};
    ticks_ = 0;
    return error;
  }

  /// True forward speed [m/s].
  double speed() const { return plant_.truth().linear_velocity.x(); }

  void setFriction(double friction) { plant_.setFriction(friction); }

 private:
  void tick() {
    if (plant_.measurement()) controller.observe(plant_.measurement()->observation());
    if (tick_ % belief_ticks_ == 0) controller.updateBelief();
    if (tick_ % 20 == 0) plant_.command(controller.updateAction());
    const BodyVector belief = controller.believedVelocity();
    squares_.forward += std::pow(belief(kForward) - plant_.truth().linear_velocity.x(), 2);
    squares_.yaw_rate += std::pow(belief(kYaw) - plant_.truth().angular_velocity.z(), 2);
    ++ticks_;
    plant_.step();
    ++tick_;
  }

  JackalPlant plant_;

 public:
  PredictiveController controller;

 private:
  long belief_ticks_;
  long tick_ = 0;
  BeliefError squares_;  // sums since the last beliefError()
  long ticks_ = 0;       // and their number
};

}  // namespace jackal_aic::sim
