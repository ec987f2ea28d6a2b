#pragma once

/// @file
/// Belief about how the body turns with the wheels: effective track b_hat of eq. 3-1, learned on line.
///
/// Wheels and gyro see the ratio alpha / b_hat only: alpha is as configured. On a real robot it depends on the motion,
/// and on the ground that the robot has just come to (turn_model.hpp). From the measured wheel speeds the turn is
/// learned where it is beyond doubt: n = w_R - w_L above five standard deviations of what measurements were lately off
/// the belief, so that the steps of an encoder are no turn however coarse they are; noise of the regressor would draw
/// the ratio towards zero. Tyres that break away take their time: the variance of the yaw rate has the square of what n
/// changed over two standard deviations of the yaw's delay, times the slope, which fades as the body comes after its
/// wheels, and that of the encoders.
///
/// Trust is bounded. Wheels and gyro alone do not tell slippery ground from a gyro whose scale is wrong: the turn stays
/// within `range` of the configured one, and a yaw rate beyond it is no slip and is not learned from. What a channel
/// contributed before it was excluded is withdrawn.

#include <optional>

#include "jackal_aic/model/turn_agreement.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/predictive/turn_model.hpp"

namespace jackal_aic {

/// What is learned, and all that has to be kept for the next start.
struct SlipState {
  double effective_track;                               ///< b_hat on ground as it usually is, turning in place [m]
  double slip_factor;                                   ///< alpha that the track belongs to
  std::optional<TurnCoefficients> turn = std::nullopt;  ///< how the turn depends on the motion; empty: nothing known
};

/// What is believed about the difference n = w_R - w_L of the wheel speeds.
struct WheelDifference {
  double value;       ///< n [rad/s]
  double variance;    ///< of n, as believed [(rad/s)^2]
  double rate;        ///< dn/dt of the model [rad/s^2]
  double error;       ///< measured minus believed [rad/s]
  double mean;        ///< m, as believed [rad/s]
  double mean_error;  ///< measured minus believed [rad/s]
};

/// Trust of a SlipBelief in its sources.
struct SlipLearning {
  double gyro_variance = 2.5e-5;      ///< Sigma_g of the yaw rate [(rad/s)^2]
  double yaw_delay_deviation = 0.05;  ///< standard deviation of the delay of the yaw behind the wheels [s]
  double excitation = 0.5;            ///< least |n| to learn from, whatever is known of it [rad/s]
  double range = 1.5;                 ///< factor by which the turn may differ from the configured one
};

/// Belief about b_hat. Nothing here allocates.
class SlipBelief {
 public:
  static constexpr double kTrustTime = 2.0;  ///< time of turning that a sensor which is excluded loses at least [s]

  /// @param configured values to start from and centre of the range; @param wheel_radius r [m].
  SlipBelief(const SlipState& configured, double wheel_radius, const SlipLearning& learning);

  /// Learns the turn from a yaw rate [rad/s] if n is beyond doubt. @param n as believed: its change tells how much a
  /// delay of the yaw falsifies the comparison; @param step since the last measurement [s].
  void learnTrack(double yaw_rate, const WheelDifference& n, double step);

  /// The gyro or an encoder is faulty: what was learned in the last kTrustTime of turning is withdrawn.
  void withdraw();

  /// Goes on with other trust in its sources.
  void setLearning(const SlipLearning& learning) { learning_ = learning; }

  /// What is believed now.
  SlipState state() const { return {slipFactor() / turn_.inPlace(), slipFactor(), turn_.coefficients()}; }

  /// b_hat in force, turning in place [m].
  double effectiveTrack() const { return slipFactor() / turn_.perDifference(0.0, 0.0); }
  double slipFactor() const { return configured_.slip_factor; }  ///< alpha
  const TurnModel& turn() const { return turn_; }                ///< as learned

  /// theta_dot of the body whose wheels turn at these speeds [rad/s].
  double yawRate(double left, double right) const;

  /// theta_dot on ground as it usually is, at these speeds of the wheels [rad/s].
  double usualYawRate(double left, double right) const;

  /// d theta_dot/dn at these speeds of the wheels [rad/s].
  double yawPerDifference(double left, double right) const;

  /// d theta_dot/dt [rad/s^2] at these speeds [rad/s] and accelerations [rad/s^2] of the wheels.
  double yawAcceleration(const WheelVector& speed, const WheelVector& acceleration) const;

  /// Wheel speeds for a forward speed [m/s] and a yaw rate [rad/s] of the body.
  WheelCommand wheelSpeeds(double forward, double yaw_rate) const;

  /// Difference n of the wheel speeds [rad/s] that turns the body with theta_dot [rad/s] at their mean m [rad/s].
  double wheelDifference(double yaw_rate, double mean) const;

  /// Goes on from another state, e.g. that of the last run, within the range.
  void setState(const SlipState& state);

 private:
  bool agrees(double yaw_rate, double x, double v, double step);
  bool turns(const WheelDifference& n, double step);
  double uncertainty(const WheelDifference& n) const;
  double changeOf(const WheelDifference& n, double step);
  void keep(const WheelDifference& n, double step);

  SlipState configured_;
  double radius_;
  SlipLearning learning_;
  TurnModel turn_;
  TurnModel kept_, recent_;      // turn_ of kTrustTime ago at least, and of later
  double trusted_ = 0.0;         // time of turning since recent_ [s]
  TurnAgreement agreement_;      // of gyro and wheels
  double error_variance_ = 0.0;  // of the believed difference of the wheel speeds, as measured [(rad/s)^2]
  double changed_ = 0.0;         // n, since some time ago [rad/s]
};

}  // namespace jackal_aic
