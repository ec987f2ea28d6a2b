#include "drive_bag.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/Twist.h>
#include <geometry_msgs/TwistStamped.h>
#include <jackal_msgs/Drive.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "bag_file.hpp"
#include "inputs/sensors.hpp"
#include "jackal_aic/config/text.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"

namespace jackal_aic {
namespace {

/// Messages of a topic by the node that sent them.
class Publishers {
 public:
  void add(const rosbag::MessageInstance& message) { ++messages_[message.getCallerId()]; }

  /// Names those of a topic if they are more than one; else empty.
  std::string rivals(const std::string& topic) const {
    constexpr std::size_t kNamed = 5;
    if (messages_.size() < 2) return "";
    std::vector<std::string> publishers;
    for (const auto& [node, count] : messages_) {
      if (publishers.size() == kNamed) break;
      publishers.push_back(fmt::format("{} sent {}", jackal_aic::quoted(node), count));
    }
    if (messages_.size() > kNamed) publishers.push_back(fmt::format("and {} more", messages_.size() - kNamed));
    return fmt::format("{} has {} publishers ({})", topic, messages_.size(), fmt::join(publishers, ", "));
  }

 private:
  std::map<std::string, int> messages_;
};

/// The first of the joints whose velocity a message lacks, or has not finite; empty if there is none.
std::string unusableJoint(const sensor_msgs::JointState& message, const std::vector<std::string>& joints) {
  if (!mentionsAny(message, joints)) return joints.front();
  for (std::size_t i = 0; i < message.name.size(); ++i) {
    if (std::find(joints.begin(), joints.end(), message.name[i]) == joints.end()) continue;
    if (i >= message.velocity.size() || !std::isfinite(message.velocity[i])) return message.name[i];
  }
  return "";
}

/// How long after their stamps the messages of a topic arrived at the recorder.
class Arrivals {
 public:
  /// @throws IdentificationError if the message has no stamp.
  void add(const std::string& topic, const ros::Time& stamp, const ros::Time& arrival) {
    if (stamp.isZero()) {
      throw IdentificationError(
          fmt::format("{}: the message that arrived at {:.3f} s has no stamp", topic, arrival.toSec()));
    }
    delays_.push_back((arrival - stamp).toSec());
  }

  /// Median delay [s]; 0 without messages.
  double delay() {
    if (delays_.empty()) return 0.0;
    const auto middle = delays_.begin() + static_cast<std::ptrdiff_t>(delays_.size() / 2);
    std::nth_element(delays_.begin(), middle, delays_.end());
    return *middle;
  }

