#pragma once

/// @file
/// Times of the node by the clock of the machine, which also runs while a simulated one stands.

namespace jackal_aic {

/// Between checks of the clock, the ROS graph and the robot's description [s]. What happens within it counts as at the
/// same time.
inline constexpr double kCheckPeriod = 0.5;

/// In which the nodes of a robot find one another at the start [s].
inline constexpr double kConnectionTime = 2.0;

}  // namespace jackal_aic
