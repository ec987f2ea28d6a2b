#include "drive_bag.hpp"

#include <jackal_msgs/Drive.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>

#include "conversions.hpp"

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

DriveRecording readOpenBag(const rosbag::Bag& bag, const std::string& path, const BagTopics& topics) {
  checkTopic(bag, path, topics.drive, "jackal_msgs/Drive", true);
  checkTopic(bag, path, topics.wheels, "sensor_msgs/JointState", true);
  checkTopic(bag, path, topics.imu, "sensor_msgs/Imu", false);
  DriveRecording recording;
  forEach<jackal_msgs::Drive>(bag, topics.drive, [&](const jackal_msgs::Drive& drive, const ros::Time& time) {
    const bool moves = drive.mode == jackal_msgs::Drive::MODE_VELOCITY;
    recording.commands.push_back(
        {time.toSec(), moves ? WheelCommand{drive.drivers[0], drive.drivers[1]} : WheelCommand{}});
  });
  forEach<sensor_msgs::JointState>(bag, topics.wheels, [&](const sensor_msgs::JointState& joints, const ros::Time&) {
    takeWheels(joints, topics, recording);
  });
  forEach<sensor_msgs::Imu>(bag, topics.imu, [&](const sensor_msgs::Imu& imu, const ros::Time&) {
    recording.yaw.push_back({imu.header.stamp.toSec(), imu.angular_velocity.z});
  });
  return recording;
}

}  // namespace

DriveRecording readDriveBag(const std::string& path, const BagTopics& topics) {
  try {
    rosbag::Bag bag(path, rosbag::bagmode::Read);
    return readOpenBag(bag, path, topics);
  } catch (const rosbag::BagException& error) {
    std::string reason = error.what();
    while (!reason.empty() && reason.back() == '\n') reason.pop_back();
    throw IdentificationError(path + ": cannot be read as a bag: " + reason);
  }
}

}  // namespace jackal_aic
