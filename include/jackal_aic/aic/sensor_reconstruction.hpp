#pragma once

/// @file
/// Reconstruction of a lost channel. The three channels of the thesis' controller measure two motions, so that each of
/// them follows from the other two by eq. 3-2:
///
///     theta_dot = r alpha (omega_R - omega_L) / b_hat
///
/// The thesis' action da/dt = -kappa_a K Pi_y eps_y needs all three. With precision zero for a lost wheel, that wheel's
/// action keeps only the yaw rate's share of K, (r alpha / b_hat)^2 = 3 % of its gain. The robot then swerves for
/// seconds after every change of the set point. A reconstructed channel keeps the loop's gain and, like precision zero,
/// adds no information.

#include <optional>

#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// The observation with every channel valid: an invalid yaw rate or wheel speed is computed from the other two, invalid
/// accelerations are zero. Empty if two or more of the three are invalid.
std::optional<Observation> reconstructed(const Observation& observation, const SkidSteerKinematics& kinematics);

}  // namespace jackal_aic
