#pragma once

/// @file
/// What was learned about slip and drive train, kept in a YAML file for the next start.

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "jackal_aic/predictive/learned_model.hpp"

namespace jackal_aic {

/// What a file holds.
struct KeptModel {
  LearnedModel learned;  ///< as far as it counts
  std::string left_out;  ///< what does not, and why, for people: a robot that was told to be another; empty: nothing
};

/// What a file holds: keys slip.effective_track [m], slip.slip_factor and, since how the turn depends on the motion is
/// learned, slip.turn_coefficients and slip.turn_covariance (lower triangle, row by row); since they are learned,
/// drive_train.dead_time and drive_train.lag [s]. Also, as told_slip and told_drive_train, the configuration
/// before it learned: where the present one differs, because the robot has been identified since or is another one, the
/// present one counts. Empty if there is no such file.
/// @param told the present configuration: centre of the range in which the belief about the slip stays.
/// @throws ParameterError naming file, key, value and bound, if the file is unreadable or holds anything else, or if a
/// value is out of range.
std::optional<KeptModel> readSlipFile(const std::string& path, const LearnedModel& told);

/// Writes what was learned to a file at once: another process sees the old file or the new one, never a
/// part. @param told the configuration before it learned.
/// @throws ParameterError naming the file and the reason.
void writeSlipFile(const std::string& path, const LearnedModel& learned, const LearnedModel& told);

/// Writes what was learned in a thread of its own, so that a slow disk does not delay the controller.
class SlipWriter {
 public:
  /// @param path file; @param learned written at once, or failure() says why not; @param told what the controller had
  /// been told.
  SlipWriter(std::string path, const LearnedModel& learned, const LearnedModel& told);

  ~SlipWriter() { finish(); }

  SlipWriter(const SlipWriter&) = delete;
  SlipWriter& operator=(const SlipWriter&) = delete;

  /// Has it written soon. Neither waits for the disk nor allocates.
  void write(const LearnedModel& learned);

  /// Waits until what is due is written, and ends the thread.
  void finish();

  /// Waits until what is due is written, for as long as a patience allows: as failure(), or std::nullopt if it is not
  /// written by then.
  std::optional<std::string> outcome(std::chrono::milliseconds patience);

  /// Why the last attempt failed; empty if it did not.
  std::string failure() const;

 private:
  void run();
  void writeNow(const LearnedModel& learned);

  std::string path_;
  LearnedModel told_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::condition_variable written_;
  std::optional<LearnedModel> due_;
  bool writing_ = false;
  bool ending_ = false;
  std::string failure_;
  std::thread thread_;
};

}  // namespace jackal_aic
