#include <poll.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <std_srvs/Trigger.h>
#include <unistd.h>

#include <boost/algorithm/string/predicate.hpp>
#include <boost/algorithm/string/replace.hpp>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>

#include "excitation.hpp"
#include "inputs/other_publishers.hpp"
#include "inputs/robot_status.hpp"
#include "inputs/set_points.hpp"
#include "jackal_aic/config/text.hpp"
#include "jackal_aic/safety/command_limiter.hpp"
#include "jackal_aic/safety/stop_cause.hpp"
#include "outputs/commands.hpp"
#include "parameters/ros_parameters.hpp"
#include "process/shutdown.hpp"

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;      // s between commands, as the controller sends them
constexpr double kConnection = 10.0;  // s of wall time to wait for the motors, the sensors and the recorder
constexpr double kSilence = 0.5;      // s without a message after which a source is lost
constexpr double kBrake = 0.5;        // s of wall time for the last commands; a simulation may stand still

/// Time of the last message of a source.
class Heartbeat {
 public:
  void beat() { last_ = ros::Time::now(), heard_ = true; }
  bool heard() const { return heard_; }
  bool silent() const { return heard_ && std::abs((ros::Time::now() - last_).toSec()) > kSilence; }

 private:
  ros::Time last_;
  bool heard_ = false;
};

/// Options of a drive.
struct Session {
  bool confirm = false;    // wait until a person confirms
  double countdown = 5.0;  // before the robot moves [s]
  std::string bag;         // bag of the recorder to wait for; empty: none
  bool twist = false;      // commands are geometry_msgs/Twist on cmd_vel; false: jackal_msgs/Drive on cmd_drive
};

/// Drives the excitation open loop on cmd_drive or cmd_vel, within the limits of the acceleration. Everything that
/// stops a controller ends it, and so does any message on jackal_AIC/set_point. It brakes first, unless another node
/// drives the motors.
class ExcitationNode {
 public:
  ExcitationNode(ros::NodeHandle& node, const ros::NodeHandle& private_node, const ExcitationParameters& bounds,
                 const GeometryParameters& geometry, const Session& session)
      : session_(session),
        tf_prefix_(tfPrefix(private_node)),
        excitation_(bounds, geometry),
        limiter_(LimitParameters{}, geometry, kPeriod),
        output_(node, session_.twist ? OutputMode::twist : OutputMode::cmd_drive, geometry),
        robot_(node, [this](const ros::Time&) { feedback_.beat(); }),
        others_(output_.topics(), nullptr),
        wheels_(node.subscribe<sensor_msgs::JointState>(
            "joint_states", 10, [this](const sensor_msgs::JointStateConstPtr&) { wheels_heard_.beat(); })),
        imu_(node.subscribe<sensor_msgs::Imu>("imu/data", 10,
                                              [this](const sensor_msgs::ImuConstPtr&) { imu_heard_.beat(); })),
        abort_(node, "jackal_AIC/set_point", 1, [this](const ReceivedSetPoint&) { end("aborted by a set point"); }),
        start_service_(ros::NodeHandle(private_node).advertiseService("start", &ExcitationNode::onStart, this)),
        timer_(node.createTimer(ros::Duration(kPeriod), &ExcitationNode::onTimer, this, false, false)) {
    ros::NodeHandle requests(node);
    requests.setCallbackQueue(&requests_);
    others_.watch(requests);
    request_thread_.start();
  }

  /// Waits until the motors and the recorder subscribe to the commands and the sensors publish, for the user's
  /// confirmation, and for the countdown. @throws ParameterError if anything is missing or keeps the robot from
  /// driving.
  void prepare() {
    const ros::WallTime patience = ros::WallTime::now() + ros::WallDuration(kConnection);
    for (std::string missing = whatIsMissing(); !missing.empty() && !over(); missing = whatIsMissing()) {
      if (ros::WallTime::now() > patience) throw ParameterError(missing);
      serve();
    }
    requireDrivable();
    if (session_.confirm) waitForConfirmation();
    const ros::WallTime begin = ros::WallTime::now() + ros::WallDuration(session_.countdown);
    for (double left = std::ceil(session_.countdown); !over() && ros::WallTime::now() < begin;) {
      if ((begin - ros::WallTime::now()).toSec() <= left) {
        ROS_INFO("Driving in %.0f s; Ctrl-C stops it at any time", left);
        left -= 1.0;
      }
      serve();
      requireDrivable();
    }
  }

