#pragma once

/// @file
/// Belief about the turn of the body with its wheels: effective track b_hat of eq. 3-1, learned on line.
///
/// Wheels and gyro determine the ratio alpha / b_hat only, so alpha is as configured. On a real robot the ratio depends
/// on the motion and on the present ground (turn_model.hpp). It is learned only from significant turns: n = w_R - w_L
/// above five standard deviations of the recent innovations. Coarse encoder steps are not a turn, and noise of the
/// regressor would draw the ratio towards zero. Tyres break away late, so the variance of the yaw rate includes the
/// square of the slope times the change of n over two standard deviations of the yaw's delay. This part fades as the
/// body follows its wheels. The variance of the encoders is added.
///
/// Wheels and gyro alone cannot distinguish slippery ground from a gyro with a wrong scale. So the turn stays within
/// `range` of the configured one, and a yaw rate beyond it is not learned from; nor one that the lateral acceleration
/// v theta_dot of an arc contradicts: a body that turns faster than the gyro reads. The recent part of an excluded
/// channel is withdrawn.

#include <optional>

#include "jackal_aic/model/turn_agreement.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/predictive/turn_model.hpp"

namespace jackal_aic {

/// The learned turn, kept for the next start.
struct SlipState {
  double effective_track;                               ///< b_hat on the usual ground, turning in place [m]
  double slip_factor;                                   ///< alpha to which the track belongs
  std::optional<TurnCoefficients> turn = std::nullopt;  ///< dependence of the turn on the motion; empty: unknown
};

/// Belief about the difference n = w_R - w_L and mean m of the wheel speeds.
struct WheelDifference {
  double value;       ///< n [rad/s]
  double variance;    ///< of n, as believed [(rad/s)^2]
  double rate;        ///< dn/dt of the model [rad/s^2]
  double error;       ///< measured minus believed [rad/s]
  double mean;        ///< m, as believed [rad/s]
  double mean_error;  ///< measured minus believed [rad/s]
};

/// Variances and bounds of a SlipBelief.
struct SlipLearning {
  double gyro_variance = 2.5e-5;      ///< Sigma_g of the yaw rate [(rad/s)^2]
  double yaw_delay_deviation = 0.05;  ///< standard deviation of the delay of the yaw behind the wheels [s]
  double excitation = 0.5;            ///< least |n| to learn from [rad/s]
  double range = 1.5;                 ///< largest ratio of learned and configured turn
};

/// Belief about b_hat. Nothing here allocates.
class SlipBelief {
 public:
  static constexpr double kTrustTime = 2.0;  ///< least withdrawn time of turning [s]

  /// @param configured values to start from and centre of the range; @param wheel_radius r [m].
  SlipBelief(const SlipState& configured, double wheel_radius, const SlipLearning& learning);

  /// Learns the turn from a yaw rate [rad/s] if n is significant. @param lateral acceleration [m/s^2], 0 if unknown;
  /// @param n as believed; its change bounds the error by a delay of the yaw; @param step since the last measurement
  /// [s].
  void learnTrack(double yaw_rate, double lateral, const WheelDifference& n, double step);

  /// The gyro or an encoder is faulty: withdraws what was learned in the last kTrustTime of turning.
  void withdraw();

  /// Adopts other variances.
  void setLearning(const SlipLearning& learning) { learning_ = learning; }

  /// Present belief.
  SlipState state() const { return {slipFactor() / turn_.inPlace(), slipFactor(), turn_.coefficients()}; }

  /// b_hat in force, turning in place [m].
  double effectiveTrack() const { return slipFactor() / turn_.perDifference(0.0, 0.0); }
  double slipFactor() const { return configured_.slip_factor; }  ///< alpha
  const TurnModel& turn() const { return turn_; }                ///< as learned

  /// theta_dot of the body whose wheels turn at these speeds [rad/s].
  double yawRate(double left, double right) const;

  /// theta_dot on the usual ground, at these speeds of the wheels [rad/s].
  double usualYawRate(double left, double right) const;

  /// d theta_dot/dn at these speeds of the wheels [rad/s].
  double yawPerDifference(double left, double right) const;

  /// d theta_dot/dt [rad/s^2] at these speeds [rad/s] and accelerations [rad/s^2] of the wheels.
  double yawAcceleration(const WheelVector& speed, const WheelVector& acceleration) const;

  /// Wheel speeds for a forward speed [m/s] and a yaw rate [rad/s] of the body.
  WheelCommand wheelSpeeds(double forward, double yaw_rate) const;

  /// Difference n of the wheel speeds [rad/s] that turns the body with theta_dot [rad/s] at their mean m [rad/s].
  double wheelDifference(double yaw_rate, double mean) const;

  /// Sets a state, e.g. that of the last run, within the range.
  void setState(const SlipState& state);

 private:
  bool agrees(double yaw_rate, double lateral, double x, double v, double step);
  bool turns(const WheelDifference& n, double step);
  double uncertainty(const WheelDifference& n) const;
  double changeOf(const WheelDifference& n, double step);
  void keep(const WheelDifference& n, double step);

  SlipState configured_;
  double radius_;
  SlipLearning learning_;
  TurnModel turn_;
  TurnModel kept_, recent_;      // turn_ at the last two ends of a kTrustTime; kept_ is the older
  double trusted_ = 0.0;         // time of turning since recent_ [s]
  TurnAgreement agreement_;      // of gyro and wheels
  TurnAgreement lateral_, arc_;  // of lateral acceleration and v theta_dot of the gyro, both with that of the wheels
  double error_variance_ = 0.0;  // of the believed difference of the wheel speeds, as measured [(rad/s)^2]
  double changed_ = 0.0;         // recent change of n [rad/s]
};

}  // namespace jackal_aic
