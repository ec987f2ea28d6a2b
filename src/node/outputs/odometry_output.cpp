#include "outputs/odometry_output.hpp"

#include <cmath>

#include "jackal_aic/safety/loop_odometry.hpp"

namespace jackal_aic {
namespace {

/// Of a pose that is exact at first [m^2], and of the speeds that wheels do not have [(m/s)^2]; as in the stock
/// odometry.
constexpr double kSmallVariance = 0.001;

/// Rows of x, y, z, roll, pitch, yaw.
using Matrix = Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>;

/// Zero but for the components that wheels and gyro do not measure: y and z, roll and pitch.
Matrix withRest(double sideways, double vertical, Covariance& covariance) {
  Matrix matrix(covariance.data());
  matrix.setZero();
  matrix.diagonal().segment<4>(1) << sideways, vertical, kUnknownVariance, kUnknownVariance;
  return matrix;
}

}  // namespace

void fillMotionCovariance(const Eigen::Matrix2d& covariance, double rest, Covariance& message) {
  Matrix matrix = withRest(rest, rest, message);
  matrix(0, 0) = covariance(0, 0);
  matrix(0, 5) = matrix(5, 0) = covariance(0, 1);
  matrix(5, 5) = covariance(1, 1);
}

void fillOdometry(const PlanarPose& pose, const Eigen::Matrix3d& covariance, const PlanarMotion& motion,
                  nav_msgs::Odometry& message) {
  message.pose.pose.position.x = pose.x;
  message.pose.pose.position.y = pose.y;
  message.pose.pose.orientation.z = std::sin(0.5 * pose.heading);
  message.pose.pose.orientation.w = std::cos(0.5 * pose.heading);
  message.twist.twist.linear.x = motion.forward;
  message.twist.twist.angular.z = motion.yaw_rate;
  const Eigen::Matrix3d uncertain = covariance + kSmallVariance * Eigen::Matrix3d::Identity();
  Matrix matrix = withRest(0.0, kUnknownVariance, message.pose.covariance);
  matrix.topLeftCorner<2, 2>() = uncertain.topLeftCorner<2, 2>();
  matrix.topRightCorner<2, 1>() = uncertain.topRightCorner<2, 1>();
  matrix.bottomLeftCorner<1, 2>() = uncertain.bottomLeftCorner<1, 2>();
  matrix(5, 5) = uncertain(2, 2);
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
