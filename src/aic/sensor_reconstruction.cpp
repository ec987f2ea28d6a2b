#include "jackal_aic/aic/sensor_reconstruction.hpp"

namespace jackal_aic {
namespace {

/// omega_R - omega_L of a yaw rate [rad/s].
double wheelDifference(double yaw_rate, const SkidSteerKinematics& kinematics) {
  const WheelCommand turn = kinematics.wheelSpeeds(0.0, yaw_rate);
  return turn.right - turn.left;
}

}  // namespace

std::optional<Observation> reconstructed(const Observation& observation, const SkidSteerKinematics& kinematics) {
  const ChannelValidity& valid = observation.valid;
  if (valid.yaw_rate + valid.wheel_left + valid.wheel_right < 2) return std::nullopt;
  Observation complete = observation;
  complete.valid = ChannelValidity{};
  if (!valid.acceleration) complete.acceleration_x = complete.acceleration_y = 0.0;
  if (!valid.yaw_rate) {
    complete.yaw_rate = kinematics.bodyVelocity({observation.wheel_left, observation.wheel_right})(kYaw);
  } else if (!valid.wheel_left) {
    complete.wheel_left = observation.wheel_right - wheelDifference(observation.yaw_rate, kinematics);
  } else if (!valid.wheel_right) {
    complete.wheel_right = observation.wheel_left + wheelDifference(observation.yaw_rate, kinematics);
  }
  return complete;
}

}  // namespace jackal_aic
