#include "controller_node.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "conversions.hpp"
#include "wheel_watchdog.hpp"

namespace jackal_aic {
namespace {

/// Wall time between looks at who else publishes commands [s].
constexpr double kGraphPeriod = 0.5;

/// Wall time between looks at the clock, and how long it may stand still before that is told [s].
constexpr double kClockPeriod = 0.5;
constexpr double kClockPatience = 3.0;

/// What a Twist with a component that is not finite asks for.
constexpr SetPoint kNotFinite{std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0};

/// Velocity in the state before the first measurement of it.
constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

}  // namespace

ControllerNode::ControllerNode(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                               const NodeParameters& parameters)
    : node_(node),
      parameters_(parameters),
      kinematics_(parameters.geometry),
      loop_(parameters, makeController(parameters)),
      inputs_(parameters.publish_inputs ? std::make_unique<InputLog>(node_, parameters, loop_) : nullptr),
      structure_(makeStructure(node_, parameters, loop_)),
      tuning_(makeTuning(private_node, parameters, *this)),
      services_(private_node, parameters.gate.deadlines.set_point, serviceActions()),
      output_(node_, parameters.output, parameters.geometry),
      odometry_(node_, parameters, loop_),
      transform_listener_(transforms_, node_),
      sensors_(parameters.robot, transforms_,
               [this](const Observation& observation, const ros::Time& stamp) { onPair(observation, stamp); }),
      robot_(node_, [this](const ros::Time& stamp) { loop_.receiveFeedback(stamp.toSec(), currentTime()); }),
      graph_(output_.topics(), kGraphPeriod, {watchdogOf(ros::this_node::getName())},
             node_.resolveName("jackal_AIC/set_point")),
      set_points_(node_, "jackal_AIC/set_point", 10,
                  [this](const ReceivedSetPoint& received) { onSetPoint(received); }) {
  const bool due = parameters.plant_model && !parameters.plant_model->identified;
  ROS_LOG(due ? ros::console::levels::Warn : ros::console::levels::Info, ROSCONSOLE_DEFAULT_NAME, "%s",
          describeRobot(parameters).c_str());
  if (parameters.motors_shared) {
    applied_.emplace(node_, parameters.geometry, [this](const WheelCommand& command, AppliedSource source) {
      loop_.applied(command, source, currentTime());
    });
  }
  diagnostics_.setHardwareID("jackal");
  diagnostics_.add("Active inference controller", this, &ControllerNode::diagnose);
  sensor_publisher_ = node_.advertise<SensorGeneralized>("sensor_generalized", 10);
  state_publisher_ = node_.advertise<ControllerState>("jackal_AIC/state", 10);
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  requireForeignSetPoints();
  wheel_subscriber_ = node_.subscribe("joint_states", 50, &ControllerNode::onWheels, this, no_delay);
  imu_subscriber_ = node_.subscribe("imu/data", 50, &ControllerNode::onImu, this, no_delay);
  const VelocityController& controller = loop_.controller();
  belief_timer_ = node_.createTimer(ros::Duration(controller.beliefStep()), &ControllerNode::onBeliefTimer, this);
  action_timer_ = node_.createTimer(ros::Duration(controller.actionStep()), &ControllerNode::onActionTimer, this);
  watched_advance_ = ros::WallTime::now();
  clock_timer_ =
      node_.createWallTimer(ros::WallDuration(kClockPeriod), [this](const ros::WallTimerEvent&) { watchClock(); });
}

void ControllerNode::requireForeignSetPoints() const {
  std::vector<std::string> ours = output_.topics();
  if (applied_) {
    const std::vector<std::string> heard = applied_->topics();
    ours.insert(ours.end(), heard.begin(), heard.end());
  }
  const std::string topic = set_points_.topic();
  if (std::find(ours.begin(), ours.end(), topic) == ours.end()) return;
  throw ParameterError("jackal_AIC/set_point is remapped to " + topic +
                       ", where this node's own commands would come back as set points; take another output, or "
                       "another topic");
}

void ControllerNode::onSetPoint(const ReceivedSetPoint& received) {
  const SetPointVerdict verdict =
      loop_.setSetPoint(received.wanted.value_or(kNotFinite), currentTime(), received.stamp);
  if (verdict == SetPointVerdict::accepted) return services_.noteSetPoint(*received.wanted);
  const bool absurd = verdict == SetPointVerdict::absurd;
  StatusReport::refused(absurd ? "set point far beyond the limits" : "set point that is not finite",
                        loop_.status().rejected_set_points);
}

void ControllerNode::onWheels(const sensor_msgs::JointStateConstPtr& message) {
  const double now = currentTime();
  const std::optional<SensorReading> reading = sensors_.addWheels(message, last_now_);
  if (!sensors_.lastRefusal().empty()) return refuseReading();
  if (reading) measured_wheels_ = {reading->observation.wheel_left, reading->observation.wheel_right};
  if (!reading || !loop_.receiveWheels(*reading, now)) return;
  odometry_.observe(reading->observation);
  publishMeasurement(message->header.stamp);
}

void ControllerNode::onImu(const sensor_msgs::ImuConstPtr& message) {
  const double now = currentTime();
  const std::optional<SensorReading> reading = sensors_.addImu(message, last_now_);
  if (!sensors_.lastRefusal().empty()) return refuseReading();
  if (reading) measured_yaw_rate_ = reading->observation.yaw_rate;
  if (!reading || !loop_.receiveImu(*reading, now)) return;
  odometry_.observe(reading->observation);
  publishMeasurement(message->header.stamp);
}

void ControllerNode::onPair(const Observation& observation, const ros::Time& stamp) {
  // At the time of the message that completed the pair, which the loop is still to be told of.
  const bool taken = loop_.observe(observation, last_now_.toSec());
  odometry_.observe(observation);
  reportStatus();
  if (taken) publishMeasurement(stamp);
}

void ControllerNode::onBeliefTimer(const ros::TimerEvent&) { loop_.updateBelief(currentTime()); }

void ControllerNode::onActionTimer(const ros::TimerEvent& event) {
  const double now = currentTime();
  loop_.report(robotStatus(), now);
  const std::optional<WheelCommand> command = loop_.advance(now, event.current_expected.toSec());
  if (inputs_) inputs_->publish(last_now_);
  reportStatus();
  if (command) {
    // Zero would keep the robot from following whoever else commands it.
    if (!contended() || *command != WheelCommand{}) output_.publish(*command);
    publishState(last_now_);
    odometry_.publish(last_now_);
  }
  diagnostics_.update();
}

RobotStatus ControllerNode::robotStatus() const {
  RobotStatus status = robot_.status();
  status.contended = contended();
  status.outputs_checked = graph_.checked();
  status.ending = ending_;
  status.disabled = !enabled_;
  status.rivals = rivalled();
  return status;
}

SlipState ControllerNode::slip() const { return dynamic_cast<const PredictiveController&>(loop_.controller()).slip(); }

DriveServices::Actions ControllerNode::serviceActions() {
  const auto reset = [this] {
    loop_.start({}, currentTime());
    sensors_.reset();
    odometry_.reset();
  };
  return {[this](bool enabled) { enabled_ = enabled; }, [this] { return DriveServices::resting(loop_.command()); },
          reset};
}

bool ControllerNode::contended() const {
  return graph_.contended() && !parameters_.allow_other_publishers && !parameters_.motors_shared;
}

bool ControllerNode::rivalled() const { return graph_.rivalled() && !parameters_.allow_multiple_set_points; }

std::uint8_t ControllerNode::drivenBy() const {
  if (contended() || loop_.status().handed_over) return ControllerState::BY_ANOTHER;
  return loop_.command() == WheelCommand{} ? ControllerState::BY_NOBODY : ControllerState::BY_US;
}

void ControllerNode::publishStop() {
  if (!contended()) output_.publish({});
}

double ControllerNode::currentTime() {
  const ros::Time now = ros::Time::now();
  if (now < last_now_) {
    ROS_WARN("The clock jumped back by %.3f s: the controller starts anew", (last_now_ - now).toSec());
    sensors_.reset();
    robot_.reset();
    odometry_.reset();
    transforms_.clear();
  }
  last_now_ = now;
  return now.toSec();
}

void ControllerNode::watchClock() {
  const ros::Time now = ros::Time::now();
  const ros::WallTime wall = ros::WallTime::now();
  if (now != watched_time_) {
    if (clock_stands_) ROS_INFO("The clock goes on");
    watched_time_ = now;
    watched_advance_ = wall;
    clock_stands_ = false;
  }
  if (clock_stands_ || (wall - watched_advance_).toSec() < kClockPatience) return;
  clock_stands_ = true;
  if (now.isZero()) {
    ROS_ERROR(
        "No clock: /use_sim_time is true and nothing came on /clock for %.0f s. Nothing happens until it does: start "
        "the simulation, or rosparam set /use_sim_time false and start this anew",
        kClockPatience);
  } else {
    ROS_ERROR("The clock stands still at %.3f s: nothing came on /clock for %.0f s, and no command is sent",
              now.toSec(), kClockPatience);
  }
}

void ControllerNode::refuseReading() { StatusReport::refused(sensors_.lastRefusal(), ++rejected_readings_); }

void ControllerNode::reportStatus() {
  const DriveLoopStatus status = loop_.status();
  std::string others;
  if (rivalled()) others = graph_.rivals() + "; end one, or set allow_multiple_set_points";
  if (contended()) others = graph_.others() + "; remap the commands of one of the two (launch/jackal.launch says how)";
  // What happens is told at once, not with the next period.
  if (report_.update(status, others)) diagnostics_.force_update();
}

void ControllerNode::publishMeasurement(const ros::Time& stamp) {
  SensorGeneralized message = structure_->measurement();
  message.header.stamp = stamp;
  message.header.frame_id = parameters_.robot.base_frame;
  sensor_publisher_.publish(message);
}

void ControllerNode::publishState(const ros::Time& now) {
  const DriveLoopStatus status = loop_.status();
  ControllerState message = structure_->state();
  message.header.stamp = now;
  message.header.frame_id = parameters_.robot.base_frame;
  message.status = static_cast<std::uint8_t>(status.decision.status);
  message.driven_by = drivenBy();
  message.reason = report_.reason();
  message.set_point_forward = loop_.setPoint().forward;
  message.set_point_yaw_rate = loop_.setPoint().yaw_rate;
  message.measured_forward = measured_wheels_ ? kinematics_.bodyVelocity(*measured_wheels_)(kForward) : kNotMeasured;
  message.measured_yaw_rate = measured_yaw_rate_.value_or(kNotMeasured);
  message.action_left = loop_.action().left;
  message.action_right = loop_.action().right;
  message.command_left = loop_.command().left;
  message.command_right = loop_.command().right;
  message.rejected_set_points = status.rejected_set_points;
  message.rejected_measurements = status.rejected_measurements + rejected_readings_;
  state_publisher_.publish(message);
  structure_->publish(message.header);
  tuning_->keep(now);
}

void ControllerNode::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) {
  report_.diagnose(status);
  status.add("Rejected measurements", loop_.status().rejected_measurements + rejected_readings_);
  status.add("Master reachable", graph_.masterReachable() ? "yes" : "no");
  status.add("Free energy", loop_.controller().freeEnergy());
}

}  // namespace jackal_aic
