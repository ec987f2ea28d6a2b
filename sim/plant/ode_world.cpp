#include "ode_world.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <atomic>
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

/// How somebody lifts the robot: upwards, to this height, turning it.
constexpr double kLiftSpeed = 0.3;   // m/s
constexpr double kLiftHeight = 0.3;  // m
constexpr double kLiftTurn = 0.8;    // rad/s

/// A contact point slower than this sticks [m/s].
constexpr double kStickSpeed = 1e-4;

/// Bounds of a sliding contact of a wheel that touches two surfaces, by Coulomb's magnitude, which its viscous friction
/// has. Of two such contacts the forces along the axle are nearly the same unknown; with both at their bounds as a rule
/// the solver would find no way from one to the other ("LCP internal error") and leave out what comes after them.
constexpr double kOneOfTwo = 1.5;

/// A force below this share of its bound is far from it: it is solved for without the bound, and with it if it goes
/// beyond.
constexpr double kFarFromBound = 0.95;

/// Steps with all bounds after one that was not kept: wheels that slide and stick by turns miss them again and again.
constexpr int kStepsWithBounds = 30;

/// By which a force at its bound may seem to exceed it.
constexpr double kRounding = 1e-6;

/// What of a normal force on tilted ground is rounding [N]: its share of the friction would break the solver.
constexpr double kSlightestForce = 1e-9;

std::atomic<long> unsolved_steps{0};

/// ODE would print each of its messages; what it has to say is that it left forces of a step out.
void countUnsolved(int /*number*/, const char* /*format*/, std::va_list /*values*/) {
  if (unsolved_steps++ == 0)
    std::fputs("simulated robot: contact forces of a step were not found (told once)\n", stderr);
}

/// ODE is initialised once per process and never closed: worlds may outlive any other static object.
void initialiseOde() {
  static std::once_flag once;
  std::call_once(once, [] {
    dInitODE2(0);
    dSetMessageHandler(countUnsolved);
  });
  static thread_local const bool allocated = dAllocateODEDataForThread(dAllocateMaskAll) != 0;
  static_cast<void>(allocated);
}

dThreadingImplementationID createThreading() {
  initialiseOde();
  return dThreadingAllocateSelfThreadedImplementation();
}

Eigen::Vector3d vectorOf(const dReal* v) { return {v[0], v[1], v[2]}; }

/// Motion of a body, to be given back to it.
struct BodyState {
  std::array<dReal, 3> position, velocity, angular_velocity;
  std::array<dReal, 4> orientation;
};

BodyState stateOf(dBodyID body) {
  BodyState state;
  std::copy_n(dBodyGetPosition(body), 3, state.position.begin());
  std::copy_n(dBodyGetLinearVel(body), 3, state.velocity.begin());
  std::copy_n(dBodyGetAngularVel(body), 3, state.angular_velocity.begin());
  std::copy_n(dBodyGetQuaternion(body), 4, state.orientation.begin());
  return state;
}

void restore(dBodyID body, const BodyState& state) {
  dBodySetPosition(body, state.position[0], state.position[1], state.position[2]);
  dBodySetQuaternion(body, state.orientation.data());
  dBodySetLinearVel(body, state.velocity[0], state.velocity[1], state.velocity[2]);
  dBodySetAngularVel(body, state.angular_velocity[0], state.angular_velocity[1], state.angular_velocity[2]);
}

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

OdeWorld::OdeWorld(const RobotModel& model, const WorldParameters& parameters)
    : gravity_(kGravity * Eigen::Vector3d(-std::sin(parameters.slope), 0.0, -std::cos(parameters.slope))),
      terrain_(parameters.terrain),
      friction_(parameters.friction),
      torque_limit_(parameters.torque_limit),
      stiffness_(parameters.stiffness),
      fixed_chassis_(parameters.fixed_chassis),
      threading_(createThreading()),
      world_(dWorldCreate()),
      contact_group_(dJointGroupCreate(0)) {
  dWorldSetStepThreadingImplementation(world_.get(), dThreadingImplementationGetFunctions(threading_.get()),
                                       threading_.get());
  dWorldSetGravity(world_.get(), gravity_.x(), gravity_.y(), gravity_.z());
  createChassis(model);
  for (std::size_t i = 0; i < wheels_.size(); ++i) createWheel(model, i);
  setInEquilibrium(model);
}

