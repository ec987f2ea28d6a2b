#pragma once

/// @file
/// The scenarios of the fault campaign: what the robot does, what goes wrong, and what has to come of it.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "injected_fault.hpp"

namespace jackal_aic::sim {

/// Topics between robot, controller and operator that messages faults can hit.
enum class FaultTopic { joint_states, imu, feedback, status, set_point, cmd_drive };

/// Words of FaultTopic, in the order of the enumerators; keys of a scenario.
inline constexpr std::array<const char*, 6> kFaultTopicNames{"joint_states", "imu",       "feedback",
                                                             "status",       "set_point", "cmd_drive"};

/// Faults that are no faults of messages. The meaning of SystemFault::amount is in brackets.
enum class SystemFaultKind {
  e_stop,            ///< /e_stop says true
  second_publisher,  ///< another node publishes drive commands [wheel speed in rad/s]
  block_left,        ///< the left motor is blocked; its encoder tells the truth
  block_right,       ///< as block_left, on the right
  push,              ///< the robot is pushed along its heading [N]
  lift,              ///< the robot is lifted, turned and set down again
  clock_jump,        ///< the clock and all stamps jump [s] and stay there
  clock_reset,       ///< the simulation starts again: robot at rest, clock at zero
  pause,             ///< the simulation stands still
  stall,             ///< the controller's process gets no processor time (SIGSTOP, SIGCONT)
  kill,              ///< the controller's process is killed (SIGKILL); roslaunch starts it again
  interrupt,         ///< the controller is ended by SIGINT
  terminate,         ///< the controller is ended by SIGTERM
  master_restart     ///< the ROS master dies; another one is started in its place
};

/// Words of SystemFaultKind, in the order of the enumerators.
inline constexpr std::array<const char*, 14> kSystemFaultKindNames{
    "e_stop", "second_publisher", "block_left",  "block_right",   "push",
    "lift",   "clock_jump",       "clock_reset", "pause",         "stall",
    "kill",   "interrupt",        "terminate",   "master_restart"};

/// A fault of robot, clock or process, for a time.
struct SystemFault {
  SystemFaultKind kind = SystemFaultKind::e_stop;  ///< what happens
  double amount = 0.0;                             ///< how much; meaning and unit depend on the kind
  double torque = 0.0;                             ///< of a push, about the vertical [N m]
  double start = 0.0;                              ///< after the onset of the scenario's faults [s]
  double duration = 1.6;                           ///< for the kinds that end [s]; pause: on the wall clock
};

/// Lists the fields of SystemFault with unit and range.
template <class Visitor>
void describeFields(Visitor& v, SystemFault& p) {
  v.field("kind", p.kind, kSystemFaultKindNames, Presence::required);
  v.field("amount", p.amount, {-1000.0, 1000.0}, "", Presence::optional);
  v.field("torque", p.torque, {-1000.0, 1000.0}, "N m", Presence::optional);
  v.field("start", p.start, {0.0, 3600.0}, "s", Presence::optional);
  v.field("duration", p.duration, {0.0, 3600.0}, "s", Presence::optional);
}

/// What the robot is asked to do during a scenario.
struct Motion {
  std::string name;       ///< key in the file
  double forward = 0.0;   ///< set point of the speed [m/s]
  double yaw_rate = 0.0;  ///< set point of the yaw rate [rad/s]
};

/// Lists the fields of Motion with unit and range.
template <class Visitor>
void describeFields(Visitor& v, Motion& p) {
  v.field("forward", p.forward, {-10.0, 10.0}, "m/s", Presence::optional);
  v.field("yaw_rate", p.yaw_rate, {-20.0, 20.0}, "rad/s", Presence::optional);
}

/// What has to become of the motion.
enum class Outcome {
  stops,   ///< the robot comes to a standstill within the configured time
  drives,  ///< the robot follows its set point throughout
  resumes  ///< the robot may brake, but latches no fault, and follows its set point again at the end
};

/// Words of Outcome, in the order of the enumerators.
inline constexpr std::array<const char*, 3> kOutcomeNames{"stops", "drives", "resumes"};

/// What tells that the fault was noticed.
enum class Detection {
  state,         ///< the controller's state gives one of the expected reasons
  set_points,    ///< the count of rejected set points rises
  measurements,  ///< the count of rejected measurements rises
  diagnostics,   ///< a warning on /diagnostics holds one of the expected reasons
  tolerated      ///< nothing has to: the fault is within what the controller is built for
};

/// Words of Detection, in the order of the enumerators.
inline constexpr std::array<const char*, 5> kDetectionNames{"state", "set_points", "measurements", "diagnostics",
                                                            "tolerated"};

/// What has to come of a scenario.
struct Expectation {
  Outcome outcome = Outcome::drives;         ///< what becomes of the motion
  Detection detected_by = Detection::state;  ///< what tells that the fault was noticed
  std::vector<std::string> reasons;          ///< texts of which one has to be part of what is told
  double within = 0.0;                       ///< configured time from the onset to the begin of the brake [s]
  double detected_within = 0.0;              ///< longest time from the onset until the fault is told [s]; 0: any
  bool recovers = true;                      ///< after a stop: whether the robot drives again once the fault is over
  double tolerance = 0.1;                    ///< of the speed at the end, relative to the set point
  /// Largest speed beyond that at the onset and the set point, of the robot and, in a turn, of its wheels [m/s].
  double overspeed = 0.2;
};

/// Lists the fields of Expectation with unit and range.
template <class Visitor>
void describeFields(Visitor& v, Expectation& p) {
  v.field("outcome", p.outcome, kOutcomeNames, Presence::required);
  v.field("detected_by", p.detected_by, kDetectionNames, Presence::optional);
  v.field("reasons", p.reasons, Presence::optional);
  v.field("within", p.within, {0.0, 60.0}, "s", Presence::optional);
  v.field("detected_within", p.detected_within, {0.0, 60.0}, "s", Presence::optional);
  v.field("recovers", p.recovers, Presence::optional);
  v.field("tolerance", p.tolerance, {0.0, 10.0}, "", Presence::optional);
  v.field("overspeed", p.overspeed, {0.0, 10.0}, "m/s", Presence::optional);
}

/// A fault on a topic.
struct TopicFault {
  FaultTopic topic;
  InjectedFault fault;
};

/// One run of the campaign. Times count from the reset of the simulation unless they say otherwise.
struct Scenario {
  std::string name;                   ///< "fault/motion", unique
  Motion motion;                      ///< what the robot is asked to do
  std::vector<TopicFault> faults;     ///< of messages
  std::optional<SystemFault> system;  ///< of robot, clock or process
  /// What is otherwise about the robot during the whole run: parameters of the plant, without prefix.
  std::vector<std::pair<std::string, ParameterValue>> plant;
  Expectation expectation;  ///< what has to come of it
  double onset = 2.0;       ///< when the faults begin [s]
  double recovery = 2.0;    ///< observed time after the faults are over [s]
  bool core = false;        ///< part of the test suite
  bool real = false;        ///< part of what runs on the plant `real` as well
  bool own_launch = false;  ///< leaves the ROS graph unfit for another scenario
  std::uint64_t seed = 1;   ///< of faults that hit a share of the messages

  /// End of the last fault [s].
  double clear() const;
  /// End of the run [s].
  double end() const { return clear() + recovery; }
};

/// Reads the scenarios of a file, in alphabetical order, each with each of its motions.
/// @throws ParameterError for a file that cannot be read, a key that is missing, unknown or out of range, a motion that
/// does not exist, or a fault that its topic cannot have.
std::vector<Scenario> readScenarios(const std::string& path);

/// As readScenarios, from YAML text; name stands for the file in messages.
std::vector<Scenario> parseScenarios(const std::string& text, const std::string& name);

}  // namespace jackal_aic::sim
