#include "drive_bag.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <geometry_msgs/TransformStamped.h>
#include <jackal_msgs/Drive.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <sys/wait.h>
#include <tf2_msgs/TFMessage.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <map>
#include <type_traits>

#include "bag_guard.hpp"
#include "conversions.hpp"
#include "fixed_frames.hpp"
#include "jackal_aic/config/text.hpp"

namespace jackal_aic {
namespace {

void checkTopic(const rosbag::Bag& bag, const std::string& path, const std::string& topic, const std::string& type,
                bool required) {
  rosbag::View view(bag, rosbag::TopicQuery(topic));
  if (view.size() == 0 && required) throw IdentificationError(path + ": no messages on " + topic);
  for (const auto* connection : view.getConnections()) {
    if (connection->datatype != type) {
      throw IdentificationError(path + ": " + topic + " has type " + connection->datatype + ", expected " + type);
    }
  }
}

template <class Message, class Take>
void forEach(const rosbag::Bag& bag, const std::string& topic, Take take) {
  rosbag::View view(bag, rosbag::TopicQuery(topic));
  for (const rosbag::MessageInstance& instance : view) {
    const auto message = instance.instantiate<Message>();
    if (message) take(*message, instance.getTime());
  }
}

void takeWheels(const sensor_msgs::JointState& message, const BagTopics& topics, DriveRecording& recording) {
  if (!mentionsAny(message, topics.left_wheel_joints) && !mentionsAny(message, topics.right_wheel_joints)) return;
  const auto left = meanVelocity(message, topics.left_wheel_joints);
  const auto right = meanVelocity(message, topics.right_wheel_joints);
  if (!left || !right) throw IdentificationError(topics.wheels + ": a wheel velocity is missing or not finite");
  recording.wheels.push_back({message.header.stamp.toSec(), {*left, *right}});
}

/// Refuses commands of more than one publisher: nobody knows which of them the motors followed.
void checkPublishers(const rosbag::Bag& bag, const std::string& path, const std::string& topic) {
  std::map<std::string, int> messages;
  rosbag::View view(bag, rosbag::TopicQuery(topic));
  for (const rosbag::MessageInstance& instance : view) ++messages[instance.getCallerId()];
  if (messages.size() < 2) return;
  std::vector<std::string> publishers;
  for (const auto& [node, count] : messages)
    publishers.push_back(fmt::format("{} sent {}", jackal_aic::quoted(node), count));
  throw IdentificationError(fmt::format("{}: {} has {} publishers ({}): which of them the motors followed is not known",
                                        path, topic, messages.size(), fmt::join(publishers, ", ")));
}

/// Where IMUs are mounted, as a bag says.
class ImuMounting {
 public:
  ImuMounting(const rosbag::Bag& bag, const BagTopics& topics) : topics_(topics) {
    forEach<tf2_msgs::TFMessage>(bag, topics.fixed_frames, [&](const tf2_msgs::TFMessage& message, const ros::Time&) {
      for (const geometry_msgs::TransformStamped& transform : message.transforms) frames_.add(transform);
    });
  }

  /// Yaw rate of the robot [rad/s].
  double yawRate(const sensor_msgs::Imu& imu) {
    const Eigen::Vector3d rate(imu.angular_velocity.x, imu.angular_velocity.y, imu.angular_velocity.z);
    return (rotationOf(imu.header.frame_id) * rate).z();
  }

 private:
  const Eigen::Quaterniond& rotationOf(const std::string& frame) {
    const auto known = rotations_.find(frame);
    if (known != rotations_.end()) return known->second;
    auto rotation = topics_.imu_rotation;
    if (!rotation) rotation = frames_.rotation(topics_.base_frame, frame);
    return rotations_.emplace(frame, rotation.value_or(Eigen::Quaterniond::Identity())).first->second;
  }

