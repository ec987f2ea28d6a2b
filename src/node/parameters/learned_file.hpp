#pragma once

/// @file
/// The learned slip and drive train in a YAML file, for the next start.

#include <optional>
#include <string>

#include "jackal_aic/predictive/learned_model.hpp"

namespace jackal_aic {

/// What a file holds.
struct KeptModel {
  LearnedModel learned;  ///< as far as it counts
  std::string left_out;  ///< the part that was learned with another configuration, for people; empty: none
};

/// Reads a file: keys slip.effective_track [m], slip.slip_factor, slip.turn_coefficients and slip.turn_covariance
/// (lower triangle, row by row), drive_train.dead_time and drive_train.lag [s]; as configured.slip and
/// configured.drive_train the configuration before it learned, in words. Where the present one differs, because the
/// robot has been identified since or is another one, the present one counts. Empty if there is no such file.
/// @param configured the present configuration: centre of the range in which the belief about the slip stays.
/// @throws ParameterError naming file, key, value and bound, if the file is unreadable or holds anything else, or if a
/// value is out of range.
std::optional<KeptModel> readLearnedFile(const std::string& path, const LearnedModel& configured);

/// Writes a file, and waits for the disk: another process sees the old file or the new one, never a part.
/// @param configured the configuration before it learned. @throws ParameterError naming the file and the reason.
void writeLearnedFile(const std::string& path, const LearnedModel& learned, const LearnedModel& configured);

}  // namespace jackal_aic
