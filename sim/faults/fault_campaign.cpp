#include "fault_campaign.hpp"

#include <geometry_msgs/Wrench.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <signal.h>
#include <std_msgs/Bool.h>
#include <std_msgs/Time.h>
#include <std_srvs/Empty.h>
#include <std_srvs/SetBool.h>

#include <algorithm>
#include <cmath>

#include "node_process.hpp"
#include "service_call.hpp"

namespace jackal_aic::sim {
namespace {

constexpr std::uint32_t kQueueSize = 1000;  // nothing of what is judged may be lost
constexpr double kSeenPeriod = 0.01;        // s between words to the plant of how far this node has come
constexpr double kSetPointPeriod = 0.05;    // s, as an operator's joystick or a planner would
constexpr double kStatusPeriod = 1.0;       // s, as the robot's firmware
constexpr double kIntrusionPeriod = 0.02;   // s, as the stock jackal_node
constexpr double kFirstSetPoint = 0.3;      // s, after the start of a run; zero until then, which releases a latch
constexpr double kRest = 3.0;      // s at rest before a run, in which the controller learns the noise of its sensors
constexpr double kSilence = 0.3;   // s without a command, after which the next is a new process'
constexpr double kLastWord = 0.2;  // s before the end, within which the controller has to have spoken
constexpr double kLatestSuccessor = 60.0;  // s after the end, until a controller that was ended has to be there again
constexpr double kPatience = 30.0;         // s on the wall clock without any progress
const ros::WallDuration kLook(0.002);      // wait for callbacks

const char* statusName(std::uint8_t status) {
  switch (status) {
    case ControllerState::IDLE:
      return "idle";
    case ControllerState::DRIVING:
      return "driving";
    case ControllerState::STOPPED:
      return "stopped";
    case ControllerState::BRAKING:
      return "braking";
    case ControllerState::FAULTED:
      return "faulted";
    default:
      return "?";
  }
}

XmlRpc::XmlRpcValue toXmlRpc(const ParameterValue& value) {
  if (const auto* word = std::get_if<std::string>(&value)) return *word;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<int>(*whole);
  return std::get<double>(value);  // a plant has no parameters of other types
}

}  // namespace

FaultCampaign::FaultCampaign(const ros::NodeHandle& node, const CampaignNodes& nodes)
    : node_(node),
      nodes_(nodes),
      joint_states_(node_, "joint_states"),
      imu_(node_, "imu/data"),
      feedback_(node_, "feedback"),
      status_(node_, "status"),
      set_points_(node_, "jackal_AIC/set_point"),
      commands_(node_, "robot/cmd_drive"),
      clock_(node_.advertise<rosgraph_msgs::Clock>("/clock", kQueueSize)),
      e_stop_(node_.advertise<std_msgs::Bool>("e_stop", 1, true)),
      push_(node_.advertise<geometry_msgs::Wrench>(nodes_.plant + "/push", kQueueSize)),
      seen_(node_.advertise<std_msgs::Time>(nodes_.plant + "/seen", kQueueSize)) {
  const auto hints = ros::TransportHints().tcpNoDelay();
  const auto forward = [this](auto& topic) { return [this, &topic](const auto& message) { pass(topic, *message); }; };
  using JointState = sensor_msgs::JointStateConstPtr;
  using Imu = sensor_msgs::ImuConstPtr;
  using Feedback = jackal_msgs::FeedbackConstPtr;
  subscribers_ = {
      node_.subscribe("robot/clock", kQueueSize, &FaultCampaign::onClock, this, hints),
      node_.subscribe<sensor_msgs::JointState>(
          "robot/joint_states", kQueueSize, [f = forward(joint_states_)](const JointState& m) { f(m); }, {}, hints),
      node_.subscribe<sensor_msgs::Imu>(
          "robot/imu/data", kQueueSize, [f = forward(imu_)](const Imu& m) { f(m); }, {}, hints),
      node_.subscribe<jackal_msgs::Feedback>(
          "robot/feedback", kQueueSize, [f = forward(feedback_)](const Feedback& m) { f(m); }, {}, hints),
      node_.subscribe("cmd_drive", kQueueSize, &FaultCampaign::onCommand, this, hints),
      node_.subscribe("ground_truth/odom", kQueueSize, &FaultCampaign::onTruth, this, hints),
      node_.subscribe("jackal_AIC/state", kQueueSize, &FaultCampaign::onState, this, hints),
      node_.subscribe("/diagnostics", kQueueSize, &FaultCampaign::onDiagnostics, this, hints)};
}

template <class Message>
void FaultCampaign::pass(FaultyTopic<Message>& topic, Message message) {
  message.header.stamp += ros::Duration(offset_);
  topic.pass(time_, message);
}

void FaultCampaign::onClock(const rosgraph_msgs::Clock& message) {
  ++ticks_;
  if (message.clock < plant_clock_) {
    base_ = time_;
    told_seen_ = ros::Time();
    ++resets_;
  }
  plant_clock_ = message.clock;
  time_ = base_ + plant_clock_.toSec();
  rosgraph_msgs::Clock clock;
  clock.clock = message.clock + ros::Duration(offset_);
  clock_.publish(clock);
  joint_states_.release(time_);
  imu_.release(time_);
  feedback_.release(time_);
  status_.release(time_);
  set_points_.release(time_);
  commands_.release(time_);
  if (plant_clock_ - told_seen_ >= ros::Duration(kSeenPeriod)) {
    std_msgs::Time seen;
    seen.data = told_seen_ = plant_clock_;
    seen_.publish(seen);
  }
}

void FaultCampaign::onCommand(const ros::MessageEvent<const jackal_msgs::Drive>& event) {
  const jackal_msgs::Drive& drive = *event.getMessage();
  commands_.pass(time_, drive);
  if (event.getPublisherName() != nodes_.controller || !recording_) return;
  CommandSample sample{time_, {drive.drivers[jackal_msgs::Drive::LEFT], drive.drivers[jackal_msgs::Drive::RIGHT]}};
  if (end_requested_ && !record_.commands.empty() && time_ - record_.commands.back().time > kSilence) {
    sample.fresh_start = true;
    end_requested_ = false;
    succeeded_ = true;
  }
  // Commands that were under way when the world started anew are no fresh start yet.
  if (world_is_new_ && sample.speeds == WheelCommand{}) {
    sample.fresh_start = true;
    world_is_new_ = false;
  }
  record_.commands.push_back(sample);
}

void FaultCampaign::onTruth(const nav_msgs::Odometry& message) {
  if (!recording_ || message.header.stamp > plant_clock_) return;  // the latter: of before a reset
  record_.truth.push_back(
      {base_ + message.header.stamp.toSec(), message.twist.twist.linear.x, message.twist.twist.angular.z});
}

void FaultCampaign::onState(const ControllerState& message) {
  states_since_reset_.push_back(message);
  if (!recording_) return;
  const std::string reason = message.reason.empty() ? "" : ": " + message.reason;
  record_.states.push_back({time_, message.status == ControllerState::DRIVING, statusName(message.status) + reason,
                            message.rejected_set_points, message.rejected_measurements});
}

void FaultCampaign::onDiagnostics(const diagnostic_msgs::DiagnosticArray& message) {
  if (!recording_) return;
  for (const auto& status : message.status) {
    if (status.level == diagnostic_msgs::DiagnosticStatus::OK) continue;
    record_.diagnostics.push_back({time_, status.message});
  }
}

RunRecord FaultCampaign::run(const Scenario& scenario) {
  record_ = {};
  tasks_.clear();
  end_requested_ = succeeded_ = world_is_new_ = false;
  set_point_ = {};
  if (!restart(scenario)) {
    breakDown("the nodes do not start: no state of the controller after a reset");
    return record_;
  }
  controller_ = controllerProcess();
  arm(scenario);
  recording_ = true;
  // A controller that was ended here is there again once a busy machine has started it.
  const auto awaited = [&] { return end_requested_ || (succeeded_ && silent()); };
  const bool completed =
      waitFor([&] { return time_ >= scenario.end() + kLatestSuccessor || (time_ >= scenario.end() && !awaited()); });
  recording_ = false;
  for (const Task& task : tasks_) task.action();  // so that no process stays stopped
  tasks_.clear();
  if (!completed) breakDown("the simulation stands still");
  checkProcess();
  intruder_.shutdown();
  simulated_ += time_;
  return record_;
}

int FaultCampaign::controllerProcess() const { return processOf(nodes_.controller).value_or(0); }

void FaultCampaign::arm(const Scenario& scenario) {
  const auto of = [&](FaultTopic topic) {
    std::vector<InjectedFault> faults;
    for (const TopicFault& fault : scenario.faults) {
      if (fault.topic == topic) faults.push_back(fault.fault);
    }
    return faults;
  };
  joint_states_.arm(of(FaultTopic::joint_states), scenario.onset, scenario.seed);
  imu_.arm(of(FaultTopic::imu), scenario.onset, scenario.seed);
  feedback_.arm(of(FaultTopic::feedback), scenario.onset, scenario.seed);
  status_.arm(of(FaultTopic::status), scenario.onset, scenario.seed);
  set_points_.arm(of(FaultTopic::set_point), scenario.onset, scenario.seed);
  commands_.arm(of(FaultTopic::cmd_drive), scenario.onset, scenario.seed);
  set_point_.linear.x = scenario.motion.forward;
  set_point_.angular.z = scenario.motion.yaw_rate;
  next_set_point_ = 0.0;
  next_status_ = 0.0;
  if (scenario.system) planSystemFault(*scenario.system, scenario.onset);
  std::stable_sort(tasks_.begin(), tasks_.end(), [](const Task& a, const Task& b) { return a.time < b.time; });
}

void FaultCampaign::planSystemFault(const SystemFault& fault, double onset) {
  const auto plan = [&](
                        std::function<void()> begin, std::function<void()> end = [] {}) {
    tasks_.push_back({onset + fault.start, std::move(begin)});
    tasks_.push_back({onset + fault.start + fault.duration, std::move(end)});
  };
  switch (fault.kind) {
    case SystemFaultKind::e_stop:
      return plan([this] { pressStop(true); }, [this] { pressStop(false); });
    case SystemFaultKind::second_publisher:
      return plan([this, fault] { intrude(fault.amount); }, [this] { intruder_.shutdown(); });
    case SystemFaultKind::block_left:
      return plan([this] { switchPlant("block_left", true); }, [this] { switchPlant("block_left", false); });
    case SystemFaultKind::block_right:
      return plan([this] { switchPlant("block_right", true); }, [this] { switchPlant("block_right", false); });
    case SystemFaultKind::push:
      return plan([this, fault] { pushRobot(fault.amount, fault.torque); }, [this] { pushRobot(0.0, 0.0); });
    case SystemFaultKind::lift:
      return plan([this] { switchPlant("lift", true); }, [this] { switchPlant("lift", false); });
    case SystemFaultKind::clock_jump:
      return plan([this, fault] { offset_ += fault.amount; });
    case SystemFaultKind::clock_reset:
      return plan([this] { startWorldAnew(); });
    case SystemFaultKind::pause:
      return plan([this, fault] { pausePlant(fault.duration); });
    case SystemFaultKind::stall:
      return plan([this] { kill(controller_, SIGSTOP); }, [this] { kill(controller_, SIGCONT); });
    case SystemFaultKind::kill:
      return plan([this] { endController(SIGKILL); });
    case SystemFaultKind::interrupt:
      return plan([this] { endController(SIGINT); });
    case SystemFaultKind::terminate:
      return plan([this] { endController(SIGTERM); });
    case SystemFaultKind::master_restart:
      return plan([this] { endMaster(); });
  }
}

void FaultCampaign::pressStop(bool pressed) {
  std_msgs::Bool message;
  message.data = pressed;
  e_stop_.publish(message);
}

void FaultCampaign::intrude(double speed) {
  intruder_speed_ = speed;
  intruder_ = node_.advertise<jackal_msgs::Drive>("cmd_drive", 1);
  next_intrusion_ = time_;
}

void FaultCampaign::switchPlant(const std::string& service, bool on) {
  std_srvs::SetBool request;
  request.request.data = on;
  if (!callService(nodes_.plant + "/" + service, request)) breakDown("the plant has no service " + service);
}

void FaultCampaign::pushRobot(double force, double torque) {
  geometry_msgs::Wrench push;
  push.force.x = force;
  push.torque.z = torque;
  push_.publish(push);
}

void FaultCampaign::startWorldAnew() {
  resetPlant();
  world_is_new_ = true;
}

void FaultCampaign::endController(int signal) {
  end_requested_ = true;
  kill(controller_, signal);
}

void FaultCampaign::endMaster() {
  const auto master = masterProcess();
  if (!master || kill(*master, SIGKILL) != 0) breakDown("the ROS master cannot be ended");
}

/// Sets the plant's parameters of a scenario, and back what the one before had set; the next reset uses them.
void FaultCampaign::changePlant(const Scenario& scenario) {
  for (const auto& [key, value] : plant_before_) {
    if (value) {
      node_.setParam(key, *value);
    } else {
      node_.deleteParam(key);
    }
  }
  plant_before_.clear();
  for (const auto& [name, value] : scenario.plant) {
    const std::string key = nodes_.plant + "/plant/" + name;
    XmlRpc::XmlRpcValue before;
    const bool given = node_.getParam(key, before);
    plant_before_.emplace_back(key, given ? std::make_optional(before) : std::nullopt);
    node_.setParam(key, toXmlRpc(value));
  }
}

bool FaultCampaign::restart(const Scenario& scenario) {
  const auto speaks = [this] { return !states_since_reset_.empty(); };
  arm(Scenario{});
  offset_ = base_ = 0.0;
  pressStop(false);
  states_since_reset_.clear();
  // A controller that was killed in the run before has to be there again, to hear and measure, and to have no fault any
  // more, before the clock is put back for all: from then on the time of the run counts.
  if (!waitFor([&] { return speaks() && controllerIsConnected() && stands(); })) return false;
  const double rested = time_ + kRest;
  if (!waitFor([&] { return time_ >= rested; })) return false;
  const std::uint64_t resets = resets_;
  changePlant(scenario);
  resetPlant();
  if (!waitFor([&] { return resets_ != resets; })) return false;
  base_ = 0.0;
  time_ = plant_clock_.toSec();
  states_since_reset_.clear();
  next_set_point_ = next_status_ = 0.0;
  return waitFor(speaks) && waitFor([this] { return stands(); });
}

bool FaultCampaign::stands() const {
  const ControllerState& state = states_since_reset_.back();
  return state.status == ControllerState::IDLE || state.status == ControllerState::STOPPED;
}

bool FaultCampaign::controllerIsConnected() const {
  const ControllerState& state = states_since_reset_.back();
  const bool hears =
      joint_states_.heard() && imu_.heard() && feedback_.heard() && status_.heard() && set_points_.heard();
  return hears && std::isfinite(state.measured_forward) && std::isfinite(state.measured_yaw_rate);
}

void FaultCampaign::resetPlant() {
  std_srvs::Empty empty;
  if (!callService(nodes_.plant + "/reset", empty)) breakDown("the plant cannot be reset");
}

bool FaultCampaign::waitFor(const std::function<bool()>& condition) {
  // Only time spent waiting counts: a task may take long, as a call to the master does on a busy machine.
  double waited = 0.0, without_progress = 0.0;
  while (ros::ok() && !condition()) {
    const std::uint64_t ticks = ticks_;
    const ros::WallTime begin = ros::WallTime::now();
    ros::getGlobalCallbackQueue()->callAvailable(kLook);
    const double elapsed = (ros::WallTime::now() - begin).toSec();
    waited += elapsed;
    without_progress = ticks_ != ticks ? 0.0 : without_progress + elapsed;
    if (without_progress > kPatience || (!recording_ && waited > kPatience)) return false;
    perform();
  }
  return condition();
}

void FaultCampaign::perform() {
  if (!recording_) return;
  while (!tasks_.empty() && tasks_.front().time <= time_) {
    const Task task = tasks_.front();
    tasks_.erase(tasks_.begin());
    task.action();
  }
  sendPeriodically();
}

void FaultCampaign::sendPeriodically() {
  if (time_ >= next_set_point_) {
    set_points_.pass(time_, time_ < kFirstSetPoint ? geometry_msgs::Twist() : set_point_);
    next_set_point_ += kSetPointPeriod;
  }
  if (time_ >= next_status_) {
    jackal_msgs::Status status;
    status.header.stamp = ros::Time(time_ - base_ + offset_);
    status.drivers_active = true;
    status.driver_external_stop_present = true;
    status_.pass(time_, status);
    next_status_ += kStatusPeriod;
  }
  if (intruder_ && time_ >= next_intrusion_) {
    jackal_msgs::Drive drive;
    drive.mode = jackal_msgs::Drive::MODE_VELOCITY;
    drive.drivers.fill(static_cast<float>(intruder_speed_));
    intruder_.publish(drive);
    next_intrusion_ += kIntrusionPeriod;
  }
}

void FaultCampaign::pausePlant(double wall_seconds) {
  const auto plant = processOf(nodes_.plant);
  if (!plant || kill(*plant, SIGSTOP) != 0) return breakDown("the plant cannot be paused");
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(wall_seconds);
  while (ros::ok() && ros::WallTime::now() < end) ros::getGlobalCallbackQueue()->callAvailable(kLook);
  kill(*plant, SIGCONT);
}

void FaultCampaign::breakDown(const std::string& reason) {
  if (record_.breakdown.empty()) record_.breakdown = reason;
}

bool FaultCampaign::silent() const { return record_.states.empty() || record_.states.back().time < time_ - kLastWord; }

void FaultCampaign::checkProcess() {
  const bool ended = !succeeded_ && (controller_ == 0 || !isRunning(controller_));
  if (ended) {
    breakDown("the controller crashed");
  } else if (silent()) {
    breakDown("the controller fell silent");
  }
}

}  // namespace jackal_aic::sim
