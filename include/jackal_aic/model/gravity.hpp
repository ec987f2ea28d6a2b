#pragma once

/// @file
/// Gravity in the readings of an accelerometer.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

namespace jackal_aic {

/// Acceleration of gravity [m/s^2].
inline constexpr double kGravity = 9.81;

/// The attitude as a unit quaternion. std::nullopt if a component is not finite or its squared norm differs from 1 by
/// more than 0.01, tf2's bound (a message without attitude has zeros), or if it is exactly (0, 0, 0, 1), which is a
/// default and no estimate.
std::optional<Eigen::Quaterniond> unitAttitude(const Eigen::Quaterniond& attitude);

/// Reading of an accelerometer at rest, R^T (0, 0, g), in its own frame [m/s^2].
/// @param attitude R, unit: from that frame into a level one with z up. Its yaw does not matter.
Eigen::Vector3d gravityReaction(const Eigen::Quaterniond& attitude);

}  // namespace jackal_aic
