#include "plant_node.hpp"

#include <nav_msgs/Odometry.h>
#include <ros/callback_queue.h>
#include <ros/console.h>
#include <ros/init.h>
#include <rosgraph_msgs/Clock.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "jackal_aic/config/text.hpp"
#include "parameters/ros_parameters.hpp"
#include "plant_conversion.hpp"
#include "plant_messages.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kTruthRate = 100.0;      // Hz
constexpr double kTransformRate = 50.0;   // Hz
constexpr double kWarningPeriod = 5.0;    // s
constexpr std::uint32_t kQueueSize = 50;  // a second of 50 Hz messages
constexpr std::uint32_t kClockQueueSize = 1000;
constexpr double kFirstPatience = 0.25;  // wall time for the command after the first [s]
constexpr double kLatestTime = 0.5;      // s: an older or future stamp is of another clock
constexpr double kLongestEnd = 2.0;  // wall time from the request to the end, if the commands do not become zero [s]
constexpr double kLongestCatchUp = 0.1;  // wall time [s]: after a longer stall no controller could follow
constexpr double kLongestPause = 0.005;  // s: after a message of the clock, if the next is not due before
constexpr int kResponsesInTime = 5;      // responses in time minus the others, from which on they are awaited

}  // namespace

PlantNode::PlantNode(ros::NodeHandle node, ros::NodeHandle private_node, const std::string& urdf_xml,
                     const PlantParameters& plant_parameters, const PlantNodeParameters& parameters)
    : private_node_(private_node),
      urdf_xml_(urdf_xml),
      plant_parameters_(plant_parameters),
      parameters_(parameters),
      plant_(urdf_xml, plant_parameters),
      clock_schedule_(parameters.clock_rate),
      truth_schedule_(kTruthRate),
      transform_schedule_(kTransformRate),
      tf_prefix_(tfPrefix(private_node)) {
  advertise(node);
  subscribe(node);
}

void PlantNode::advertise(ros::NodeHandle& node) {
  if (parameters_.publish_clock) clock_ = node.advertise<rosgraph_msgs::Clock>("/clock", kClockQueueSize);
  joint_states_ = node.advertise<sensor_msgs::JointState>("joint_states", kQueueSize);
  imu_ = node.advertise<sensor_msgs::Imu>("imu/data", kQueueSize);
  feedback_ = node.advertise<jackal_msgs::Feedback>("feedback", kQueueSize);
  truth_ = node.advertise<nav_msgs::Odometry>("ground_truth/odom", kQueueSize);
}

void PlantNode::subscribe(ros::NodeHandle& node) {
  const ros::TransportHints hints = ros::TransportHints().tcpNoDelay();
  drive_ = node.subscribe("cmd_drive", kQueueSize, &PlantNode::onDrive, this, hints);
  left_wheel_ = node.subscribe("jackal_left_wheel/command", kQueueSize, &PlantNode::onLeftWheel, this, hints);
  right_wheel_ = node.subscribe("jackal_right_wheel/command", kQueueSize, &PlantNode::onRightWheel, this, hints);
  if (parameters_.lockstep > 0.0) {
    state_ = node.subscribe("jackal_AIC/state", kQueueSize, &PlantNode::onState, this, hints);
    measurement_ = node.subscribe("sensor_generalized", kQueueSize, &PlantNode::onTaken, this, hints);
    seen_ = private_node_.subscribe("seen", kQueueSize, &PlantNode::onSeen, this, hints);
  }
  push_ = private_node_.subscribe("push", kQueueSize, &PlantNode::onPush, this, hints);
  services_ = {
      private_node_.advertiseService("reset", &PlantNode::onReset, this),
      switchService("block_left", [this](bool blocked) { plant_.blockWheels(Side::left, blocked); }),
      switchService("block_right", [this](bool blocked) { plant_.blockWheels(Side::right, blocked); }),
      switchService("lift", [this](bool lifted) { plant_.lift(lifted); }),
      switchService("pull_imu", [this](bool pulled) { imu_pulled_ = pulled; }),
  };
}

ros::ServiceServer PlantNode::switchService(const std::string& name, const std::function<void(bool)>& set) {
  using Request = std_srvs::SetBool::Request;
  using Response = std_srvs::SetBool::Response;
  return private_node_.advertiseService<Request, Response>(name, [set](Request& request, Response& response) {
    set(request.data);
    response.success = true;
    return true;
  });
}

