#pragma once

/// @file
/// Odometry for any drive loop.

#include "jackal_aic/odometry/odometry.hpp"
#include "jackal_aic/safety/drive_loop.hpp"

namespace jackal_aic {

/// Odometry with the belief of a loop's controller, or with a separate estimator if that is biased (thesis) or missing.
/// The loop's controller has to outlive it. @param parameters of the loop.
Odometry makeOdometry(const DriveParameters& parameters, const DriveLoop& loop);

/// The last measurement of a loop: calibrated, without faulty and impossible channels.
Observation asCounted(Observation observation, const DriveLoop& loop);

}  // namespace jackal_aic
