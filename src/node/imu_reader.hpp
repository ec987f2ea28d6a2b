#pragma once

/// @file
/// IMU messages, checked and rotated into the base frame.

#include <sensor_msgs/Imu.h>

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "fixed_frames.hpp"
#include "jackal_aic/safety/drive_loop.hpp"

namespace jackal_aic {

/// Makes readings of /imu/data messages.
class ImuReader {
 public:
  /// @param base_frame of the body velocity; @param frames have to outlive the reader.
  ImuReader(const std::string& base_frame, const FixedFrames& frames) : base_frame_(base_frame), frames_(frames) {}

  /// The reading of a message. One with a non-finite value, without a stamp, from the future, or from a frame that tf
  /// cannot relate to the base frame is refused (empty, and lastRefusal() says why).
  std::optional<SensorReading> read(const sensor_msgs::Imu& message, const ros::Time& now);

  /// The observation of a message in the frame of the last one that was read.
  Observation observation(const sensor_msgs::Imu& message) const;

  /// Why the last message was refused; empty if it was not.
  const std::string& lastRefusal() const { return refusal_; }

 private:
  std::nullopt_t refuse(const std::string& reason);

  std::string base_frame_;
  const FixedFrames& frames_;
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  std::string refusal_;
};

}  // namespace jackal_aic
