#include "jackal_aic/config/urdf_geometry.hpp"

#include <fmt/format.h>

#include <cmath>

#include "jackal_aic/config/text.hpp"
#include "jackal_aic/model/thresholds.hpp"
#include "urdf_document.hpp"

namespace jackal_aic {
namespace {

/// Pose of the root link in the link called name; the identity if the URDF has none of that name.
Eigen::Isometry3d rootIn(const urdf::ModelInterface& model, const std::string& name) {
  const std::size_t begin = name.find_first_not_of('/');
  const urdf::LinkConstSharedPtr link = begin == std::string::npos ? nullptr : model.getLink(name.substr(begin));
  if (!link || !link->parent_joint) return Eigen::Isometry3d::Identity();
  return poseInRoot(model, *link->parent_joint).inverse();
}

/// Mean of the y of one side's wheel joints in the base [m]. @param radius of the wheels so far [m]; 0 before the
/// first.
double readSide(const urdf::ModelInterface& model, const std::vector<std::string>& joints,
                const Eigen::Isometry3d& root_in_base, double& radius) {
  if (joints.empty()) throw ParameterError("URDF: no wheel joint of a side is named");
  double y = 0.0;
  for (const std::string& name : joints) {
    const urdf::Joint& joint = requiredWheelJoint(model, name);
    const double found = wheelRadius(model, joint);
    if (radius == 0.0) radius = found;
    if (std::abs(found - radius) > thresholds::kRounding) {
      throw ParameterError(
          fmt::format("URDF: wheel of joint {} has radius {:g} m: must be equal to the first wheel's {:g} m",
                      quoted(name), found, radius));
    }
    const Eigen::Isometry3d pose = root_in_base * poseInRoot(model, joint);
    if ((pose.linear() * Eigen::Vector3d(joint.axis.x, joint.axis.y, joint.axis.z)).y() < -thresholds::kRounding) {
      throw ParameterError("URDF: axis of wheel joint " + quoted(name) +
                           " points to the right: must point to the left, or its speed is negative when the robot "
                           "drives forward; turn the axis, or the joint, round");
    }
    y += pose.translation().y() / static_cast<double>(joints.size());
  }
  return y;
}

}  // namespace

UrdfGeometry readUrdfGeometry(const std::string& urdf_xml, const std::vector<std::string>& left_joints,
                              const std::vector<std::string>& right_joints, const std::string& base_frame) {
  const urdf::ModelInterfaceSharedPtr model = parseUrdf(urdf_xml);
  const Eigen::Isometry3d root_in_base = rootIn(*model, base_frame);
  double radius = 0.0;
  const double left = readSide(*model, left_joints, root_in_base, radius);
  const double right = readSide(*model, right_joints, root_in_base, radius);
  if (left - right > thresholds::kRounding) return {radius, left - right};
  throw ParameterError(fmt::format(
      "URDF: left wheel joints at y = {:g} m, right ones at y = {:g} m: the left ones must lie further left", left,
      right));
}

double readWheelSeparation(const std::string& urdf_xml, const std::string& left_joint, const std::string& right_joint) {
  const urdf::ModelInterfaceSharedPtr model = parseUrdf(urdf_xml);
  const auto origin = [&](const std::string& joint) {
    return toEigen(requiredWheelJoint(*model, joint).parent_to_joint_origin_transform).translation().eval();
  };
  return (origin(left_joint) - origin(right_joint)).norm();
}

double readWheelRadius(const std::string& urdf_xml, const std::string& joint) {
  const urdf::ModelInterfaceSharedPtr model = parseUrdf(urdf_xml);
  return wheelRadius(*model, requiredWheelJoint(*model, joint));
}

}  // namespace jackal_aic
