#include <geometry_msgs/Twist.h>
#include <jackal_msgs/Drive.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include "conversions.hpp"
#include "excitation.hpp"
#include "graph_watch.hpp"
#include "node_help.hpp"
#include "ros_parameters.hpp"
#include "stop_request.hpp"

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;      // s between commands, as the controller sends them
constexpr double kConnection = 10.0;  // s of wall time to wait for somebody who drives
constexpr double kGraphPeriod = 0.5;  // s of wall time between looks at who else publishes commands

/// Drives the excitation open loop on cmd_drive. Any message on jackal_AIC/set_point ends it with zero commands,
/// another publisher of commands without: that one has the motors.
class ExcitationNode {
 public:
  ExcitationNode(ros::NodeHandle& node, const Excitation& excitation)
      : excitation_(excitation),
        drive_(node.advertise<jackal_msgs::Drive>("cmd_drive", 1)),
        graph_({drive_.getTopic()}, kGraphPeriod) {
    abort_ = node.subscribe("jackal_AIC/set_point", 1, &ExcitationNode::onSetPoint, this);
  }

  /// Waits until somebody subscribes to the commands, then starts. Throws ParameterError if nobody does, or if another
  /// node publishes commands as well.
  void start(ros::NodeHandle& node) {
    const ros::WallTime patience = ros::WallTime::now() + ros::WallDuration(kConnection);
    while (ros::ok() && (drive_.getNumSubscribers() == 0 || ros::Time::now().isZero() || !graph_.checked())) {
      if (ros::WallTime::now() > patience) throw ParameterError("nobody subscribes to " + drive_.getTopic());
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.01));
    }
    requireMotors();
    start_ = ros::Time::now();
    timer_ = node.createTimer(ros::Duration(kPeriod), &ExcitationNode::onTimer, this);
  }

  void stop() {
    if (!graph_.contended()) drive_.publish(driveMessage({}));
  }

  /// Throws ParameterError if another node publishes commands.
  void requireMotors() const {
    if (!graph_.contended()) return;
    throw ParameterError(
        "another node publishes commands: " + graph_.others() +
        "; the excitation needs the motors for itself (launch/jackal.launch says how to part the two)");
  }

 private:
  void onTimer(const ros::TimerEvent&) {
    if (graph_.contended()) return end("Another node publishes commands");
    const double time = (ros::Time::now() - start_).toSec();
    if (time > excitation_.duration() || time < 0.0) return end("The excitation is complete");
    drive_.publish(driveMessage(excitation_.at(time)));
    ROS_INFO_THROTTLE(2.0, "Excitation: [%3.0f%%]", 100.0 * time / excitation_.duration());
  }

  void onSetPoint(const geometry_msgs::Twist&) { end("Aborted by a set point"); }

  void end(const char* why) {
    timer_.stop();
    stop();
    ROS_INFO("%s", why);
    StopRequest::request();
  }

  Excitation excitation_;
  ros::Publisher drive_;
  GraphWatch graph_;
  ros::Subscriber abort_;
  ros::Timer timer_;
  ros::Time start_;
};

void excite(ros::NodeHandle& node, const ros::NodeHandle& private_node, StopRequest& stop_request) {
  ParameterMap map = readRosParameters(private_node);
  const auto bounds = readParameters<ExcitationParameters>(map, "excitation");
  const auto geometry = readParameters<GeometryParameters>(map, "robot");
  map.refuseUnknown();
  ExcitationNode excitation(node, Excitation(bounds, geometry));
  excitation.start(node);
  stop_request.spinUntilRequested();
  excitation.stop();
  excitation.requireMotors();
  stop_request.flush();
}

}  // namespace
}  // namespace jackal_aic

int main(int argc, char** argv) {
  if (jackal_aic::printedHelp(
          argc, argv, "excitation_node",
          "Drives the motion that identify learns from; the robot moves. launch/identify.launch records it.\n")) {
    return 0;
  }
  ros::init(argc, argv, "excitation", ros::init_options::NoSigintHandler);
  ros::NodeHandle node, private_node("~");
  jackal_aic::StopRequest stop_request;
  try {
    jackal_aic::excite(node, private_node, stop_request);
  } catch (const jackal_aic::ParameterError& error) {
    ROS_FATAL("%s", error.what());
    return 1;
  }
  return 0;
}