  /// Drives; callbacks have to be served until the end is requested.
  void start() {
    if (over()) return;
    start_ = ros::Time::now();
    timer_.start();
  }

  bool atRest() const { return limiter_.atRest() || others_.contended(); }  ///< or others have the motors
  void publishStop() { publish({}); }                                       ///< unless others have the motors
  bool complete() const { return why_ && why_->empty(); }                   ///< the motion was driven to its end
  std::string why() const { return why_.value_or(""); }                     ///< it was not; empty: a person ended it

  /// Next steps with the bag.
  std::string next() const {
    if (session_.bag.empty()) return "";
    std::string options;
    const auto add = [&options](const char* option, const std::string& name, const char* usual) {
      if (name != usual) options += std::string(" --") + option + " " + name;
    };
    add("command-topic", output_.topics().front(), "/cmd_drive");
    add("wheel-topic", wheels_.getTopic(), "/joint_states");
    add("imu-topic", imu_.getTopic(), "/imu/data");
    add("base-frame", prefixedFrame(tf_prefix_, "base_link"), "base_link");
    return "Next:\n    rosrun jackal_aic identify '" + boost::replace_all_copy(session_.bag, "'", "'\\''") + "'" +
           options + " --robot \"my Jackal\" --out my_jackal.yaml\n";
  }

 private:
  bool over() const { return !ros::ok() || StopRequest::requested(); }

  static void serve() { ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.01)); }

  /// A line on the terminal, or the service ~start.
  void waitForConfirmation() {
    const bool terminal = isatty(STDIN_FILENO) != 0;
    std::cout << "The robot will move by itself for " << std::lround(excitation_.duration())
              << " s: keep 2 m free all around, or its wheels off the ground.\n"
              << (terminal ? "Press Enter here to start, or in another terminal:" : "To start, in another terminal:")
              << " rosservice call " << start_service_.getService() << std::endl;
    pollfd input{STDIN_FILENO, POLLIN, 0};
    for (std::string line; !confirmed_ && !over();) {
      serve();
      requireDrivable();
      const bool typed = terminal && poll(&input, 1, 0) > 0 && (input.revents & POLLIN) != 0;
      if (typed && std::getline(std::cin, line)) confirmed_ = true;
    }
  }

  /// Missing inputs and outputs, before and during the drive; empty if there are none.
  std::string whatIsMissing() const {
    if (ros::Time::now().isZero()) return "no clock: /use_sim_time is true and nothing comes on /clock";
    if (!others_.checked()) return "the master does not say who publishes commands";
    // An open bag has another name. The recorder subscribes to the commands, too.
    if (!session_.bag.empty() && !std::filesystem::exists(session_.bag + ".active")) {
      return (start_.isZero() ? "the recorder does not write " : "the recorder has ended, which was to write ") +
             session_.bag;
    }
    if (output_.subscribers() <= (session_.bag.empty() ? 0U : 1U)) {
      return "no motors subscribe to " + output_.topics().front();
    }
    if (!wheels_heard_.heard() || wheels_heard_.silent()) return "no wheel speeds on " + wheels_.getTopic();
    return imu_heard_.heard() && !imu_heard_.silent() ? "" : "no IMU data on " + imu_.getTopic();
  }

  /// Reason why the robot may not be driven; else empty.
  std::string obstacle() const {
    const RobotStatus& robot = robot_.status();
    const StopCause cause = StopCauses()
                                .add(StopCause::contention, others_.contended())
                                .add(StopCause::emergency_stop, robot.emergency_stop)
                                .add(StopCause::robot_stopped, robot.robot_stopped)
                                .add(StopCause::driver_fault, robot.driver_fault)
                                .add(StopCause::motors_off, robot.motors_off)
                                .add(StopCause::feedback_late, feedback_.silent())
                                .worst();
    if (cause == StopCause::none) return whatIsMissing();
    return text(cause) + (cause == StopCause::contention ? ": " + others_.text() : "");
  }

  void requireDrivable() const {
    const std::string reason = over() ? "" : obstacle();
    if (!reason.empty()) throw ParameterError(reason);
  }

  void onTimer(const ros::TimerEvent&) {
    const double time = (ros::Time::now() - start_).toSec();
    const std::string reason = time < 0.0 ? "the clock jumped back" : obstacle();
    if (!over() && time > excitation_.duration()) end("");
    if (!over() && !reason.empty()) end(reason);
    if (!over()) ROS_INFO_THROTTLE(2.0, "Excitation: [%3.0f%%]", 100.0 * time / excitation_.duration());
    publish(limiter_.drive(over() ? WheelCommand{} : excitation_.at(time)));
  }

  void publish(const WheelCommand& command) {
    if (!others_.contended()) output_.publish(command);
  }

  bool onStart(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
    confirmed_ = true;
    response.success = true;
    return true;
  }

  void end(const std::string& why) {
    if (!why_) why_ = why;
    StopRequest::request();
  }

  Session session_;
  std::string tf_prefix_;
  Excitation excitation_;
  CommandLimiter limiter_;
  Heartbeat feedback_, wheels_heard_, imu_heard_;
  CommandOutput output_;
  RobotReports robot_;
  ros::CallbackQueue requests_;  // of the master, which may be slow; others_ has a timer in it
  OtherPublishers others_;
  ros::Subscriber wheels_, imu_;
  SetPointSource abort_;
  ros::ServiceServer start_service_;
  ros::Timer timer_;
  ros::Time start_;
  bool confirmed_ = false;
  std::optional<std::string> why_;  // it ended by itself
  ros::AsyncSpinner request_thread_{1, &requests_};
};

