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
  double track;         ///< distance between the left and the right wheel joints along y of the base frame [m]
};

/// Reads the wheel geometry from a URDF.
/// @param urdf_xml text of the URDF; @param left_joints, right_joints names of the wheel joints of each side;
/// @param base_frame link whose y axis points to the left; the root link if the URDF does not have it.
/// @throws ParameterError (one line) if the URDF does not parse or lacks a joint, or a wheel has no cylinder or sphere.
/// Also if the radii differ, an axis points to the right, or the left wheels are not left of the right ones.
UrdfGeometry readUrdfGeometry(const std::string& urdf_xml, const std::vector<std::string>& left_joints,
                              const std::vector<std::string>& right_joints, const std::string& base_frame = "");

/// Distance between the origins of two joints in their parent frames [m], along any axis, as ros_control's differential
/// drive takes the separation of the wheels. @throws ParameterError as above if a joint is missing.
double readWheelSeparation(const std::string& urdf_xml, const std::string& left_joint, const std::string& right_joint);

/// Radius of a wheel by its joint [m]. @throws ParameterError as above.
double readWheelRadius(const std::string& urdf_xml, const std::string& joint);

}  // namespace jackal_aic
