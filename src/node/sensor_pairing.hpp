#pragma once

/// @file
/// Wheel speeds and IMU samples, checked, rotated into the base frame and paired by stamp.

#include <message_filters/pass_through.h>
#include <message_filters/sync_policies/approximate_time.h>
#include <message_filters/synchronizer.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "imu_reader.hpp"
#include "jackal_aic/model/acceleration_pairing.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "node_parameters.hpp"

namespace jackal_aic {

/// Takes /joint_states and /imu/data messages and hands on one Observation for each pair of stamps.
class SensorPairing {
 public:
  /// Called with each paired observation; its stamp is that of the wheel speeds, its accelerations are paired
  /// (acceleration_pairing.hpp).
  using Callback = std::function<void(const Observation&, const ros::Time&)>;

  SensorPairing(const RobotNames& names, const FixedFrames& frames, Callback callback);

  /// Takes a joint state message and returns its reading. Messages without a wheel of ours are left alone (empty); one
  /// without both sides, with a missing or non-finite velocity, without a stamp or from the future is refused (empty,
  /// and lastRefusal() says why).
  std::optional<SensorReading> addWheels(const sensor_msgs::JointStateConstPtr& message, const ros::Time& now);

  /// Takes an IMU message and returns its reading. One with a non-finite value, without a stamp, from the future, or
  /// from a frame that tf cannot relate to the base frame is refused (empty, and lastRefusal() says why).
  std::optional<SensorReading> addImu(const sensor_msgs::ImuConstPtr& message, const ros::Time& now);

  /// Why the last message was refused; empty if it was not.
  const std::string& lastRefusal() const { return refusal_; }

  /// Forgets everything received.
  void reset();

 private:
  using Policy = message_filters::sync_policies::ApproximateTime<sensor_msgs::JointState, sensor_msgs::Imu>;

  void onPair(const sensor_msgs::JointStateConstPtr& wheels, const sensor_msgs::ImuConstPtr& imu);
  Observation wheelsAlone(const sensor_msgs::JointState& message) const;
  SensorReading wheelReading(const sensor_msgs::JointState& message) const;
  std::nullopt_t refuse(const std::string& reason);

  RobotNames names_;
  ImuReader imu_reader_;
  Callback callback_;
  ros::Time paired_wheels_;  // stamps of the last samples that the pairing got
  ros::Time paired_imu_;
  AccelerationPairing accelerations_;
  std::string refusal_;
  message_filters::PassThrough<sensor_msgs::JointState> wheel_input_;
  message_filters::PassThrough<sensor_msgs::Imu> imu_input_;
  std::unique_ptr<message_filters::Synchronizer<Policy>> synchronizer_;
};

}  // namespace jackal_aic
