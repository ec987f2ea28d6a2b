#pragma once

/// @file
/// Shared by the readers of URDF files: parsing, poses and wheels as Eigen types.

#include <urdf_model/model.h>
#include <urdf_world/types.h>

#include <Eigen/Geometry>
#include <string>

namespace jackal_aic {

/// Parses a URDF; the parser prints what it does not understand.
/// @throws ParameterError if the text is not a URDF.
urdf::ModelInterfaceSharedPtr parseUrdf(const std::string& urdf_xml);

/// The joint of a wheel called name. @throws ParameterError, naming it, if the URDF has none, or if it does not turn.
const urdf::Joint& requiredWheelJoint(const urdf::ModelInterface& model, const std::string& name);

/// A URDF pose as a transform from the child frame to the parent frame.
Eigen::Isometry3d toEigen(const urdf::Pose& pose);

/// Pose of a joint's frame in the root link, with every joint at its zero position.
Eigen::Isometry3d poseInRoot(const urdf::ModelInterface& model, const urdf::Joint& joint);

/// Radius of the cylinder or sphere that is the collision (else the visual) geometry of a wheel's child link [m].
/// @throws ParameterError without such a geometry, or if its radius is not positive and finite.
double wheelRadius(const urdf::ModelInterface& model, const urdf::Joint& joint);

}  // namespace jackal_aic
