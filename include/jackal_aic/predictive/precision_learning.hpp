#pragma once

/// @file
/// Precision of a channel, learned by the gradient of the free energy.
///
/// With the log-precision zeta, Pi = e^zeta, the part of the free energy that depends on it is
/// 1/2 e^zeta E[n^2] - 1/2 zeta, n the noise of the channel, so that
///
///     dzeta/dt = 1/2 kappa (1 - e^zeta E[n^2]).
///
/// n itself is hidden. A residual eps = y - H x of the belief x after its correction with the gain K holds
/// eps = n - H e, e the error of the belief, which contains K n. Its square therefore misses
///
///     E[n^2] = E[eps^2] + 2 H K Sigma - H C H',    C = E[e e'].
///
/// If the belief is as wrong as it says, H K Sigma = H C H' and the correction is + H C H', the posterior term of
/// variational Bayes. A controller's belief is not: its random fluctuations are chosen for how fast it follows a
/// disturbance, larger than what disturbs a robot that drives steadily, and that formula would find the noise too small
/// by up to a half. So C is carried along as it is for a robot that follows its drive train (wheel_belief.hpp), and the
/// estimate is unbiased as long as the robot does.

#include "jackal_aic/model/wheel_belief.hpp"

namespace jackal_aic {

/// Log-precision of one channel. Does not allocate.
class LogPrecision {
 public:
  /// Range of the variance: this factor to either side of the configured one.
  static constexpr double kRange = 100.0;

  /// @param variance configured Sigma; @param memory time over which errors are averaged, 2/kappa [s].
  LogPrecision(double variance, double memory);

  /// One step of the gradient. @param residual eps; @param hidden what its square misses, 2 H K Sigma - H C H';
  /// @param step since the last residual [s].
  void learn(double residual, double hidden, double step);

  /// Sigma = e^-zeta.
  double variance() const { return variance_; }

 private:
  double smallest_;
  double largest_;
  double memory_;
  double variance_;
};

/// Variance Sigma_y of each channel.
struct SensorVariances {
  double wheel_left = 9e-4;       ///< of a left wheel speed [(rad/s)^2]
  double wheel_right = 9e-4;      ///< of a right wheel speed [(rad/s)^2]
  double gyro = 2.5e-5;           ///< of the yaw rate [(rad/s)^2]
  double accelerometer = 2.5e-3;  ///< of the forward acceleration [(m/s^2)^2]
};

/// Precisions of all channels of the predictive controller. To be asked only while the robot moves steadily: at rest
/// quantised encoders have no noise and the others less than on the way, and while it accelerates an error of the dead
/// time looks like noise.
class SensorPrecisions {
 public:
  /// @param configured variances to start from; @param memory as in LogPrecision [s].
  SensorPrecisions(const SensorVariances& configured, double memory);

  /// Learns from the residuals of both wheels after their correction. @param step since the last measurement [s].
  void learnWheels(const WheelBelief& left, const WheelBelief& right, double step);

  /// Learns from the residual of the yaw rate [rad/s] against the wheels. @param slope yaw rate per wheel speed, r q;
  /// @param track_gain part of the residual that the slip belief took for itself before, 0..1.
  void learnGyro(double residual, const WheelBelief& left, const WheelBelief& right, double slope, double track_gain,
                 double step);

  /// Learns from the residual of the acceleration [m/s^2], averaged by the sensor since the last measurement, against
  /// the change of the wheel speeds that was predicted. @param radius r alpha [m].
  void learnAccelerometer(double residual, const WheelBelief& left, const WheelBelief& right, double radius,
                          double step);

  /// What is believed now.
  SensorVariances variances() const;

 private:
  LogPrecision wheel_left_, wheel_right_, gyro_, accelerometer_;
};

}  // namespace jackal_aic
