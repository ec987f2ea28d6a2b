#pragma once

/// @file
/// How a skid-steer body turns, as it was learned over minutes: the effective track depends on the motion.
///
/// With x = r (w_R - w_L) the difference and v = r (w_L + w_R)/2 the mean of the wheels' circumference speeds,
///
///     theta_dot = phi(x, v)^T q = q_1 x + q_2 x |v| + q_3 v + q_4 v |x|
///
/// q_1 is eq. 3-1's alpha/b_hat turning in place, q_2 how it changes with the forward speed, q_3 how a straight drive
/// veers, q_4 how left and right turns differ. The coefficients q have a Gaussian belief N(q, P). A measured yaw rate y
/// of variance Sigma takes the natural gradient of the free energy F = 1/2 (y - phi^T q)^2 / Sigma, with the curvature
/// of F summed over a forgetting memory T on top of that of the prior, P_0^-1:
///
///     P^-1 <- P_0^-1 + (P^-1 - P_0^-1) T/(T + step) + phi phi^T / Sigma,     q <- q + P phi (y - phi^T q) / Sigma
///
/// The prior is wide for q_1 and narrow around zero for the others: where the data say no more, the robot has one
/// track. What the model misses (ground, tyres, slopes) stays for a while, so that a second of samples does not count
/// as that many measurements: Sigma has a part sigma_m^2 tau_m / step, which gives one independent measurement in
/// tau_m. How much it misses differs by ten times from a smooth floor to a skidding robot, and is learned from the
/// turns: sigma_m^2 descends F + 1/2 ln Sigma to the mean of what neither the sensor's variance nor the uncertainty of
/// q explains, max(0, eps^2 - Sigma_y - phi^T P phi), over N measurements, of which the first value counts as N_0.

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
  static constexpr double kTurn = 0.15;  ///< least |x| of a turn, and |v| of a straight line, to learn from [m/s]

  /// @param ratio alpha / b_hat as configured [1/m]; @param range factor by which d theta_dot/dx may differ from it.
  explicit TurnModel(double ratio, double range = GeometryParameters::kTrackRange);

  /// theta_dot of the body [rad/s], by a correction g. @param x difference, @param v mean of the wheels' circumference
  /// speeds [m/s].
  double yawRate(double x, double v, double correction = 1.0) const;

  /// d theta_dot/dx at a motion [1/m], by a correction g of it; within the range, and positive.
  double perDifference(double x, double v, double correction = 1.0) const;

  /// d theta_dot/dv at a motion [1/m].
  double perSpeed(double x, double v) const;

  /// x [m/s] that turns the body with theta_dot [rad/s] at v [m/s]: the inverse of yawRate().
  double difference(double yaw_rate, double v, double correction = 1.0) const;

  /// True for a yaw rate [rad/s] that a robot within the range, and what its body does beside, can have.
  bool plausible(double yaw_rate, double x, double v) const;

  /// A ratio [1/m] within the range.
  double bounded(double ratio) const;

  /// Takes a measured yaw rate [rad/s] of a turn, or of a straight line, which tells how it veers and forgets nothing;
  /// between the two it is ignored. @param variance of it, beside what the model misses [(rad/s)^2]; @param step
  /// since the last one [s].
  void learn(double yaw_rate, double x, double v, double variance, double step);

  double inPlace() const { return mean_(0); }            ///< q_1 [1/m]
  const Eigen::Vector4d& mean() const { return mean_; }  ///< q
  TurnCoefficients coefficients() const;                 ///< q and P

  /// Goes on from others, within the range. @throws ParameterError if they are not finite or P is not positive
  /// definite.
  void setCoefficients(const TurnCoefficients& coefficients);

 private:
  void learnError(double unexplained, double weight, double forgetting);
  void bound();

  double configured_;
  double range_;
  Eigen::Vector4d mean_;
  Eigen::Matrix4d prior_;        // P_0^-1
  Eigen::Matrix4d information_;  // P^-1
  Eigen::Matrix4d covariance_;   // P
  double model_error_;           // sigma_m^2 [(rad/s)^2]
  double error_evidence_;        // N
};

}  // namespace jackal_aic
