#pragma once

/// @file
/// The learned slip and drive train in a YAML file, for the next start.

#include <optional>
#include <string>

#include "jackal_aic/predictive/learned_model.hpp"

namespace jackal_aic {

/// A model in words: "effective track 0.56 m, slip factor 1, dead time 0.08 s, lag 0.01 s".
std::string describe(const LearnedModel& model);

/// Reads a file: keys slip.effective_track [m], slip.slip_factor, slip.turn_coefficients and slip.turn_covariance
/// (lower triangle, row by row), drive_train.dead_time and drive_train.lag [s]; as configured.slip and
/// configured.drive_train the configuration before the robot learned, in words. Empty if there is no such file.
/// @param configured the present configuration. @throws ParameterError naming file, key, value and bound, if the file
/// is unreadable or holds anything else, if a value is out of range, or if the robot learned with another
/// configuration: it has been identified since, or it is another one.
std::optional<LearnedModel> readLearnedFile(const std::string& path, const LearnedModel& configured);

/// Writes a file, and waits for the disk: another process sees the old file or the new one, never a part.
/// @param configured the configuration before it learned. @throws ParameterError naming the file and the reason.
void writeLearnedFile(const std::string& path, const LearnedModel& learned, const LearnedModel& configured);

/// Renames a file that cannot be used to PATH.old, in the place of an earlier one. False if it cannot be renamed.
bool putAside(const std::string& path);

}  // namespace jackal_aic
