#include "ros_control_publisher.hpp"

#include <geometry_msgs/TwistStamped.h>

#include <cerrno>

#include "outputs/commands.hpp"

namespace jackal_aic {
namespace {

void setDiagonal(boost::array<double, 36>& covariance, const std::array<double, 6>& diagonal) {
  covariance.fill(0.0);
  for (std::size_t i = 0; i < diagonal.size(); ++i) covariance[i * diagonal.size() + i] = diagonal[i];
}

}  // namespace

RosControlPublisher::RosControlPublisher(const ros::NodeHandle& robot, const ros::NodeHandle& controller,
                                         const RosControlParameters& parameters, const OdometryUpdate& initial)
    : base_frame_(parameters.drive.robot.base_frame),
      pose_covariance_(parameters.pose_covariance_diagonal),
      twist_covariance_(parameters.twist_covariance_diagonal),
      report_(parameters.drive.gate.deadlines.set_point),
      // The full name with the slash of a node's, because the updater drops the first character.
      diagnostics_(robot, controller, controller.getNamespace()),
      odometry_updates_(initial) {
  odometry_.header.frame_id = parameters.odom_frame_id;
  odometry_.child_frame_id = base_frame_;
  ros::NodeHandle node(controller);
  odometry_publisher_ = node.advertise<nav_msgs::Odometry>("odom", 100);
  state_publisher_ = node.advertise<ControllerState>("state", 10);
  if (parameters.publish_cmd) command_publisher_ = node.advertise<geometry_msgs::TwistStamped>("cmd_vel_out", 100);
  diagnostics_.setHardwareID("jackal");
  diagnostics_.add("Active inference controller",
                   [this](diagnostic_updater::DiagnosticStatusWrapper& status) { report_.diagnose(status); });
  sem_init(&news_, 0, 0);
  thread_ = std::thread([this] { run(); });
}

RosControlPublisher::~RosControlPublisher() {
  ending_ = true;
  sem_post(&news_);
  thread_.join();
  sem_destroy(&news_);
}

void RosControlPublisher::post(const OdometryUpdate& update) {
  odometry_updates_.write(update);
  sem_post(&news_);
}

void RosControlPublisher::post(const CommandUpdate& update) {
  if (!command_publisher_) return;
  command_updates_.write(update);
  sem_post(&news_);
}

void RosControlPublisher::run() {
  while (!ending_) {
    if (sem_wait(&news_) != 0 && errno == EINTR) continue;
    if (const OdometryUpdate* update = odometry_updates_.read()) publish(*update);
    if (const CommandUpdate* update = command_updates_.read()) publish(*update);
  }
}

void RosControlPublisher::publish(const OdometryUpdate& update) {
  odometry_.header.stamp = update.state.header.stamp;
  fillOdometry(update.pose, update.pose_covariance, update.motion, odometry_);
  if (pose_covariance_) setDiagonal(odometry_.pose.covariance, *pose_covariance_);
  if (twist_covariance_) setDiagonal(odometry_.twist.covariance, *twist_covariance_);
  odometry_publisher_.publish(odometry_);
  if (update.transform) broadcaster_.sendTransform(transformOf(odometry_));
  if (report_.update(update.status, "")) diagnostics_.force_update();
  diagnostics_.update();
  ControllerState state = update.state;
  addRemarks(update.status, {}, base_frame_, state);
  state_publisher_.publish(state);
}

void RosControlPublisher::publish(const CommandUpdate& update) {
  geometry_msgs::TwistStamped message;
  message.header.stamp = update.stamp;
  message.twist = twistMessage(update.velocity);
  command_publisher_.publish(message);
}

}  // namespace jackal_aic
