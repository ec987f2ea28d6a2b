#pragma once

/// @file
/// The messages of a bag as what a drive loop would have been told by a node that heard them when they were recorded.

#include <rosbag/message_instance.h>

#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "jackal_aic/safety/drive_input.hpp"
#include "node_parameters.hpp"
#include "sensor_pairing.hpp"

namespace jackal_aic {

/// How the messages are played.
struct PlayerSettings {
  std::string name_space = "/";                    ///< of the relative topics
  std::string set_point = "jackal_AIC/set_point";  ///< topic of the set points (geometry_msgs/Twist)
  double belief_step = 0.001;                      ///< period of the belief's timer [s]
  double action_step = 0.02;                       ///< period of the action's timer [s]
  bool commands = false;                           ///< another source drives: what reached the motors is an input, too
};

/// A topic as a node in a namespace resolves it.
std::string resolvedTopic(const std::string& name_space, const std::string& topic);

/// Plays messages in the order in which they were recorded, and the timers of the node between them. Times that
/// decrease are a clock that was set back.
class MessagePlayer {
 public:
  using Sink = std::function<void(const DriveInput&)>;

  /// @param parameters names of the robot; @param sink gets the inputs of the loop.
  MessagePlayer(const NodeParameters& parameters, const PlayerSettings& settings, Sink sink);

  /// Topics that are played, and their types.
  std::map<std::string, std::string> topics() const;

  /// Plays the next message. One of another type than the topic's is left out.
  void play(const rosbag::MessageInstance& message);

  /// Messages of sensors and transforms that were refused, by the reason; those beyond the first hundred reasons as
  /// one.
  const std::map<std::string, int>& refusals() const { return refusals_; }

 private:
  static constexpr std::size_t kMostReasons = 100;  // a reason may hold text of the recording

  void runTimers(std::int64_t now);
  void followClockBack();
  void count(const std::string& refusal);
  void tell(decltype(DriveInput::what) what) { sink_({now_.toSec(), std::move(what)}); }
  void playWheels(const rosbag::MessageInstance& message);
  void playImu(const rosbag::MessageInstance& message);
  void playStatus(const rosbag::MessageInstance& message);
  void playCommand(const rosbag::MessageInstance& message);
  void playTransforms(const rosbag::MessageInstance& message);
  std::string topic(const std::string& name) const { return resolvedTopic(settings_.name_space, name); }

  NodeParameters parameters_;
  PlayerSettings settings_;
  Sink sink_;
  SkidSteerKinematics kinematics_;
  FixedFrames frames_;
  SensorPairing sensors_;
  RobotStatus status_;
  ros::Time now_;
  std::int64_t next_belief_ = 0;  // ns
  std::int64_t next_action_ = 0;  // ns; 0: no message yet
  std::map<std::string, int> refusals_;
};

}  // namespace jackal_aic
