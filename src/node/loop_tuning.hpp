#pragma once

/// @file
/// What people change in a controller that runs: its gains and the variances of its sensors, through
/// dynamic_reconfigure, and what becomes of what it learns. The same for the node and for the controller of
/// ros_control.

#include <ros/node_handle.h>
#include <ros/time.h>

#include <memory>

#include "jackal_aic/predictive/learned_model.hpp"
#include "node_parameters.hpp"

namespace jackal_aic {

/// How a drive loop is changed by the thread that serves requests, which need not be the one that drives.
class LoopChanges {
 public:
  virtual ~LoopChanges() = default;

  /// Have certified gains taken over.
  virtual void adoptGains(const ControllerParameters& gains) = 0;
  virtual void adoptGains(const PredictiveParameters& gains) = 0;

  /// Has the loop go on from what was learned before, its values in range.
  virtual void setLearned(const LearnedModel& learned) = 0;

  /// Has the learning of the robot stopped (true) or resumed.
  virtual void freezeLearning(bool frozen) = 0;

  /// What is learned until now, or a moment ago. Of the predictive structure only.
  virtual LearnedModel learned() const = 0;
};

/// Certifies the gains on the plant model when it starts, and tells; then serves changes until it is destroyed.
class LoopTuning {
 public:
  virtual ~LoopTuning() = default;

  /// To be called now and then, by the thread that serves the requests: with a slip file, writes what was learned every
  /// 10 s.
  virtual void keep(const ros::Time& now) = 0;
};

/// Serves the changes of the structure that runs, in a namespace:
/// thesis: dynamic_reconfigure of the gains in `controller`; predictive: in `predictive` and `sensors`, and the
/// services freeze_learning (std_srvs/SetBool), which stops and resumes the learning of the robot, and
/// save_learned_model (std_srvs/Trigger), which writes what was learned to the slip file at once; the baseline:
/// nothing. With a slip file, what was learned outlives the process.
/// @param node the namespace; @param loop has to outlive what is returned. @throws ParameterError if the slip file
/// cannot be read or written.
std::unique_ptr<LoopTuning> makeTuning(const ros::NodeHandle& node, const NodeParameters& parameters,
                                       LoopChanges& loop);

}  // namespace jackal_aic
