#include "ode_world.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <mutex>

#include "jackal_aic/model/gravity.hpp"
#include "jackal_plant.hpp"

namespace jackal_aic::sim {
namespace {

/// Tyre against ground along the normal: stiff enough that the robot does not visibly sink (0.2 mm), damped close to
/// critical.
constexpr double kContactStiffness = 2.0e5;  // N/m
constexpr double kContactDamping = 2.0e3;    // N s/m

/// That spring in a step, as ODE takes it.
constexpr double kStep = JackalPlant::kStep;
constexpr double kCorrection = kStep * kContactStiffness / (kStep * kContactStiffness + kContactDamping);
constexpr double kSoftness = 1.0 / (kStep * kContactStiffness + kContactDamping);

/// Motion of a lift: upwards to a height, with a turn.
constexpr double kLiftSpeed = 0.3;   // m/s
constexpr double kLiftHeight = 0.3;  // m
constexpr double kLiftTurn = 0.8;    // rad/s

/// Rounding error of a height above the ground [m], so that a lift has as many steps down as up.
constexpr double kSlightestHeight = 1e-9;

/// A contact point slower than this sticks [m/s].
constexpr double kStickSpeed = 1e-4;

/// Rounding of a normal force on tilted ground [N]; its share of the friction would break the solver.
constexpr double kSlightestForce = 1e-9;

thread_local bool left_out = false;  // true: ODE omitted forces of a step in this thread

/// Replaces ODE's printed messages, which report omitted forces of a step.
void noteLeftOut(int /*number*/, const char* /*format*/, std::va_list /*values*/) { left_out = true; }

void reportUnsolved() {
  static std::once_flag once;
  std::call_once(
      once, [] { std::fputs("simulated robot: contact forces of a step were not found (reported once)\n", stderr); });
}

/// ODE is initialised once per process and never closed: worlds may outlive any other static object.
void initialiseOde() {
  static std::once_flag once;
  std::call_once(once, [] {
    dInitODE2(0);
    dSetMessageHandler(noteLeftOut);
  });
  static thread_local const bool allocated = dAllocateODEDataForThread(dAllocateMaskAll) != 0;
  static_cast<void>(allocated);
}

dThreadingImplementationID createThreading() {
  initialiseOde();
  return dThreadingAllocateSelfThreadedImplementation();
}

Eigen::Vector3d vectorOf(const dReal* v) { return {v[0], v[1], v[2]}; }

/// A body's own matrix, in rows of four, which changes as it turns.
using Rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>, 0, Eigen::OuterStride<4>>;

Rotation rotationOf(dBodyID body) { return Rotation(dBodyGetRotation(body)); }

Eigen::Quaterniond orientationOf(dBodyID body) {
  const dReal* q = dBodyGetQuaternion(body);
  return {q[0], q[1], q[2], q[3]};
}

dBodyID createBody(dWorldID world, const RigidBody& source) {
  dBodyID body = dBodyCreate(world);
  dMass mass;
  const Eigen::Matrix3d& i = source.inertia;
  dMassSetParameters(&mass, source.mass, 0, 0, 0, i(0, 0), i(1, 1), i(2, 2), i(0, 1), i(0, 2), i(1, 2));
  dBodySetMass(body, &mass);
  dBodySetPosition(body, source.centre.x(), source.centre.y(), source.centre.z());
  return body;
}

/// Normal forces N = a + b x + c y of equal springs under the wheels, as (a, b, c).
Eigen::Vector3d normalForcePlane(const RobotModel& model, const Eigen::Vector3d& gravity) {
  RigidBody robot = model.chassis;
  for (const WheelModel& wheel : model.wheels) robot = robot + wheel.body;
  const Eigen::Vector3d force = robot.mass * gravity;
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  double ground = 0.0;
  for (const WheelModel& wheel : model.wheels) {
    const Eigen::Vector3d arm(1.0, wheel.hub.x(), wheel.hub.y());
    moments += arm * arm.transpose();
    ground += 0.25 * (wheel.hub.z() - wheel.radius);
  }
  // The line of gravity through the centre of mass meets the ground in this point.
  const double height = robot.centre.z() - ground;
  const Eigen::Vector3d foot = robot.centre - force * (height / force.z());
  return moments.ldlt().solve(-force.z() * Eigen::Vector3d(1.0, foot.x(), foot.y()));
}

}  // namespace

OdeWorld::OdeWorld(const RobotModel& model, const PlantParameters& parameters)
    : gravity_(kGravity * Eigen::Vector3d(-std::sin(parameters.slope * kRadiansPerDegree), 0.0,
                                          -std::cos(parameters.slope * kRadiansPerDegree))),
      terrain_(parameters),
      friction_(parameters.friction),
      torque_limit_(parameters.torque_limit),
      stiffness_(parameters.velocity_loop_stiffness),
      fixed_chassis_(parameters.support == Support::box),
      threading_(createThreading()),
      world_(dWorldCreate()),
      contact_group_(dJointGroupCreate(0)) {
  dWorldSetStepThreadingImplementation(world_.get(), dThreadingImplementationGetFunctions(threading_.get()),
                                       threading_.get());
  dWorldSetGravity(world_.get(), gravity_.x(), gravity_.y(), gravity_.z());
  chassis_ = createBody(world_.get(), model.chassis);
  if (fixed_chassis_) dBodySetKinematic(chassis_);
  for (std::size_t i = 0; i < wheels_.size(); ++i) createWheel(model, i);
  setInEquilibrium(model);
}

void OdeWorld::createWheel(const RobotModel& model, std::size_t index) {
  const WheelModel& wheel = model.wheels[index];
  radius_[index] = wheel.radius;
  hub_in_wheel_[index] = wheel.hub - wheel.body.centre;
  wheels_[index] = createBody(world_.get(), wheel.body);
  dJointID hinge = dJointCreateHinge(world_.get(), nullptr);
  dJointAttach(hinge, wheels_[index], chassis_);
  dJointSetHingeAnchor(hinge, wheel.hub.x(), wheel.hub.y(), wheel.hub.z());
  dJointSetHingeAxis(hinge, 0.0, 1.0, 0.0);
  // w + c tau = reference: a motor of constraint force mixing c is a proportional controller of gain 1/c.
  if (stiffness_ > 0.0) dJointSetHingeParam(hinge, dParamCFM, 1.0 / stiffness_);
  dJointSetHingeParam(hinge, dParamFMax, torque_limit_);
  dJointSetFeedback(hinge, &hinge_feedback_[index]);
  hinges_[index] = hinge;
}

void OdeWorld::setInEquilibrium(const RobotModel& model) {
  const Eigen::Vector3d forces = normalForcePlane(model, gravity_);
  const double pitch = forces(1) / kContactStiffness;
  double roll = -forces(2) / kContactStiffness;
  const WheelModel& left = model.wheels[kFrontLeft];
  const WheelModel& right = model.wheels[kFrontRight];
  if (left.radius != right.radius) roll += (left.radius - right.radius) / (left.hub.y() - right.hub.y());
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()));
  double height = -forces(0) / kContactStiffness;
  for (const WheelModel& wheel : model.wheels) height += 0.25 * (wheel.radius - wheel.hub.z());
  const auto place = [&](dBodyID body) {
    const Eigen::Vector3d position = tilt * vectorOf(dBodyGetPosition(body)) + height * Eigen::Vector3d::UnitZ();
    dBodySetPosition(body, position.x(), position.y(), position.z());
    const dQuaternion q = {tilt.w(), tilt.x(), tilt.y(), tilt.z()};
    dBodySetQuaternion(body, q);
  };
  place(chassis_);
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    place(wheels_[i]);
    const Eigen::Vector3d hub = model.wheels[i].hub;
    contacts_[i].normal_force = std::max(0.0, forces.dot(Eigen::Vector3d(1.0, hub.x(), hub.y())));
  }
}

