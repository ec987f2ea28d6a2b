#pragma once

/// @file
/// A recorded drive as the inputs of a drive loop: exactly as the controller got them, where the bag has its log
/// (jackal_AIC/inputs), else as the messages of sensors and set points say.

#include <jackal_aic/ControllerState.h>
#include <jackal_aic/LoopInputs.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "jackal_aic/safety/drive_input.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic {

/// What was played.
struct PlayReport {
  std::uint64_t inputs = 0;             ///< of the log
  std::uint64_t first = 0;              ///< number of the first one; above 0, the recording began after the controller
  std::uint64_t missing = 0;            ///< between the first and the last
  bool restarted = false;               ///< after the last the bag has those of a controller that was restarted
  std::map<std::string, int> refusals;  ///< messages of sensors that were refused, by the reason
};

/// An open bag.
class RecordedDrive {
 public:
  using Sink = std::function<void(const DriveInput&)>;

  /// @param bag has to outlive this; @param name_space of the controller.
  RecordedDrive(const rosbag::Bag& bag, std::string name_space) : bag_(bag), name_space_(std::move(name_space)) {}

  /// True if it has what the controller was told.
  bool hasLog() const { return has("jackal_AIC/inputs"); }

  /// Number of the first input of the log; 0 without a log.
  std::uint64_t firstInput() const;

  /// Parameters of the controller that recorded, as YAML; empty if they are not in the bag.
  std::string configuration() const;

  /// States of the controller that recorded, in the order of their stamps.
  std::vector<ControllerState> states() const;

  /// Hands on the inputs of the log, in their order. @throws ParameterError as inputsOf().
  PlayReport playLog(const Sink& sink) const;

  /// Hands on the messages as inputs, in the order of recording, with the action steps that are due between them.
  /// @param parameters names of the robot; @param set_point topic of the set points (geometry_msgs/Twist or
  /// TwistStamped). @throws ParameterError if wheels, IMU or set points are missing: the line names what there is.
  PlayReport playMessages(const NodeParameters& parameters, const std::string& set_point, const Sink& sink) const;

  /// True if the bag has messages of a topic of the controller.
  bool has(const std::string& name) const { return rosbag::View(bag_, rosbag::TopicQuery(topic(name))).size() > 0; }

 private:
  struct Log {
    std::vector<LoopInputs::ConstPtr> messages;  // of the first controller in the bag, in their order
    bool restarted = false;                      // there is another one
  };
  Log log() const;
  std::string topic(const std::string& name) const;
  void require(const std::string& topic, const std::vector<std::string>& types) const;

  const rosbag::Bag& bag_;
  std::string name_space_;
};

}  // namespace jackal_aic
