#include "urdf_document.hpp"

#include <urdf_parser/urdf_parser.h>

#include <cmath>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/config/text.hpp"

namespace jackal_aic {
namespace {

double radiusOf(const urdf::GeometrySharedPtr& geometry) {
  if (const auto cylinder = std::dynamic_pointer_cast<urdf::Cylinder>(geometry)) return cylinder->radius;
  if (const auto sphere = std::dynamic_pointer_cast<urdf::Sphere>(geometry)) return sphere->radius;
  return 0.0;
}

}  // namespace

urdf::ModelInterfaceSharedPtr parseUrdf(const std::string& urdf_xml) {
  urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(urdf_xml);
  if (!model || !model->getRoot()) throw ParameterError("URDF: cannot be parsed, for the reason printed above");
  return model;
}

const urdf::Joint& requiredWheelJoint(const urdf::ModelInterface& model, const std::string& name) {
  const urdf::JointConstSharedPtr joint = model.getJoint(name);
  if (!joint) throw ParameterError("URDF: no joint " + quoted(name));
  if (joint->type == urdf::Joint::CONTINUOUS || joint->type == urdf::Joint::REVOLUTE) return *joint;
  throw ParameterError("URDF: wheel joint " + quoted(name) + " does not turn: its type must be continuous or revolute");
}

Eigen::Isometry3d toEigen(const urdf::Pose& pose) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.translation() << pose.position.x, pose.position.y, pose.position.z;
  const urdf::Rotation& q = pose.rotation;
  transform.linear() = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix();
  return transform;
}

Eigen::Isometry3d poseInRoot(const urdf::ModelInterface& model, const urdf::Joint& joint) {
  const Eigen::Isometry3d in_parent = toEigen(joint.parent_to_joint_origin_transform);
  const urdf::JointConstSharedPtr above = model.getLink(joint.parent_link_name)->parent_joint;
  return above ? poseInRoot(model, *above) * in_parent : in_parent;
}

double wheelRadius(const urdf::ModelInterface& model, const urdf::Joint& joint) {
  const urdf::LinkConstSharedPtr link = model.getLink(joint.child_link_name);
  double radius = link->collision ? radiusOf(link->collision->geometry) : 0.0;
  if (radius == 0.0 && link->visual) radius = radiusOf(link->visual->geometry);
  if (!(radius > 0.0) || !std::isfinite(radius)) {
    throw ParameterError("URDF: link " + quoted(link->name) + " has no cylinder or sphere with a positive radius");
  }
  return radius;
}

}  // namespace jackal_aic
