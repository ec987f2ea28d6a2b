#pragma once

/// @file
/// What a belief gains that knows, or learns, that the noise of its sensors has a memory.

#include <string>

#include "package_files.hpp"

namespace jackal_aic::sim {

/// Drives the robot on box, ground and the plant `real` (driving cycles of two minutes by kColouredNoiseSeeds seeds,
/// segments of 3 to 6 s), adds noise of several colours and sizes to what its encoders and its gyro measured, and lets
/// every estimator believe the motion from that and from the commands. Writes coloured_noise.csv into a directory: per
/// plant, noise and estimator the errors over the second minute, root mean squares, and what was learned of the left
/// encoder's and the gyro's noise. @param jobs threads; 0: one per core.
void writeColouredNoiseTable(const PackageFiles& files, const std::string& directory, unsigned jobs);

/// Drives on each plant.
inline constexpr std::size_t kColouredNoiseSeeds = 4;

}  // namespace jackal_aic::sim
