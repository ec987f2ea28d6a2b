#include <geometry_msgs/Twist.h>
#include <jackal_msgs/Drive.h>
#include <poll.h>
#include <ros/callback_queue.h>
#include <ros/network.h>
#include <ros/ros.h>
#include <ros/xmlrpc_manager.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <std_srvs/Trigger.h>
#include <topic_tools/shape_shifter.h>
#include <unistd.h>

#include <algorithm>
#include <boost/algorithm/string/predicate.hpp>
#include <boost/algorithm/string/replace.hpp>
#include <cctype>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <string>
#include <system_error>
#include <vector>

#include "conversions.hpp"
#include "excitation.hpp"
#include "graph_watch.hpp"
#include "identification_report.hpp"
#include "jackal_aic/config/text.hpp"
#include "jackal_aic/safety/command_limiter.hpp"
#include "robot_watch.hpp"
#include "ros_parameters.hpp"
#include "stop_request.hpp"

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;        // s between commands, as the controller sends them
constexpr double kConnection = 10.0;    // s of wall time to wait for the motors and the sensors
constexpr double kGraphPeriod = 0.5;    // s of wall time between looks at who else publishes commands
constexpr double kSilence = 0.5;        // s without a message after which a source is lost
constexpr double kClockPatience = 5.0;  // s of wall time in which the clock has to go on
constexpr double kBrake = 0.5;          // s of wall time for the last commands; a simulation may stand still
constexpr double kOthersStart = 5.0;    // s of wall time for other nodes to start
constexpr double kOthersEnd = 10.0;     // s of wall time for other nodes to end
constexpr double kPoll = 0.05;          // s of wall time between looks at them

/// When a source spoke last.
class Heartbeat {
 public:
  void beat() {
    last_ = ros::Time::now();
    heard_ = true;
  }
  bool heard() const { return heard_; }
  bool silent() const { return heard_ && std::abs((ros::Time::now() - last_).toSec()) > kSilence; }

 private:
  ros::Time last_;
  bool heard_ = false;
};

/// Waits for a condition, for at most `longest` of wall time [s].
template <class Condition>
void waitUntil(const Condition& condition, double longest) {
  const ros::WallTime patience = ros::WallTime::now() + ros::WallDuration(longest);
  while (!condition() && ros::WallTime::now() < patience) ros::WallDuration(kPoll).sleep();
}

/// The URI of a node; empty if there is none of this name.
std::string uriOf(const std::string& node) {
  XmlRpc::XmlRpcValue request, response, payload;
  request[0] = ros::this_node::getName();
  request[1] = node;
  return ros::master::execute("lookupNode", request, response, payload, false) ? std::string(payload) : "";
}

/// Ends a node as `rosnode kill` does, and waits until it is gone.
void endNode(const std::string& name) {
  const std::string uri = uriOf(name);
  std::string host;
  std::uint32_t port = 0;
  if (uri.empty() || !ros::network::splitURI(uri, host, port)) return;
  XmlRpc::XmlRpcClient* client = ros::XMLRPCManager::instance()->getXMLRPCClient(host, static_cast<int>(port), "/");
  XmlRpc::XmlRpcValue request, response;
  request[0] = ros::this_node::getName();
  request[1] = std::string("the excitation is over");
  const bool told = client->execute("shutdown", request, response);
  ros::XMLRPCManager::instance()->releaseXMLRPCClient(client);
  // The master goes on to list one that was killed.
  if (told) waitUntil([&name] { return uriOf(name).empty(); }, kOthersEnd);
}

/// The recorder of the drive, a node of its own, and its bag.
class Recording {
 public:
  /// @param session bag and nodes to end; without a bag nothing is recorded.
  explicit Recording(const ExcitationSession& session) : bag_(session.bag) {
    // As rosbag record names it.
    if (!bag_.empty() && !boost::algorithm::ends_with(bag_, ".bag")) bag_ += ".bag";
    for (const std::string& name : session.end) nodes_.push_back(ros::names::resolve(name));
  }

  /// Moves a bag that is there already to NAME.1, or the next number that is free: the recorder would replace it as
  /// soon as it ends, with what was recorded until then. @throws ParameterError if it cannot be moved.
  void keepEarlierBag() {
    earlier_ = keepEarlier(bag_);
    ours_ = true;
  }

