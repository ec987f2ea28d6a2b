#pragma once

/// @file
/// Uncertainty of the believed motion of the body, in addition to the beliefs' covariances, which contain only the
/// configured noise and an exact model.
///
/// Innovations measure the real errors of a belief. At its minimum the free energy F of a measurement is nu^2/(2 S),
/// with the innovation nu and its variance S, so the mean of 2 F should be 1. The variance P of a belief is multiplied
/// by phi, for the wheels and for the gyro: the mean of 2 F over a second, within bounds.
///
/// Errors that innovations do not show, or show too late, are added:
///
///   - (rho x_dot)^2: the encoders do not measure the radius of the tyres, whose relative error is rho;
///   - phi^2 1/2 (s_L^2 + s_R^2), s_L and s_R the slip of each side of a body that follows its wheels with a lag T,
///     T ds/dt = T dv/dt - s. Late sensors have the same effect, and make phi large;
///   - the square of the change of the motion in a time t, the learned minus the configured dead time. It may lie
///     before the motors or behind the encoders, which then measure the body a time t ago; a model with this dead time
///     leaves no innovation in either case;
///   - (c theta_dot)^2: a robot whose turning centre lies c off its middle moves while the mean of its wheels stands.
///     Both the centre and the turn vary where the ground differs under the wheels: c^2 = c_0^2 + (l q)^2, and of the
///     yaw rate (m q theta_dot)^2. q^2 is the mean of the squares of theta_dot/f - 1 in turns, f the usual yaw rate of
///     the wheels; differences that every ground has are ignored.
///
/// On the box nothing slips, and velocities are those of wheels with the configured radius.
///
/// The constants are chosen so that the error is within its 95 % bounds 95 % of the time on the simulated robots. They
/// do not change a belief or a command.

#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Uncertainty of the believed motion. Does not allocate.
class MotionUncertainty {
 public:
  static constexpr double kLeastFactor = 0.3;        ///< of phi
  static constexpr double kLargestFactor = 100.0;    ///< of phi
  static constexpr double kRadiusDeviation = 0.015;  ///< rho
  static constexpr double kSlipTime = 0.03;          ///< T [s]
  static constexpr double kCentreDeviation = 0.045;  ///< c_0 [m]
  static constexpr double kCentrePerTurn = 1.5;      ///< l [m]
  static constexpr double kYawPerTurn = 0.4;         ///< m
  static constexpr double kUsualTurn = 0.15;         ///< |theta_dot/f - 1| that every ground has

  /// @param wheel_radius r [m]; @param on_box the wheels turn free.
  MotionUncertainty(double wheel_radius, bool on_box) : wheel_radius_(wheel_radius), on_box_(on_box) {}

  /// Advances by a step [s] with the wheels' accelerations [rad/s^2].
  void predict(double left_acceleration, double right_acceleration, double step);

  /// Takes a measurement of the wheels. @param free_energy mean F of both; @param step since the last measurement [s].
  void learnWheels(double free_energy, double step) { learn(wheels_, free_energy, step); }

  /// Takes a measurement of the yaw rate. @param free_energy F of it; @param step since the last measurement [s].
  void learnGyro(double free_energy, double step) { learn(gyro_, free_energy, step); }

  /// Takes a yaw rate of the body [rad/s]. @param usual f [rad/s]; @param step since the last measurement [s].
  void learnTurn(double yaw_rate, double usual, double step);

  /// Variance of x_dot [(m/s)^2]. @param believed P, by the wheels; @param velocity of the body (base_link); @param
  /// ahead change of the speed in a time t [m/s].
  double forwardVariance(double believed, const BodyVector& velocity, double ahead = 0.0) const;

  /// Variance of theta_dot [(rad/s)^2]. @param believed P; @param velocity of the body (base_link); @param ahead change
  /// of the yaw rate in a time t [rad/s].
  double yawVariance(double believed, const BodyVector& velocity, double ahead = 0.0) const;

  /// Forgets the motion; keeps what was learned about the ground.
  void resetMotion();

 private:
  static void learn(double& factor, double free_energy, double step);

  double wheel_radius_;
  bool on_box_;
  WheelVector slip_ = WheelVector::Zero();  // s_L, s_R [m/s]
  double wheels_ = 1.0, gyro_ = 1.0;        // phi
  double turn_ = 0.0;                       // q^2
};

}  // namespace jackal_aic
