#include "recorded_drive.hpp"

#include <fmt/format.h>
#include <geometry_msgs/TwistStamped.h>
#include <jackal_msgs/Feedback.h>
#include <jackal_msgs/Status.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Bool.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "inputs/robot_status.hpp"
#include "inputs/sensors.hpp"
#include "inputs/set_points.hpp"
#include "outputs/input_log.hpp"

namespace jackal_aic {
namespace {

constexpr double kLongestGap = 60.0;  // s without a message after which no steps are made up: the recorder was stopped
constexpr double kStep = 0.005;       // s, between looks at the steps that are due
constexpr std::size_t kMostReasons = 100;  // of refusals: a reason may hold text of the recording

/// The messages of a topic, by the time of the recorder.
template <class Message>
std::vector<boost::shared_ptr<const Message>> messagesOf(const rosbag::Bag& bag, const std::string& topic) {
  std::vector<boost::shared_ptr<const Message>> messages;
  for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery(topic))) {
    if (const auto message = instance.instantiate<Message>()) messages.push_back(message);
  }
  return messages;
}

/// Messages as what a drive loop would have been told by a node that heard them when they were recorded.
class MessagePlayer {
 public:
  MessagePlayer(const NodeParameters& parameters, RecordedDrive::Sink sink, PlayReport& report)
      : parameters_(parameters),
        kinematics_(parameters.geometry),
        sink_(std::move(sink)),
        report_(report),
        sensors_(parameters.robot, frames_,
                 [this](const Observation& observation, const ros::Time&) { tell(ObservationInput{observation}); }) {
    ros::Time::init();  // warnings of the pairing want a clock, at any time
  }

  void playTransforms(const tf2_msgs::TFMessage& message) {
    for (const auto& transform : message.transforms) frames_.setTransform(transform, "", true);
  }

  /// The action steps that are due until a time.
  void advanceTo(const ros::Time& now) {
    if (!now_.isZero() && (now - now_).toSec() < kLongestGap) {
      for (; now_ + ros::Duration(kStep) < now; now_ += ros::Duration(kStep)) act();
    }
    now_ = now;
    act();
  }

  void playSetPoint(const rosbag::MessageInstance& message) {
    const auto twist = message.instantiate<geometry_msgs::Twist>();
    const auto stamped = message.instantiate<geometry_msgs::TwistStamped>();
    if (!twist && !stamped) return;
    const ReceivedSetPoint received = twist ? receivedSetPoint(*twist) : receivedSetPoint(*stamped);
    tell(SetPointInput{received.wanted, received.stamp});
  }

  void playSensors(const rosbag::MessageInstance& message) {
    if (const auto wheels = message.instantiate<sensor_msgs::JointState>()) {
      const auto reading = sensors_.addWheels(wheels, now_);
      count();
      if (reading) tell(WheelsInput{*reading});
    } else if (const auto imu = message.instantiate<sensor_msgs::Imu>()) {
      const auto reading = sensors_.addImu(imu, now_);
      count();
      if (reading) tell(ImuInput{*reading});
    }
  }

  void playStatus(const rosbag::MessageInstance& message) {
    if (const auto stop = message.instantiate<std_msgs::Bool>()) status_.emergency_stop = stop->data;
    if (const auto status = message.instantiate<jackal_msgs::Status>()) takeStatus(*status, status_);
    const auto feedback = message.instantiate<jackal_msgs::Feedback>();
    if (!feedback || feedback->header.stamp.isZero()) return;
    tell(FeedbackInput{feedback->header.stamp.toSec()});
    takeFeedback(*feedback, status_);
  }

  /// What reached the motors. @param from_mux a Twist behind twist_mux; else a drive message.
  void playCommand(const rosbag::MessageInstance& message, bool from_mux) {
    if (const auto drive = message.instantiate<jackal_msgs::Drive>()) {
      if (const auto command = wheelCommand(*drive)) tell(AppliedInput{*command, AppliedSource::drive});
    }
    const auto twist = from_mux ? message.instantiate<geometry_msgs::Twist>() : nullptr;
    const auto velocity = twist ? setPoint(*twist) : std::nullopt;
    if (!velocity) return;
    tell(AppliedInput{kinematics_.wheelSpeeds(velocity->forward, velocity->yaw_rate), AppliedSource::twist});
  }

 private:
  void tell(decltype(DriveInput::what) what) { sink_({now_.toSec(), std::move(what)}); }

  void act() {
    tell(StatusInput{status_});
    tell(ActionInput{});
  }

  void count() {
    const std::string& refusal = sensors_.lastRefusal();
    if (refusal.empty()) return;
    const bool kept = report_.refusals.size() < kMostReasons || report_.refusals.count(refusal) > 0;
    ++report_.refusals[kept ? refusal : "for other reasons"];
  }

