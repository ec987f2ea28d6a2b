#pragma once

/// @file
/// Turn of a skid-steer body with its wheels: the effective track depends on the motion and on the ground.
///
/// With x = r (w_R - w_L) the difference and v = r (w_L + w_R)/2 the mean of the wheels' circumference speeds,
///
///     theta_dot = phi(x, v)^T q + h c x,    phi^T q = q_1 x + q_2 x |v| + q_3 v + q_4 v |x|
///
/// q_1 is alpha/b_hat of eq. 3-1 turning in place, q_2 its change with the forward speed, q_3 the veer of a straight
/// drive, q_4 the difference of left and right turns. q belongs to the robot, which changes over minutes of turning.
/// The state h is the ground's present part of the configured ratio c, and fades to 0 in turns and at rest:
///
///     dh/dt = -h/T_h + noise, so that h has the deviation sigma_h
///
/// One Kalman filter estimates both, (q, h) ~ N(m, P). A turn updates both by their uncertainty: a new robot learns q
/// from its first turn, and a robot that has turned for minutes takes a change for the ground. The prior of q_1 is as
/// wide as its range, and narrow around zero for the others: without more data the robot has one track. P^-1 of q
/// returns to that of the prior with the time of turning T.
///
/// A body that skids chatters: in addition to the sensor's noise the yaw rate has noise of deviation sigma_w c x. It
/// differs by a factor of ten between a smooth floor and rough ground, and is learned. sigma_w^2 descends F + 1/2 ln S,
/// with the innovation's variance S. So it approaches the mean of the error that neither the sensor nor P explains,
/// over N times T_h; the first value counts as N_0.

#include <Eigen/Core>

#include "jackal_aic/model/geometry.hpp"

namespace jackal_aic {

/// Belief about the coefficients, kept for the next start.
struct TurnCoefficients {
  Eigen::Vector4d mean;        ///< q [1/m, s/m^2, 1/m, s/m^2]
  Eigen::Matrix4d covariance;  ///< P; positive definite
};

/// Belief about the turn of the body with its wheels. Nothing here allocates.
class TurnModel {
 public:
  static constexpr double kTimeConstant = 120;  ///< T, time of turning over which the coefficients are averaged [s]
  static constexpr double kTurn = 0.15;         ///< least |v| of a straight line to learn from [m/s]

  /// @param ratio alpha / b_hat as configured [1/m]; @param range largest ratio of d theta_dot/dx and it.
  explicit TurnModel(double ratio, double range = GeometryParameters::kTrackRange);

  /// theta_dot of the body [rad/s]. @param x difference, @param v mean of the wheels' circumference speeds [m/s].
  double yawRate(double x, double v) const;

  /// theta_dot on the usual ground, h = 0 [rad/s].
  double usualYawRate(double x, double v) const;

  /// d theta_dot/dx at a motion [1/m]; within the range, and positive.
  double perDifference(double x, double v) const;

  /// d theta_dot/dv at a motion [1/m].
  double perSpeed(double x, double v) const;

  /// x [m/s] that turns the body with theta_dot [rad/s] at v [m/s]: the inverse of yawRate().
  double difference(double yaw_rate, double v) const;

  /// True for a yaw rate [rad/s] that is possible within the range, chatter included.
  bool plausible(double yaw_rate, double x, double v) const;

  /// A ratio [1/m] within the range.
  double bounded(double ratio) const;

  /// Advances the ground by a time [s].
  void pass(double step);

  /// Error of a yaw rate [rad/s] against the wheel speeds that were measured with it [m/s].
  double error(double yaw_rate, double x, double v) const;

  /// Takes an error() of a turn.
  /// @param x, v believed before the measurement [m/s]: with the encoders' noise in the error and in x, a steady turn
  /// would seem not to depend on x; @param variance of the error [(rad/s)^2]; @param step since the last one [s].
  void learn(double error, double x, double v, double variance, double step);

  /// Takes an error() of a straight line, which measures the veer; ignored below kTurn.
  void learnVeer(double error, double x, double v, double variance, double step);

  double inPlace() const { return mean_(0); }               ///< q_1 [1/m]
  double ground() const { return mean_(4); }                ///< h
  Eigen::Vector4d mean() const { return mean_.head<4>(); }  ///< q
  TurnCoefficients coefficients() const;                    ///< q and P

  /// Sets coefficients, within the range. @throws ParameterError if they are not finite or P is not positive definite.
  void setCoefficients(const TurnCoefficients& coefficients);

 private:
  using State = Eigen::Matrix<double, 5, 1>;
  using Covariance = Eigen::Matrix<double, 5, 5>;

  State motion(double x, double v) const;
  double ratio(double x, double v, double ground) const;
  void learnNoise(double error, const State& phi, double variance, double step);
  void correct(double error, const State& phi, double variance);
  void bound();

  double configured_;  // c
  double range_;
  State mean_;             // (q, h)
  Covariance covariance_;  // P
  Eigen::Matrix4d prior_;  // P_0^-1
  double noise_variance_;  // sigma_w^2
  double evidence_;        // N
};

}  // namespace jackal_aic
