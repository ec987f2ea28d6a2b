#pragma once

/// @file
/// Texts that identify prints and writes.

#include <string>

#include "jackal_aic/identification/plant_identification.hpp"

namespace jackal_aic {

/// Remarks on an impossibly small effective track. @param least distance of the wheels [m].
void remarkOnTrack(double least, Identification& result);

/// Table of the estimates with their 95 % confidence intervals, the residual and the remarks.
std::string identificationTable(const Identification& result);

/// Source of a plant model.
struct RecordingSource {
  std::string recording;  ///< file
  std::string date;       ///< start of the recording, e.g. 2022-05-17 14:03 UTC; left out if empty
  std::string robot;      ///< name of the robot by the user; left out if empty
};

/// The estimates as a YAML file of the prefix `plant_model`; robot, date, recording, R^2 and remarks stand in it.
/// @throws IdentificationError if dead time, lag or gain are unknown.
std::string plantModelYaml(const Identification& result, const RecordingSource& source);

/// Columns time, command_left, command_right, measured_left, measured_right, fitted_left, fitted_right (s, rad/s), one
/// row per wheel sample; time starts at zero.
std::string identificationCsv(const DriveRecording& recording, const Identification& result);

}  // namespace jackal_aic
