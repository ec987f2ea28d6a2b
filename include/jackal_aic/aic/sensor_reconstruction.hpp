#pragma once

/// @file
/// What a lost channel would have read. The three channels that the thesis' controller uses see two motions, so that
/// any one of them follows from the others by eq. 3-2:
///
///     theta_dot = r alpha (omega_R - omega_L) / b_hat
///
/// The thesis' action needs all three: with precision zero for a lost wheel, da/dt = -kappa_a K Pi_y eps_y leaves to
/// that wheel's action only the yaw rate's share of K, (r alpha / b_hat)^2 = 3 % of its gain, and the robot swerves for
/// seconds after every change of the set point. A reconstructed channel adds nothing to what the others say, which is
/// what precision zero is for, and keeps the loop's gain.

#include <optional>

#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// The observation with every channel counting: the yaw rate or a wheel that does not count is computed from the other
/// two, accelerations that do not count are zero. Empty if two or more of these three do not count.
std::optional<Observation> reconstructed(const Observation& observation, const SkidSteerKinematics& kinematics);

}  // namespace jackal_aic