bool PlantNode::goesOn() {
  if (!ros::ok() || !end_requested_()) return ros::ok();
  if (!end_) end_ = ros::WallTime::now() + ros::WallDuration(kLongestEnd);
  return !(command_ == WheelCommand{}) && ros::WallTime::now() < *end_;
}

void PlantNode::run(const std::function<bool()>& end_requested) {
  end_requested_ = end_requested;
  if (!parameters_.publish_clock) return runByClock();
  restartPace();
  publish();
  while (goesOn()) {
    // Between two messages of the clock no node receives the time of a step. So the steps run when the next message is
    // due, and their effects are in time.
    if (told_time_ == plant_.time()) keepPace(plant_.time() + std::min(kLongestPause, 1.0 / parameters_.clock_rate));
    ros::getGlobalCallbackQueue()->callAvailable();
    step();
  }
}

void PlantNode::step() {
  if (parameters_.lockstep > 0.0) waitForFollowers();
  stopIfSilent();
  plant_.step();
  publish();
}

/// Lets the time of the plant go on from now on the wall.
void PlantNode::restartPace() {
  if (parameters_.real_time_factor <= 0.0) return;
  wall_zero_ = ros::WallTime::now() - ros::WallDuration(plant_.time() / parameters_.real_time_factor);
}

/// Sleeps until a time of the plant [s] is due on the wall. After a long stall it goes on from here.
void PlantNode::keepPace(double time) {
  if (parameters_.real_time_factor <= 0.0) return;
  const ros::WallTime due = wall_zero_ + ros::WallDuration(time / parameters_.real_time_factor);
  const ros::WallDuration late = ros::WallTime::now() - due;
  if (late.toSec() > kLongestCatchUp) wall_zero_ += late;
  if (late.toSec() < 0.0) ros::WallTime::sleepUntil(due);
}

void PlantNode::runByClock() {
  const ros::WallDuration kWait(0.001);
  bool started = false;
  ros::Time last;
  while (goesOn()) {
    ros::getGlobalCallbackQueue()->callAvailable(kWait);
    const ros::Time now = ros::Time::now();
    if (now.isZero()) continue;
    if (!started || now < last) {  // the first call, or the clock was set back
      started = true;
      ahead_ = now - stampOf(plant_.time());
      publish();
    }
    last = now;
    while (goesOn() && stampOf(plant_.time()) + ahead_ < now) {
      ros::getGlobalCallbackQueue()->callAvailable();
      step();
    }
  }
}

void PlantNode::shift(std_msgs::Header& header) const {
  header.stamp += ahead_;
  header.frame_id = header.frame_id.empty() ? "" : prefixedFrame(tf_prefix_, header.frame_id);
}

void PlantNode::waitForFollowers() {
  waitFor(controller_, [this] {
    return drive_.getNumPublishers() + left_wheel_.getNumPublishers() + right_wheel_.getNumPublishers() +
               state_.getNumPublishers() >
           0;
  });
  waitFor(spectator_, [this] { return seen_.getNumPublishers() > 0; });
  waitFor(taken_, measurement_);
  waitFor(acted_, state_);
}

void PlantNode::waitFor(Follower& follower, const std::function<bool()>& is_there) {
  const auto behind = [&] {
    return follower.awaited && plant_.time() + 0.5 * JackalPlant::kStep > follower.time + parameters_.lockstep;
  };
  if (!behind()) return;
  publishClock();  // the awaited node acts on it
  if (!waitWhile(behind, is_there, follower.patience)) follower.awaited = false;
}

void PlantNode::waitFor(Response& response, const ros::Subscriber& subscriber) {
  if (!response.due || response.in_stride.value_or(0) < kResponsesInTime || plant_.time() < *response.due) return;
  const auto missing = [&] { return response.due.has_value(); };
  const auto is_there = [&] { return subscriber.getNumPublishers() > 0; };
  if (waitWhile(missing, is_there, kFirstPatience)) return;
  response.in_stride = 0;
  response.due.reset();
}

