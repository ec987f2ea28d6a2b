#pragma once

/// @file
/// One way to reach the stamp and the values of every message that faults can hit.

#include <geometry_msgs/Twist.h>
#include <jackal_msgs/Drive.h>
#include <jackal_msgs/Feedback.h>
#include <jackal_msgs/Status.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>

#include <functional>
#include <type_traits>

#include "injected_fault.hpp"

namespace jackal_aic::sim {

/// Maps a value of a message to what becomes of it.
using ValueMap = std::function<double(double)>;

/// Maps the wheel velocities of a channel: all, left or right.
void mapValues(sensor_msgs::JointState& message, FaultChannel channel, const ValueMap& map);

/// Maps the yaw rate (gyro), the acceleration, or both (all).
void mapValues(sensor_msgs::Imu& message, FaultChannel channel, const ValueMap& map);

/// Maps the measured velocity of the left driver, the right one or both.
void mapValues(jackal_msgs::Feedback& message, FaultChannel channel, const ValueMap& map);

/// Maps the wheel speeds of a drive command.
void mapValues(jackal_msgs::Drive& message, FaultChannel channel, const ValueMap& map);

/// Maps the forward speed, the yaw rate or both of a set point.
void mapValues(geometry_msgs::Twist& message, FaultChannel channel, const ValueMap& map);

/// A status has no values that a controller follows.
inline void mapValues(jackal_msgs::Status&, FaultChannel, const ValueMap&) {}

/// Faults of one type of message only; false if this one has no such fault.
bool spoil(sensor_msgs::JointState& message, FaultKind kind);
bool spoil(sensor_msgs::Imu& message, FaultKind kind);       ///< @copydoc spoil(sensor_msgs::JointState&, FaultKind)
bool spoil(jackal_msgs::Feedback& message, FaultKind kind);  ///< @copydoc spoil(sensor_msgs::JointState&, FaultKind)
bool spoil(jackal_msgs::Status& message, FaultKind kind);    ///< @copydoc spoil(sensor_msgs::JointState&, FaultKind)

/// Messages without faults of their own.
template <class Message>
bool spoil(Message&, FaultKind) {
  return false;
}

/// Whether a message carries a stamp.
template <class Message>
inline constexpr bool kHasStamp = ros::message_traits::HasHeader<Message>::value;

/// The stamp of a message; nullptr if it carries none.
template <class Message>
ros::Time* stampIn(Message& message) {
  if constexpr (kHasStamp<Message>) {
    return &message.header.stamp;
  } else {
    (void)message;
    return nullptr;
  }
}

/// The stamp of a message; zero if it carries none.
template <class Message>
ros::Time stampOn(const Message& message) {
  if constexpr (kHasStamp<Message>) {
    return message.header.stamp;
  } else {
    (void)message;
    return {};
  }
}

/// Whether a kind of fault and a channel mean anything to a type of message.
template <class Message>
bool canSuffer(FaultKind kind, FaultChannel channel) {
  switch (kind) {
    case FaultKind::drop:
    case FaultKind::delay:
    case FaultKind::duplicate:
    case FaultKind::reorder:
    case FaultKind::burst:
    case FaultKind::stale:
      return true;
    case FaultKind::stamp_zero:
    case FaultKind::stamp_shift:
    case FaultKind::stamp_repeated:
    case FaultKind::stamp_reversed:
      return kHasStamp<Message>;
    case FaultKind::freeze:
    case FaultKind::not_a_number:
    case FaultKind::infinite:
    case FaultKind::set:
    case FaultKind::huge:
    case FaultKind::bias:
    case FaultKind::scale: {
      Message probe;
      if constexpr (std::is_same_v<Message, sensor_msgs::JointState>) {
        probe.name = {"left", "right"};
        probe.velocity = {0.0, 0.0};
      }
      bool touched = false;
      mapValues(probe, channel, [&touched](double value) {
        touched = true;
        return value;
      });
      return touched;
    }
    default: {
      Message probe;
      return spoil(probe, kind);
    }
  }
}

}  // namespace jackal_aic::sim