 private:
  std::vector<double> delays_;  // s
};

// By one clock, no message arrives before its stamp: what is left to it are the steps of a simulation's clock. A
// network's delay looks like a clock that is behind: a long one is remarked on, of one that no network has the stamps
// are refused.
constexpr double kEarliestArrival = -0.01, kRemarkedArrival = 0.05, kLatestArrival = 0.5;  // s behind the stamp

std::string arrivalText(const std::string& topic, double delay) {
  return fmt::format("{}: stamps are {:.3f} s {} their arrival at the recorder (median)", topic, std::abs(delay),
                     delay < 0.0 ? "later than" : "before");
}

/// Refuses stamps of another clock than that of the commands, which is the recorder's.
void checkWheelClock(const std::string& topic, double delay, std::vector<std::string>& remarks) {
  const std::string text = arrivalText(topic, delay);
  if (delay < kEarliestArrival || delay > kLatestArrival) {
    throw IdentificationError(fmt::format(
        "{}, must be at most {:g} s {}: the clocks of the wheels and of the recorder, which times the commands, "
        "differ, and the dead time would be off by as much",
        text, std::abs(delay < 0.0 ? kEarliestArrival : kLatestArrival), delay < 0.0 ? "later" : "before"));
  }
  if (delay > kRemarkedArrival) {
    remarks.push_back(text + ": unless the network takes as long, the clocks differ, and the dead time is too short");
  }
}

/// Remarks on stamps of another clock than the recorder's.
void checkImuClock(const std::string& topic, double delay, std::vector<std::string>& remarks) {
  if (delay >= kEarliestArrival && delay <= kRemarkedArrival) return;
  remarks.push_back(arrivalText(topic, delay) +
                    ": if the clocks differ, yaw rate and wheel speeds of the effective track are of different times");
}

void readCommands(const rosbag::Bag& bag, const BagTopics& topics, DriveRecording& recording) {
  Publishers publishers;
  const auto add = [&](const WheelCommand& command, const rosbag::MessageInstance& message) {
    publishers.add(message);
    recording.commands.push_back({message.getTime().toSec(), command});
  };
  const SkidSteerKinematics kinematics(topics.geometry);
  const auto addTwist = [&](const geometry_msgs::Twist& twist, const rosbag::MessageInstance& message) {
    add(kinematics.wheelSpeeds(twist.linear.x, twist.angular.z), message);
  };
  // The topic has one of these types.
  forEach<jackal_msgs::Drive>(
      bag, topics.commands, [&](const jackal_msgs::Drive::ConstPtr& drive, const rosbag::MessageInstance& message) {
        const bool moves = drive->mode == jackal_msgs::Drive::MODE_VELOCITY;
        add(moves ? WheelCommand{drive->drivers[0], drive->drivers[1]} : WheelCommand{}, message);
      });
  forEach<geometry_msgs::Twist>(bag, topics.commands,
                                [&](const auto& twist, const auto& message) { addTwist(*twist, message); });
  forEach<geometry_msgs::TwistStamped>(
      bag, topics.commands, [&](const auto& stamped, const auto& message) { addTwist(stamped->twist, message); });
  const std::string rivals = publishers.rivals(topics.commands);
  if (!rivals.empty()) throw IdentificationError(rivals + ": which of them the motors followed is not known");
}

/// Reads the speeds of a message. @returns reason if it has none; else empty.
std::string takeWheels(const sensor_msgs::JointState& message, const BagTopics& topics, DriveRecording& recording) {
  const auto left = meanVelocity(message, topics.left_wheel_joints);
  const auto right = meanVelocity(message, topics.right_wheel_joints);
  const double stamp = message.header.stamp.toSec();
  if (!left || !right) {
    return fmt::format(
        "{}: the velocity of joint {} at {:.3f} s is missing or not finite", topics.wheels,
        jackal_aic::quoted(unusableJoint(message, left ? topics.right_wheel_joints : topics.left_wheel_joints)), stamp);
  }
  recording.wheels.push_back({stamp, {*left, *right}});
  return "";
}

void readWheels(const rosbag::Bag& bag, const BagTopics& topics, DriveRecording& recording) {
  constexpr std::size_t kUsable = 20;  // messages for one that is not
  Arrivals arrivals;
  Publishers publishers;
  std::string unusable;  // the first
  std::size_t left_out = 0;
  forEach<sensor_msgs::JointState>(
      bag, topics.wheels,
      [&](const sensor_msgs::JointState::ConstPtr& received, const rosbag::MessageInstance& message) {
        const sensor_msgs::JointState& joints = *received;
        if (!mentionsAny(joints, topics.left_wheel_joints) && !mentionsAny(joints, topics.right_wheel_joints)) {
          return;
        }
        publishers.add(message);
        arrivals.add(topics.wheels, joints.header.stamp, message.getTime());
        const std::string why = takeWheels(joints, topics, recording);
        if (!why.empty() && ++left_out == 1) unusable = why;
      });
  const std::string rivals = publishers.rivals(topics.wheels);
  if (!rivals.empty()) throw IdentificationError(rivals + ": which of them measures the wheels is not known");
  if (left_out * kUsable > recording.wheels.size()) throw IdentificationError(unusable);
  if (left_out > 0) recording.remarks.push_back(fmt::format("left out: {} message(s); {}", left_out, unusable));
  if (recording.wheels.empty()) {
    throw IdentificationError(fmt::format("{}: no message names a joint of {} or {}", topics.wheels,
                                          fmt::join(topics.left_wheel_joints, ", "),
                                          fmt::join(topics.right_wheel_joints, ", ")));
  }
  checkWheelClock(topics.wheels, arrivals.delay(), recording.remarks);
}

/// Mounting of IMUs in a bag.
class ImuMounting {
 public:
  ImuMounting(const rosbag::Bag& bag, const BagTopics& topics) : topics_(topics) {
    for (const std::string& topic : {topics.fixed_frames, topics.frames}) {
      forEach<tf2_msgs::TFMessage>(bag, topic, [&](const auto& message, const auto&) {
        for (const geometry_msgs::TransformStamped& transform : message->transforms) {
          frames_.setTransform(transform, "", true);  // a fixed frame holds at any time
        }
      });
    }
  }