void OdeWorld::lift(bool lifted) {
  if (fixed_chassis_ || lifted == lifted_) return;
  if (!carried_) height_on_ground_ = dBodyGetPosition(chassis_)[2];
  lifted_ = lifted;
  carried_ = true;
  dBodySetKinematic(chassis_);
}

/// A lift prescribes the motion of the chassis; on the ground it moves freely.
void OdeWorld::carry() {
  const double height = dBodyGetPosition(chassis_)[2] - height_on_ground_;
  if (!lifted_ && height <= kSlightestHeight) {
    carried_ = false;
    dBodySetDynamic(chassis_);
    dBodySetLinearVel(chassis_, 0.0, 0.0, 0.0);
    dBodySetAngularVel(chassis_, 0.0, 0.0, 0.0);
    return;
  }
  const double climb = lifted_ ? (height < kLiftHeight ? kLiftSpeed : 0.0) : -kLiftSpeed;
  dBodySetLinearVel(chassis_, 0.0, 0.0, climb);
  dBodySetAngularVel(chassis_, 0.0, 0.0, lifted_ ? kLiftTurn : 0.0);
}

void OdeWorld::step() {
  initialiseOde();
  if (carried_) carry();
  const Eigen::Vector3d velocity = vectorOf(dBodyGetLinearVel(chassis_));
  const Eigen::Vector3d angular_velocity = vectorOf(dBodyGetAngularVel(chassis_));
  for (std::size_t i = 0; i < wheels_.size() && !fixed_chassis_; ++i) touch(i);
  solve();
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    updateContact(i, contacts_[i]);
    updateContact(i, kerb_contacts_[i]);
    speed_[i] = dJointGetHingeAngleRate(hinges_[i]);
  }
  acceleration_ = (vectorOf(dBodyGetLinearVel(chassis_)) - velocity) / kStep;
  angular_acceleration_ = (vectorOf(dBodyGetAngularVel(chassis_)) - angular_velocity) / kStep;
}

