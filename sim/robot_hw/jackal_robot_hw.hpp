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
  JackalRobotHW(const std::string& urdf_xml, const PlantParameters& parameters, bool with_imu = false);

  /// Goes on by JackalPlant::kStep. The sample that came in this step, if one did.
  const std::optional<PlantMeasurement>& step();

  void read(const ros::Time& time, const ros::Duration& period) override;
  void write(const ros::Time& time, const ros::Duration& period) override;

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
