/// @file
/// Node diff_drive_node: the differential drive baseline on the topics of the controller, as the stock Jackal would
/// run.

#include <geometry_msgs/Twist.h>
#include <jackal_msgs/Drive.h>
#include <ros/ros.h>

#include <cmath>
#include <optional>

#include "differential_drive.hpp"
#include "jackal_aic/gate_parameters.hpp"
#include "ros_parameters.hpp"
#include "stop_request.hpp"

namespace jackal_aic::sim {
namespace {

/// Turns jackal_AIC/set_point into cmd_drive at a fixed rate; a set point that is too old counts as zero.
class DifferentialDriveNode {
 public:
  /// @param set_point_timeout largest age of the set point [s].
  DifferentialDriveNode(const DifferentialDriveParameters& parameters, double set_point_timeout)
      : drive_(parameters), set_point_timeout_(set_point_timeout) {
    command_ = node_.advertise<jackal_msgs::Drive>("cmd_drive", 1);
    set_point_ = node_.subscribe("jackal_AIC/set_point", 1, &DifferentialDriveNode::onSetPoint, this);
    timer_ = node_.createTimer(ros::Duration(1.0 / parameters.rate), &DifferentialDriveNode::onTimer, this);
  }

  /// Publishes a zero command, for shutdown.
  void publishStop() { publish({}); }

 private:
  void onSetPoint(const geometry_msgs::Twist& message) {
    const SetPoint set_point{message.linear.x, message.linear.y, message.angular.z};
    if (!set_point.vector().allFinite()) {
      ROS_WARN_THROTTLE(1.0, "set point rejected: not finite");
      return;
    }
    drive_.setSetPoint(set_point);
    received_ = ros::Time::now();
  }

  void onTimer(const ros::TimerEvent& event) {
    const bool clock_jumped_back = event.current_real < event.last_real;
    if (clock_jumped_back) drive_.reset();
    if (clock_jumped_back || (received_ && (event.current_real - *received_).toSec() > set_point_timeout_)) {
      drive_.setSetPoint({});
      received_.reset();
    }
    publish(drive_.update());
  }

  void publish(const WheelCommand& command) {
    jackal_msgs::Drive message;
    message.mode = jackal_msgs::Drive::MODE_VELOCITY;
    message.drivers[jackal_msgs::Drive::LEFT] = static_cast<float>(command.left);
    message.drivers[jackal_msgs::Drive::RIGHT] = static_cast<float>(command.right);
    command_.publish(message);
  }

  DifferentialDrive drive_;
  double set_point_timeout_;
  std::optional<ros::Time> received_;  // when the set point in force arrived
  ros::NodeHandle node_;
  ros::Publisher command_;
  ros::Subscriber set_point_;
  ros::Timer timer_;
};

}  // namespace
}  // namespace jackal_aic::sim

int main(int argc, char** argv) {
  using namespace jackal_aic;
  ros::init(argc, argv, "diff_drive_node", ros::init_options::NoSigintHandler);
  ros::NodeHandle private_node("~");  // kept to the end: without a handle roscpp shuts down and logs no more
  StopRequest stop;
  try {
    ParameterMap map = readRosParameters(private_node);
    const auto parameters = readParameters<sim::DifferentialDriveParameters>(map, "diff_drive");
    const auto deadlines = readParameters<DeadlineParameters>(map, "deadlines");
    map.refuseUnknown();
    sim::DifferentialDriveNode node(parameters, deadlines.set_point);
    stop.spinUntilRequested();
    node.publishStop();
    stop.flush();
    return 0;
  } catch (const ParameterError& error) {
    ROS_FATAL("%s", error.what());
    return 1;
  }
}
