#pragma once

/// @file
/// Odometry for any drive loop.

#include "jackal_aic/odometry/odometry.hpp"
#include "jackal_aic/safety/drive_loop.hpp"

namespace jackal_aic {

/// Odometry by the belief of a loop's controller, or by an estimator of its own where that is biased (thesis), or none.
/// The loop's controller has to outlive it. @param parameters of the loop.
Odometry makeOdometry(const DriveParameters& parameters, const DriveLoop& loop);

/// The last measurement of a loop as it counts for it: calibrated, without channels that are faulty or impossible.
Observation asCounted(Observation observation, const DriveLoop& loop);

}  // namespace jackal_aic
