#pragma once

/// @file
/// What the simulated robot of a test did, on the plant that the test's parameter ~plant names.

#include <sensor_msgs/JointState.h>

#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {

/// The test's parameter ~plant: ground, box or real.
inline std::string plantName() { return ros::param::param<std::string>("~plant", "ground"); }

/// Whether the chassis stands on a box.
inline bool onBox() { return plantName() == "box"; }

/// What the robot did: ground truth; on the box, where the chassis stands, what the wheels would make of it.
class Truth {
 public:
  /// Listens to the wheels.
  Truth() { subscriber_ = node_.subscribe("joint_states", 1000, &Truth::onWheels, this); }

  /// Motion since clear(). @param robot whose ground truth counts where it is not on the box.
  const Recording& of(const SimulatedRobot& robot) const { return onBox() ? by_wheels_ : robot.truth(); }
  /// Whether the wheels were heard.
  bool any() const { return !by_wheels_.time.empty(); }

  /// Forgets everything recorded from the wheels.
  void clear() { by_wheels_ = {}; }

 private:
  void onWheels(const sensor_msgs::JointState& message) {
    WheelCommand wheels;
    for (std::size_t i = 0; i < message.name.size(); ++i) {
      if (message.name[i] == "front_left_wheel") wheels.left = message.velocity[i];
      if (message.name[i] == "front_right_wheel") wheels.right = message.velocity[i];
    }
    const BodyVector body = kinematics_.bodyVelocity(wheels);
    by_wheels_.time.push_back(message.header.stamp.toSec());
    by_wheels_.forward.push_back(body(kForward));
    by_wheels_.yaw_rate.push_back(body(kYaw));
  }

  SkidSteerKinematics kinematics_{GeometryParameters{}};
  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
  Recording by_wheels_;
};

}  // namespace jackal_aic::test
