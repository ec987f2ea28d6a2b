#pragma once

/// @file
/// A recorded drive as the inputs of a drive loop: exactly those of the controller if the bag has its log
/// (jackal_AIC/inputs), else from the messages of sensors and set points.

#include <jackal_aic/ControllerState.h>
#include <jackal_aic/LoopInputs.h>
#include <rosbag/bag.h>

#include <functional>
#include <string>
#include <vector>

#include "jackal_aic/safety/drive_input.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic {

/// An open bag.
class RecordedDrive {
 public:
  using Sink = std::function<void(const DriveInput&)>;

  /// @param bag has to outlive this; @param name_space of the controller.
  RecordedDrive(const rosbag::Bag& bag, std::string name_space);

  /// True if it has the log of the controller; fromTheStart(): from the start of the controller on.
  bool hasLog() const { return !log_.empty(); }
  bool fromTheStart() const { return hasLog() && log_.front()->first == 0; }  ///< as above

  /// Parameters of the controller that recorded, as YAML; empty if they are not in the bag.
  std::string configuration() const;

  /// States of the controller that recorded, in the order of their stamps.
  std::vector<ControllerState> states() const;

  /// Plays the inputs of the log in their order. @returns remarks on them, one a line.
  /// @throws ParameterError as inputsOf().
  std::string playLog(const Sink& sink) const;

  /// Plays the messages as inputs in the order of recording, with the due action steps between them.
  /// @param parameters names of the robot; @param set_point topic of the set points (geometry_msgs/Twist or
  /// TwistStamped). @returns as playLog(). @throws ParameterError if wheels, IMU or set points are missing: the line
  /// lists the recorded topics.
  std::string playMessages(const NodeParameters& parameters, const std::string& set_point, const Sink& sink) const;

  /// True if the bag has messages of a topic of the controller.
  bool has(const std::string& name) const;

 private:
  std::string topic(const std::string& name) const;

  const rosbag::Bag& bag_;
  std::string name_space_;
  std::vector<LoopInputs::ConstPtr> log_;  // of the first controller in the bag, in their order
  bool restarted_ = false;                 // there is another controller
};

}  // namespace jackal_aic