bool PlantNode::waitWhile(const std::function<bool()>& behind, const std::function<bool()>& is_there, double patience) {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(patience);
  bool came = true;
  while (ros::ok() && came && behind()) {
    const ros::WallTime now = ros::WallTime::now();
    came = is_there() && now < end;
    if (came) ros::getGlobalCallbackQueue()->callOne(std::min(end - now, ros::WallDuration(0.05)));
  }
  restartPace();
  return came;
}

void PlantNode::expectResponses(const PlantMeasurement& sample) {
  for (Response* response : {&taken_, &acted_}) {
    if (response->due && response->in_stride) count(*response, false);
  }
  taken_.from = sample.stamp;
  taken_.due = acted_.from = plant_.time();
  acted_.due = std::numeric_limits<double>::infinity();  // the next message of the clock
}

void PlantNode::respond(Response& response, double responded, double at) {
  if (!response.due || responded + 0.5 * JackalPlant::kStep < response.from) return;
  // The first counts, however late. Otherwise a controller on a busy machine would never be synchronised.
  count(response, !response.in_stride || at < *response.due + 0.5 * JackalPlant::kStep);
}

void PlantNode::count(Response& response, bool in_time) {
  const int counted = response.in_stride.value_or(kResponsesInTime) + (in_time ? 1 : -1);
  response.in_stride = std::clamp(counted, 0, kResponsesInTime);
  response.due.reset();
}

void PlantNode::follow(Follower& follower, double time) {
  // A follower is awaited from its first message on. Otherwise a controller on a busy machine would never be
  // synchronised. A follower with rare messages is awaited for a short time only.
  const bool in_stride = time - follower.time <= 2.0 * parameters_.lockstep;
  follower = {time, true, in_stride ? parameters_.patience : std::min(parameters_.patience, kFirstPatience)};
}

std::optional<double> PlantNode::recentTime(const ros::Time& stamp) const {
  const double time = stamp.toSec() - ahead_.toSec() - stampOf(0.0).toSec();
  const double age = plant_.time() - time;
  if (age < -0.5 * JackalPlant::kStep || age > kLatestTime) return std::nullopt;
  return time;
}

void PlantNode::onDrive(const jackal_msgs::Drive& message) {
  switch (message.mode) {
    case jackal_msgs::Drive::MODE_VELOCITY:
      drive({message.drivers[jackal_msgs::Drive::LEFT], message.drivers[jackal_msgs::Drive::RIGHT]}, message.mode);
      break;
    case jackal_msgs::Drive::MODE_NONE:
      drive({}, message.mode);
      break;
    default:
      ignore("mode other than MODE_VELOCITY and MODE_NONE");
  }
}

void PlantNode::onState(const ControllerState& state) {
  state_time_ = recentTime(state.header.stamp);
  if (!state_time_) return;
  follow(controller_, *state_time_);
  respond(acted_, *state_time_, *state_time_);
}

void PlantNode::onSeen(const std_msgs::Time& seen) {
  if (const std::optional<double> time = recentTime(seen.data)) follow(spectator_, *time);
}

void PlantNode::onTaken(const SensorGeneralized& measurement) {
  const std::optional<double> time = recentTime(measurement.header.stamp);
  if (time) respond(taken_, *time, told_time_);
}

void PlantNode::onLeftWheel(const std_msgs::Float64& speed) {
  drive({speed.data, command_.right}, jackal_msgs::Drive::MODE_VELOCITY);
}

void PlantNode::onRightWheel(const std_msgs::Float64& speed) {
  drive({command_.left, speed.data}, jackal_msgs::Drive::MODE_VELOCITY);
}

bool PlantNode::onReset(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  try {
    ParameterMap map = readRosParameters(private_node_);
    const PlantParameters plant_parameters = readSimulatedRobot(map);
    readParameters<PlantNodeParameters>(map, "");  // unchanged; the keys that remain are unknown
    map.refuseUnknown();
    plant_ = JackalPlant(urdf_xml_, plant_parameters);
    plant_parameters_ = plant_parameters;
  } catch (const ParameterError& error) {
    ROS_ERROR("Not reset: %s", onOneLine(error.what()).c_str());
    return false;
  }
  restart();
  return true;
}