  /// Yaw rate of the robot [rad/s]; nothing if the mounting of the IMU is unknown.
  std::optional<double> yawRate(const sensor_msgs::Imu& imu) {
    const Eigen::Vector3d rate(imu.angular_velocity.x, imu.angular_velocity.y, imu.angular_velocity.z);
    const auto& rotation = rotationOf(imu.header.frame_id);
    return rotation ? std::optional<double>((*rotation * rate).z()) : std::nullopt;
  }

 private:
  const std::optional<Eigen::Quaterniond>& rotationOf(const std::string& frame) {
    const auto known = rotations_.find(frame);
    if (known != rotations_.end()) return known->second;
    const auto rotation =
        topics_.imu_rotation ? topics_.imu_rotation : rotationInto(topics_.base_frame, frame, frames_);
    return rotations_.emplace(frame, rotation).first->second;
  }

  const BagTopics& topics_;
  tf2::BufferCore frames_;
  std::map<std::string, std::optional<Eigen::Quaterniond>> rotations_;  // by frame
};

void readYaw(const rosbag::Bag& bag, const BagTopics& topics, DriveRecording& recording) {
  ImuMounting mounting(bag, topics);
  Arrivals arrivals;
  Publishers publishers;
  std::optional<std::string> unknown;  // frame
  std::size_t left_out = 0;
  forEach<sensor_msgs::Imu>(bag, topics.imu,
                            [&](const sensor_msgs::Imu::ConstPtr& received, const rosbag::MessageInstance& message) {
                              const sensor_msgs::Imu& imu = *received;
                              publishers.add(message);
                              arrivals.add(topics.imu, imu.header.stamp, message.getTime());
                              const auto rate = mounting.yawRate(imu);
                              if (!rate) unknown = imu.header.frame_id;
                              if (std::isfinite(rate.value_or(0.0))) {
                                recording.yaw.push_back({imu.header.stamp.toSec(), rate.value_or(0.0)});
                              } else {
                                ++left_out;
                              }
                            });
  if (left_out > 0) {
    recording.remarks.push_back(
        fmt::format("left out: {} message(s); {}: a yaw rate is not finite", left_out, topics.imu));
  }
  const std::string rivals = publishers.rivals(topics.imu);
  if (!rivals.empty()) recording.yaw_unknown = rivals + ": which of them measures the robot is not known";
  if (unknown) {
    recording.yaw_unknown = fmt::format(
        "neither {} nor {} says how IMU frame {} is mounted on {}: say it with --imu-rotation", topics.fixed_frames,
        topics.frames, jackal_aic::quoted(*unknown), jackal_aic::quoted(topics.base_frame));
  }
  if (unknown || !rivals.empty()) recording.yaw.clear();
  checkImuClock(topics.imu, arrivals.delay(), recording.remarks);
}

DriveRecording readOpenBag(const rosbag::Bag& bag, const std::string& path, const BagTopics& topics) {
  const std::vector<std::string> commands{"jackal_msgs/Drive", "geometry_msgs/Twist", "geometry_msgs/TwistStamped"};
  requireTopic<IdentificationError>(bag, topics.commands, commands);
  requireTopic<IdentificationError>(bag, topics.wheels, {"sensor_msgs/JointState"});
  requireTopic<IdentificationError>(bag, topics.imu, {"sensor_msgs/Imu"}, false);
  requireTopic<IdentificationError>(bag, topics.fixed_frames, {"tf2_msgs/TFMessage"}, false);
  DriveRecording recording;
  try {
    readCommands(bag, topics, recording);
    readWheels(bag, topics, recording);
    readYaw(bag, topics, recording);
  } catch (const IdentificationError& error) {
    throw IdentificationError(path + ": " + error.what());
  }
  return recording;
}

}  // namespace

DriveRecording readDriveBag(const std::string& path, const BagTopics& topics) {
  DriveRecording recording;
  withBag<IdentificationError>(path, [&](const rosbag::Bag& bag) { recording = readOpenBag(bag, path, topics); });
  return recording;
}

}  // namespace jackal_aic
