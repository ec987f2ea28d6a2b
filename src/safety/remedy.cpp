#include "jackal_aic/safety/remedy.hpp"

namespace jackal_aic {
namespace {

constexpr const char* kImuDriver = "Check the IMU, its cable and its driver (imu/data)";
constexpr const char* kWheelDriver = "Check the robot's driver and the encoders (joint_states)";
constexpr const char* kClocks = "Synchronise the clocks of the machines (chrony), or check the network";
constexpr const char* kMounting = "Check how the IMU is mounted, and its frame in the URDF";

}  // namespace

const char* remedy(StopCause cause) {
  switch (cause) {
    case StopCause::none:
    case StopCause::set_point_late:
    case StopCause::set_point_missing:
    case StopCause::set_points_rival:
    case StopCause::shutdown:
    case StopCause::contention:
      return "";
    case StopCause::unpaired:
      return kClocks;
    case StopCause::moved:
      return "It drives on when it stands still";
    case StopCause::imu_frozen:
    case StopCause::imu_late:
    case StopCause::imu_missing:
      return kImuDriver;
    case StopCause::wheels_frozen:
    case StopCause::wheels_late:
    case StopCause::wheels_missing:
      return kWheelDriver;
    case StopCause::feedback_late:
      return "Check the power and the cable of the motor controller";
    case StopCause::clock_jump:
      return "It drives on by itself";
    case StopCause::graph_unchecked:
      return "Check that the ROS master runs";
    case StopCause::start:
      return "Send a zero set point, or pause, to set off";
    case StopCause::motors_off:
      return "Switch the motors to velocity control";
    case StopCause::robot_stopped:
      return "Release the stop button of the robot";
    case StopCause::emergency_stop:
      return "Release it to drive on";
    case StopCause::disabled:
      return "Call the service enable with true to drive on";
    case StopCause::sensor_fault:
      return "Check the sensors and the motors, then send a zero set point";
    case StopCause::belief_diverged:
      return "Send a zero set point to drive on; if it comes again, check the gains and the plant model (analyze)";
    case StopCause::driver_fault:
      return "Look at /feedback and restart the motor driver";
  }
  return "";
}

const char* remedy(Fault fault) {
  switch (fault) {
    case Fault::none:
    case Fault::moved:
      return "";
    case Fault::wheels_blocked:
    case Fault::left_wheels_blocked:
    case Fault::right_wheels_blocked:
      return "Free the wheels, and check the power of the motors; then send a zero set point";
    case Fault::left_encoder_frozen:
    case Fault::left_encoder_wrong:
    case Fault::right_encoder_frozen:
    case Fault::right_encoder_wrong:
      return "Check the encoder and its cable";
    case Fault::imu_upside_down:
    case Fault::gyro_reversed:
      return kMounting;
    case Fault::gyro_frozen:
    case Fault::accelerometer_frozen:
      return kImuDriver;
    case Fault::gyro_disagrees:
      return "Check the unit (rad/s) and the bias of the gyro, and the effective track";
    case Fault::accelerometer_disagrees:
      return "Check the unit (m/s^2) and the mounting of the accelerometer";
    case Fault::no_gravity:
      return "Check that the accelerometer is there, in m/s^2, and mounted as tf says";
    case Fault::stuck:
      return "Free the robot, or stop driving";
    case Fault::wheels_off_model:
      return "Check the scale of the encoders, the motors and the plant model";
    case Fault::turn_off_model:
      return "Check the ground, the scale of the gyro, robot.effective_track and robot.track_range";
  }
  return "";
}

const char* remedy(Loss loss) {
  switch (loss) {
    case Loss::none:
      return "";
    case Loss::yaw_rate:
      return kImuDriver;
    case Loss::left_encoder:
    case Loss::right_encoder:
    case Loss::both_encoders:
      return kWheelDriver;
    case Loss::encoder_and_yaw_rate:
    case Loss::unclear:
      return "Check the sensors and their drivers (joint_states, imu/data)";
  }
  return "";
}

}  // namespace jackal_aic
