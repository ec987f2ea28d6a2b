#pragma once

/// @file
/// Thresholds and times that several parts of the core share, one value each.

namespace jackal_aic::thresholds {

// Motion.
inline constexpr double kRest = 0.2;    ///< a slower wheel stands: 2 cm/s of a Jackal, above an encoder's noise [rad/s]
inline constexpr double kMoving = 0.5;  ///< a faster wheel moves: its position changes with every sample [rad/s]
inline constexpr double kSlow = 0.05;   ///< kMoving at the circumference of a Jackal's wheel [m/s]
inline constexpr double kTurning = 0.1;  ///< a faster body turns [rad/s]
inline constexpr double kGrip = 3.0;     ///< wheels that accelerate more may slide, of their circumference [m/s^2]

// Times.
inline constexpr double kFollowing = 0.1;  ///< a body follows its wheels within it; samples within it err alike [s]
inline constexpr double kGap = 0.2;        ///< samples of a source that lie further apart have a gap between them [s]
inline constexpr double kPatience = 0.3;   ///< a finding counts that lasts longer; after it a motion has settled [s]
inline constexpr double kRounding = 1e-6;  ///< difference of equal times [s] or lengths [m]

// Forgetting: T of keptAfter() and average() (forgetting.hpp).
inline constexpr double kMotionMemory = 0.2;   ///< of the present motion [s]
inline constexpr double kNoiseMemory = 1.0;    ///< of the noise of a sensor [s]
inline constexpr double kSensorMemory = 10.0;  ///< of the offset of a sensor, and of the ground [s]

/// Standard deviations that chance does not reach.
inline constexpr double kSure = 3.0;

}  // namespace jackal_aic::thresholds