void PlantNode::onPush(const geometry_msgs::Wrench& push) {
  if (!std::isfinite(push.force.x) || !std::isfinite(push.force.y) || !std::isfinite(push.torque.z)) return;
  plant_.push(push.force.x, push.force.y, push.torque.z);
}

void PlantNode::restart() {
  restartPace();
  clock_schedule_ = Periodic(parameters_.clock_rate);
  truth_schedule_ = Periodic(kTruthRate);
  transform_schedule_ = Periodic(kTransformRate);
  command_ = WheelCommand{};
  mode_ = jackal_msgs::Drive::MODE_NONE;
  command_time_ = 0.0;
  told_time_ = -1.0;
  controller_ = spectator_ = Follower{};
  taken_ = acted_ = Response{};
  state_time_.reset();
  feedback_stamp_.reset();
  if (!parameters_.publish_clock) ahead_ = ros::Time::now() - stampOf(plant_.time());
  publish();
}

void PlantNode::drive(const WheelCommand& command, std::int8_t mode) {
  if (!plant_.command(command)) {
    ignore("wheel speed that is not finite");
    return;
  }
  command_time_ = plant_.time();
  // A command arrives after its action. Counting from its arrival would delay every further action by the delay of a
  // busy machine.
  if (!state_time_ || command_time_ > *state_time_ + kLatestTime) follow(controller_, command_time_);
  command_ = command;
  mode_ = mode;
}

void PlantNode::ignore(const char* reason) {
  ++ignored_commands_;
  ROS_WARN_THROTTLE(kWarningPeriod, "drive command ignored (%s); %llu ignored since the start", reason,
                    static_cast<unsigned long long>(ignored_commands_));
}

void PlantNode::stopIfSilent() {
  const bool silent = parameters_.command_timeout > 0.0 && plant_.time() - command_time_ > parameters_.command_timeout;
  if (!silent || command_ == WheelCommand{}) return;
  command_ = WheelCommand{};
  mode_ = jackal_msgs::Drive::MODE_NONE;
  plant_.command(command_);
}

void PlantNode::publish() {
  const double now = plant_.time();
  const bool clock_due = clock_schedule_.due(now), truth_due = truth_schedule_.due(now);
  const bool transform_due = transform_schedule_.due(now);
  // The clock is published first, so that no sample is stamped in the future of its receiver.
  if (clock_due || truth_due || transform_due || plant_.measurement() || plant_.imuMeasurement()) publishClock();
  if (plant_.measurement()) publishMeasurement(*plant_.measurement());
  if (plant_.imuMeasurement() && !imu_pulled_) {
    sensor_msgs::Imu imu = toImu(*plant_.imuMeasurement(), plant_parameters_);
    shift(imu.header);
    imu_.publish(imu);
  }
  if (truth_due) {
    nav_msgs::Odometry truth = toOdometry(plant_.truth());
    shift(truth.header);
    truth.child_frame_id = prefixedFrame(tf_prefix_, truth.child_frame_id);
    truth_.publish(truth);
  }
  if (transform_due) {
    geometry_msgs::TransformStamped transform = toTransform(plant_.truth());
    shift(transform.header);
    transform.child_frame_id = prefixedFrame(tf_prefix_, transform.child_frame_id);
    transforms_.sendTransform(transform);
  }
}

void PlantNode::publishClock() {
  if (!clock_ || told_time_ == plant_.time()) return;
  told_time_ = plant_.time();
  if (acted_.due) acted_.due = std::min(*acted_.due, told_time_);
  rosgraph_msgs::Clock clock;
  clock.clock = stampOf(plant_.time());
  clock_.publish(clock);
}

void PlantNode::publishMeasurement(const PlantMeasurement& measurement) {
  sensor_msgs::JointState joints = toJointState(measurement);
  shift(joints.header);
  joint_states_.publish(joints);
  // Encoders may have to wait for an IMU with its own rate.
  if (plant_parameters_.imu_rate == 0.0) expectResponses(measurement);
  if (measurement.feedback_stamp == feedback_stamp_)
    return;  // the joint states repeat it; the motor controller does not
  feedback_stamp_ = measurement.feedback_stamp;
  jackal_msgs::Feedback feedback = toFeedback(measurement, mode_);
  shift(feedback.header);
  feedback_.publish(feedback);
}

}  // namespace jackal_aic::sim
