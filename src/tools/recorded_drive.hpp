#pragma once

/// @file
/// A drive as `record:=true` keeps it: what the controller was told, and what it did.

#include <jackal_aic/ControllerState.h>
#include <rosbag/bag.h>

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "jackal_aic/safety/drive_input.hpp"
#include "message_player.hpp"

namespace jackal_aic {

/// How complete the log of inputs in a bag is.
struct LogReport {
  std::uint64_t inputs = 0;   ///< played
  std::uint64_t first = 0;    ///< number of the first one; above 0, the recording began after the controller
  std::uint64_t missing = 0;  ///< between the first and the last

  bool restarted = false;  ///< after the last the bag has those of a controller that was restarted

  /// True if the controller was told nothing else until the last input.
  bool complete() const { return first == 0 && missing == 0; }
};

/// An open bag.
class RecordedDrive {
 public:
  using Sink = std::function<void(const DriveInput&)>;

  /// @param name_space of the controller. @throws rosbag::BagException, or another exception, if it is no bag.
  RecordedDrive(const std::string& path, const std::string& name_space);

  /// True if it has what the controller was told (jackal_AIC/inputs).
  bool hasLog() const;

  /// Parameters of the controller that recorded, as YAML; empty if they are not in the bag.
  std::string configuration() const;

  /// Number of the first input of the log; above 0, the recording began after the controller. 0 without a log.
  std::uint64_t firstInput() const;

  /// States of the controller that recorded, in the order of recording.
  std::vector<ControllerState> states() const;

  /// Hands on what the controller was told, in its order. @throws ParameterError as inputsOf().
  LogReport playLog(const Sink& sink) const;

  /// Hands on the messages through a player. @throws ParameterError if wheels, IMU or set points are missing, or a
  /// topic has another type than it is to have; the line names what there is.
  void playMessages(MessagePlayer& player, const std::string& set_point) const;

  /// True if the bag has messages of a topic.
  bool has(const std::string& topic) const;

 private:
  std::string topic(const std::string& name) const { return resolvedTopic(name_space_, name); }

  std::string path_;
  std::string name_space_;
  rosbag::Bag bag_;
};

}  // namespace jackal_aic