long OdeWorld::unsolvedSteps() { return unsolved_steps; }

void OdeWorld::createChassis(const RobotModel& model) {
  chassis_ = createBody(world_.get(), model.chassis);
  if (fixed_chassis_) dBodySetKinematic(chassis_);
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

void OdeWorld::setWheelReference(std::size_t wheel, double speed) {
  dJointSetHingeParam(hinges_[wheel], dParamVel, speed);
}

void OdeWorld::lift(bool lifted) {
  if (fixed_chassis_ || lifted == lifted_) return;
  if (!carried_) height_on_ground_ = dBodyGetPosition(chassis_)[2];
  lifted_ = lifted;
  carried_ = true;
  dBodySetKinematic(chassis_);
}

/// The one who carries gives the chassis its motion; once it is down, it is on its own.
void OdeWorld::carry() {
  const double height = dBodyGetPosition(chassis_)[2] - height_on_ground_;
  if (!lifted_ && height <= 0.0) {
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

/// The solver takes all unbounded forces in one factorisation and every bounded one in a step of its own. Without a
/// bound that it keeps, a solution is the same, so that bounds that are far are left out until one is not
/// kept.
void OdeWorld::step(double step) {
  initialiseOde();
  if (carried_) carry();
  const std::array<dBodyID, 5> bodies{chassis_, wheels_[0], wheels_[1], wheels_[2], wheels_[3]};
  std::array<BodyState, 5> before;
  std::transform(bodies.begin(), bodies.end(), before.begin(), stateOf);
  const bool far = bounded_steps_ == 0;
  if (!far) --bounded_steps_;
  if (!solve(step, far ? kFarFromBound : 0.0) && far) {
    bounded_steps_ = kStepsWithBounds;
    for (std::size_t i = 0; i < bodies.size(); ++i) restore(bodies[i], before[i]);
    solve(step, 0.0);
  }
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    updateContact(i, contacts_[i]);
    updateContact(i, kerb_contacts_[i]);
  }
  acceleration_ = (vectorOf(dBodyGetLinearVel(chassis_)) - vectorOf(before[0].velocity.data())) / step;
  angular_acceleration_ = (vectorOf(dBodyGetAngularVel(chassis_)) - vectorOf(before[0].angular_velocity.data())) / step;
}

bool OdeWorld::solve(double step, double far) {
  if (push_torque_ != 0.0) dBodyAddRelTorque(chassis_, 0.0, 0.0, push_torque_);
  if (!push_force_.isZero(0.0)) dBodyAddRelForce(chassis_, push_force_.x(), push_force_.y(), push_force_.z());
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    const bool bounded = !(std::abs(wheelTorque(i)) < far * torque_limit_);
    dJointSetHingeParam(hinges_[i], dParamFMax, bounded ? torque_limit_ : dInfinity);
    if (!fixed_chassis_) createContacts(i, step, far);
  }
  dWorldStep(world_.get(), step);
  dJointGroupEmpty(contact_group_.get());
  bool kept = true;
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    kept = kept && std::abs(wheelTorque(i)) <= (1.0 + kRounding) * torque_limit_ && keepsBounds(contacts_[i]) &&
           keepsBounds(kerb_contacts_[i]);
  }
  return kept;
}

bool OdeWorld::keepsBounds(const Contact& contact) {
  if (!contact.touching) return true;
  const Eigen::Vector3d force = vectorOf(contact.feedback.f1);
  const double largest = std::max(std::abs(force.dot(contact.rolling)), std::abs(force.dot(contact.lateral())));
  return largest <= (1.0 + kRounding) * contact.limit;
}

