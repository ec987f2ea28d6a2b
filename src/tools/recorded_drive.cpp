#include "recorded_drive.hpp"

#include <geometry_msgs/TwistStamped.h>
#include <jackal_msgs/Feedback.h>
#include <jackal_msgs/Status.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Bool.h>

#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "bag_file.hpp"
#include "inputs/robot_status.hpp"
#include "inputs/sensors.hpp"
#include "inputs/set_points.hpp"
#include "outputs/input_log.hpp"

namespace jackal_aic {
namespace {

constexpr double kLongestGap =
    60.0;  // s without a message after which the recorder counts as stopped, and no steps are added
constexpr double kLateClock = 1.0;  // s by which the clock of a recorder may be late
constexpr double kStep = 0.005;     // s between calls that run the due steps

/// Converts messages to the inputs that a node would have given its drive loop.
class MessagePlayer {
 public:
  /// @param bag with the mounting of the IMU, in fixed and moving frames; @param set_point, mux topics of the set
  /// points, and of the output of a multiplexer.
  MessagePlayer(const rosbag::Bag& bag, const NodeParameters& parameters, std::string set_point, std::string mux,
                RecordedDrive::Sink sink)
      : shared_(parameters.motors_shared),
        set_point_(std::move(set_point)),
        mux_(std::move(mux)),
        kinematics_(parameters.geometry),
        sink_(std::move(sink)),
        sensors_(parameters.robot, frames_,
                 [this](const Observation& observation, const ros::Time&) { pass(ObservationInput{observation}); }) {
    ros::Time::init();  // warnings of the pairing want a clock, at any time
    for (const char* topic : {"/tf_static", "/tf"}) readFrames(bag, topic, frames_);
  }

  void play(const rosbag::MessageInstance& message) {
    const auto wheels = message.instantiate<sensor_msgs::JointState>();
    const auto imu = message.instantiate<sensor_msgs::Imu>();
    const ros::Time stamp = wheels ? wheels->header.stamp : imu ? imu->header.stamp : ros::Time();
    // No message comes before it was measured. The recorder's clock is late on a busy machine, or another one. In
    // seconds, as a ros::Duration of any two times overflows.
    const double late = stamp.isZero() ? 0.0 : stamp.toSec() - message.getTime().toSec();
    if (late > kFurthestAhead && late < kLateClock) ++recorded_early_;
    advanceTo(std::max(late > 0.0 && late < kLateClock ? stamp : message.getTime(), now_));
    const auto twist = message.instantiate<geometry_msgs::Twist>();
    const auto stamped = message.instantiate<geometry_msgs::TwistStamped>();
    // Two kinds may share a topic: the set points of the multiplexer are commands, too.
    if (message.getTopic() == set_point_ && (twist || stamped)) {
      pass(twist ? setPointInput(*twist) : setPointInput(*stamped));
    }
    if (wheels) {
      passReading<WheelsInput>(sensors_.addWheels(wheels, now_));
    } else if (imu) {
      passReading<ImuInput>(sensors_.addImu(imu, now_));
    } else if (const auto stop = message.instantiate<std_msgs::Bool>()) {
      status_.emergency_stop = stop->data;
    } else if (const auto status = message.instantiate<jackal_msgs::Status>()) {
      takeStatus(*status, status_);
    } else if (const auto feedback = message.instantiate<jackal_msgs::Feedback>()) {
      if (feedback->header.stamp.isZero()) return;
      pass(FeedbackInput{feedback->header.stamp.toSec()});
      takeFeedback(*feedback, status_);
    } else if (const auto drive = message.instantiate<jackal_msgs::Drive>()) {
      if (const auto command = wheelCommand(*drive); command && shared_) {
        pass(AppliedInput{*command, AppliedSource::drive});
      }
    } else if (twist && shared_ && message.getTopic() == mux_) {
      if (const SetPoint v = setPoint(*twist); v.vector().allFinite()) {
        pass(AppliedInput{kinematics_.wheelSpeeds(v.forward, v.yaw_rate), AppliedSource::twist});
      }
    }
  }

  /// Numbers of refused sensor messages by reason.
  const std::map<std::string, int>& refusals() const { return refusals_; }

  /// Number of sensor messages that a node would have refused by the recorder's clock.
  int recordedEarly() const { return recorded_early_; }

 private:
  /// The action steps that are due until a time.
  void advanceTo(const ros::Time& now) {
    if (!now_.isZero() && now.toSec() - now_.toSec() < kLongestGap) {
      for (; now_ + ros::Duration(kStep) < now; now_ += ros::Duration(kStep)) act();
    }
    now_ = now;
    act();
  }

  void act() {
    pass(StatusInput{status_});
    pass(ActionInput{});
  }

