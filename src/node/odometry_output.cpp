#include "odometry_output.hpp"

#include "jackal_aic/safety/loop_odometry.hpp"
#include "odometry_message.hpp"

namespace jackal_aic {

OdometryOutput::OdometryOutput(ros::NodeHandle& node, const NodeParameters& parameters, const DriveLoop& loop)
    : loop_(loop), odometry_(makeOdometry(parameters, loop)) {
  message_.header.frame_id = parameters.odometry.frame;
  message_.child_frame_id = parameters.robot.base_frame;
  if (parameters.odometry.publish) publisher_ = node.advertise<nav_msgs::Odometry>("odom", 10);
  if (parameters.odometry.tf) broadcaster_.emplace();
}

void OdometryOutput::observe(const Observation& observation, const ros::Time& now) {
  advance(loop_.command(), now);
  odometry_.observe(asCounted(observation, loop_));
}

void OdometryOutput::advance(const WheelCommand& applied, const ros::Time& now) {
  if (!last_.isZero()) odometry_.advance(applied, (now - last_).toSec());
  last_ = now;
}

void OdometryOutput::publish(const WheelCommand& applied, const ros::Time& now) {
  advance(applied, now);
  message_.header.stamp = now;
  fillPose(odometry_.pose(), message_);
  fillMotion(odometry_.motion(), message_);
  fillPoseCovariance(odometry_.poseCovariance(), message_);
  fillMotionCovariance(odometry_.motion().covariance, message_);
  if (publisher_) publisher_.publish(message_);
  if (broadcaster_) publishTransform();
}

void OdometryOutput::publishTransform() {
  geometry_msgs::TransformStamped transform;
  transform.header = message_.header;
  transform.child_frame_id = message_.child_frame_id;
  transform.transform.translation.x = message_.pose.pose.position.x;
  transform.transform.translation.y = message_.pose.pose.position.y;
  transform.transform.rotation = message_.pose.pose.orientation;
  broadcaster_->sendTransform(transform);
}

void OdometryOutput::reset() {
  odometry_.forgetMotion();
  last_ = {};
}

}  // namespace jackal_aic
