#pragma once

/// @file
/// What the gyro should read while the wheels turn.
///
///     theta_dot = s x + beta + c v + e + noise,   x = r alpha (w_R - w_L),   s = 1 / b_hat
///
/// s: slip in a turn, beta: bias of the gyro, c: unlike tyres, e: of the ground, an Ornstein-Uhlenbeck process. In a
/// steady turn only the sum of the first three is observable, so they are one Kalman filter with their covariance.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "jackal_aic/faults/density.hpp"
#include "jackal_aic/faults/fault_parameters.hpp"
#include "jackal_aic/faults/jitter.hpp"
#include "jackal_aic/model/robot_range.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic::faults {

/// Kalman filter of s, beta, c and e. Does not allocate.
class YawPrediction {
 public:
  static constexpr double kGroundMemory = 0.3;  ///< of e: samples within it are no separate evidence [s]

  /// @param effective_track b_hat at the start [m]; @param on_box the body does not follow its wheels.
  YawPrediction(const FaultParameters& parameters, double effective_track, bool on_box);

  /// Lets a sample's time pass [s]. @param x [m/s]; @param x_change, v_change of x and v since the last sample, as
  /// predicted [m/s].
  void predict(double x, double x_change, double v_change, double step);

  /// Predicted yaw rate [rad/s]. @param x [m/s]; @param v [m/s].
  double mean(double x, double v) const { return row(x, v).dot(theta_) + e_.mean; }

  /// Variance of a measured yaw rate about mean() [(rad/s)^2]. @param x with its variance [m/s].
  double variance(const Normal& x, double v) const;

  /// Least |yaw rate| of a robot whose body follows its wheels on any ground [rad/s]. @param x with its variance [m/s].
  double leastTurn(const Normal& x) const {
    const double least = std::abs(x.mean) - thresholds::kSure * std::sqrt(x.variance);
    return given_slope_ / kSlopeRange * std::max(0.0, least);
  }

  /// Learns from a yaw rate. @param healthy probability that gyro and wheels agree; @param ground false: e explains
  /// nothing.
  void learn(double yaw_rate, const Normal& x, double v, double step, double healthy, bool ground = true);

  /// The ground may be another one. @param deviation of s, relative.
  void widen(double deviation) { P_(0, 0) = std::max(P_(0, 0), square(deviation * given_slope_)); }

  /// The same with an offset of the gyro of unknown size. @param deviation of it [rad/s].
  YawPrediction withOffset(double deviation) const;

  /// ln P(|beta| > least).
  double logBeyond(double least) const { return faults::logBeyond({theta_(1), P_(1, 1)}, least); }

  /// Mixture with another one of this weight, as one of the same mean and covariance.
  void mix(const YawPrediction& other, double weight);

  /// What happened meanwhile is unknown: e starts anew.
  void restart() { e_ = {0.0, ground_}; }

  double slope() const { return theta_(0); }          ///< s [1/m]
  double bias() const { return theta_(1); }           ///< beta [rad/s]
  double noise() const { return noise_.variance(); }  ///< of the gyro [(rad/s)^2]

 private:
  static constexpr double kLargestSlip = 0.3;       // standard deviation of s, relative
  static constexpr double kSlipDrift = 0.05;        // of s after a second of the same motion, relative
  static constexpr double kMotionScale = 0.5;       // change of a speed after which s has another slip_deviation [m/s]
  static constexpr double kBiasDrift = 1e-3;        // of beta after a second [rad/s]
  static constexpr double kUnlikeTyres = 0.01;      // of c, in multiples of s
  static constexpr double kSlopeRange = 2.0;        // factor about the given s
  static constexpr double kGroundDeviation = 0.01;  // of e, at least [rad/s]
  static constexpr double kGrip = 0.1;  // change of v that makes s uncertain by slip_deviation at once [m/s]

  static Eigen::Vector3d row(double x, double v) { return {x, 1.0, v}; }

  FaultParameters parameters_;
  double given_slope_;
  double largest_bias_;    // two deviations of its prior [rad/s]
  Eigen::Vector3d theta_;  // s, beta, c
  Eigen::Matrix3d P_;
  Normal e_;
  double ground_ = square(kGroundDeviation);  // variance of e
  Jitter noise_;
};

}  // namespace jackal_aic::faults
