#include <fmt/format.h>

/// @file
/// Node step_recorder: leads a controller through a manoeuvre over the real topics, records what happens, and writes
/// the time series and the figures of every step, both as CSV. Simulated time throughout; the wall clock only tells
/// that data has stopped coming.

#include <geometry_msgs/Twist.h>
#include <jackal_msgs/Drive.h>
#include <nav_msgs/Odometry.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Time.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "jackal_aic/ControllerState.h"
#include "jackal_aic/config/urdf_geometry.hpp"
#include "parameters/ros_parameters.hpp"
#include "response_metrics.hpp"
#include "set_point_timeline.hpp"
#include "time_series.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kSetPointRate = 20.0;  // Hz
constexpr std::uint32_t kQueue = 1000;  // every sample counts, also after a moment without processor time
constexpr const char* kState = "jackal_AIC/state";

/// Settings of the recorder. YAML prefix `recorder`.
struct RecorderParameters {
  std::string output_directory;  ///< existing directory for response.csv and metrics.csv
  double data_timeout = 20.0;    ///< largest wait for data, on the wall clock [s]
  std::vector<std::string> left_wheel_joints = {"front_left_wheel", "rear_left_wheel"};     ///< averaged to omega_L
  std::vector<std::string> right_wheel_joints = {"front_right_wheel", "rear_right_wheel"};  ///< averaged to omega_R
};

template <class Visitor>
void describeFields(Visitor& v, RecorderParameters& p) {
  v.field("output_directory", p.output_directory, Presence::required);
  v.field("data_timeout", p.data_timeout, {1.0, 3600.0}, "s", Presence::optional);
  v.field("left_wheel_joints", p.left_wheel_joints, Presence::optional);
  v.field("right_wheel_joints", p.right_wheel_joints, Presence::optional);
}

/// Mean speed of the joints named; empty if one of them is not in the message.
std::optional<double> meanSpeed(const sensor_msgs::JointState& message, const std::vector<std::string>& joints) {
  double sum = 0.0;
  for (const auto& joint : joints) {
    std::size_t i = 0;
    while (i < message.name.size() && message.name[i] != joint) ++i;
    if (i >= message.velocity.size()) return std::nullopt;
    sum += message.velocity[i];
  }
  return sum / static_cast<double>(joints.size());
}

/// True if the master has a publisher of a topic.
bool isPublished(const std::string& topic) {
  ros::master::V_TopicInfo published;
  ros::master::getTopics(published);
  return std::any_of(published.begin(), published.end(), [&](const auto& info) { return info.name == topic; });
}

std::ofstream createFile(const std::string& directory, const char* name) {
  std::ofstream file(directory + "/" + name);
  if (!file) throw ParameterError("recorder.output_directory = '" + directory + "': cannot create " + name + " there");
  return file;
}

/// Publishes the set point at 20 Hz and keeps every message about the robot's response.
class StepRecorder {
 public:
  /// @param wheel_radius turns measured wheel speeds into the measured forward speed [m].
  /// @throws ParameterError if the files cannot be created.
  StepRecorder(const RecorderParameters& parameters, const SetPointTimeline& timeline, double wheel_radius);

  /// True once the manoeuvre was driven and recorded to its end.
  bool finished() const { return finished_; }

  /// True if it cannot be finished any more; the reason was logged.
  bool failed() const { return failed_; }

  /// Writes response.csv and metrics.csv. @throws ParameterError if that fails.
  void write();

 private:
  void onTruth(const nav_msgs::Odometry& message);
  void onJoints(const sensor_msgs::JointState& message);
  void onImu(const sensor_msgs::Imu& message);
  void onCommand(const jackal_msgs::Drive& message);
  void onState(const ControllerState& message);
  void onTimer(const ros::TimerEvent& event);
  void onWatchdog(const ros::WallTimerEvent& event);

  std::string awaited() const;
  void publishSetPoint(double time);
  void showProgress(double time);
  void fail(const std::string& reason);
  void writeMetrics(const SetPointStep& step);
  double sinceStart(const ros::Time& stamp) const { return (stamp - *start_).toSec(); }

  RecorderParameters parameters_;
  SetPointTimeline timeline_;
  double wheel_radius_;
  std::optional<ros::Time> start_;
  std::vector<double> change_times_;  // when each set point was really published, s since start_
  int shown_tenths_ = -1;
  bool finished_ = false;
  bool failed_ = false;
  std::string waits_for_;  // why a controller does not drive, by its state; empty if it does
  std::ofstream response_file_, metrics_file_;
  ros::WallTime alive_ = ros::WallTime::now();
  std::map<std::string, bool> received_ = {{"ground_truth/odom", false},
                                           {"joint_states", false},
                                           {"imu/data", false},
                                           {"cmd_drive", false},
                                           {kState, false}};
  TimeSeries set_forward_, set_yaw_rate_, true_forward_, true_yaw_rate_, measured_forward_, measured_yaw_rate_;
  TimeSeries believed_forward_, believed_yaw_rate_, command_left_, command_right_;