  /// Waits for the recorder if it has not started yet. One that starts later could not be ended.
  void awaitStart() const {
    const auto started = [this] {
      return open() && std::none_of(nodes_.begin(), nodes_.end(), [](const auto& node) { return uriOf(node).empty(); });
    };
    if (!bag_.empty()) waitUntil(started, kOthersStart);
  }

  /// Ends the recorder and waits until the bag is closed. @param driven else the new bag is of no use and is removed.
  /// Without a new bag the earlier one gets its name back.
  void end(bool driven) {
    for (const std::string& node : nodes_) endNode(node);
    if (bag_.empty()) return;
    // A recorder is gone for the master before it has closed its bag.
    waitUntil([this] { return !open(); }, kOthersEnd);
    if (open()) return;  // it may still take the name
    std::error_code error;
    if (!driven && ours_) std::filesystem::remove(bag_, error);
    if (!written() && !earlier_.empty()) {
      std::filesystem::rename(earlier_, bag_, error);
      if (!error) earlier_.clear();
    }
  }

  /// True while the recorder writes: until a bag is closed it has another name.
  bool open() const {
    std::error_code error;
    return std::filesystem::exists(bag_ + ".active", error);
  }

  /// True once the bag is there.
  bool written() const {
    std::error_code error;
    return !bag_.empty() && std::filesystem::exists(bag_, error);
  }

  /// Path of the bag; empty if nothing is recorded.
  const std::string& bag() const { return bag_; }

  /// Where the earlier bag of this name is now; empty if there was none, or it has its name again.
  const std::string& earlier() const { return earlier_; }

  /// Resolved names of the nodes that record. Empty if nothing is recorded.
  std::vector<std::string> recorders() const { return bag_.empty() ? std::vector<std::string>{} : nodes_; }

 private:
  std::string bag_;
  std::vector<std::string> nodes_;  // resolved names
  std::string earlier_;
  bool ours_ = false;  // what has the name now
};

/// Drives the excitation open loop on cmd_drive or cmd_vel, within the limits of the acceleration. It ends by
/// everything that stops a controller, and by any message on jackal_AIC/set_point; it brakes first, unless another node
/// has the motors.
class ExcitationNode {
 public:
  /// @param twist as in ExcitationSession.
  ExcitationNode(ros::NodeHandle& node, const ros::NodeHandle& private_node, const Excitation& excitation,
                 const GeometryParameters& geometry, bool twist, const Recording& recording)
      : excitation_(excitation),
        kinematics_(geometry),
        twist_(twist),
        tf_prefix_(tfPrefix(private_node)),
        recording_(recording),
        recorders_(recording.recorders()),
        limiter_(LimitParameters{}, geometry, kPeriod),
        drive_(twist ? advertise<geometry_msgs::Twist>(node, "cmd_vel")
                     : advertise<jackal_msgs::Drive>(node, "cmd_drive")),
        graph_({{drive_.getTopic()}, {}, false, "", false, "", [] { return 0u; }}, kGraphPeriod),
        robot_(node, [this](const ros::Time&) { feedback_.beat(); }),
        wheels_(node.subscribe<sensor_msgs::JointState>(
            "joint_states", 10, [this](const sensor_msgs::JointStateConstPtr&) { wheels_heard_.beat(); })),
        imu_(node.subscribe<sensor_msgs::Imu>("imu/data", 10,
                                              [this](const sensor_msgs::ImuConstPtr&) { imu_heard_.beat(); })),
        abort_(node.subscribe<topic_tools::ShapeShifter>(
            "jackal_AIC/set_point", 1,
            [this](const topic_tools::ShapeShifter::ConstPtr&) { end("aborted by a set point"); })),
        start_service_(ros::NodeHandle(private_node).advertiseService("start", &ExcitationNode::onStart, this)) {}

  /// Waits until the motors subscribe to the commands and the sensors publish. @throws ParameterError if they do not,
  /// or if anything keeps the robot from driving.
  void waitForRobot() {
    const ros::WallTime patience = ros::WallTime::now() + ros::WallDuration(kConnection);
    for (std::string missing = whatIsMissing(); !missing.empty(); missing = whatIsMissing()) {
      const std::string ended = recorderEnded();  // nothing to wait for
      if (!ended.empty()) throw ParameterError(ended);
      if (ros::WallTime::now() > patience) throw ParameterError(missing);
      serve();
      if (over()) return;
    }
    requireDrivable();
  }