/// Drives; returns the exit status. @throws ParameterError if the drive cannot begin.
int excite(ros::NodeHandle& node, const ros::NodeHandle& private_node, StopRequest& stop) {
  ParameterMap map = readRosParameters(private_node);
  const auto bounds = readParameters<ExcitationParameters>(map, "excitation");
  const auto geometry = readParameters<GeometryParameters>(map, "robot");
  Session session;
  ParameterReader reader(map, "session");
  reader.field("confirm", session.confirm, Presence::optional);
  reader.field("countdown", session.countdown, {0.0, 60.0}, "s", Presence::optional);
  reader.field("bag", session.bag, Presence::optional);
  reader.field("twist", session.twist, Presence::optional);
  map.refuseUnknown();
  // As rosbag record names it.
  if (!session.bag.empty() && !boost::algorithm::ends_with(session.bag, ".bag")) session.bag += ".bag";
  ExcitationNode excitation(node, private_node, bounds, geometry, session);
  excitation.prepare();
  excitation.start();
  stop.spinUntilRequested();
  stop.spinWhile([&] { return !excitation.atRest(); }, kBrake);
  excitation.publishStop();
  if (!excitation.why().empty()) ROS_FATAL("the excitation was not driven to its end: %s", excitation.why().c_str());
  stop.flush();  // nothing is logged after it
  if (excitation.complete()) std::cout << "The excitation is complete.\n" << excitation.next() << std::flush;
  return excitation.why().empty() ? 0 : 1;
}

}  // namespace
}  // namespace jackal_aic

int main(int argc, char** argv) {
  ros::init(argc, argv, "excitation", ros::init_options::NoSigintHandler);
  ros::NodeHandle node, private_node("~");
  jackal_aic::StopRequest stop;
  try {
    return jackal_aic::excite(node, private_node, stop);
  } catch (const std::exception& error) {
    ROS_FATAL("%s", jackal_aic::onOneLine(error.what()).c_str());
    return 1;
  }
}
