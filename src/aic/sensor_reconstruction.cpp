#include "jackal_aic/aic/sensor_reconstruction.hpp"

namespace jackal_aic {

std::optional<Observation> reconstructed(const Observation& observation, const SkidSteerKinematics& kinematics) {
  const ChannelValidity& valid = observation.valid;
  if (valid.yaw_rate + valid.wheel_left + valid.wheel_right < 2) return std::nullopt;
  Observation complete = observation;
  complete.valid = ChannelValidity{};
  if (!valid.acceleration) complete.acceleration_x = complete.acceleration_y = 0.0;
  const double difference = observation.yaw_rate / kinematics.yawPerDifference();  // omega_R - omega_L [rad/s]
  if (!valid.yaw_rate) {
    complete.yaw_rate = kinematics.bodyVelocity({observation.wheel_left, observation.wheel_right})(kYaw);
  } else if (!valid.wheel_left) {
    complete.wheel_left = observation.wheel_right - difference;
  } else if (!valid.wheel_right) {
    complete.wheel_right = observation.wheel_left + difference;
  }
  return complete;
}

}  // namespace jackal_aic
