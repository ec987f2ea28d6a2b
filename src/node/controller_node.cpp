#include "controller_node.hpp"

#include <algorithm>
#include <cmath>

#include "conversions.hpp"
#include "wheel_watchdog.hpp"

namespace jackal_aic {
namespace {

/// Action periods that a late timer may catch up at once: 0.1 s at 50 Hz. Beyond that the measurements are too old to
/// act on.
constexpr int kMostPeriods = 5;

/// Wall time between looks at who else publishes commands [s].
constexpr double kGraphPeriod = 0.5;

/// Age of an input: by its stamp or by its arrival, whichever is further from now.
double age(const ros::Time& now, const ros::Time& stamp, const ros::Time& received) {
  if (stamp.isZero()) return kNever;
  const double by_stamp = (now - stamp).toSec();
  const double by_arrival = (now - received).toSec();
  return std::abs(by_stamp) > std::abs(by_arrival) ? by_stamp : by_arrival;
}

std::int64_t nanoseconds(const ros::Time& time) { return static_cast<std::int64_t>(time.toNSec()); }

}  // namespace

ControllerNode::ControllerNode(const ros::NodeHandle& node, const NodeParameters& parameters)
    : node_(node),
      parameters_(parameters),
      structure_(makeStructure(node_, parameters)),
      controller_(structure_->controller()),
      kinematics_(parameters.geometry),
      gate_(parameters.gate, parameters.geometry, controller_.actionStep()),
      schedule_(std::llround(1e9 * controller_.beliefStep()), controller_.beliefStepsPerAction(), kMostPeriods),
      output_(node_, parameters.output, parameters.geometry),
      transform_listener_(transforms_, node_),
      sensors_(parameters.robot, transforms_,
               [this](const Observation& observation, const ros::Time& stamp) { onObservation(observation, stamp); }),
      robot_(node_, parameters.robot, parameters.gate.deadlines, [this] { return currentTime(); }),
      graph_(output_.topics(), kGraphPeriod, {watchdogOf(ros::this_node::getName())}),
      motors_(node_, parameters.output, parameters.geometry, [this] { return currentTime(); }),
      measurements_(parameters) {
  const bool due = parameters.plant_model && !parameters.plant_model->identified;
  ROS_LOG(due ? ros::console::levels::Warn : ros::console::levels::Info, ROSCONSOLE_DEFAULT_NAME, "%s",
          describeRobot(parameters).c_str());
  diagnostics_.setHardwareID("jackal");
  diagnostics_.add("Active inference controller", this, &ControllerNode::diagnose);
  sensor_publisher_ = node_.advertise<SensorGeneralized>("sensor_generalized", 10);
  state_publisher_ = node_.advertise<ControllerState>("jackal_AIC/state", 10);
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  set_point_subscriber_ = node_.subscribe("jackal_AIC/set_point", 10, &ControllerNode::onSetPoint, this, no_delay);
  requireForeignSetPoints();
  wheel_subscriber_ = node_.subscribe("joint_states", 50, &ControllerNode::onWheels, this, no_delay);
  imu_subscriber_ = node_.subscribe("imu/data", 50, &ControllerNode::onImu, this, no_delay);
  belief_timer_ = node_.createTimer(ros::Duration(controller_.beliefStep()), &ControllerNode::onBeliefTimer, this);
  action_timer_ = node_.createTimer(ros::Duration(controller_.actionStep()), &ControllerNode::onActionTimer, this);
}

void ControllerNode::requireForeignSetPoints() const {
  std::vector<std::string> ours = motors_.topics();
  const std::vector<std::string> outputs = output_.topics();
  ours.insert(ours.end(), outputs.begin(), outputs.end());
  const std::string topic = set_point_subscriber_.getTopic();
  if (std::find(ours.begin(), ours.end(), topic) == ours.end()) return;
  throw ParameterError("jackal_AIC/set_point is remapped to " + topic +
                       ", where this node's own commands would come back as set points; take another output, or "
                       "another topic");
}

void ControllerNode::onSetPoint(const geometry_msgs::Twist& message) {
  const auto wanted = setPoint(message);
  if (!wanted || !isPlausible(*wanted, parameters_.gate.limits)) {
    reportRefusal(wanted ? "set point far beyond the limits" : "set point that is not finite", ++rejected_set_points_);
    return;
  }
  set_point_received_ = currentTime();
  set_point_ = gate_.reachable(*wanted);
  controller_.setSetPoint(set_point_);
}

void ControllerNode::onWheels(const sensor_msgs::JointStateConstPtr& message) {
  if (sensors_.addWheels(message, currentTime())) {
    robot_.addWheels(*message, last_now_, appliedCommand());
    motors_.addWheels(last_now_.toSec(), robot_.wheelSpeeds());
    if (measurements_.imuSilent() && mentionsAny(*message, parameters_.robot.left_wheel_joints)) {
      onObservation(sensors_.wheelsAlone(*message), message->header.stamp);
    }
  } else {
    reportRefusal(sensors_.lastRefusal().c_str(), ++rejected_measurements_);
  }
}

void ControllerNode::onImu(const sensor_msgs::ImuConstPtr& message) {
  if (sensors_.addImu(message, currentTime())) {
    robot_.addImu(*message, last_now_);
    if (measurements_.wheelsSilent()) onObservation(sensors_.imuAlone(*message), message->header.stamp);
  } else {
    reportRefusal(sensors_.lastRefusal().c_str(), ++rejected_measurements_);
  }
}

void ControllerNode::onObservation(Observation observation, const ros::Time& stamp) {
  catchUp(last_now_);  // a measurement that overtakes the belief timer must not meet a belief about the past
  const bool alone = !observation.valid.all();
  const bool taken_alone = taken_alone_ && stamp == measurement_stamp_;
  measurements_.judge(observation, last_now_.toSec());
  const SampleVerdict verdict = controller_.observe(observation);
  if (!taken(verdict) && verdict != SampleVerdict::incomplete) {
    // The partner of a sample that was taken alone has come back.
    if (!taken_alone) reportRefusal("measurement whose stamp is not later than the last one", ++rejected_measurements_);
    return;
  }
  measurement_stamp_ = stamp;
  measurement_received_ = last_now_;
  taken_alone_ = alone;
  if (verdict == SampleVerdict::incomplete) return;  // it has come, but does not count: measurements_ says why
  if (measurements_.trustsBlindly(last_now_.toSec())) seedBelief();
  SensorGeneralized message = structure_->measurement();
  message.header.stamp = stamp;
  message.header.frame_id = parameters_.robot.base_frame;
  sensor_publisher_.publish(message);
}

void ControllerNode::onBeliefTimer(const ros::TimerEvent&) { catchUp(currentTime()); }

void ControllerNode::catchUp(const ros::Time& now) {
  for (int due = schedule_.beliefStepsDue(nanoseconds(now)); due > 0; --due) updateBelief();
}

void ControllerNode::onActionTimer(const ros::TimerEvent& event) {
  const ros::Time now = currentTime();
  // A timer set before the clock jumped back still expects the old time.
  const std::int64_t boundary = nanoseconds(std::min(event.current_expected, now));
  // A simulated clock begins when its first message comes, with the timer already set: what it skips is no stall.
  const std::int64_t period = std::llround(1e9 * controller_.actionStep());
  if (!schedule_.started()) schedule_.start(std::max(boundary, nanoseconds(now) - period));

  const auto dropped = schedule_.droppedPeriods();
  int periods = schedule_.actionPeriodsDue(boundary);
  if (schedule_.droppedPeriods() != dropped) {
    const auto missed = static_cast<double>(schedule_.droppedPeriods() - dropped) * controller_.actionStep();
    ROS_WARN_THROTTLE(1.0, "Held up: %.2f s of action steps dropped", missed);
    measurements_.forgiveStall(now.toSec());
  }

  // Beliefs catch up; the command does so no faster than time went by since the last one, because the limits of its
  // acceleration hold for what the motors get.
  const double since_last = (now - last_action_).toSec() / controller_.actionStep();
  const int most_actions =
      since_last < 0.0 ? 1 : static_cast<int>(std::clamp(since_last + 0.25, 1.0, 1.0 * kMostPeriods));

  WheelCommand command = gate_.command();
  for (; periods > 0; --periods) {
    while (schedule_.beliefStepsLeft() > 0) updateBelief();
    if (periods <= most_actions) command = act(now);
    schedule_.actionStepDone(boundary);
    if (periods > 1) continue;
    last_action_ = now;
    if (!contended() || command != WheelCommand{}) output_.publish(command);
    motors_.send(now.toSec(), command);
    publishState(now, command);
  }
  diagnostics_.update();
}

void ControllerNode::updateBelief() {
  measurements_.advance(appliedCommand(), controller_.beliefStep());
  controller_.updateBelief();
  schedule_.beliefStepDone();
}

WheelCommand ControllerNode::act(const ros::Time& now) {
  if (clock_jumped_ && atRest()) {
    gate_.reset();
    clock_jumped_ = false;
  }
  reportStatus(gate_.decide(gateInputs(now)));
  if (decision_.cause == StopCause::belief_diverged && !decision_.unacknowledged) startAnew();
  if (decision_.status != DriveStatus::driving) {
    action_ = {};
    handed_over_ = false;
    gate_.rest();
    controller_.overrule(appliedCommand());
    return gate_.command();
  }
  return drive(now);
}

WheelCommand ControllerNode::drive(const ros::Time& now) {
  const auto others = othersCommand(now);
  handed_over_ = others.has_value();
  if (!others) {
    action_ = controller_.updateAction();
    controller_.hold(gate_.drive(action_, set_point_));
    return gate_.command();
  }
  controller_.overrule(*others);
  action_ = motors_.offer(kinematics_.wheelSpeeds(set_point_.forward, set_point_.yaw_rate));
  gate_.follow(*others);
  return gate_.drive(action_, set_point_);
}

std::optional<WheelCommand> ControllerNode::othersCommand(const ros::Time& now) { return motors_.another(now.toSec()); }

WheelCommand ControllerNode::appliedCommand() { return motors_.applied(last_now_.toSec()).value_or(gate_.command()); }

GateInputs ControllerNode::gateInputs(const ros::Time& now) {
  StopCauses causes = overdueInputs(ages(now), parameters_.gate.deadlines);
  robot_.addCauses(causes);
  const bool no_set_point = causes.hasAny({StopCause::set_point_late, StopCause::set_point_missing});
  const bool set_point_at_rest = no_set_point || set_point_.vector().isZero(0.0);
  // What the motors do under somebody else's commands cannot be predicted.
  if (contended()) measurements_.reset();
  measurements_.applyPolicy(causes, now.toSec(), atRest() && set_point_at_rest);
  const bool plausible = isPlausible(controller_.believedVelocity(), controller_.freeEnergy(), parameters_.gate);
  causes.add(StopCause::belief_diverged, !plausible)
      .add(StopCause::clock_jump, clock_jumped_)
      .add(StopCause::outputs_unchecked, !graph_.checked())
      .add(StopCause::shutdown, ending_)
      .add(StopCause::contention, contended());
  return {causes, set_point_at_rest};
}

bool ControllerNode::contended() const {
  return graph_.contended() && !parameters_.allow_other_publishers && !motors_.shared();
}

std::string ControllerNode::reason() const {
  std::string reason = text(decision_.cause);
  if (decision_.cause == StopCause::contention && contended()) {
    reason += ": " + graph_.others() + "; remap the commands of one of the two (launch/jackal.launch says how)";
  }
  if (handed_over_) reason = "somebody else has the motors";
  const std::string fault = measurements_.reason();
  if (!fault.empty()) reason += (reason.empty() ? "" : "; ") + fault;
  if (decision_.unacknowledged) reason += " (over; a zero set point, or one after a pause, starts anew)";
  return reason;
}

void ControllerNode::publishStop() {
  if (!contended()) output_.publish({});
}

void ControllerNode::startAnew() {
  controller_.reset();
  controller_.setSetPoint(set_point_);
}

void ControllerNode::seedBelief() {
  controller_.restart();
  controller_.overrule(gate_.command());
}

InputAges ControllerNode::ages(const ros::Time& now) const {
  InputAges ages;
  ages.set_point = age(now, set_point_received_, set_point_received_);
  ages.wheels = age(now, sensors_.wheels().stamp, sensors_.wheels().received);
  ages.imu = age(now, sensors_.imu().stamp, sensors_.imu().received);
  ages.measurement = age(now, measurement_stamp_, measurement_received_);
  ages.feedback = age(now, robot_.feedback().stamp, robot_.feedback().received);
  return ages;
}

ros::Time ControllerNode::currentTime() {
  const ros::Time now = ros::Time::now();
  if (now < last_now_) {
    ROS_WARN("The clock jumped back by %.3f s: the controller starts anew", (last_now_ - now).toSec());
    reset();
  }
  last_now_ = now;
  return now;
}

void ControllerNode::reset() {
  ++clock_resets_;
  structure_->reset();
  sensors_.reset();
  robot_.reset();
  motors_.reset();
  measurements_.restart();
  schedule_.stop();
  transforms_.clear();
  set_point_ = {};
  set_point_received_ = measurement_stamp_ = measurement_received_ = ros::Time();
  action_ = {};
  clock_jumped_ = true;
}

void ControllerNode::reportRefusal(const char* what, std::uint32_t count) {
  ROS_WARN_THROTTLE(1.0, "Rejected %s (%u so far)", what, count);
}

void ControllerNode::reportStatus(const GateDecision& decision) {
  const DriveStatus before = decision_.status;
  if (before == DriveStatus::faulted && decision.status != before) measurements_.reset();
  const bool changed = decision.status != before || decision.cause != decision_.cause;
  decision_ = decision;
  if (std::string now = reason(); changed || now != reason_) {
    reason_ = std::move(now);
    diagnostics_.force_update();  // what happens is told at once, not with the next period
  }
  if (!changed) return;
  switch (decision.status) {
    case DriveStatus::idle:
      break;
    case DriveStatus::driving:
      ROS_INFO("Driving");
      break;
    case DriveStatus::braking:
      if (before != DriveStatus::braking) ++brakes_;
      ROS_WARN("Braking: %s", reason_.c_str());
      break;
    case DriveStatus::stopped:
      // A start is no event: what is waited for is told, but nothing has stopped.
      if (before == DriveStatus::idle) {
        ROS_INFO("Waiting: %s", reason_.c_str());
      } else {
        ROS_WARN("Stopped: %s", reason_.c_str());
      }
      break;
    case DriveStatus::faulted:
      if (before != DriveStatus::faulted) ++faults_;
      ROS_ERROR("Faulted: %s", reason_.c_str());
      break;
  }
}

void ControllerNode::publishState(const ros::Time& now, const WheelCommand& command) {
  ControllerState message = structure_->state();
  message.header.stamp = now;
  message.header.frame_id = parameters_.robot.base_frame;
  message.status = static_cast<std::uint8_t>(decision_.status);
  message.reason = reason_;
  message.set_point_forward = set_point_.forward;
  message.set_point_yaw_rate = set_point_.yaw_rate;
  message.action_left = action_.left;
  message.action_right = action_.right;
  message.command_left = command.left;
  message.command_right = command.right;
  message.rejected_set_points = rejected_set_points_;
  message.rejected_measurements = rejected_measurements_;
  state_publisher_.publish(message);
  structure_->publish(message.header);
}

void ControllerNode::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) {
  using diagnostic_msgs::DiagnosticStatus;
  switch (decision_.status) {
    case DriveStatus::driving:
      status.summary(reason_.empty() ? DiagnosticStatus::OK : DiagnosticStatus::WARN,
                     reason_.empty() ? "driving" : "driving with a fault: " + reason_);
      break;
    case DriveStatus::idle:
      status.summary(DiagnosticStatus::OK, reason_);
      break;
    case DriveStatus::braking:
    case DriveStatus::stopped:
      status.summary(DiagnosticStatus::WARN, reason_);
      break;
    case DriveStatus::faulted:
      status.summary(DiagnosticStatus::ERROR, reason_);
      break;
  }
  status.add("Rejected set points", rejected_set_points_);
  status.add("Rejected measurements", rejected_measurements_);
  status.add("Dropped action periods", schedule_.droppedPeriods());
  status.add("Clock resets", clock_resets_);
  status.add("Brakes", brakes_);
  status.add("Faults", faults_);
  status.add("Sensor faults detected", measurements_.detected());
  status.add("Sensor faults", measurements_.reason());
  status.add("Master reachable", graph_.masterReachable() ? "yes" : "no");
  status.add("Free energy", controller_.freeEnergy());
}

}  // namespace jackal_aic
