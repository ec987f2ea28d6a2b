#pragma once

/// @file
/// How a skid-steer body turns with its wheels: the effective track depends on the motion, and on the ground.
///
/// With x = r (w_R - w_L) the difference and v = r (w_L + w_R)/2 the mean of the wheels' circumference speeds,
///
///     theta_dot = phi(x, v)^T q + h c x,    phi^T q = q_1 x + q_2 x |v| + q_3 v + q_4 v |x|
///
/// q_1 is eq. 3-1's alpha/b_hat turning in place, q_2 how it changes with the forward speed, q_3 how a straight drive
/// veers, q_4 how left and right turns differ: the robot, which changes over minutes of turning. h is what the ground
/// under it makes of the configured ratio c now, and fades to 0 whether the robot turns or rests:
///
///     dh/dt = -h/T_h + noise of which h has the deviation sigma_h
///
/// One Kalman filter has both, (q, h) ~ N(m, P). What a turn tells is shared between them as they are uncertain: a
/// robot of which nothing is known learns q from its first turn, one that has turned for minutes takes a change for the
/// ground. The prior of q_1 is as wide as its range and narrow around zero for the others: where the data say no more,
/// the robot has one track. P^-1 of q returns to that of the prior with the time of turning T.
///
/// A body that skids chatters: the yaw rate has, beside the sensor's noise, one of deviation sigma_w c x. It differs by
/// ten times from a smooth floor to rough ground and is learned: sigma_w^2 descends F + 1/2 ln S, with the innovation's
/// variance S, to the mean of what neither the sensor nor P explains of an error, over N times T_h, of which the first
/// value counts as N_0.

#include <Eigen/Core>

#include "jackal_aic/model/geometry.hpp"

namespace jackal_aic {

/// Belief about the coefficients: all that has to be kept for the next start.
struct TurnCoefficients {
  Eigen::Vector4d mean;        ///< q [1/m, s/m^2, 1/m, s/m^2]
  Eigen::Matrix4d covariance;  ///< P; positive definite
};

/// Belief about how the body turns with its wheels. Nothing here allocates.
class TurnModel {
 public:
  static constexpr double kTimeConstant = 120;  ///< T, time of turning over which the coefficients are averaged [s]
  static constexpr double kTurn = 0.15;         ///< least |v| of a straight line to learn from [m/s]

  /// @param ratio alpha / b_hat as configured [1/m]; @param range factor by which d theta_dot/dx may differ from it.
  explicit TurnModel(double ratio, double range = GeometryParameters::kTrackRange);

  /// theta_dot of the body [rad/s]. @param x difference, @param v mean of the wheels' circumference speeds [m/s].
  double yawRate(double x, double v) const;

  /// theta_dot on ground as it usually is, h = 0 [rad/s].
  double usualYawRate(double x, double v) const;

  /// d theta_dot/dx at a motion [1/m]; within the range, and positive.
  double perDifference(double x, double v) const;

  /// d theta_dot/dv at a motion [1/m].
  double perSpeed(double x, double v) const;

  /// x [m/s] that turns the body with theta_dot [rad/s] at v [m/s]: the inverse of yawRate().
  double difference(double yaw_rate, double v) const;

  /// True for a yaw rate [rad/s] that a robot within the range, and what its body does beside, can have.
  bool plausible(double yaw_rate, double x, double v) const;

  /// A ratio [1/m] within the range.
  double bounded(double ratio) const;

  /// The ground changes for a time [s].
  void pass(double step);

  /// What a yaw rate is off [rad/s], beside speeds of the wheels that were measured with it [m/s].
  double error(double yaw_rate, double x, double v) const;

  /// Takes an error() of a turn.
  /// @param x believed before the measurement [m/s], as v: with the encoders' noise in both, the error and what it is
  /// put down to, a steady turn would seem not to depend on x; @param v likewise [m/s]; @param variance of the error
  /// [(rad/s)^2]; @param step since the last one [s].
  void learn(double error, double x, double v, double variance, double step);

  /// Takes an error() of a straight line, which tells how it veers; slower than kTurn it is ignored.
  void learnVeer(double error, double x, double v, double variance, double step);

  double inPlace() const { return mean_(0); }               ///< q_1 [1/m]
  double ground() const { return mean_(4); }                ///< h
  Eigen::Vector4d mean() const { return mean_.head<4>(); }  ///< q
  TurnCoefficients coefficients() const;                    ///< q and P

  /// Goes on from others, within the range. @throws ParameterError if they are not finite or P is not positive
  /// definite.
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
