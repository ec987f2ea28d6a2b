#pragma once

/// @file
/// The topics that wheel commands leave on.

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include "jackal_aic/types.hpp"
#include "node_parameters.hpp"

namespace jackal_aic {

/// Publishes wheel commands on the topics of the chosen output mode.
class CommandOutput {
 public:
  /// Advertises the topics: cmd_drive, or jackal_left_wheel/command and jackal_right_wheel/command.
  CommandOutput(ros::NodeHandle& node, OutputMode mode);

  /// Publishes wheel speeds [rad/s].
  void publish(const WheelCommand& command);

 private:
  OutputMode mode_;
  ros::Publisher drive_;
  ros::Publisher left_;
  ros::Publisher right_;
};

}  // namespace jackal_aic
