#include "imu_reader.hpp"

#include "conversions.hpp"
#include "jackal_aic/config/text.hpp"

namespace jackal_aic {

std::nullopt_t ImuReader::refuse(const std::string& reason) {
  refusal_ = reason;
  return std::nullopt;
}

std::optional<SensorReading> ImuReader::read(const sensor_msgs::Imu& message, const ros::Time& now) {
  refusal_.clear();
  if (message.header.stamp.isZero()) return refuse("IMU data without a stamp");
  if (message.header.stamp > now + ros::Duration(kFurthestAhead)) return refuse("IMU data from the future");
  const std::string& frame = message.header.frame_id;
  const auto rotation = frames_.rotation(base_frame_, frame);
  if (!rotation) {
    return refuse("IMU data in frame " + jackal_aic::quoted(frame) + ", which tf does not relate to " +
                  jackal_aic::quoted(base_frame_));
  }
  rotation_ = *rotation;
  if (!planarMotion(message, rotation_)) return refuse("IMU data that is not finite");
  SensorReading reading{observation(message), FrozenSource::Sample::Zero()};
  const auto& w = message.angular_velocity;
  const auto& a = message.linear_acceleration;
  reading.sample.head<6>() << w.x, w.y, w.z, a.x, a.y, a.z;
  return reading;
}

// Messages were checked when they were read, so that the values are there.
Observation ImuReader::observation(const sensor_msgs::Imu& message) const {
  const auto motion = planarMotion(message, rotation_);
  Observation observation;
  observation.stamp = message.header.stamp.toSec();
  observation.yaw_rate = (*motion)(0);
  observation.acceleration_x = (*motion)(1);
  observation.acceleration_y = (*motion)(2);
  observation.acceleration_z = (*motion)(3);
  observation.valid.wheel_left = observation.valid.wheel_right = false;
  // REP 145: a first covariance of -1 says that the sensor is absent.
  observation.valid.yaw_rate = message.angular_velocity_covariance[0] >= 0.0;
  observation.valid.acceleration = message.linear_acceleration_covariance[0] >= 0.0;
  return observation;
}

}  // namespace jackal_aic
