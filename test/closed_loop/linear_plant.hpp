#pragma once

/// @file
/// A plant model in steps of 1 ms, by the drive train of the simulated robot without its limits and without a physics
/// engine: what the certificates are about.

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/types.hpp"
#include "motor.hpp"

namespace jackal_aic {

/// Two wheels and a body that turns with them. Rates have to divide 1 kHz, dead times to be whole milliseconds.
class LinearPlant {
 public:
  static constexpr double kStep = 0.001;  ///< [s]

  LinearPlant(const PlantModel& model, const GeometryParameters& geometry)
      : model_(model), geometry_(geometry), delay_(model.dead_time, kStep), left_(motor(model)), right_(motor(model)) {}

  void command(const WheelCommand& command) { delay_.push(steps_, command); }

  void step() {
    const WheelCommand acting = delay_.acting(steps_++);
    speed_(0) = left_.reference(acting.left, speed_(0));
    speed_(1) = right_.reference(acting.right, speed_(1));
  }

  Observation observation() const {
    const GeometryParameters robot = geometryOf(model_, geometry_);
    Observation y;
    y.stamp = static_cast<double>(steps_) * kStep;
    y.yaw_rate =
        model_.on_box ? 0.0 : robot.wheel_radius * robot.slip_factor * (speed_(1) - speed_(0)) / robot.effective_track;
    y.wheel_left = speed_(0);
    y.wheel_right = speed_(1);
    return y;
  }

 private:
  static sim::MotorLoop motor(const PlantModel& plant) {
    sim::PlantParameters p;
    p.wheel_gain = plant.gain;
    p.motor_lag = plant.lag;
    p.velocity_loop_integral = plant.velocity_loop_integral;
    p.acceleration_limit = p.speed_limit = 1e300;
    return {p, 1.0, kStep};
  }

  PlantModel model_;
  GeometryParameters geometry_;
  sim::CommandDelay delay_;
  sim::MotorLoop left_, right_;
  std::int64_t steps_ = 0;
  WheelVector speed_ = WheelVector::Zero();
};

}  // namespace jackal_aic
