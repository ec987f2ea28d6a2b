#include "outputs/odometry_output.hpp"

#include <cmath>

#include "jackal_aic/safety/loop_odometry.hpp"

namespace jackal_aic {
namespace {

constexpr int kSize = 6;                   // of a covariance: x, y, z, roll, pitch, yaw
constexpr int kPlanar[] = {0, 1, 5};       // rows of x, y and yaw
constexpr int kMotion[] = {0, 5};          // rows of the forward speed and the yaw rate
constexpr double kGroundVariance = 0.001;  // m^2, of the exact initial pose
constexpr double kSmallVariance = 0.001;   // (m/s)^2, of speeds that wheels do not have, as in the stock odometry

/// The diagonal of the components that wheels and gyro do not measure: y and z, roll and pitch.
void setRest(double sideways, double vertical, Covariance& covariance) {
  covariance.fill(0.0);
  covariance[1 * kSize + 1] = sideways;
  covariance[2 * kSize + 2] = vertical;
  covariance[3 * kSize + 3] = covariance[4 * kSize + 4] = kUnknownVariance;
}

}  // namespace

void fillMotionCovariance(const Eigen::Matrix2d& covariance, double rest, Covariance& matrix) {
  setRest(rest, rest, matrix);
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) matrix[kMotion[i] * kSize + kMotion[j]] = covariance(i, j);
  }
}

void fillOdometry(const PlanarPose& pose, const Eigen::Matrix3d& covariance, const PlanarMotion& motion,
                  nav_msgs::Odometry& message) {
  message.pose.pose.position.x = pose.x;
  message.pose.pose.position.y = pose.y;
  message.pose.pose.orientation.z = std::sin(0.5 * pose.heading);
  message.pose.pose.orientation.w = std::cos(0.5 * pose.heading);
  message.twist.twist.linear.x = motion.forward;
  message.twist.twist.angular.z = motion.yaw_rate;
  auto& matrix = message.pose.covariance;
  setRest(0.0, kUnknownVariance, matrix);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) matrix[kPlanar[i] * kSize + kPlanar[j]] = covariance(i, j);
    matrix[kPlanar[i] * (kSize + 1)] += kGroundVariance;
  }
  fillMotionCovariance(motion.covariance, kSmallVariance, message.twist.covariance);
}

geometry_msgs::TransformStamped transformOf(const nav_msgs::Odometry& message) {
  geometry_msgs::TransformStamped transform;
  transform.header = message.header;
  transform.child_frame_id = message.child_frame_id;
  transform.transform.translation.x = message.pose.pose.position.x;
  transform.transform.translation.y = message.pose.pose.position.y;
  transform.transform.rotation = message.pose.pose.orientation;
  return transform;
}

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
  fillOdometry(odometry_.pose(), odometry_.poseCovariance(), odometry_.motion(), message_);
  if (publisher_) publisher_.publish(message_);
  if (broadcaster_) broadcaster_->sendTransform(transformOf(message_));
}

void OdometryOutput::reset() {
  odometry_.resetMotion();
  last_ = {};
}

}  // namespace jackal_aic
