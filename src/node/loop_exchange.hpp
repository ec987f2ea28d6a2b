#pragma once

/// @file
/// Changes of a drive loop, handed over by the threads that serve requests to the one that drives.

#include <mutex>

#include "latest.hpp"
#include "loop_tuning.hpp"

namespace jackal_aic {

/// What was asked for last, until the loop's thread takes it. Gains are certified by the thread that hands them over,
/// so that the thread that drives has nothing to wait for.
class LoopExchange : public LoopChanges {
 public:
  // From any thread but the one that drives:
  void adoptGains(const ControllerParameters& gains) override;
  void adoptGains(const PredictiveParameters& gains) override;
  void setLearned(const LearnedModel& learned) override;
  void freezeLearning(bool frozen) override;
  LearnedModel learned() const override;

  /// Has the loop go on with what was asked for. For the thread that drives; does not lock, and allocates only where
  /// the loop does (DriveLoop::adoptGains() of the thesis' structure).
  void apply(DriveLoop& loop, double now);

  /// Hands what the loop has learned over to the others; for the thread that drives, as apply().
  void tell(const DriveLoop& loop);

 private:
  mutable std::mutex requests_;  // between the threads of these
  Latest<ControllerParameters> thesis_gains_;
  Latest<PredictiveParameters> predictive_gains_;
  Latest<LearnedModel> wanted_model_;
  Latest<bool> frozen_;
  mutable Latest<LearnedModel> believed_model_;
  mutable LearnedModel learned_{};  // the last that was read
};

}  // namespace jackal_aic