  /// Waits for a person: a line on the terminal, or the service ~start. @throws ParameterError as waitForRobot().
  void waitForConfirmation() {
    const bool terminal = isatty(STDIN_FILENO) != 0;
    std::cout << "The robot will move by itself for " << std::lround(excitation_.duration())
              << " s: keep 2 m free all around, or its wheels off the ground.\n"
              << (terminal ? "Press Enter here to start, or in another terminal:" : "To start, in another terminal:")
              << " rosservice call " << start_service_.getService() << std::endl;
    while (!confirmed_ && !over()) {
      serve();
      requireDrivable();
      if (terminal && lineRead()) confirmed_ = true;
    }
  }

  /// Counts the seconds down in which nothing moves yet. @throws ParameterError as waitForRobot().
  void countDown(double seconds) {
    const ros::WallTime begin = ros::WallTime::now() + ros::WallDuration(seconds);
    for (double told = std::ceil(seconds); !over() && ros::WallTime::now() < begin;) {
      const double left = (begin - ros::WallTime::now()).toSec();
      if (left <= told) {
        ROS_INFO("Driving in %.0f s; Ctrl-C stops it at any time", told);
        told -= 1.0;
      }
      serve();
      requireDrivable();
    }
  }

  /// Drives; the callbacks have to be served until the end is requested.
  void start(ros::NodeHandle& node) {
    if (over()) return;
    start_ = ros::Time::now();
    timer_ = node.createTimer(ros::Duration(kPeriod), &ExcitationNode::onTimer, this);
    clock_timer_ = node.createWallTimer(ros::WallDuration(kClockPatience), [this](const ros::WallTimerEvent&) {
      if (ros::Time::now() == seen_) end("the clock stands still");
      seen_ = ros::Time::now();
    });
  }

  /// True once it drives, or did.
  bool started() const { return !start_.isZero(); }

  /// Brakes from now on.
  void brake() { braking_ = true; }

  /// True when the last command was zero, or others have the motors.
  bool atRest() const { return limiter_.atRest() || graph_.contended(); }

  /// Says zero once more, unless others have the motors.
  void publishStop() { publish({}); }

  /// Options of identify for a bag of these topics.
  std::string bagOptions() const {
    std::string options;
    const auto tell = [&options](const char* option, const std::string& name, const char* usual) {
      if (name != usual) options += std::string(" --") + option + " " + name;
    };
    tell("command-topic", drive_.getTopic(), "/cmd_drive");
    tell("wheel-topic", wheels_.getTopic(), "/joint_states");
    tell("imu-topic", imu_.getTopic(), "/imu/data");
    tell("base-frame", prefixedFrame(tf_prefix_, "base_link"), "base_link");
    return options;
  }

  /// True if the motion was driven to its end. Else why not; empty if a person ended it.
  bool complete() const { return complete_; }
  const std::string& why() const { return why_; }

 private:
  /// Commands whose subscribers are counted.
  template <class Message>
  ros::Publisher advertise(ros::NodeHandle& node, const char* topic) {
    return node.advertise<Message>(
        topic, 1, [this](const ros::SingleSubscriberPublisher& link) { ++subscribers_[link.getSubscriberName()]; },
        [this](const ros::SingleSubscriberPublisher& link) { --subscribers_[link.getSubscriberName()]; });
  }

  bool over() const { return !ros::ok() || ended_ || StopRequest::requested(); }