  ros::NodeHandle node_;
  ros::Publisher set_point_;
  ros::Publisher seen_;
  std::vector<ros::Subscriber> subscribers_;
  ros::Timer timer_;
  ros::WallTimer watchdog_;
};

StepRecorder::StepRecorder(const RecorderParameters& parameters, const SetPointTimeline& timeline, double wheel_radius)
    : parameters_(parameters),
      timeline_(timeline),
      wheel_radius_(wheel_radius),
      response_file_(createFile(parameters.output_directory, "response.csv")),
      metrics_file_(createFile(parameters.output_directory, "metrics.csv")),
      seen_(ros::NodeHandle("~").advertise<std_msgs::Time>("seen", kQueue)) {
  set_point_ = node_.advertise<geometry_msgs::Twist>("jackal_AIC/set_point", 1);
  const ros::TransportHints at_once = ros::TransportHints().tcpNoDelay();  // the simulation waits for ~seen
  subscribers_ = {node_.subscribe("ground_truth/odom", kQueue, &StepRecorder::onTruth, this, at_once),
                  node_.subscribe("joint_states", kQueue, &StepRecorder::onJoints, this, at_once),
                  node_.subscribe("imu/data", kQueue, &StepRecorder::onImu, this, at_once),
                  node_.subscribe("cmd_drive", kQueue, &StepRecorder::onCommand, this, at_once),
                  node_.subscribe(kState, kQueue, &StepRecorder::onState, this, at_once)};
  timer_ = node_.createTimer(ros::Duration(1.0 / kSetPointRate), &StepRecorder::onTimer, this);
  watchdog_ = node_.createWallTimer(ros::WallDuration(0.2), &StepRecorder::onWatchdog, this);
}

void StepRecorder::onTruth(const nav_msgs::Odometry& message) {
  std_msgs::Time seen;  // the simulation waits for its set points
  seen.data = message.header.stamp;
  seen_.publish(seen);
  received_["ground_truth/odom"] = true;
  if (!start_) return;
  alive_ = ros::WallTime::now();
  const double time = sinceStart(message.header.stamp);
  true_forward_.add(time, message.twist.twist.linear.x);
  true_yaw_rate_.add(time, message.twist.twist.angular.z);
  finished_ = finished_ || time >= timeline_.duration;  // by the data, which may come later than the clock
}

void StepRecorder::onJoints(const sensor_msgs::JointState& message) {
  const auto left = meanSpeed(message, parameters_.left_wheel_joints);
  const auto right = meanSpeed(message, parameters_.right_wheel_joints);
  if (!left || !right) return;
  received_["joint_states"] = true;
  if (!start_) return;
  measured_forward_.add(sinceStart(message.header.stamp), 0.5 * wheel_radius_ * (*left + *right));
}

void StepRecorder::onImu(const sensor_msgs::Imu& message) {
  received_["imu/data"] = true;
  if (!start_) return;
  measured_yaw_rate_.add(sinceStart(message.header.stamp), message.angular_velocity.z);
}

void StepRecorder::onCommand(const jackal_msgs::Drive& message) {
  received_["cmd_drive"] = true;
  if (!start_) return;
  const double time = sinceStart(ros::Time::now());  // the message has no stamp
  command_left_.add(time, message.drivers[jackal_msgs::Drive::LEFT]);
  command_right_.add(time, message.drivers[jackal_msgs::Drive::RIGHT]);
}

void StepRecorder::onState(const ControllerState& message) {
  received_[kState] = true;
  waits_for_ = message.status == ControllerState::DRIVING ? "" : message.reason + ", says the controller";
  if (!start_ || message.belief_forward.empty() || message.belief_yaw_rate.empty()) return;
  const double time = sinceStart(message.header.stamp);
  believed_forward_.add(time, message.belief_forward[0]);
  believed_yaw_rate_.add(time, message.belief_yaw_rate[0]);
}

std::string StepRecorder::awaited() const {
  std::string topics;
  for (const auto& [topic, received] : received_) {
    if (!received && topic != kState) topics += (topics.empty() ? "" : ", ") + topic;
  }
  if (!topics.empty()) return "data on " + topics;
  // Only now: a controller that commands the motors has advertised its other topics.
  if (!received_.at(kState) && isPublished(node_.resolveName(kState))) return fmt::format("data on {}", kState);
  if (set_point_.getNumSubscribers() == 0) return "a subscriber of jackal_AIC/set_point";
  return waits_for_.empty() ? "" : "driving: " + waits_for_;
}

void StepRecorder::onTimer(const ros::TimerEvent& event) {
  if (event.current_real < event.last_real) return fail("the clock jumped backwards");
  if (!start_) {
    set_point_.publish(geometry_msgs::Twist());  // without a set point no controller drives
    if (!awaited().empty()) return;
    start_ = event.current_real;
    alive_ = ros::WallTime::now();
  }
  const double time = sinceStart(event.current_real);
  publishSetPoint(time);
  showProgress(time);
}

