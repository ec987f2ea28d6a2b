#include "message_player.hpp"

#include <geometry_msgs/Twist.h>
#include <jackal_msgs/Drive.h>
#include <jackal_msgs/Feedback.h>
#include <jackal_msgs/Status.h>
#include <std_msgs/Bool.h>
#include <tf2_msgs/TFMessage.h>

#include <cmath>
#include <utility>

#include "conversions.hpp"

namespace jackal_aic {
namespace {

/// Time without a message after which the timers do not fill the gap [ns]: the recorder was stopped.
constexpr std::int64_t kLongestGap = 60'000'000'000;

std::int64_t nanoseconds(double seconds) { return std::llround(1e9 * seconds); }

}  // namespace

std::string resolvedTopic(const std::string& name_space, const std::string& topic) {
  if (!topic.empty() && topic.front() == '/') return topic;
  std::string resolved = "/" + name_space + "/" + topic;
  for (std::size_t i = resolved.find("//"); i != std::string::npos; i = resolved.find("//")) resolved.erase(i, 1);
  return resolved;
}

MessagePlayer::MessagePlayer(const NodeParameters& parameters, const PlayerSettings& settings, Sink sink)
    : parameters_(parameters),
      settings_(settings),
      sink_(std::move(sink)),
      kinematics_(parameters.geometry),
      sensors_(parameters.robot, frames_,
               [this](const Observation& observation, const ros::Time&) { tell(ObservationInput{observation}); }) {
  ros::Time::init();  // warnings of the pairing want a clock, at any time
}

std::map<std::string, std::string> MessagePlayer::topics() const {
  std::map<std::string, std::string> topics{{topic(settings_.set_point), "geometry_msgs/Twist"},
                                            {topic("joint_states"), "sensor_msgs/JointState"},
                                            {topic("imu/data"), "sensor_msgs/Imu"},
                                            {topic("feedback"), "jackal_msgs/Feedback"},
                                            {topic("status"), "jackal_msgs/Status"},
                                            {topic("e_stop"), "std_msgs/Bool"},
                                            {"/tf", "tf2_msgs/TFMessage"},
                                            {"/tf_static", "tf2_msgs/TFMessage"}};
  if (settings_.commands) {
    topics.emplace(topic("cmd_drive"), "jackal_msgs/Drive");
    topics.emplace(topic("jackal_velocity_controller/cmd_vel"), "geometry_msgs/Twist");
  }
  return topics;
}

void MessagePlayer::runTimers(std::int64_t now) {
  const std::int64_t belief = nanoseconds(settings_.belief_step), action = nanoseconds(settings_.action_step);
  if (next_action_ == 0 || now - next_action_ > kLongestGap) {
    next_belief_ = now + belief;
    next_action_ = now + action;
  }
  while (std::min(next_belief_, next_action_) <= now) {
    now_.fromNSec(static_cast<std::uint64_t>(std::min(next_belief_, next_action_)));
    if (next_belief_ <= next_action_) {
      tell(BeliefInput{});
      next_belief_ += belief;
    } else {
      tell(StatusInput{status_});
      tell(ActionInput{now_.toSec()});
      next_action_ += action;
    }
  }
}

/// As the node does; the loop notices by itself.
void MessagePlayer::followClockBack() {
  next_action_ = 0;
  sensors_.reset();
  status_.motors_off = status_.driver_fault = false;
}

void MessagePlayer::play(const rosbag::MessageInstance& message) {
  const std::string& name = message.getTopic();
  if (name == "/tf" || name == "/tf_static") return playTransforms(message);
  if (message.getTime() < now_) followClockBack();
  runTimers(static_cast<std::int64_t>(message.getTime().toNSec()));
  now_ = message.getTime();
  // Two kinds may share a topic: the set points of the multiplexer are commands, too.
  if (name == topic(settings_.set_point)) {
    const auto set_point = message.instantiate<topic_tools::ShapeShifter>();
    const auto received = set_point ? receivedSetPoint(*set_point) : std::nullopt;
    if (received) tell(SetPointInput{received->wanted, received->stamp});
  }
  playWheels(message);
  playImu(message);
  playStatus(message);
  if (settings_.commands) playCommand(message);
}

void MessagePlayer::count(const std::string& refusal) {
  if (refusal.empty()) return;
  const bool kept = refusals_.size() < kMostReasons || refusals_.count(refusal) > 0;
  ++refusals_[kept ? refusal : "for other reasons"];
}

void MessagePlayer::playWheels(const rosbag::MessageInstance& message) {
  const auto wheels = message.instantiate<sensor_msgs::JointState>();
  if (!wheels) return;
  const std::optional<SensorReading> reading = sensors_.addWheels(wheels, now_);
  count(sensors_.lastRefusal());
  if (reading) tell(WheelsInput{*reading});
}

void MessagePlayer::playImu(const rosbag::MessageInstance& message) {
  const auto imu = message.instantiate<sensor_msgs::Imu>();
  if (!imu) return;
  const std::optional<SensorReading> reading = sensors_.addImu(imu, now_);
  count(sensors_.lastRefusal());
  if (reading) tell(ImuInput{*reading});
}

void MessagePlayer::playStatus(const rosbag::MessageInstance& message) {
  if (const auto stop = message.instantiate<std_msgs::Bool>()) status_.emergency_stop = stop->data;
  if (const auto status = message.instantiate<jackal_msgs::Status>()) takeStatus(*status, status_);
  const auto feedback = message.instantiate<jackal_msgs::Feedback>();
  if (!feedback || feedback->header.stamp.isZero()) return;
  tell(FeedbackInput{feedback->header.stamp.toSec()});
  takeFeedback(*feedback, status_);
}

void MessagePlayer::playCommand(const rosbag::MessageInstance& message) {
  if (const auto drive = message.instantiate<jackal_msgs::Drive>()) {
    const auto command = wheelCommand(*drive);
    if (command) tell(AppliedInput{*command, AppliedSource::drive});
  }
  if (message.getTopic() != topic("jackal_velocity_controller/cmd_vel")) return;
  const auto twist = message.instantiate<geometry_msgs::Twist>();
  const auto velocity = twist ? setPoint(*twist) : std::nullopt;
  if (velocity) {
    tell(AppliedInput{kinematics_.wheelSpeeds(velocity->forward, velocity->yaw_rate), AppliedSource::twist});
  }
}

void MessagePlayer::playTransforms(const rosbag::MessageInstance& message) {
  const auto transforms = message.instantiate<tf2_msgs::TFMessage>();
  if (!transforms) return;
  for (const auto& transform : transforms->transforms) count(frames_.add(transform));
}

}  // namespace jackal_aic
