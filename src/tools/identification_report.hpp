#pragma once

/// @file
/// What identify prints and writes, as text.

#include <string>

#include "jackal_aic/identification/plant_identification.hpp"

namespace jackal_aic {

/// Table of the estimates with their 95 % confidence intervals, the residual and the remarks.
std::string identificationTable(const Identification& result);

/// The estimates as a YAML file of the prefix `plant_model`. @param source named in its comment; @param robot which one
/// it is, in the user's words, left out if empty.
/// @throws IdentificationError if dead time, lag or gain are unknown.
std::string plantModelYaml(const Identification& result, const std::string& source, const std::string& robot = "");

/// Columns time, command_left, command_right, measured_left, measured_right, fitted_left, fitted_right (s, rad/s), one
/// row per wheel sample; time starts at zero.
std::string identificationCsv(const DriveRecording& recording, const Identification& result);

}  // namespace jackal_aic