  NodeParameters parameters_;
  SkidSteerKinematics kinematics_;
  RecordedDrive::Sink sink_;
  PlayReport& report_;
  tf2::BufferCore frames_;
  SensorPairing sensors_;
  RobotStatus status_;
  ros::Time now_;
};

}  // namespace

std::string RecordedDrive::topic(const std::string& name) const {
  if (!name.empty() && name.front() == '/') return name;
  std::string resolved = "/" + name_space_ + "/" + name;
  for (std::size_t i = resolved.find("//"); i != std::string::npos; i = resolved.find("//")) resolved.erase(i, 1);
  return resolved;
}

RecordedDrive::Log RecordedDrive::log() const {
  Log log;
  log.messages = messagesOf<LoopInputs>(bag_, topic("jackal_AIC/inputs"));
  const auto begins = [](const auto& message) { return message->first == 0; };
  auto second = std::find_if(log.messages.begin(), log.messages.end(), begins);
  if (second != log.messages.end()) second = std::find_if(second + 1, log.messages.end(), begins);
  log.restarted = second != log.messages.end();
  log.messages.erase(second, log.messages.end());
  // By their numbers: the clock may have been set back.
  std::stable_sort(log.messages.begin(), log.messages.end(),
                   [](const auto& a, const auto& b) { return a->first < b->first; });
  return log;
}

std::string RecordedDrive::configuration() const {
  for (const auto& message : log().messages) {
    if (!message->configuration.empty()) return message->configuration;
  }
  return "";
}

std::uint64_t RecordedDrive::firstInput() const {
  const auto messages = log().messages;
  return messages.empty() ? 0 : messages.front()->first;
}

std::vector<ControllerState> RecordedDrive::states() const {
  std::vector<ControllerState> states;
  for (const auto& state : messagesOf<ControllerState>(bag_, topic("jackal_AIC/state"))) states.push_back(*state);
  const auto earlier = [](const auto& a, const auto& b) { return a.header.stamp < b.header.stamp; };
  std::stable_sort(states.begin(), states.end(), earlier);
  return states;
}

PlayReport RecordedDrive::playLog(const Sink& sink) const {
  const Log recorded = log();
  PlayReport report;
  report.restarted = recorded.restarted;
  report.first = recorded.messages.empty() ? 0 : recorded.messages.front()->first;
  std::uint64_t next = report.first;
  for (const auto& message : recorded.messages) {
    report.missing += message->first - next;
    for (const DriveInput& input : inputsOf(*message)) sink(input);
    report.inputs += message->inputs.size();
    next = message->first + message->inputs.size();
  }
  return report;
}

void RecordedDrive::require(const std::string& topic, const std::vector<std::string>& types) const {
  std::string others;
  rosbag::View all(bag_);
  for (const auto* connection : all.getConnections()) {
    if (std::find(types.begin(), types.end(), connection->datatype) == types.end()) {
      if (connection->topic != topic) continue;
      throw ParameterError(fmt::format("{}: {} has type {}, expected {}", bag_.getFileName(), topic,
                                       connection->datatype, types.front()));
    }
    if (connection->topic == topic) return;
    others += (others.empty() ? "" : ", ") + connection->topic;
  }
  throw ParameterError(fmt::format("{}: no messages on {} ({}); of that type it has {}", bag_.getFileName(), topic,
                                   types.front(), others.empty() ? "none" : others));
}

PlayReport RecordedDrive::playMessages(const NodeParameters& parameters, const std::string& set_point,
                                       const Sink& sink) const {
  const std::string wheels = topic("joint_states"), imu = topic("imu/data"), wanted = topic(set_point);
  require(wheels, {"sensor_msgs/JointState"});
  require(imu, {"sensor_msgs/Imu"});
  require(wanted, {"geometry_msgs/Twist", "geometry_msgs/TwistStamped"});
  const std::string drive = topic("cmd_drive"), mux = topic("jackal_velocity_controller/cmd_vel");
  std::vector<std::string> names{wheels, imu, wanted, topic("feedback"), topic("status"), topic("e_stop"), "/tf"};
  if (parameters.motors_shared) names.insert(names.end(), {drive, mux});
  PlayReport report;
  MessagePlayer player(parameters, sink, report);
  // What is static holds from the start, also if the recorder heard the first measurement before it.
  for (const auto& message : messagesOf<tf2_msgs::TFMessage>(bag_, "/tf_static")) player.playTransforms(*message);
  for (const rosbag::MessageInstance& message : rosbag::View(bag_, rosbag::TopicQuery(names))) {
    if (const auto transforms = message.instantiate<tf2_msgs::TFMessage>()) {
      player.playTransforms(*transforms);
      continue;
    }
    player.advanceTo(message.getTime());
    // Two kinds may share a topic: the set points of the multiplexer are commands, too.
    if (message.getTopic() == wanted) player.playSetPoint(message);
    player.playSensors(message);
    player.playStatus(message);
    if (parameters.motors_shared) player.playCommand(message, message.getTopic() == mux);
  }
  return report;
}

}  // namespace jackal_aic
