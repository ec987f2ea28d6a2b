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
#include <utility>

#include "bag_file.hpp"
#include "inputs/sensors.hpp"
#include "jackal_aic/config/text.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"

namespace jackal_aic {
namespace {

/// The messages of a topic: who sent them, and how long after their stamps they arrived at the recorder.
class Source {
 public:
  explicit Source(std::string topic) : topic_(std::move(topic)) {}

  void add(const rosbag::MessageInstance& message) { ++messages_[message.getCallerId()]; }

  /// @throws IdentificationError if the message has no stamp.
  void add(const rosbag::MessageInstance& message, const ros::Time& stamp) {
    if (stamp.isZero()) {
      throw IdentificationError(
          fmt::format("{}: the message that arrived at {:.3f} s has no stamp", topic_, message.getTime().toSec()));
    }
    add(message);
    delays_.push_back((message.getTime() - stamp).toSec());
  }

  /// Names the publishers if they are more than one; else empty.
  std::string rivals() const {
    if (messages_.size() < 2) return "";
    constexpr std::size_t kLongest = 200;
    std::vector<std::string> publishers;
    for (const auto& [node, count] : messages_)
      publishers.push_back(fmt::format("{} sent {}", jackal_aic::quoted(node), count));
    return fmt::format("{} has {} publishers ({})", topic_, messages_.size(),
                       shortened(fmt::format("{}", fmt::join(publishers, ", ")), kLongest));
  }

  /// Median delay [s]; 0 without messages.
  double delay() {
    if (delays_.empty()) return 0.0;
    const auto middle = delays_.begin() + static_cast<std::ptrdiff_t>(delays_.size() / 2);
    std::nth_element(delays_.begin(), middle, delays_.end());
    return *middle;
  }

 private:
  std::string topic_;
  std::map<std::string, int> messages_;  // by node
  std::vector<double> delays_;           // s
};

/// The first of the robot's joints whose velocity is missing or not finite in a message.
std::string unusableJoint(const sensor_msgs::JointState& message, const RobotNames& robot) {
  for (const auto* joints : {&robot.left_wheel_joints, &robot.right_wheel_joints}) {
    if (!mentionsAny(message, *joints)) return joints->front();
    for (std::size_t i = 0; i < message.name.size(); ++i) {
      if (std::find(joints->begin(), joints->end(), message.name[i]) == joints->end()) continue;
      if (i >= message.velocity.size() || !std::isfinite(message.velocity[i])) return message.name[i];
    }
  }
  return "";
}

// With one clock no message arrives before its stamp, except by a step of a simulation's clock. A network's delay looks
// like a clock that is behind: a long delay is remarked on, and a delay beyond any network's is refused.
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
  Source source(topics.commands);
  const SkidSteerKinematics kinematics(topics.geometry);
  for (const rosbag::MessageInstance& message : rosbag::View(bag, rosbag::TopicQuery(topics.commands))) {
    const auto drive = message.instantiate<jackal_msgs::Drive>();
    const auto stamped = message.instantiate<geometry_msgs::TwistStamped>();
    const auto plain = message.instantiate<geometry_msgs::Twist>();
    WheelCommand command;
    if (drive) {
      if (drive->mode == jackal_msgs::Drive::MODE_VELOCITY) command = {drive->drivers[0], drive->drivers[1]};
    } else if (stamped || plain) {
      const geometry_msgs::Twist& twist = stamped ? stamped->twist : *plain;
      command = kinematics.wheelSpeeds(twist.linear.x, twist.angular.z);
    } else {
      continue;  // of another version
    }
    source.add(message);
    recording.commands.push_back({message.getTime().toSec(), command});
  }
  const std::string rivals = source.rivals();
  if (!rivals.empty()) throw IdentificationError(rivals + ": which of them the motors followed is not known");
}

void readWheels(const rosbag::Bag& bag, const BagTopics& topics, DriveRecording& recording) {
  constexpr std::size_t kUsable = 20;  // messages for one that is not
  const RobotNames& robot = topics.robot;
  Source source(topics.wheels);
  std::string unusable;  // the first
  std::size_t left_out = 0;
  forEach<sensor_msgs::JointState>(bag, topics.wheels, [&](const auto& joints, const auto& message) {
    if (!mentionsAny(*joints, robot.left_wheel_joints) && !mentionsAny(*joints, robot.right_wheel_joints)) return;
    source.add(message, joints->header.stamp);
    if (const auto speeds = wheelObservation(*joints, robot)) {
      recording.wheels.push_back({speeds->stamp, {speeds->wheel_left, speeds->wheel_right}});
    } else if (++left_out == 1) {
      unusable = fmt::format("{}: the velocity of joint {} at {:.3f} s is missing or not finite", topics.wheels,
                             jackal_aic::quoted(unusableJoint(*joints, robot)), joints->header.stamp.toSec());
    }
  });
  const std::string rivals = source.rivals();
  if (!rivals.empty()) throw IdentificationError(rivals + ": which of them measures the wheels is not known");
  if (left_out * kUsable > recording.wheels.size()) throw IdentificationError(unusable);
  if (left_out > 0) recording.remarks.push_back(fmt::format("left out: {} message(s); {}", left_out, unusable));
  if (recording.wheels.empty()) {
    throw IdentificationError(fmt::format("{}: no message names a joint of {} or {}", topics.wheels,
                                          fmt::join(robot.left_wheel_joints, ", "),
                                          fmt::join(robot.right_wheel_joints, ", ")));
  }
  checkWheelClock(topics.wheels, source.delay(), recording.remarks);
}

void readYaw(const rosbag::Bag& bag, const BagTopics& topics, DriveRecording& recording) {
  tf2::BufferCore frames;
  for (const std::string& topic : {topics.fixed_frames, topics.frames}) readFrames(bag, topic, frames);
  Source source(topics.imu);
  std::optional<std::string> unknown;  // frame
  std::size_t left_out = 0;
  forEach<sensor_msgs::Imu>(bag, topics.imu, [&](const auto& imu, const auto& message) {
    source.add(message, imu->header.stamp);
    const std::string& frame = imu->header.frame_id;
    const auto rotation =
        topics.imu_rotation ? topics.imu_rotation : rotationInto(topics.robot.base_frame, frame, frames);
    if (!rotation) unknown = frame;
    const auto& w = imu->angular_velocity;
    const double rate = (rotation.value_or(Eigen::Quaterniond::Identity()) * Eigen::Vector3d(w.x, w.y, w.z)).z();
    if (std::isfinite(rate)) recording.yaw.push_back({imu->header.stamp.toSec(), rate});
    left_out += std::isfinite(rate) ? 0 : 1;
  });
  if (left_out > 0) {
    recording.remarks.push_back(
        fmt::format("left out: {} message(s); {}: a yaw rate is not finite", left_out, topics.imu));
  }
  const std::string rivals = source.rivals();
  if (!rivals.empty()) recording.yaw_unknown = rivals + ": which of them measures the robot is not known";
  if (unknown) {
    recording.yaw_unknown = fmt::format(
        "neither {} nor {} says how IMU frame {} is mounted on {}: say it with --imu-roll, --imu-pitch and --imu-yaw",
        topics.fixed_frames, topics.frames, jackal_aic::quoted(*unknown), jackal_aic::quoted(topics.robot.base_frame));
  }
  if (unknown || !rivals.empty()) recording.yaw.clear();
  checkImuClock(topics.imu, source.delay(), recording.remarks);
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
