#pragma once

/// @file
/// Every input of a drive loop as messages, from which a drive can be replayed exactly.

#include <jackal_aic/LoopInputs.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>

#include <cstdint>
#include <vector>

#include "jackal_aic/safety/drive_input.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic {

/// Adds an input to a message, gains as their text. Numbers keep their bits.
void addInput(const DriveInput& input, LoopInputs& message);

/// The inputs of a message, in their order; exactly those that were added.
/// @throws ParameterError if an input has an unknown kind, missing values or invalid gains.
std::vector<DriveInput> inputsOf(const LoopInputs& message);

/// Publishes jackal_AIC/inputs (jackal_aic/LoopInputs). Inputs before the first subscriber are kept for 20 s, so that a
/// recorder started with the node receives all of them.
class InputLog {
 public:
  /// Listens to a loop, which must not call it after its destruction. @param parameters with which the loop was made.
  InputLog(ros::NodeHandle& node, const NodeParameters& parameters, DriveLoop& loop);
  InputLog(const InputLog&) = delete;
  InputLog& operator=(const InputLog&) = delete;

  /// Publishes the kept inputs to a subscriber. @param now time of the action update.
  void publish(const ros::Time& now);

 private:
  // Does not publish, and allocates for changed gains only.
  void keep(const DriveInput& input);
  void dropKept();

  NodeParameters configuration_;  // in force after the last input that was published
  std::vector<DriveInput> kept_;
  std::uint64_t first_ = 0;  // number of the first kept one
  ros::Time configured_;     // when the configuration was published last
  ros::Publisher publisher_;
};

}  // namespace jackal_aic
