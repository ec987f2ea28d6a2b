#include "jackal_aic/config/urdf_geometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "urdf_document.hpp"

namespace jackal_aic {
namespace {

/// Larger differences between wheels [m] are a modelling error, not rounding in the file.
constexpr double kTolerance = 1e-6;

/// An axle whose axis has less than this of the direction to the left turns backwards.
constexpr double kBackwards = -0.5;

/// Pose of the root link in the link called name; the identity if the URDF has none of that name.
Eigen::Isometry3d rootIn(const urdf::ModelInterface& model, const std::string& name) {
  const std::size_t begin = name.find_first_not_of('/');
  const urdf::LinkConstSharedPtr link = begin == std::string::npos ? nullptr : model.getLink(name.substr(begin));
  if (!link || !link->parent_joint) return Eigen::Isometry3d::Identity();
  return poseInRoot(model, *link->parent_joint).inverse();
}

/// Collects the wheels of one side: checks each radius against the first wheel's, returns the joints' common y.
class WheelCollector {
 public:
  WheelCollector(const UrdfDocument& document, const std::string& base_frame)
      : document_(document), root_in_base_(rootIn(*document.model, base_frame)) {}

  double lateralPosition(const std::string& side, const std::vector<std::string>& joints) {
    if (joints.empty()) throw ParameterError("URDF: no " + side + " wheel joint is named");
    double sum = 0.0;
    for (const std::string& name : joints) {
      const urdf::Joint& joint = requiredWheelJoint(*document_.model, name);
      checkRadius(name, wheelRadius(document_, joint));
      const Eigen::Isometry3d pose = root_in_base_ * poseInRoot(*document_.model, joint);
      checkAxis(name, pose.linear() * Eigen::Vector3d(joint.axis.x, joint.axis.y, joint.axis.z));
      sum += pose.translation().y();
    }
    return sum / static_cast<double>(joints.size());
  }

  double radius() const { return radius_; }

 private:
  void checkRadius(const std::string& joint, double radius) {
    if (radius_ == 0.0) radius_ = radius;
    if (std::abs(radius - radius_) > kTolerance) {
      throw ParameterError(
          fmt::format("URDF: wheel of joint '{}' has radius {:g} m: must be equal to the first wheel's {:g} m", joint,
                      radius, radius_));
    }
  }

  static void checkAxis(const std::string& joint, const Eigen::Vector3d& axis) {
    if (axis.y() >= kBackwards) return;
    throw ParameterError(fmt::format(
        "URDF: axis of wheel joint '{}' points to the right: must point to the left, or its speed is negative when the "
        "robot drives forward; turn the axis, or the joint, round",
        joint));
  }

  const UrdfDocument& document_;
  Eigen::Isometry3d root_in_base_;
  double radius_ = 0.0;
};

}  // namespace

UrdfGeometry readUrdfGeometry(const std::string& urdf_xml, const std::vector<std::string>& left_joints,
                              const std::vector<std::string>& right_joints, const std::string& base_frame) {
  const UrdfDocument document = parseUrdf(urdf_xml);
  WheelCollector wheels(document, base_frame);
  const double left = wheels.lateralPosition("left", left_joints);
  const double right = wheels.lateralPosition("right", right_joints);
  const double track = left - right;
  if (!(track > kTolerance) || !std::isfinite(track)) {
    throw ParameterError(fmt::format(
        "URDF: left wheel joints at y = {:g} m, right ones at y = {:g} m: the left ones must lie further left", left,
        right));
  }
  return {wheels.radius(), track};
}

double readWheelSeparation(const std::string& urdf_xml, const std::string& left_joint, const std::string& right_joint) {
  const urdf::ModelInterfaceSharedPtr model = parseUrdf(urdf_xml).model;
  const auto origin = [&](const std::string& joint) {
    return toEigen(requiredWheelJoint(*model, joint).parent_to_joint_origin_transform).translation().eval();
  };
  return (origin(left_joint) - origin(right_joint)).norm();
}

double readWheelRadius(const std::string& urdf_xml, const std::string& joint) {
  const UrdfDocument document = parseUrdf(urdf_xml);
  return wheelRadius(document, requiredWheelJoint(*document.model, joint));
}

}  // namespace jackal_aic