  template <class Input>
  void passReading(const std::optional<SensorReading>& reading) {
    if (!sensors_.lastRefusal().empty()) ++refusals_[sensors_.lastRefusal()];
    if (reading) pass(Input{*reading});
  }

  void pass(decltype(DriveInput::what) what) { sink_({now_.toSec(), std::move(what)}); }

  bool shared_;  // the motors, with another source
  std::string set_point_, mux_;
  SkidSteerKinematics kinematics_;
  RecordedDrive::Sink sink_;
  tf2::BufferCore frames_;
  SensorPairing sensors_;
  RobotStatus status_;
  ros::Time now_;
  std::map<std::string, int> refusals_;
  int recorded_early_ = 0;
};

}  // namespace

RecordedDrive::RecordedDrive(const rosbag::Bag& bag, std::string name_space)
    : bag_(bag), name_space_(std::move(name_space)) {
  int starts = 0;  // of controllers; a clock that was set back may put inputs before the first
  forEach<LoopInputs>(bag, topic("jackal_AIC/inputs"), [&](const LoopInputs::ConstPtr& message, const auto&) {
    starts += message->first == 0 ? 1 : 0;
    restarted_ = starts > 1;
    if (!restarted_) log_.push_back(message);
  });
  // By their numbers: the clock may have been set back.
  std::stable_sort(log_.begin(), log_.end(), [](const auto& a, const auto& b) { return a->first < b->first; });
}

std::string RecordedDrive::topic(const std::string& name) const {
  if (!name.empty() && name.front() == '/') return name;
  std::string resolved = "/" + name_space_ + "/" + name;
  for (std::size_t i = resolved.find("//"); i != std::string::npos; i = resolved.find("//")) resolved.erase(i, 1);
  return resolved;
}

bool RecordedDrive::has(const std::string& name) const {
  return rosbag::View(bag_, rosbag::TopicQuery(topic(name))).size() > 0;
}

std::string RecordedDrive::configuration() const {
  for (const auto& message : log_) {
    if (!message->configuration.empty()) return message->configuration;
  }
  return "";
}

std::vector<ControllerState> RecordedDrive::states() const {
  std::vector<ControllerState> states;
  forEach<ControllerState>(bag_, topic("jackal_AIC/state"),
                           [&](const ControllerState::ConstPtr& state, const auto&) { states.push_back(*state); });
  const auto earlier = [](const auto& a, const auto& b) { return a.header.stamp < b.header.stamp; };
  std::stable_sort(states.begin(), states.end(), earlier);
  return states;
}

std::string RecordedDrive::playLog(const Sink& sink) const {
  const std::uint64_t first = log_.front()->first;
  std::uint64_t next = first, missing = 0;
  for (const auto& message : log_) {
    missing += message->first - next;
    for (const DriveInput& input : inputsOf(*message)) sink(input);
    next = message->first + message->inputs.size();
  }
  std::string text = fmt::format("Log of the controller: {} inputs\n", next - first - missing);
  if (first > 0) text += fmt::format("It begins {} inputs after the start of the controller\n", first);
  if (missing > 0) text += fmt::format("{} inputs are missing from it\n", missing);
  if (restarted_) text += "The controller was restarted in this bag: its first drive is replayed\n";
  return text;
}

std::string RecordedDrive::playMessages(const NodeParameters& parameters, const std::string& set_point,
                                        const Sink& sink) const {
  const std::string wheels = topic("joint_states"), imu = topic("imu/data"), wanted = topic(set_point);
  requireTopic<ParameterError>(bag_, wheels, {"sensor_msgs/JointState"});
  requireTopic<ParameterError>(bag_, imu, {"sensor_msgs/Imu"});
  requireTopic<ParameterError>(bag_, wanted, {"geometry_msgs/Twist", "geometry_msgs/TwistStamped"});
  const std::string mux = topic("jackal_velocity_controller/cmd_vel");
  std::vector<std::string> names{wheels, imu, wanted, topic("feedback"), topic("status"), topic("e_stop")};
  if (parameters.motors_shared) names.insert(names.end(), {topic("cmd_drive"), mux});
  MessagePlayer player(bag_, parameters, wanted, mux, sink);
  for (const rosbag::MessageInstance& message : rosbag::View(bag_, rosbag::TopicQuery(names))) player.play(message);
  std::string text = "Messages of the sensors; action steps at their due times\n";
  for (const auto& [why, count] : player.refusals()) text += fmt::format("{} refused: {}\n", count, why);
  if (player.recordedEarly() > 0) {
    text += fmt::format("{} recorded more than {:g} s before their stamps: played at their stamps\n",
                        player.recordedEarly(), kFurthestAhead);
  }
  return text;
}

}  // namespace jackal_aic
