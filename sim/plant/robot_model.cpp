#include "robot_model.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/urdf_geometry.hpp"
#include "jackal_aic/model/geometry.hpp"
#include "jackal_plant.hpp"
#include "urdf_document.hpp"

namespace jackal_aic::sim {
namespace {

constexpr const char* kBaseLink = "base_link";
constexpr const char* kImuLink = "imu_link";

bool isWheelJoint(const std::string& name) {
  return std::find(kWheelJoints.begin(), kWheelJoints.end(), name) != kWheelJoints.end();
}

/// Mass properties of one link whose frame has the given pose; zero mass without an inertial element.
RigidBody bodyOf(const urdf::Link& link, const Eigen::Isometry3d& pose) {
  if (!link.inertial) return {};
  const urdf::Inertial& source = *link.inertial;
  const Eigen::Isometry3d frame = pose * toEigen(source.origin);
  Eigen::Matrix3d inertia;
  inertia << source.ixx, source.ixy, source.ixz, source.ixy, source.iyy, source.iyz, source.ixz, source.iyz, source.izz;
  return {source.mass, frame.translation(), frame.linear() * inertia * frame.linear().transpose()};
}

/// Lumps a link with its subtree, except the wheels.
RigidBody lump(const urdf::Link& link, const Eigen::Isometry3d& pose) {
  RigidBody body = bodyOf(link, pose);
  for (const auto& joint : link.child_joints) {
    if (isWheelJoint(joint->name)) continue;
    const auto child = std::find_if(link.child_links.begin(), link.child_links.end(),
                                    [&](const auto& candidate) { return candidate->name == joint->child_link_name; });
    body = body + lump(**child, pose * toEigen(joint->parent_to_joint_origin_transform));
  }
  return body;
}

/// Requires a body that the rigid-body solver can move; the bounds are beyond any wheeled robot.
void checkPhysical(const RigidBody& body, const std::string& name) {
  const Eigen::Vector3d principal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(body.inertia).eigenvalues();
  const double least = principal.minCoeff(), most = principal.maxCoeff();
  if (body.mass >= 1e-3 && body.mass <= 1e4 && body.inertia.allFinite() && least >= 1e-9 && most <= 1e5 &&
      body.centre.norm() <= 100.0) {
    return;
  }
  throw ParameterError(fmt::format(
      "URDF: {}: mass {:g} kg, principal inertia {:g} to {:g} kg m^2, centre of mass {:g} m away: must be in "
      "[0.001, 10000] kg, [1e-09, 100000] kg m^2 and within 100 m",
      name, body.mass, least, most, body.centre.norm()));
}

/// Pose of a link of the chassis in the root link.
Eigen::Isometry3d chassisLinkPose(const urdf::ModelInterface& model, const std::string& name) {
  const urdf::LinkConstSharedPtr link = model.getLink(name);
  if (!link) throw ParameterError("URDF: no link " + quoted(name));
  for (urdf::JointConstSharedPtr j = link->parent_joint; j; j = model.getLink(j->parent_link_name)->parent_joint) {
    if (isWheelJoint(j->name))
      throw ParameterError("URDF: link " + quoted(name) + " hangs on the wheel joint " + quoted(j->name));
  }
  return link->parent_joint ? poseInRoot(model, *link->parent_joint) : Eigen::Isometry3d::Identity();
}

WheelModel wheelOf(const urdf::ModelInterface& model, const std::string& name, const Eigen::Isometry3d& root_in_base) {
  const urdf::Joint& joint = requiredWheelJoint(model, name);
  const Eigen::Isometry3d pose = root_in_base * poseInRoot(model, joint);
  const Eigen::Vector3d axis = pose.linear() * Eigen::Vector3d(joint.axis.x, joint.axis.y, joint.axis.z);
  if (!axis.isApprox(Eigen::Vector3d::UnitY(), 1e-6)) {
    throw ParameterError("URDF: joint " + quoted(name) + " must turn about +y of " + kBaseLink +
                         " (positive is forward)");
  }
  const urdf::LinkConstSharedPtr link = model.getLink(joint.child_link_name);
  WheelModel wheel{lump(*link, pose), pose.translation(), wheelRadius(model, joint)};
  checkPhysical(wheel.body, "wheel " + quoted(link->name));
  return wheel;
}

/// Checks the controller's assumptions on a URDF: equal radii in range, left wheels on the left.
void checkGeometry(const std::string& urdf_xml) {
  const UrdfGeometry wheels = readUrdfGeometry(urdf_xml, {kWheelJoints[kFrontLeft], kWheelJoints[kRearLeft]},
                                               {kWheelJoints[kFrontRight], kWheelJoints[kRearRight]}, kBaseLink);
  GeometryParameters geometry;
  geometry.wheel_radius = wheels.wheel_radius;
  try {
    requireInRange(geometry, "");
  } catch (const ParameterError& error) {
    throw ParameterError(std::string("URDF: ") + error.what());
  }
}

}  // namespace

RigidBody RigidBody::operator+(const RigidBody& other) const {
  if (other.mass == 0.0) return *this;
  if (mass == 0.0) return other;
  RigidBody sum;
  sum.mass = mass + other.mass;
  sum.centre = (mass * centre + other.mass * other.centre) / sum.mass;
  sum.inertia = inertia + other.inertia;
  for (const RigidBody* part : {this, &other}) {
    const Eigen::Vector3d arm = part->centre - sum.centre;
    sum.inertia += part->mass * (arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose());
  }
  return sum;
}

RobotModel readRobotModel(const std::string& urdf_xml) {
  const urdf::ModelInterfaceSharedPtr parsed = parseUrdf(urdf_xml);
  const urdf::ModelInterface& model = *parsed;
  const Eigen::Isometry3d root_in_base = chassisLinkPose(model, kBaseLink).inverse();
  RobotModel robot;
  robot.imu = root_in_base * chassisLinkPose(model, kImuLink);
  for (std::size_t i = 0; i < kWheelJoints.size(); ++i) {
    robot.wheels[i] = wheelOf(model, kWheelJoints[i], root_in_base);
  }
  robot.chassis = lump(*model.getRoot(), root_in_base);
  checkPhysical(robot.chassis, "the chassis");
  checkGeometry(urdf_xml);
  return robot;
}

}  // namespace jackal_aic::sim
