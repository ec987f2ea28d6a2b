#pragma once

/// @file
/// The simulated Jackal as a robot of ros_control, with the interfaces of the stock driver.

#include <hardware_interface/imu_sensor_interface.h>
#include <hardware_interface/joint_command_interface.h>
#include <hardware_interface/joint_state_interface.h>
#include <hardware_interface/robot_hw.h>

#include <array>
#include <optional>
#include <string>

#include "jackal_plant.hpp"

namespace jackal_aic::sim {

/// Four wheels with position, velocity and effort, commanded by velocity. As on the stock robot, read() gives the last
/// sample that came, again and again, and write() takes the commands of the front wheels for both of a side.
class JackalRobotHW : public hardware_interface::RobotHW {
 public:
  /// @param with_imu offers the IMU too, by the name "imu" and in base_link.
  /// @throws ParameterError as JackalPlant.
  JackalRobotHW(const std::string& urdf_xml, const PlantParameters& parameters, bool with_imu = false)
      : plant_(urdf_xml, parameters), sample_(*plant_.measurement()) {
    using namespace hardware_interface;
    for (std::size_t i = 0; i < kWheelJoints.size(); ++i) {
      const JointStateHandle state(kWheelJoints[i], &position_[i], &velocity_[i], &effort_[i]);
      states_.registerHandle(state);
      velocities_.registerHandle(JointHandle(state, &command_[i]));
    }
    registerInterface(&states_);
    registerInterface(&velocities_);
    if (!with_imu) return;
    ImuSensorHandle::Data imu;
    imu.name = "imu";
    imu.frame_id = "base_link";
    imu.orientation = orientation_.data();
    imu.angular_velocity = angular_velocity_.data();
    imu.linear_acceleration = linear_acceleration_.data();
    imus_.registerHandle(ImuSensorHandle(imu));
    registerInterface(&imus_);
  }

  /// Goes on by JackalPlant::kStep. The sample that came in this step, if one did.
  const std::optional<PlantMeasurement>& step() {
    plant_.step();
    if (plant_.measurement()) sample_ = *plant_.measurement();
    return plant_.measurement();
  }

  void read(const ros::Time&, const ros::Duration&) override {
    position_ = sample_.wheel_position;
    velocity_ = sample_.wheel_velocity;
    effort_ = sample_.wheel_effort;
    const auto& q = sample_.orientation;
    orientation_ = {q.x(), q.y(), q.z(), q.w()};
    for (int i = 0; i < 3; ++i) {
      angular_velocity_[i] = sample_.angular_velocity(i);
      linear_acceleration_[i] = sample_.linear_acceleration(i);
    }
  }

  void write(const ros::Time&, const ros::Duration&) override {
    plant_.command({command_[kFrontLeft], command_[kFrontRight]});
  }

  JackalPlant& plant() { return plant_; }

 private:
  JackalPlant plant_;
  PlantMeasurement sample_;  // the last
  std::array<double, 4> position_{}, velocity_{}, effort_{}, command_{};
  std::array<double, 4> orientation_{0.0, 0.0, 0.0, 1.0};
  std::array<double, 3> angular_velocity_{}, linear_acceleration_{};
  hardware_interface::JointStateInterface states_;
  hardware_interface::VelocityJointInterface velocities_;
  hardware_interface::ImuSensorInterface imus_;
};

}  // namespace jackal_aic::sim
