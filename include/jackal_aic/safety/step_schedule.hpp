#pragma once

/// @file
/// Schedule of fixed steps under late timers. No clock: times are passed in nanoseconds.

#include <cstdint>

namespace jackal_aic {

/// Keeps belief and action steps in their fixed ratio and order, although two timers fire late and in any order. An
/// action period has n belief steps and ends with one action step at its boundary: the belief timer does not run past a
/// boundary whose action is due, and the action timer first runs the belief steps that are missing.
class StepSchedule {
 public:
  /// @param belief_step length of a belief step [ns]; @param belief_steps_per_action n, 1 or more;
  /// @param most_periods most action periods to catch up at once; later periods are dropped and counted.
  StepSchedule(std::int64_t belief_step, int belief_steps_per_action, int most_periods);

  /// True once start() was called.
  bool started() const { return started_; }

  /// Starts the first action period at this time [ns].
  void start(std::int64_t now);

  /// Returns to the state before start().
  void stop() { started_ = false; }

  /// Belief steps to run now [ns], without passing the boundary of the present action period.
  int beliefStepsDue(std::int64_t now) const;

  /// Belief steps still missing in the present action period.
  int beliefStepsLeft() const { return belief_steps_per_action_ - belief_steps_done_; }

  /// Time for which the next belief step is due [ns].
  std::int64_t nextBeliefStep() const { return boundary_ + (belief_steps_done_ + 1) * belief_step_; }

  /// Counts a belief step.
  void beliefStepDone() { ++belief_steps_done_; }

  /// Whole action periods that are over at the time [ns] for which the action timer was set, at most most_periods. The
  /// remainder moves the boundary without losing a step: the timer was delayed, or advanced by at most 1/16 of a
  /// period, to follow the measurements (phase_lock.hpp).
  int actionPeriodsDue(std::int64_t expected);

  /// End of the last action period that is over at a time [ns], for a caller without a timer.
  std::int64_t lastBoundary(std::int64_t now) const;

  /// Notes that the action step was run; the next action period begins at `boundary` [ns].
  void actionStepDone(std::int64_t boundary);

  /// Action periods dropped since construction because the timer was too late.
  std::uint64_t droppedPeriods() const { return dropped_; }

 private:
  std::int64_t belief_step_;
  int belief_steps_per_action_;
  int most_periods_;
  bool started_ = false;
  std::int64_t boundary_ = 0;
  int belief_steps_done_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace jackal_aic
