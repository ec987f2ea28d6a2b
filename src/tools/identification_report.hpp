#pragma once

/// @file
/// What identify prints and writes, as text.

#include <string>

#include "jackal_aic/identification/plant_identification.hpp"

namespace jackal_aic {

/// Remarks on an effective track that is below what a robot can have. @param least distance of the wheels [m].
void remarkOnTrack(double least, Identification& result);

/// Table of the estimates with their 95 % confidence intervals, the residual and the remarks.
std::string identificationTable(const Identification& result);

/// Where a plant model comes from.
struct RecordingSource {
  std::string recording;  ///< file
  std::string date;       ///< at which it began, e.g. 2022-05-17 14:03 UTC; left out if empty
  std::string robot;      ///< which one it is, in the user's words; left out if empty
};

/// The estimates as a YAML file of the prefix `plant_model`; robot, date, recording, R^2 and remarks stand in it.
/// @throws IdentificationError if dead time, lag or gain are unknown.
std::string plantModelYaml(const Identification& result, const RecordingSource& source);

/// Columns time, command_left, command_right, measured_left, measured_right, fitted_left, fitted_right (s, rad/s), one
/// row per wheel sample; time starts at zero.
std::string identificationCsv(const DriveRecording& recording, const Identification& result);

}  // namespace jackal_aic