  const BagTopics& topics_;
  FixedFrames frames_;
  std::map<std::string, Eigen::Quaterniond> rotations_;  // by frame
};

DriveRecording readOpenBag(const rosbag::Bag& bag, const std::string& path, const BagTopics& topics) {
  checkTopic(bag, path, topics.drive, "jackal_msgs/Drive", true);
  checkTopic(bag, path, topics.wheels, "sensor_msgs/JointState", true);
  checkTopic(bag, path, topics.imu, "sensor_msgs/Imu", false);
  checkTopic(bag, path, topics.fixed_frames, "tf2_msgs/TFMessage", false);
  checkPublishers(bag, path, topics.drive);
  DriveRecording recording;
  forEach<jackal_msgs::Drive>(bag, topics.drive, [&](const jackal_msgs::Drive& drive, const ros::Time& time) {
    const bool moves = drive.mode == jackal_msgs::Drive::MODE_VELOCITY;
    recording.commands.push_back(
        {time.toSec(), moves ? WheelCommand{drive.drivers[0], drive.drivers[1]} : WheelCommand{}});
  });
  forEach<sensor_msgs::JointState>(bag, topics.wheels, [&](const sensor_msgs::JointState& joints, const ros::Time&) {
    takeWheels(joints, topics, recording);
  });
  ImuMounting mounting(bag, topics);
  forEach<sensor_msgs::Imu>(bag, topics.imu, [&](const sensor_msgs::Imu& imu, const ros::Time&) {
    recording.yaw.push_back({imu.header.stamp.toSec(), mounting.yawRate(imu)});
  });
  return recording;
}

DriveRecording readBag(const std::string& path, const BagTopics& topics) {
  try {
    const rosbag::Bag bag(path, rosbag::bagmode::Read);
    return readOpenBag(bag, path, topics);
  } catch (const IdentificationError&) {
    throw;
  } catch (const std::exception& error) {
    throw IdentificationError(unreadableBag(path, error));
  }
}

/// One end of a pipe.
class PipeEnd {
 public:
  explicit PipeEnd(int descriptor) : descriptor_(descriptor) {}
  ~PipeEnd() { close(descriptor_); }
  PipeEnd(const PipeEnd&) = delete;
  PipeEnd& operator=(const PipeEnd&) = delete;

  /// Writes all bytes; false if the other end is gone.
  bool put(const void* data, std::size_t size) const {
    const char* next = static_cast<const char*>(data);
    while (size > 0) {
      const ssize_t written = write(descriptor_, next, size);
      if (written < 0 && errno != EINTR) return false;
      if (written > 0) next += written, size -= static_cast<std::size_t>(written);
    }
    return true;
  }

  /// Reads so many bytes; false if the other end stops before.
  bool get(void* data, std::size_t size) const {
    char* next = static_cast<char*>(data);
    while (size > 0) {
      const ssize_t got = read(descriptor_, next, size);
      if (got == 0 || (got < 0 && errno != EINTR)) return false;
      if (got > 0) next += got, size -= static_cast<std::size_t>(got);
    }
    return true;
  }

  /// A text or a list of plain structs with its length before it.
  template <class List>
  bool putList(const List& list) const {
    static_assert(std::is_trivially_copyable_v<typename List::value_type>);
    const std::size_t size = list.size();
    return put(&size, sizeof size) && put(list.data(), size * sizeof(typename List::value_type));
  }
  template <class List>
  bool getList(List& list) const {
    std::size_t size = 0;
    if (!get(&size, sizeof size)) return false;
    list.resize(size);
    return get(list.data(), size * sizeof(typename List::value_type));
  }

 private:
  int descriptor_;
};

/// What the child does: the recording, or the reason why there is none, goes into the pipe.
void sendBag(const std::string& path, const BagTopics& topics, const PipeEnd& pipe) {
  boundMemory(path);
  std::string refusal;
  DriveRecording recording;
  try {
    recording = readBag(path, topics);
  } catch (const IdentificationError& error) {
    refusal = error.what();
  }
  pipe.putList(refusal) && pipe.putList(recording.commands) && pipe.putList(recording.wheels) &&
      pipe.putList(recording.yaw);
}

}  // namespace

DriveRecording readDriveBag(const std::string& path, const BagTopics& topics) {
  // The bag library trusts the lengths and positions in a file, and a damaged one makes it die in many ways: it reads
  // in a process of its own.
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw IdentificationError(path + ": cannot be read: " + std::strerror(errno));
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    // What the library prints about a damaged file is full of its bytes.
    if (std::freopen("/dev/null", "w", stdout) == nullptr || std::freopen("/dev/null", "w", stderr) == nullptr)
      _exit(1);
    sendBag(path, topics, PipeEnd(ends[1]));
    _exit(0);
  }
  close(ends[1]);
  const PipeEnd pipe(ends[0]);
  if (child < 0) throw IdentificationError(path + ": cannot be read: " + std::strerror(errno));
  std::string refusal;
  DriveRecording recording;
  const bool complete = pipe.getList(refusal) && pipe.getList(recording.commands) && pipe.getList(recording.wheels) &&
                        pipe.getList(recording.yaw);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!refusal.empty()) throw IdentificationError(refusal);
  if (!complete) throw IdentificationError(path + ": cannot be read as a bag: it is damaged");
  return recording;
}

}  // namespace jackal_aic
