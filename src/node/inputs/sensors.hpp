#pragma once

/// @file
/// Wheel speeds and IMU samples: checked, rotated into the base frame, and paired by stamp.

#include <message_filters/pass_through.h>
#include <message_filters/sync_policies/approximate_time.h>
#include <message_filters/synchronizer.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <tf2/buffer_core.h>

#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "jackal_aic/model/acceleration_pairing.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic {

/// True if at least one of the joints is named in the message (other nodes publish joint states too).
bool mentionsAny(const sensor_msgs::JointState& message, const std::vector<std::string>& joints);

/// Wheel speeds of a message, of each side the mean of the joints that it lists, without the other channels.
/// std::nullopt if a side has none, or a speed is missing or not finite.
std::optional<Observation> wheelObservation(const sensor_msgs::JointState& message, const RobotNames& names);

/// Yaw rate and acceleration of an IMU message in the base frame, without the wheels. Gravity is removed from x and y
/// by the message's attitude, and stays in z. A message without attitude (first covariance -1, or no unit quaternion)
/// leaves gravity in x and y too.
/// @param rotation from the IMU's frame into the base frame. std::nullopt if a component is not finite.
std::optional<Observation> imuObservation(const sensor_msgs::Imu& message, const Eigen::Quaterniond& rotation);

/// Both as one sample of the time of the wheels.
Observation paired(const Observation& wheels, Observation imu);

/// Rotation from `frame` into `base`; std::nullopt if no transform relates them. A leading slash of a name, from older
/// drivers, is ignored.
std::optional<Eigen::Quaterniond> rotationInto(const std::string& base, const std::string& frame,
                                               const tf2::BufferCore& frames);

/// Reads IMU messages.
class ImuReader {
 public:
  /// @param base_frame of the body velocity; @param frames tf with the mounting of the IMU; has to outlive the reader.
  ImuReader(const std::string& base_frame, const tf2::BufferCore& frames) : base_frame_(base_frame), frames_(frames) {}

  /// The reading of a message. One with a non-finite value, without a stamp, from the future, or from a frame that tf
  /// cannot relate to the base frame is refused (empty, and lastRefusal() says why).
  std::optional<SensorReading> read(const sensor_msgs::Imu& message, const ros::Time& now);

  /// From the frame of the last message that was read into the base frame.
  const Eigen::Quaterniond& rotation() const { return rotation_; }

  /// Why the last message was refused; empty if it was not.
  const std::string& lastRefusal() const { return refusal_; }

 private:
  std::string base_frame_;
  const tf2::BufferCore& frames_;
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  std::string refusal_;
};

/// Takes joint_states and imu/data messages and hands on one Observation for each pair of stamps.
class SensorPairing {
 public:
  /// Called with each paired observation; its stamp is that of the wheel speeds, its accelerations are paired
  /// (acceleration_pairing.hpp).
  using Callback = std::function<void(const Observation&, const ros::Time&)>;

  /// @param names of wheels and base frame; @param frames as for ImuReader; @param callback gets the pairs.
  SensorPairing(const RobotNames& names, const tf2::BufferCore& frames, Callback callback);

  /// The reading of a joint state message. A message without our wheels is ignored (empty). One without both sides,
  /// with a missing or non-finite velocity, without a stamp or from the future is refused (empty, and lastRefusal()
  /// says why).
  std::optional<SensorReading> addWheels(const sensor_msgs::JointStateConstPtr& message, const ros::Time& now);

  /// The reading of an IMU message, as ImuReader::read().
  std::optional<SensorReading> addImu(const sensor_msgs::ImuConstPtr& message, const ros::Time& now);

  /// Why the last message was refused; empty if it was not.
  const std::string& lastRefusal() const { return refusal_; }

  /// Forgets everything received.
  void reset();

 private:
  using Policy = message_filters::sync_policies::ApproximateTime<sensor_msgs::JointState, sensor_msgs::Imu>;

  void onPair(const sensor_msgs::JointStateConstPtr& wheels, const sensor_msgs::ImuConstPtr& imu);

  RobotNames names_;
  ImuReader imu_reader_;
  Callback callback_;
  ros::Time paired_wheels_;  // stamps of the last paired samples
  ros::Time paired_imu_;
  AccelerationPairing accelerations_;
  std::string refusal_;
  message_filters::PassThrough<sensor_msgs::JointState> wheel_input_;
  message_filters::PassThrough<sensor_msgs::Imu> imu_input_;
  std::unique_ptr<message_filters::Synchronizer<Policy>> synchronizer_;
};

}  // namespace jackal_aic
