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
/// by up to a half. So C is carried along as it is for a robot that follows its drive train: by the recursion of the
/// belief's own covariance, without the random fluctuations,
///
///     C <- J C J'                                        between measurements, J the transition of the belief
///     C <- (I - K H) C (I - K H)' + K Sigma K'           with a measurement
///
/// and the estimate is unbiased as long as the robot does.

#include <Eigen/Core>

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

/// Error of a wheel's belief while the robot drives steadily and nothing but noise disturbs it. Does not allocate.
class SteadyError {
 public:
  /// The belief was seeded with a measured speed.
  void start(const WheelBelief& wheel);

  /// The belief has moved by one inner step.
  void predict(const WheelBelief& wheel);

  /// The belief has taken a measurement.
  void correct(const WheelBelief& wheel);

  double residual() const { return residual_; }  ///< eps of the last measurement, after the step [rad/s]

  /// What the square of residual() misses of the variance of the measurement, 2 H K Sigma - H C H' [(rad/s)^2].
  double hiddenVariance() const { return hidden_; }

  /// Variance H C H' of the error of the believed speed [(rad/s)^2].
  double variance() const { return C_(0, 0); }

  /// How the speed was predicted to change from the last measurement but one to the last [rad/s], and the variance of
  /// that prediction's error [(rad/s)^2].
  double predictedChange() const { return predicted_change_; }
  double predictedChangeVariance() const { return predicted_change_variance_; }  ///< likewise

 private:
  Eigen::Matrix3d C_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d C_since_ = Eigen::Matrix3d::Zero();  // of the error with that after the last measurement
  double speed_ = 0.0;                                 // believed after the last measurement [rad/s]
  double variance_ = 0.0;                              // of its error
  double residual_ = 0.0;
  double hidden_ = 0.0;
  double predicted_change_ = 0.0;
  double predicted_change_variance_ = 0.0;
};

/// Precisions of all channels of the predictive controller. To be asked only while the robot moves steadily: at rest
/// quantised encoders have no noise and the others less than on the way, and while it accelerates an error of the dead
/// time looks like noise. The errors of both wheels' beliefs are carried along by start(), predict() and correct(), as
/// in SteadyError.
class SensorPrecisions {
 public:
  /// @param configured variances to start from; @param memory as in LogPrecision [s].
  SensorPrecisions(const SensorVariances& configured, double memory);

  void start(const WheelBelief& left, const WheelBelief& right);    ///< as SteadyError
  void predict(const WheelBelief& left, const WheelBelief& right);  ///< as SteadyError
  void correct(const WheelBelief& left, const WheelBelief& right);  ///< as SteadyError

  /// Learns from the residuals of both wheels after their correction. @param step since the last measurement [s].
  void learnWheels(double step);

  /// Learns from the residual of the yaw rate [rad/s] against the wheels. @param slope yaw rate per wheel speed, r q;
  /// @param track_gain part of the residual that the slip belief took for itself before, 0..1.
  void learnGyro(double residual, double slope, double track_gain, double step);

  /// Learns from an acceleration free of its offset [m/s^2], averaged by the sensor since the last measurement, against
  /// the change of the wheel speeds that was predicted. @param radius r alpha [m].
  void learnAccelerometer(double acceleration, double radius, double step);

  /// What is believed now.
  SensorVariances variances() const;

 private:
  LogPrecision wheel_left_, wheel_right_, gyro_, accelerometer_;
  SteadyError left_, right_;
};

}  // namespace jackal_aic
