#include "jackal_robot_hw.hpp"

namespace jackal_aic::sim {

JackalRobotHW::JackalRobotHW(const std::string& urdf_xml, const PlantParameters& parameters, bool with_imu)
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

const std::optional<PlantMeasurement>& JackalRobotHW::step() {
  plant_.step();
  if (plant_.measurement()) sample_ = *plant_.measurement();
  return plant_.measurement();
}

void JackalRobotHW::read(const ros::Time&, const ros::Duration&) {
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

void JackalRobotHW::write(const ros::Time&, const ros::Duration&) {
  plant_.command({command_[kFrontLeft], command_[kFrontRight]});
}

}  // namespace jackal_aic::sim
