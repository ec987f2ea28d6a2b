#include <diagnostic_updater/diagnostic_updater.h>
#include <jackal_msgs/Drive.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Bool.h>

#include <cmath>
#include <variant>

#include "command_monitor.hpp"
#include "graph_watch.hpp"
#include "jackal_aic/config/text.hpp"
#include "node_help.hpp"
#include "node_parameters.hpp"
#include "ros_parameters.hpp"
#include "set_point_source.hpp"

namespace {

using jackal_aic::Breach;
using jackal_aic::CommandMonitor;
using jackal_aic::CommandMonitorParameters;
using jackal_aic::kMonitored;
using jackal_aic::NodeParameters;

constexpr std::uint32_t kQueue = 50;
constexpr double kGraphPeriod = 0.5;  // s of wall time

/// How long a controller may drive without wheel speeds beyond their deadline [s].
double longestBlind(const NodeParameters& controller) {
  if (std::holds_alternative<jackal_aic::DifferentialDriveParameters>(controller.controller)) return HUGE_VAL;
  const bool predicts = std::holds_alternative<jackal_aic::PredictiveParameters>(controller.controller);
  const bool drives = controller.on_loss.wheels == jackal_aic::LossAction::drive;
  return predicts && drives ? controller.on_loss.model_time : 0.0;
}

/// Topics in, accusations out: a log line, at most one a second for each requirement, and /diagnostics.
class CommandMonitorNode {
 public:
  CommandMonitorNode(ros::NodeHandle& node, const CommandMonitorParameters& parameters,
                     const NodeParameters& controller)
      : parameters_(parameters),
        controller_(controller),
        monitor_(made()),
        graph_({{}, {}, true, node.resolveName("jackal_AIC/set_point"), true}, kGraphPeriod),
        set_points_(
            node, "jackal_AIC/set_point", kQueue,
            [this](const jackal_aic::ReceivedSetPoint& received) {
              monitor_.takeSetPoint(received.wanted.forward, received.wanted.yaw_rate, now());
            },
            [this] { return graph_.loneTypes(); }) {
    const auto no_delay = ros::TransportHints().tcpNoDelay();
    wheels_ = node.subscribe("joint_states", kQueue, &CommandMonitorNode::onWheels, this, no_delay);
    stop_ = node.subscribe("e_stop", kQueue, &CommandMonitorNode::onEmergencyStop, this, no_delay);
    commands_ = node.subscribe("cmd_drive", kQueue, &CommandMonitorNode::onCommand, this, no_delay);
    diagnostics_.setHardwareID("jackal");
    diagnostics_.add("Command monitor", this, &CommandMonitorNode::fill);
    timer_ =
        node.createWallTimer(ros::WallDuration(0.2), [this](const ros::WallTimerEvent&) { diagnostics_.update(); });
  }

 private:
  CommandMonitor made() const {
    return {parameters_, controller_.gate, controller_.geometry, longestBlind(controller_)};
  }

  /// After a restart of the simulation nothing of the time before counts.
  double now() {
    const double time = ros::Time::now().toSec();
    if (time < last_now_) {
      monitor_ = made();
      accused_ = {};
    }
    return last_now_ = time;
  }

  void onWheels(const sensor_msgs::JointStateConstPtr&) { monitor_.takeWheels(now()); }
  void onEmergencyStop(const std_msgs::BoolConstPtr& message) { monitor_.takeEmergencyStop(message->data, now()); }

  void onCommand(const jackal_msgs::DriveConstPtr& message) {
    const double left = message->drivers[jackal_msgs::Drive::LEFT], right = message->drivers[jackal_msgs::Drive::RIGHT];
    const double time = now();
    const std::optional<Breach> breach = monitor_.takeCommand({left, right}, time);
    if (!breach) return;
    const auto index = static_cast<std::size_t>(*breach);
    if (time - accused_[index] < 1.0) return;
    accused_[index] = time;
    ROS_ERROR("%s broken: command (%g, %g) rad/s %s", kMonitored[index].id, left, right, kMonitored[index].text);
    diagnostics_.force_update();
  }

  void fill(diagnostic_updater::DiagnosticStatusWrapper& status) {
    using diagnostic_msgs::DiagnosticStatus;
    status.summary(DiagnosticStatus::OK, "no requirement broken");
    status.add("Commands", monitor_.commands());
    for (std::size_t i = 0; i < kMonitored.size(); ++i) {
      const std::uint32_t count = monitor_.count(static_cast<Breach>(i));
      if (count > 0) status.mergeSummary(DiagnosticStatus::ERROR, std::string(kMonitored[i].id) + " broken");
      status.add(kMonitored[i].id, count);
    }
  }

  CommandMonitorParameters parameters_;
  NodeParameters controller_;
  CommandMonitor monitor_;
  double last_now_ = 0.0;                            // s
  std::array<double, kMonitored.size()> accused_{};  // when each was told last [s]
  jackal_aic::GraphWatch graph_;                     // who publishes set points
  jackal_aic::SetPointSource set_points_;
  ros::Subscriber wheels_, stop_, commands_;
  diagnostic_updater::Updater diagnostics_;
  ros::WallTimer timer_;
};

}  // namespace

int main(int argc, char** argv) {
  if (jackal_aic::printedHelp(
          argc, argv, "command_monitor",
          "Listens to set points, wheel speeds, emergency stop and cmd_drive, and accuses commands "
          "that break\n"
          "a requirement (doc/reference/requirements.yaml): log lines and /diagnostics. Private "
          "parameters:\n"
          "controller (node whose limits hold, default jackal_aic), action_period, standstill.\n")) {
    return 0;
  }
  ros::init(argc, argv, "jackal_aic_monitor");
  ros::NodeHandle handle, private_handle("~");
  try {
    jackal_aic::ParameterMap map = jackal_aic::readRosParameters(private_handle);
    const auto parameters = jackal_aic::readParameters<CommandMonitorParameters>(map, "");
    std::string name = "jackal_aic";
    jackal_aic::ParameterReader(map, "").field("controller", name, jackal_aic::Presence::optional);
    map.refuseUnknown();
    const ros::NodeHandle controller(handle, name);
    const auto watched = jackal_aic::readNodeParameters(jackal_aic::readRosParameters(controller),
                                                        [&] { return jackal_aic::robotDescription(controller); });
    if (watched.output != jackal_aic::OutputMode::cmd_drive) {
      ROS_WARN("Nothing to watch: %s does not publish cmd_drive (its parameter output)", name.c_str());
      return 0;
    }
    CommandMonitorNode node(handle, parameters, watched);
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL("%s", jackal_aic::onOneLine(error.what()).c_str());
    return 1;
  }
  return 0;
}