/// ODE's friction is a box, by dContactApprox1 scaled with the normal force that would act without friction; here its
/// limit is mu N with the normal force N of the last step, in which the tyres' spring makes N continuous. While the
/// contact point slides at speed s, viscous friction of coefficient mu N / s, taken from the last step, has the Coulomb
/// magnitude mu N and opposes the slip in every direction; the solver applies it implicitly, so that it does not
/// chatter. While the point sticks, friction is a rigid constraint within the pyramid.
void OdeWorld::createContact(std::size_t index, Contact& last, const TouchPoint& touch, double step, double far,
                             bool one_of_two) {
  const Eigen::Vector3d force = vectorOf(last.feedback.f1);
  const double rolling_force = force.dot(last.rolling), lateral_force = force.dot(last.lateral());
  last.touching = touch.depth >= 0.0;
  if (!last.touching) return;

  dContact contact{};
  dReal axle[4];
  dJointGetHingeAxis(hinges_[index], axle);
  last.normal = touch.normal;
  last.friction = friction_ * terrain_.frictionShare(touch.point.x(), touch.point.y());
  last.rolling = vectorOf(axle).cross(touch.normal).normalized();
  const double spring = step * kContactStiffness;
  contact.surface.mode = dContactFDir1 | dContactMu2 | dContactSoftERP | dContactSoftCFM;
  contact.surface.soft_erp = spring / (spring + kContactDamping);
  contact.surface.soft_cfm = 1.0 / (spring + kContactDamping);
  const double coulomb = last.friction * last.normal_force;
  const bool slides = !last.sticking && coulomb > 0.0;
  const double limit = last.limit = slides && one_of_two ? kOneOfTwo * coulomb : coulomb;
  contact.surface.mu = std::abs(rolling_force) < far * limit ? dInfinity : limit;
  contact.surface.mu2 = std::abs(lateral_force) < far * limit ? dInfinity : limit;
  if (slides) {
    contact.surface.mode |= dContactSlip1 | dContactSlip2;
    contact.surface.slip1 = contact.surface.slip2 = std::max(last.slip_speed, kStickSpeed) / coulomb;
  }
  std::copy_n(last.rolling.data(), 3, contact.fdir1);
  std::copy_n(touch.point.data(), 3, contact.geom.pos);
  std::copy_n(touch.normal.data(), 3, contact.geom.normal);
  contact.geom.depth = touch.depth;
  dJointID joint = dJointCreateContact(world_.get(), contact_group_.get(), &contact);
  dJointAttach(joint, wheels_[index], nullptr);
  dJointSetFeedback(joint, &last.feedback);
}

void OdeWorld::createContacts(std::size_t index, double step, double far) {
  const Eigen::Vector3d hub =
      vectorOf(dBodyGetPosition(wheels_[index])) + orientationOf(wheels_[index]) * hub_in_wheel_[index];
  const double radius = radius_[index];
  const Surface ground = terrain_.surface(hub.x(), hub.y());
  const double depth = radius - (hub.z() - ground.height) * ground.normal.z();
  const auto kerb = terrain_.kerb(hub, radius);
  const bool two = kerb.has_value();
  createContact(index, contacts_[index], {hub - radius * ground.normal, ground.normal, depth}, step, far, two);
  kerb_contacts_[index].touching = false;
  if (kerb) createContact(index, kerb_contacts_[index], *kerb, step, far, two);
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

double OdeWorld::wheelSpeed(std::size_t wheel) const { return dJointGetHingeAngleRate(hinges_[wheel]); }

double OdeWorld::wheelTorque(std::size_t wheel) const {
  const dJointFeedback& feedback = hinge_feedback_[wheel];
  dReal axle[4];
  dJointGetHingeAxis(hinges_[wheel], axle);
  const Eigen::Vector3d hub = orientationOf(wheels_[wheel]) * hub_in_wheel_[wheel];
  // The feedback torque is about the wheel's centre of mass; the motor acts about the axle.
  return vectorOf(axle).dot(vectorOf(feedback.t1) - hub.cross(vectorOf(feedback.f1)));
}

}  // namespace jackal_aic::sim
