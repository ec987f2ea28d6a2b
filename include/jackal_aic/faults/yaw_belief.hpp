#pragma once

/// @file
/// What the gyro should read while the wheels turn: a belief about the slip in a turn and the gyro's bias, for fault
/// detection.
///
///     theta_dot = s x + beta + noise,    x = r alpha (w_R - w_L),    s = 1 / b_hat
///
/// In a steady turn only the sum s x + beta is observable: what noise and drift do to it must not wander into the bias.
/// So beta is learned where the slip says less than the noise, at rest and on a straight line, and s in turns, each by
/// a scalar Kalman filter that counts the other's variance as noise (a Schmidt-Kalman, or consider, filter without the
/// covariance of the two).
///
/// Tyres that are not alike turn a robot on a straight line by its speed, which looks like a bias that changes with it.
///
/// Motion of the body that its wheels do not explain goes on from sample to sample: then the bias is a mean of at least
/// kErrorTime.
///
/// s changes with the motion (a skid-steer robot that drives a fast arc turns as if its track were narrower: on the
/// simulated ground b_hat goes from 0.55 m to 0.38 m) and beta hardly ever: what changes while the motion stays is
/// suspect.

#include <algorithm>
#include <limits>

namespace jackal_aic {

/// Trust of a YawBelief in its sources.
struct YawBeliefParameters {
  double gyro_variance = 2.5e-5;  ///< Sigma_g of the measured yaw rate [(rad/s)^2]
  double slip_deviation = 0.15;   ///< standard deviation of s, relative, after a change of the motion by kMotionScale
  double slip_drift = 0.05;       ///< standard deviation of s, relative, after a second of the same motion
  double bias_deviation = 0.02;   ///< standard deviation of beta at the start [rad/s]
};

/// Beliefs about s and beta. Nothing here allocates.
class YawBelief {
 public:
  /// Change of the forward speed, or of x, after which little is known about s [m/s].
  static constexpr double kMotionScale = 0.5;

  /// Time in which such motion is one error [s].
  static constexpr double kErrorTime = 0.5;

  /// @param effective_track b_hat at the start [m].
  YawBelief(double effective_track, const YawBeliefParameters& parameters);

  /// Lets time pass [s]. @param recent_change how much the motion changed lately, in multiples of kMotionScale; @param
  /// memory what "lately" means [s]; @param recent_turn how much what unlike tyres turn the robot by changed lately, at
  /// most [rad/s].
  void predict(double recent_change, double memory, double step, double recent_turn = 0.0) {
    const double moved = parameters_.slip_deviation * given_slope_ * recent_change;
    slope_variance_ = std::min(slope_variance_ + (moved * moved / memory + drift_) * step, largest_slope_variance_);
    // However long it was not seen, it is not wider than that of a gyro without a sample.
    bias_variance_ = std::min(bias_variance_ + (kBiasDrift * kBiasDrift + recent_turn * recent_turn / memory) * step,
                              std::max(bias_variance_, parameters_.bias_deviation * parameters_.bias_deviation));
  }

  /// theta_dot - (s x + beta) [rad/s].
  double error(double yaw_rate, double x) const { return yaw_rate - slope_ * x - bias_; }

  /// Variance of error(). @param x_variance of x [(m/s)^2].
  double variance(double x, double x_variance) const;

  /// Takes a yaw rate [rad/s]. @param noise_factor lambda: the noise's variance in multiples of the configured one;
  /// @param settled the motion has not changed for a while. Else nothing is learned of the bias: a body that begins to
  /// turn before its encoders tell would be one; @param step since the last one [s]; endless if
  /// the body is at rest.
  void correct(double yaw_rate, double x, double x_variance, double noise_factor, bool settled = true,
               double step = std::numeric_limits<double>::infinity());

  /// Forgets how much it knows, but not what: both slip and bias may have jumped. @param bias_deviation of beta
  /// [rad/s].
  void inflate(double bias_deviation);

  double slope() const { return slope_; }                         ///< s [1/m]
  double bias() const { return bias_; }                           ///< beta [rad/s]
  double biasVariance() const { return bias_variance_; }          ///< of beta [(rad/s)^2]
  double relativeSlope() const { return slope_ / given_slope_; }  ///< s in multiples of the one at the start

 private:
  static constexpr double kBiasDrift = 1e-3;  // of beta after a second [rad/s]

  bool biasObservable(double x) const;

  YawBeliefParameters parameters_;
  double given_slope_;
  double slope_;
  double bias_ = 0.0;
  double drift_;                   // of s [1/m^2/s]
  double largest_slope_variance_;  // [1/m^2]
  double slope_variance_;
  double bias_variance_;
};

}  // namespace jackal_aic
