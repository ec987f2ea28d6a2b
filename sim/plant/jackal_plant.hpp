#pragma once

/// @file
/// The simulated Jackal: rigid bodies and contacts by ODE, built from a URDF; no ROS.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/types.hpp"
#include "plant_parameters.hpp"

namespace jackal_aic::sim {

/// Order of the wheels in every per-wheel array.
enum Wheel { kFrontLeft = 0, kFrontRight = 1, kRearLeft = 2, kRearRight = 3 };

/// Names of the wheel joints in the order of Wheel, as on the stock Jackal.
inline constexpr std::array<const char*, 4> kWheelJoints{"front_left_wheel", "front_right_wheel", "rear_left_wheel",
                                                         "rear_right_wheel"};

/// One side of the robot, with its motor and its two wheels.
enum class Side { left, right };

/// True state of the robot.
struct PlantTruth {
  double time = 0.0;                     ///< simulated time [s]
  Eigen::Vector3d position;              ///< base_link in the ground frame [m]
  Eigen::Quaterniond orientation;        ///< base_link in the ground frame
  Eigen::Vector3d linear_velocity;       ///< velocity of the base_link origin, in base_link [m/s]
  Eigen::Vector3d angular_velocity;      ///< in base_link [rad/s]
  std::array<double, 4> wheel_position;  ///< [rad]
  std::array<double, 4> wheel_velocity;  ///< [rad/s], positive is forward
  WheelCommand acting_command;           ///< command that left the dead time and drives the motors now [rad/s]
};

/// One sample of the IMU, with noise.
struct ImuMeasurement {
  /// Time of the sample, plus its delay where `stamp_jitter` is set [s].
  double stamp = 0.0;

  /// Gyro, in imu_link [rad/s].
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();

  /// Mean since the last sample, gravity included, in imu_link [m/s^2].
  Eigen::Vector3d linear_acceleration = Eigen::Vector3d::Zero();

  /// Of imu_link in a level frame.
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

/// Wheel speeds from the motor controller, with noise: /feedback of a Jackal.
struct WheelFeedback {
  double feedback_stamp = 0.0;             ///< time at which it was measured [s]
  std::array<double, 4> wheel_position{};  ///< encoders [rad]
  std::array<double, 4> wheel_velocity{};  ///< encoders [rad/s]
  std::array<double, 4> wheel_effort{};    ///< torque the motors apply, from the physics engine [N m]
};

/// One sample of the robot's sensors: /joint_states, which is the newest feedback with another stamp, and the IMU: of
/// the same time, or the newest sample with an `imu_rate`.
struct PlantMeasurement : ImuMeasurement, WheelFeedback {
  /// The channels of eq. 3-3: gyro z, mean of each side's wheels, accelerometer x and y without gravity; and
  /// accelerometer z. As the node reads them from the messages of this sample (an IMU mounted as base_link).
  Observation observation() const;
};

/// A Clearpath Jackal in simulation: rigid chassis and wheels on the ground (OdeWorld, Terrain), one motor per side
/// (CommandDelay, MotorLoop), encoders and IMU (SensorModel). Deterministic: equal parameters and commands give equal
/// bytes. Plants are independent; each may be used by one thread at a time.
///
/// Ground frame: origin under base_link at the start, x along the initial heading, z normal to the ground. A slope
/// tilts this frame by `slope` about y against the level frame of the IMU's orientation.
class JackalPlant {
 public:
  /// Step of the simulation [s].
  static constexpr double kStep = 0.001;

  /// Builds the robot at rest from a URDF text. @throws ParameterError if the URDF lacks a body, joint, inertia or
  /// wheel.
  JackalPlant(const std::string& urdf_xml, const PlantParameters& parameters);

  ~JackalPlant();
  JackalPlant(JackalPlant&&) noexcept;
  JackalPlant& operator=(JackalPlant&&) noexcept;

  /// Takes a wheel command now. The motors receive it after the dead time and the network delay, rounded to whole
  /// steps: without dead time it drives the next step(). Returns false for a command that is not finite, and ignores
  /// it.
  bool command(const WheelCommand& command);

  /// Advances by kStep.
  void step();

  /// Simulated time [s].
  double time() const;

  /// The sensor sample that arrived in the last step(), if one was due (rate `sensor_rate`) and was not lost. Without
  /// `stamp_jitter` it was taken in that step. The first one, of time 0, exists right after construction.
  const std::optional<PlantMeasurement>& measurement() const;

  /// The IMU's sample that arrived in the last step(): the one in measurement(), or, with an `imu_rate`, at that rate.
  const std::optional<ImuMeasurement>& imuMeasurement() const;

  /// True state after the last step().
  const PlantTruth& truth() const;

  /// Changes the friction coefficient of the ground from now on. @throws ParameterError if negative or
  /// not finite.
  void setFriction(double friction);

  /// Sets another steady-state wheel speed per command and another offset [rad/s] of all motors: a weak
  /// battery, a load.
  /// @throws ParameterError if the gain is not positive, the offset negative, or one of them not finite.
  void changeMotors(double gain, double offset);

  /// Blocks the motor of a side from now on, or releases it: its wheels stop within the torque limit, and its encoder
  /// shows it.
  void blockWheels(Side side, bool blocked);

  /// Pushes the robot from now on: a force along and across it [N] and a torque about its vertical [N m], at its centre
  /// of mass and in base_link; zeros end it. A kerb is a short push against the motion.
  void push(double forward, double left, double torque);

  /// Lifts the robot by 0.3 m at 0.3 m/s, turning it at 0.8 rad/s, or sets it down again. Nothing happens on a box.
  void lift(bool lifted);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> self_;
};

}  // namespace jackal_aic::sim
