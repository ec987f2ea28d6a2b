#pragma once

/// @file
/// The robot's rigid bodies, joints and wheel contacts in the Open Dynamics Engine.

#include <ode/ode.h>

#include <Eigen/Geometry>
#include <array>
#include <memory>

#include "robot_model.hpp"
#include "terrain.hpp"

namespace jackal_aic::sim {

/// Motion of the chassis' centre of mass; vectors in the ground frame.
struct ChassisState {
  Eigen::Vector3d position;              ///< [m]
  Eigen::Quaterniond orientation;        ///< base_link in the ground frame
  Eigen::Vector3d velocity;              ///< [m/s]
  Eigen::Vector3d angular_velocity;      ///< [rad/s]
  Eigen::Vector3d acceleration;          ///< mean over the last step [m/s^2]
  Eigen::Vector3d angular_acceleration;  ///< mean over the last step [rad/s^2]
};

/// Chassis and four wheels on hinges with velocity motors, on the ground.
///
/// Ground frame: x along the robot's initial heading, z normal to the ground under it, which is z = 0; a slope tilts
/// gravity. Each wheel touches the ground in one point (sphere against the tangential plane under its hub), and a kerb
/// in another, with a spring and damper along the normal. Friction is isotropic Coulomb friction, as slip in a turn
/// depends on it: rolling and lateral friction share the limit mu N, so that a skidding tyre also slips lengthwise
/// (with a friction pyramid it would hold, and the robot would turn without skidding). The chassis touches nothing.
class OdeWorld {
 public:
  /// Builds the robot at rest, its wheels in static equilibrium with the ground, base_link above the ground frame's
  /// origin.
  OdeWorld(const RobotModel& model, const PlantParameters& parameters);

  /// Sets the speed of a wheel's motor in the next step, if its torque suffices [rad/s].
  void setWheelReference(std::size_t wheel, double speed) { dJointSetHingeParam(hinges_[wheel], dParamVel, speed); }

  /// Changes the friction coefficient.
  void setFriction(double friction) { friction_ = friction; }

  /// Force on the chassis at its centre of mass [N] and torque about its vertical [N m], both in the chassis' frame,
  /// from now on.
  void push(const Eigen::Vector3d& force, double torque) {
    push_force_ = force;
    push_torque_ = torque;
  }

  /// Lifts the robot and turns it meanwhile, or sets it down again. Not on a box.
  void lift(bool lifted);

  /// Advances by JackalPlant::kStep.
  void step();

  ChassisState chassis() const;                                           ///< motion of the chassis after the step
  double wheelSpeed(std::size_t wheel) const { return speed_[wheel]; }    ///< relative to the chassis [rad/s]
  double wheelTorque(std::size_t wheel) const { return torque_[wheel]; }  ///< of its motor in the last step [N m]
  const Eigen::Vector3d& gravity() const { return gravity_; }             ///< in the ground frame [m/s^2]

 private:
  struct Destroy {
    void operator()(dWorldID world) const { dWorldDestroy(world); }
    void operator()(dThreadingImplementationID threading) const { dThreadingFreeImplementation(threading); }
    void operator()(dJointGroupID group) const { dJointGroupDestroy(group); }
  };
  template <class Id>
  using Handle = std::unique_ptr<std::remove_pointer_t<Id>, Destroy>;

  /// Contact of one wheel in the last step, from which the friction of the next one is linearised.
  struct Contact {
    bool touching = false;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   ///< of the surface
    Eigen::Vector3d rolling = Eigen::Vector3d::UnitX();  ///< direction in which the wheel rolls
    double friction = 0.0;                               ///< Coulomb coefficient of the place
    Eigen::Vector3d point = Eigen::Vector3d::Zero();     ///< in which they touch [m]
    double depth = 0.0;                                  ///< penetration of the wheel into the ground [m]
    double limit = 0.0;  ///< of the friction, in each direction [N]; none while it slides
    double slip = 0.0;   ///< slip speed per friction [m/(N s)]; 0 sticks
    bool sticking = true;
    double normal_force = 0.0;  ///< [N]
    double slip_speed = 0.0;    ///< of the contact point over the ground [m/s]
    dJointFeedback feedback{};  ///< f1: force on the wheel [N]
  };

  void createWheel(const RobotModel& model, std::size_t index);
  void setInEquilibrium(const RobotModel& model);
  void carry();
  void solve();
  void createContact(std::size_t index, Contact& contact);
  void touch(std::size_t index);
  void touch(std::size_t index, Contact& contact, const TouchPoint& touch) const;
  void updateContact(std::size_t index, Contact& contact);

  Eigen::Vector3d gravity_;
  Terrain terrain_;
  double friction_;
  double torque_limit_;
  double stiffness_;
  bool fixed_chassis_;
  Handle<dThreadingImplementationID> threading_;  ///< the world's own: ODE's default one is shared
  Handle<dWorldID> world_;
  Handle<dJointGroupID> contact_group_;
  dBodyID chassis_ = nullptr;
  Eigen::Vector3d push_force_ = Eigen::Vector3d::Zero();
  double push_torque_ = 0.0;
  bool lifted_ = false;            // on its way up, or held
  bool carried_ = false;           // not yet set down
  double height_on_ground_ = 0.0;  // of the chassis' centre of mass [m]
  Eigen::Vector3d acceleration_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_acceleration_ = Eigen::Vector3d::Zero();
  std::array<double, 4> radius_{};
  std::array<Eigen::Vector3d, 4>
      hub_in_wheel_{};              ///< joint origin relative to the wheel's centre of mass, in the wheel [m]
  std::array<double, 4> torque_{};  ///< of the motors in the last step [N m]
  std::array<double, 4> speed_{};   ///< of the wheels relative to the chassis after it [rad/s]
  std::array<dBodyID, 4> wheels_{};
  std::array<dJointID, 4> hinges_{};
  std::array<dJointFeedback, 4> hinge_feedback_{};
  std::array<Contact, 4> contacts_{};       ///< with the ground
  std::array<Contact, 4> kerb_contacts_{};  ///< with the kerb
};

}  // namespace jackal_aic::sim