void StepRecorder::publishSetPoint(double time) {
  constexpr double kRounding = 1e-6;  // s; the timer fires on multiples of its period
  const SetPoint set_point = timeline_.at(time + kRounding);
  geometry_msgs::Twist message;
  message.linear.x = set_point.forward;
  message.angular.z = set_point.yaw_rate;
  set_point_.publish(message);
  set_forward_.add(time, set_point.forward);
  set_yaw_rate_.add(time, set_point.yaw_rate);
  while (change_times_.size() < timeline_.changesUntil(time + kRounding)) change_times_.push_back(time);
}

void StepRecorder::showProgress(double time) {
  const int tenths = static_cast<int>(10.0 * std::min(1.0, time / timeline_.duration));
  if (tenths == shown_tenths_) return;
  shown_tenths_ = tenths;
  const SetPoint now = timeline_.at(time);
  ROS_INFO("[%3d%%] set point %g m/s, %g rad/s", 10 * tenths, now.forward, now.yaw_rate);
}

void StepRecorder::onWatchdog(const ros::WallTimerEvent&) {
  const double timeout = parameters_.data_timeout;
  if ((ros::WallTime::now() - alive_).toSec() < timeout) return;
  const std::string missing = start_ ? "data on ground_truth/odom" : awaited();
  fail(fmt::format("no {} for {:g} s on the wall clock", missing.empty() ? "simulated time" : missing, timeout));
}

void StepRecorder::fail(const std::string& reason) {
  ROS_FATAL("%s", reason.c_str());
  failed_ = true;
}

void StepRecorder::write() {
  writeTable(response_file_, true_forward_.between(0.0, timeline_.duration).time(),
             {{"set_forward", &set_forward_},
              {"set_yaw_rate", &set_yaw_rate_},
              {"true_forward", &true_forward_},
              {"true_yaw_rate", &true_yaw_rate_},
              {"measured_forward", &measured_forward_},
              {"measured_yaw_rate", &measured_yaw_rate_},
              {"believed_forward", &believed_forward_},
              {"believed_yaw_rate", &believed_yaw_rate_},
              {"command_left", &command_left_},
              {"command_right", &command_right_}});
  metrics_file_ << "step,begin_s,end_s,settling_s,rise_s,overshoot_pct,steady_error_pct,bounded,command_gap_s\n";
  for (const auto& step : timeline_.steps()) writeMetrics(step);
  if (!response_file_.flush() || !metrics_file_.flush()) {
    throw ParameterError("recorder.output_directory = '" + parameters_.output_directory +
                         "': writing failed; is the disk full?");
  }
}

void StepRecorder::writeMetrics(const SetPointStep& step) {
  const double begin = change_times_[step.change];
  const double end = step.change + 1 < change_times_.size() ? change_times_[step.change + 1] : timeline_.duration;
  const TimeSeries response = (step.channel == kForward ? true_forward_ : true_yaw_rate_).between(begin, end);
  const ResponseMetrics metrics =
      stepResponseMetrics(response.time(), response.value(), begin, step.initial, step.set_point);
  const auto cell = [](const std::optional<double>& value) { return value ? fmt::format("{:g}", *value) : ""; };
  metrics_file_ << step.name << ',' << begin << ',' << end << ',' << cell(metrics.settling) << ',' << cell(metrics.rise)
                << ',' << metrics.overshoot_pct << ',' << metrics.steady_error_pct << ',' << metrics.bounded << ','
                << command_left_.between(begin, end).longestGap() << '\n';
}

/// Wheel radius from robot_description.
double wheelRadius(const ros::NodeHandle& node, const RecorderParameters& parameters) {
  const std::string urdf = robotDescription(node);
  if (urdf.empty()) throw ParameterError("robot_description: missing; expected a URDF");
  return readUrdfGeometry(urdf, parameters.left_wheel_joints, parameters.right_wheel_joints).wheel_radius;
}

bool record(const ros::NodeHandle& private_node) {
  ParameterMap map = readRosParameters(private_node);
  const auto parameters = readParameters<RecorderParameters>(map, "recorder");
  const SetPointTimeline timeline = timelineOf(readParameters<ManoeuvreParameters>(map, "manoeuvre"));
  map.refuseUnknown();
  StepRecorder recorder(parameters, timeline, wheelRadius(private_node, parameters));
  // Not ros::shutdown() from a callback: after it, nothing could be logged any more.
  while (ros::ok() && !recorder.finished() && !recorder.failed()) {
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.1));
  }
  if (recorder.finished()) recorder.write();
  return recorder.finished();
}

}  // namespace
}  // namespace jackal_aic::sim

int main(int argc, char** argv) {
  ros::init(argc, argv, "step_recorder");
  ros::NodeHandle private_node("~");  // kept to the end: without a handle roscpp shuts down and logs no more
  try {
    return jackal_aic::sim::record(private_node) ? 0 : 1;
  } catch (const std::exception& error) {
    ROS_FATAL("%s", error.what());
    return 1;
  }
}
