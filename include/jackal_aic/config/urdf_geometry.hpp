#pragma once

/// @file
/// Wheel radius and track of a robot from its URDF (robot_description).

#include <string>
#include <vector>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic {

/// Wheel geometry read from a URDF.
struct UrdfGeometry {
  double wheel_radius;  ///< radius of the wheels' collision (or visual) cylinder or sphere [m]
  double track;         ///< distance between the left and the right wheel joints along y of the root link [m]
};

/// Reads the wheel geometry from a URDF.
/// @param urdf_xml text of the URDF; @param left_joints, right_joints names of the wheel joints of each side.
/// @throws ParameterError (one line) if the URDF does not parse, lacks a joint, a wheel has no cylinder or sphere
/// geometry,
///         the radii differ, or the left wheels are not left of the right ones.
UrdfGeometry readUrdfGeometry(const std::string& urdf_xml, const std::vector<std::string>& left_joints,
                              const std::vector<std::string>& right_joints);

}  // namespace jackal_aic
