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
      const JointStateHandle state(kWheelJoints[i], &read_.wheel_position[i], &read_.wheel_velocity[i],
                                   &read_.wheel_effort[i]);
      states_.registerHandle(state);
      velocities_.registerHandle(JointHandle(state, &command_[i]));
    }
    registerInterface(&states_);
    registerInterface(&velocities_);
    if (!with_imu) return;
    ImuSensorHandle::Data imu;
    imu.name = "imu";
    imu.frame_id = "base_link";
    imu.orientation = read_.orientation.coeffs().data();
    imu.angular_velocity = read_.angular_velocity.data();
    imu.linear_acceleration = read_.linear_acceleration.data();
    imus_.registerHandle(ImuSensorHandle(imu));
    registerInterface(&imus_);
  }

  /// Goes on by JackalPlant::kStep. The sample that came in this step, if one did.
  const std::optional<PlantMeasurement>& step() {
    plant_.step();
    if (plant_.measurement()) sample_ = *plant_.measurement();
    return plant_.measurement();
  }

  void read(const ros::Time&, const ros::Duration&) override { read_ = sample_; }

  void write(const ros::Time&, const ros::Duration&) override {
    plant_.command({command_[kFrontLeft], command_[kFrontRight]});
  }

  JackalPlant& plant() { return plant_; }

 private:
  JackalPlant plant_;
  PlantMeasurement sample_;  // the last
  PlantMeasurement read_;    // as the interfaces show it
  std::array<double, 4> command_{};
  hardware_interface::JointStateInterface states_;
  hardware_interface::VelocityJointInterface velocities_;
  hardware_interface::ImuSensorInterface imus_;
};

}  // namespace jackal_aic::sim