/// Lets ODE move the bodies, and reads the forces.
void OdeWorld::solve() {
  dBodyAddRelForce(chassis_, push_force_.x(), push_force_.y(), push_force_.z());
  dBodyAddRelTorque(chassis_, 0.0, 0.0, push_torque_);
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    createContact(i, contacts_[i]);
    createContact(i, kerb_contacts_[i]);
  }
  left_out = false;
  dWorldStep(world_.get(), kStep);
  if (left_out) reportUnsolved();
  dJointGroupEmpty(contact_group_.get());
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    // The feedback torque is about the wheel's centre of mass; the motor acts about the axle.
    const Eigen::Vector3d hub = rotationOf(wheels_[i]) * hub_in_wheel_[i];
    dReal axle[4];
    dJointGetHingeAxis(hinges_[i], axle);
    const dJointFeedback& feedback = hinge_feedback_[i];
    torque_[i] = vectorOf(axle).dot(vectorOf(feedback.t1) - hub.cross(vectorOf(feedback.f1)));
  }
}

/// ODE's friction is a box, scaled by dContactApprox1 with the normal force without friction. Here its limit is mu N
/// with the normal force N of the last step; the tyres' spring makes N continuous. While the contact point slides at
/// speed s, viscous friction of the coefficient mu N / s of the last step has the Coulomb magnitude mu N and opposes
/// the slip in every direction. The solver applies it implicitly, without chatter, and without a bound: with two
/// contacts close together at their bounds, one of them a kerb's, ODE often finds no forces ("LCP internal error").
/// While the point sticks, friction is a rigid constraint within the pyramid.
void OdeWorld::touch(std::size_t index, Contact& contact, const TouchPoint& touch) const {
  contact.touching = touch.depth >= 0.0;
  if (!contact.touching) return;
  contact.point = touch.point;
  contact.depth = touch.depth;
  contact.normal = touch.normal;
  contact.friction = friction_ * terrain_.frictionShare(touch.point.x(), touch.point.y());
  contact.rolling = rotationOf(wheels_[index]).col(1).cross(touch.normal).normalized();
  const double limit = contact.friction * contact.normal_force;
  const bool slides = !contact.sticking && limit > 0.0;
  contact.slip = slides ? std::max(contact.slip_speed, kStickSpeed) / limit : 0.0;
  contact.limit = slides ? dInfinity : limit;
}

void OdeWorld::touch(std::size_t index) {
  const Eigen::Vector3d hub =
      vectorOf(dBodyGetPosition(wheels_[index])) + rotationOf(wheels_[index]) * hub_in_wheel_[index];
  const double radius = radius_[index];
  const Surface ground = terrain_.surface(hub.x(), hub.y());
  const double depth = radius - (hub.z() - ground.height) * ground.normal.z();
  touch(index, contacts_[index], {hub - radius * ground.normal, ground.normal, depth});
  const auto kerb = terrain_.kerb(hub, radius);
  kerb_contacts_[index].touching = false;
  if (kerb) touch(index, kerb_contacts_[index], *kerb);
}

void OdeWorld::createContact(std::size_t index, Contact& last) {
  if (!last.touching) return;
  dContact contact{};
  contact.surface.mode = dContactFDir1 | dContactSoftERP | dContactSoftCFM;
  contact.surface.soft_erp = kCorrection;
  contact.surface.soft_cfm = kSoftness;
  contact.surface.mu = last.limit;
  if (last.slip > 0.0) {
    contact.surface.mode |= dContactSlip1 | dContactSlip2;
    contact.surface.slip1 = contact.surface.slip2 = last.slip;
  }
  std::copy_n(last.rolling.data(), 3, contact.fdir1);
  std::copy_n(last.point.data(), 3, contact.geom.pos);
  std::copy_n(last.normal.data(), 3, contact.geom.normal);
  contact.geom.depth = last.depth;
  dJointID joint = dJointCreateContact(world_.get(), contact_group_.get(), &contact);
  dJointAttach(joint, wheels_[index], nullptr);
  dJointSetFeedback(joint, &last.feedback);
}

void OdeWorld::updateContact(std::size_t index, Contact& contact) {
  if (!contact.touching) {
    contact.normal_force = 0.0;
    contact.sticking = true;
    return;
  }
  const auto along = [&contact](const Eigen::Vector3d& v) {
    return Eigen::Vector3d(v - contact.normal * contact.normal.dot(v)).norm();
  };
  const Eigen::Vector3d force = vectorOf(contact.feedback.f1);
  const Eigen::Vector3d hub = orientationOf(wheels_[index]) * hub_in_wheel_[index];
  const Eigen::Vector3d arm = hub - radius_[index] * contact.normal;
  const Eigen::Vector3d slip =
      vectorOf(dBodyGetLinearVel(wheels_[index])) + vectorOf(dBodyGetAngularVel(wheels_[index])).cross(arm);
  const double normal_force = contact.normal.dot(force);
  contact.normal_force = normal_force > kSlightestForce ? normal_force : 0.0;
  contact.slip_speed = along(slip);
  contact.sticking = contact.slip_speed < kStickSpeed && along(force) <= contact.friction * contact.normal_force;
}

ChassisState OdeWorld::chassis() const {
  return {vectorOf(dBodyGetPosition(chassis_)),   orientationOf(chassis_), vectorOf(dBodyGetLinearVel(chassis_)),
          vectorOf(dBodyGetAngularVel(chassis_)), acceleration_,           angular_acceleration_};
}

}  // namespace jackal_aic::sim
