#include "jackal_aic/config/urdf_geometry.hpp"

#include <fmt/format.h>

#include <cmath>

#include "jackal_aic/config/text.hpp"
#include "urdf_document.hpp"

namespace jackal_aic {
namespace {

/// Larger differences between wheels [m] are a modelling error, not rounding in the file.
constexpr double kTolerance = 1e-6;

void checkRadii(const std::string& joint, double radius, double first) {
  if (std::abs(radius - first) <= kTolerance) return;
  throw ParameterError(
      fmt::format("URDF: wheel of joint {} has radius {:g} m: must be equal to the first wheel's {:g} m", quoted(joint),
                  radius, first));
}

/// Pose of the root link in the link called name; the identity if the URDF has none of that name.
Eigen::Isometry3d rootIn(const urdf::ModelInterface& model, const std::string& name) {
  const std::size_t begin = name.find_first_not_of('/');
  const urdf::LinkConstSharedPtr link = begin == std::string::npos ? nullptr : model.getLink(name.substr(begin));
  if (!link || !link->parent_joint) return Eigen::Isometry3d::Identity();
  return poseInRoot(model, *link->parent_joint).inverse();
}

/// Wheels of one side.
struct Side {
  double radius;  // m
  double y;       // of their joints along y of the base, mean [m]
};

Side readSide(const urdf::ModelInterface& model, const std::vector<std::string>& joints,
              const Eigen::Isometry3d& root_in_base) {
  Side side{0.0, 0.0};
  for (const std::string& name : joints) {
    const urdf::Joint& joint = requiredWheelJoint(model, name);
    const double radius = wheelRadius(model, joint);
    if (side.radius == 0.0) side.radius = radius;
    checkRadii(name, radius, side.radius);
    const Eigen::Isometry3d pose = root_in_base * poseInRoot(model, joint);
    if ((pose.linear() * Eigen::Vector3d(joint.axis.x, joint.axis.y, joint.axis.z)).y() < -kTolerance) {
      throw ParameterError("URDF: axis of wheel joint " + quoted(name) +
                           " points to the right: must point to the left, or its speed is negative when the robot "
                           "drives forward; turn the axis, or the joint, round");
    }
    side.y += pose.translation().y() / static_cast<double>(joints.size());
  }
  return side;
}

}  // namespace

UrdfGeometry readUrdfGeometry(const std::string& urdf_xml, const std::vector<std::string>& left_joints,
                              const std::vector<std::string>& right_joints, const std::string& base_frame) {
  const urdf::ModelInterfaceSharedPtr model = parseUrdf(urdf_xml);
  const Eigen::Isometry3d root_in_base = rootIn(*model, base_frame);
  const Side left = readSide(*model, left_joints, root_in_base), right = readSide(*model, right_joints, root_in_base);
  if (left.radius <= 0.0 || right.radius <= 0.0) throw ParameterError("URDF: no wheel joint of a side is named");
  checkRadii(right_joints.front(), right.radius, left.radius);
  const double track = left.y - right.y;
  if (!(track > kTolerance)) {
    throw ParameterError(fmt::format(
        "URDF: left wheel joints at y = {:g} m, right ones at y = {:g} m: the left ones must lie further left", left.y,
        right.y));
  }
  return {left.radius, track};
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