  static void serve() { ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.01)); }

  static bool lineRead() {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    std::string line;
    return poll(&input, 1, 0) > 0 && (input.revents & POLLIN) != 0 && std::getline(std::cin, line);
  }

  std::string whatIsMissing() const {
    if (ros::Time::now().isZero()) return "no clock: /use_sim_time is true and nothing comes on /clock";
    if (!graph_.checked()) return "the master does not say who publishes commands";
    if (!motorsListen()) return "no motors subscribe to " + drive_.getTopic();
    for (const std::string& recorder : recorders_) {
      if (!listens(recorder)) {
        return "the recorder does not record " + drive_.getTopic() + ": " + recorder + ", which is to write " +
               recording_.bag();
      }
    }
    if (!recorders_.empty() && !recording_.open()) return "the recorder does not write " + recording_.bag();
    if (!wheels_heard_.heard()) return "no wheel speeds on " + wheels_.getTopic();
    if (!imu_heard_.heard()) return "no IMU data on " + imu_.getTopic();
    return "";
  }

  /// True if a node subscribes to the commands.
  bool listens(const std::string& node) const {
    const auto found = subscribers_.find(node);
    return found != subscribers_.end() && found->second > 0;
  }

  /// True if a node other than the recorder subscribes to the commands.
  bool motorsListen() const {
    return std::any_of(subscribers_.begin(), subscribers_.end(), [this](const auto& subscriber) {
      return subscriber.second > 0 &&
             std::find(recorders_.begin(), recorders_.end(), subscriber.first) == recorders_.end();
    });
  }

  /// Which recorder subscribed to the commands and does no more; empty if none.
  std::string recorderEnded() const {
    for (const std::string& recorder : recorders_) {
      if (subscribers_.count(recorder) > 0 && !listens(recorder)) {
        return "the recorder has ended: " + recorder + ", which was to write " + recording_.bag();
      }
    }
    return "";
  }

  /// Why the robot may not be driven; empty if it may.
  std::string obstacle() const {
    if (graph_.contended()) {
      return "another node publishes commands: " + graph_.others() +
             "; the excitation needs the motors for itself (launch/jackal.launch says how to part the two)";
    }
    const RobotStatus& robot = robot_.status();
    if (robot.emergency_stop) return "emergency stop";
    if (robot.robot_stopped) return "the robot reports that it is stopped";
    if (robot.driver_fault) return "a motor driver reports a fault";
    if (robot.motors_off) return "the motors do not take velocity commands";
    if (feedback_.silent()) return "the feedback of the motors stays away";
    if (wheels_heard_.silent()) return "no wheel speeds any more on " + wheels_.getTopic();
    if (imu_heard_.silent()) return "no IMU data any more on " + imu_.getTopic();
    if (!motorsListen()) return "no motors subscribe any more to " + drive_.getTopic();
    return recorderEnded();
  }

  void requireDrivable() const {
    const std::string reason = obstacle();
    if (!reason.empty()) throw ParameterError(reason);
  }

  void onTimer(const ros::TimerEvent&) {
    if (!braking_) {
      const double time = (ros::Time::now() - start_).toSec();
      const std::string reason = obstacle();
      if (!reason.empty()) {
        end(reason);
      } else if (time > excitation_.duration() || time < 0.0) {
        complete_ = time >= 0.0;
        end(complete_ ? "" : "the clock jumped back");
      } else {
        ROS_INFO_THROTTLE(2.0, "Excitation: [%3.0f%%]", 100.0 * time / excitation_.duration());
        return publish(limiter_.drive(excitation_.at(time)));
      }
    }
    publish(limiter_.drive({}));
  }

  void publish(const WheelCommand& command) {
    if (graph_.contended()) return;
    twist_ ? drive_.publish(twistMessage(kinematics_.bodyVelocity(command))) : drive_.publish(driveMessage(command));
  }

  bool onStart(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
    confirmed_ = true;
    response.success = true;
    return true;
  }

  void end(const std::string& why) {
    if (ended_) return;
    why_ = why;
    ended_ = true;
    brake();
    StopRequest::request();
  }

  Excitation excitation_;
  SkidSteerKinematics kinematics_;
  bool twist_;
  std::string tf_prefix_;
  const Recording& recording_;
  std::vector<std::string> recorders_;
  std::map<std::string, int> subscribers_;  // of the commands: connections of each node that had one
  CommandLimiter limiter_;
  Heartbeat feedback_, wheels_heard_, imu_heard_;
  ros::Publisher drive_;
  GraphWatch graph_;
  RobotWatch robot_;
  ros::Subscriber wheels_, imu_, abort_;
  ros::ServiceServer start_service_;
  ros::Timer timer_;
  ros::WallTimer clock_timer_;
  ros::Time start_;
  ros::Time seen_;  // of the clock
  bool confirmed_ = false;
  bool braking_ = false;
  bool ended_ = false;
  bool complete_ = false;
  std::string why_;
};

/// A path as a word of the shell.
std::string shellWord(const std::string& path) {
  const auto plain = [](unsigned char c) { return std::isalnum(c) != 0 || std::strchr("/._-", c) != nullptr; };
  if (std::all_of(path.begin(), path.end(), plain)) return path;
  return "'" + boost::replace_all_copy(path, "'", "'\\''") + "'";
}

