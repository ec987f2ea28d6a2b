#include "process/controller_node.hpp"

#include <algorithm>
#include <cmath>
#include <variant>

#include "process/wall_times.hpp"

namespace jackal_aic {
namespace {

constexpr double kReportPeriod = 0.05;  // s of wall time between log lines

ros::NodeHandle withQueue(ros::NodeHandle node, ros::CallbackQueue& queue) {
  node.setCallbackQueue(&queue);
  return node;
}

}  // namespace

ControllerNode::ControllerNode(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                               const NodeParameters& parameters)
    : node_(node),
      parameters_(parameters),
      loop_(parameters, makeController(parameters)),
      changes_(loop_),
      diagnostics_(parameters.preset.empty() ? "no preset" : parameters.preset,
                   node_.resolveName("jackal_AIC/set_point"), parameters.gate.deadlines.set_point),
      inputs_(parameters.publish_inputs ? std::make_unique<InputLog>(node_, parameters, loop_) : nullptr),
      state_(node_, parameters, loop_),
      live_parameters_(withQueue(private_node, requests_), parameters, changes_),
      drive_services_(serveDriving(private_node, changes_)),
      output_(node_, parameters.output, parameters.geometry),
      odometry_(node_, parameters, loop_),
      frame_listener_(frames_, withQueue(node_, requests_), false),
      sensors_(parameters.robot, frames_,
               [this](const Observation& observation, const ros::Time& stamp) { onPair(observation, stamp); }),
      robot_(node_, [this](const ros::Time& stamp) { onFeedback(stamp); }),
      set_points_(node_, "jackal_AIC/set_point", 10,
                  [this](const SetPointInput& input) { loop_.setSetPoint(input.wanted, currentTime(), input.stamp); }),
      others_(parameters.allow_other_publishers ? std::vector<std::string>{} : output_.topics(), robot_.emergencyStop(),
              set_points_),
      request_thread_(1, &requests_) {
  set_points_.requireForeign(output_.topics());
  if (parameters.motors_shared) {
    applied_ = subscribeToApplied(
        node_, parameters.geometry,
        [this](const WheelCommand& command, AppliedSource source) { loop_.applied(command, source, currentTime()); });
    set_points_.requireForeign({applied_[0].getTopic(), applied_[1].getTopic()});
  }
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  wheel_subscriber_ = node_.subscribe("joint_states", 50, &ControllerNode::onWheels, this, no_delay);
  imu_subscriber_ = node_.subscribe("imu/data", 50, &ControllerNode::onImu, this, no_delay);
  const double period = loop_.controller().actionStep();
  action_timer_ = node_.createTimer(ros::Duration(period), &ControllerNode::onActionTimer, this);
  setActionTimer(currentTime() + period);
  // A clock that is set back stalls the action timer until the timer is set again.
  clock_timer_ =
      node_.createWallTimer(ros::WallDuration(kCheckPeriod), [this](const ros::WallTimerEvent&) { currentTime(); });
  const auto report = [this](const ros::WallTimerEvent&) { diagnostics_.publish(); };
  report_timer_ = withQueue(node_, requests_).createWallTimer(ros::WallDuration(kReportPeriod), report);
  others_.watch(withQueue(node_, requests_));
  changes_.apply(loop_, currentTime());  // of the learned file
  request_thread_.start();
}

void ControllerNode::onWheels(const sensor_msgs::JointStateConstPtr& message) {
  const double now = currentTime();
  const std::optional<SensorReading> reading = sensors_.addWheels(message, last_now_);
  take(reading, message->header.stamp, [&] { return loop_.receiveWheels(*reading, now); });
}

void ControllerNode::onImu(const sensor_msgs::ImuConstPtr& message) {
  const double now = currentTime();
  const std::optional<SensorReading> reading = sensors_.addImu(message, last_now_);
  take(reading, message->header.stamp, [&] { return loop_.receiveImu(*reading, now); });
}

void ControllerNode::take(const std::optional<SensorReading>& reading, const ros::Time& stamp,
                          const std::function<bool()>& receive) {
  if (!sensors_.lastRefusal().empty()) StatusReport::refused(sensors_.lastRefusal(), ++rejected_readings_);
  if (!reading || !receive()) return;
  odometry_.observe(reading->observation, last_now_);
  state_.publishMeasurement(stamp);
}

void ControllerNode::onFeedback(const ros::Time& stamp) {
  if (parameters_.output == OutputMode::gazebo && !refused_) {
    refused_ = true;
    ROS_FATAL(
        "output = gazebo: for simulations only, but a robot publishes /feedback: use output: twist. Its wheels would "
        "keep their last speed if this node died");
  }
  loop_.receiveFeedback(stamp.toSec(), currentTime());
}

void ControllerNode::onPair(const Observation& observation, const ros::Time& stamp) {
  // At the time of the message that completed the pair, which the loop does not know yet.
  const bool taken = loop_.observe(observation, last_now_.toSec());
  odometry_.observe(observation, last_now_);
  if (taken) state_.publishMeasurement(stamp);
}

void ControllerNode::onActionTimer(const ros::TimerEvent&) {
  const double now = currentTime();
  if (changes_.apply(loop_, now)) resetSensors();
  no_subscriber_ = output_.complaint();
  loop_.report(robotStatus(), now);
  const WheelCommand applied = loop_.command();  // until now
  const std::optional<WheelCommand> command = loop_.advance(now, action_due_);
  if (inputs_) inputs_->publish(last_now_);
  const DriveLoopStatus status = loop_.status();
  const Surroundings around{contender(), no_subscriber_, others_.contended(), rejected_readings_};
  diagnostics_.post({status, around, missing(), others_.masterReachable()});
  if (command) {
    // Zero would keep the robot from following the other publisher.
    if (!others_.contended() || *command != WheelCommand{}) output_.publish(*command);
    state_.publish(last_now_, status, around);
    odometry_.publish(applied, last_now_);
  }
  changes_.send(loop_);
  setActionTimer(loop_.nextDue(action_due_, now));
}

void ControllerNode::setActionTimer(double due) {
  action_due_ = due;
  // Set for each action, because a timer with a changed period keeps its old due time.
  action_timer_.setPeriod(ros::Duration(std::max(0.0, due - ros::Time::now().toSec())));
}

RobotStatus ControllerNode::robotStatus() const {
  RobotStatus status = robot_.status();
  status.contended = others_.contended();
  status.graph_checked = others_.checked();
  status.set_points_connected = others_.setPointsConnected();
  status.ending = ending_;
  status.disabled = !changes_.enabled();
  status.rivals = !parameters_.allow_multiple_set_points && !set_points_.rivals().empty();
  status.no_subscriber = !no_subscriber_.empty();
  return status;
}

bool ControllerNode::run(StopRequest& stop) {
  stop.spinWhile([this] { return !StopRequest::requested() && !refused_; });
  ending_ = true;
  const auto at_rest = [this] { return loop_.command() == WheelCommand{}; };
  // A paused simulation never comes to rest.
  stop.spinWhile([&] { return !at_rest(); }, parameters_.gate.brake.time + kCheckPeriod);
  if (!others_.contended()) output_.publish({});
  if (at_rest()) {
    ROS_INFO("Stopping; wheels at zero");
  } else {
    ROS_WARN("Stopping before the wheels are at rest: the clock stands still, or the machine is too busy");
  }
  stop.flush();
  return !refused_;
}

double ControllerNode::currentTime() {
  const ros::Time now = ros::Time::now();
  if (now < last_now_) {
    ROS_WARN("The clock jumped back by %.3f s: the controller starts again", (last_now_ - now).toSec());
    resetSensors();
    robot_.reset();
    setActionTimer(now.toSec() + loop_.controller().actionStep());
  }
  last_now_ = now;
  return now.toSec();
}

void ControllerNode::resetSensors() {
  sensors_.reset();
  odometry_.reset();
}

/// Sensors without a message since the start, in words.
std::string ControllerNode::missing() const {
  std::string text;
  const auto add = [&](StopCause cause, double measured) {
    if (std::isnan(measured)) text.append(text.empty() ? "" : "; ").append(jackal_aic::text(cause));
  };
  if (std::holds_alternative<DifferentialDriveParameters>(parameters_.controller)) return text;  // which uses none
  add(StopCause::wheels_missing, loop_.measuredVelocity()(kForward));
  add(StopCause::imu_missing, loop_.measuredVelocity()(kYaw));
  return text;
}

/// Other publishers of commands or set points, with a remedy.
std::string ControllerNode::contender() const {
  const bool rivals = loop_.status().decision.cause == StopCause::set_points_rival;
  return rivals ? set_points_.rivals() + "; end one, or set allow_multiple_set_points" : others_.text();
}

}  // namespace jackal_aic