/// Ends the launch file that started this node, as Ctrl-C does. Its attribute `required` would do so in red.
void endLaunch() {
  const pid_t parent = getppid();
  std::ifstream command("/proc/" + std::to_string(parent) + "/cmdline");
  const std::string words((std::istreambuf_iterator<char>(command)), std::istreambuf_iterator<char>());
  if (words.find("roslaunch") != std::string::npos) kill(parent, SIGINT);
}

/// What a node that excites is to do.
struct Settings {
  ExcitationParameters bounds;
  GeometryParameters geometry;
  ExcitationSession session;
};

/// @throws ParameterError for a parameter that is refused.
Settings readSettings(const ros::NodeHandle& private_node) {
  ParameterMap map = readRosParameters(private_node);
  Settings settings;
  settings.bounds = readParameters<ExcitationParameters>(map, "excitation");
  settings.geometry = readParameters<GeometryParameters>(map, "robot");
  settings.session = readParameters<ExcitationSession>(map, "session");
  map.refuseUnknown();
  return settings;
}

/// What is to be said of the bag after a drive.
std::string bagNews(const Recording& recording, const ExcitationNode& excitation) {
  std::string text;
  if (!recording.earlier().empty()) text += "The earlier bag is now " + recording.earlier() + ".\n";
  if (!excitation.started() || !recording.written()) return text;
  if (!excitation.complete()) return text + recording.bag() + " holds the drive as far as it went.\n";
  return text + "Recorded " + recording.bag() + ". Next:\n    rosrun jackal_aic identify " +
         shellWord(recording.bag()) + excitation.bagOptions() + " --robot \"my Jackal\" --out my_jackal.yaml\n";
}

/// Drives; returns the exit status. @throws ParameterError if it does not come to that; the recorder then still runs.
int excite(ros::NodeHandle& node, const ros::NodeHandle& private_node, StopRequest& stop_request,
           const Settings& settings, Recording& recording) {
  ExcitationNode excitation(node, private_node, Excitation(settings.bounds, settings.geometry), settings.geometry,
                            settings.session.twist, recording);
  excitation.waitForRobot();
  if (settings.session.confirm) excitation.waitForConfirmation();
  excitation.countDown(settings.session.countdown);
  excitation.start(node);
  stop_request.spinUntilRequested();
  excitation.brake();
  stop_request.spinWhile([&] { return !excitation.atRest(); }, kBrake);
  excitation.publishStop();
  bool failed = !excitation.complete() && !excitation.why().empty();
  if (failed) ROS_FATAL("the excitation was not driven to its end: %s", excitation.why().c_str());
  recording.end(excitation.started());
  if (excitation.complete() && !recording.bag().empty() && !recording.written()) {
    ROS_FATAL("the recorder has ended without its bag: there is no %s", recording.bag().c_str());
    failed = true;
  }
  stop_request.flush();  // nothing is logged after it
  if (excitation.complete()) std::cout << "The excitation is complete.\n";
  std::cout << bagNews(recording, excitation) << std::flush;
  return failed ? 1 : 0;
}

}  // namespace
}  // namespace jackal_aic

int main(int argc, char** argv) {
  ros::init(argc, argv, "excitation", ros::init_options::NoSigintHandler);
  ros::NodeHandle node, private_node("~");
  jackal_aic::StopRequest stop_request;
  // What ends with the node is read before anything can be refused.
  jackal_aic::ExcitationSession session;
  private_node.getParam("session/bag", session.bag);
  private_node.getParam("session/end", session.end);
  private_node.getParam("session/end_launch", session.end_launch);
  jackal_aic::Recording recording(session);
  int status = 1;
  bool refused = true;
  try {
    recording.keepEarlierBag();
    const jackal_aic::Settings settings = jackal_aic::readSettings(private_node);
    refused = false;
    status = jackal_aic::excite(node, private_node, stop_request, settings, recording);
  } catch (const std::exception& error) {
    ROS_FATAL("%s", jackal_aic::onOneLine(error.what()).c_str());
    if (refused) recording.awaitStart();
    recording.end(false);
    if (!recording.earlier().empty()) ROS_WARN("the earlier bag is now %s", recording.earlier().c_str());
  }
  if (session.end_launch) jackal_aic::endLaunch();
  return status;
}
