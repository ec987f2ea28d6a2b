#pragma once

/// @file
/// Belief about how the body follows the wheels: effective track b_hat and slip alpha of eq. 3-1, learned on line.
///
/// With the wheel speeds w_L, w_R, n = w_R - w_L, m = (w_L + w_R)/2, eq. 3-1 predicts
///
///     theta_dot = r q n,  q = alpha / b_hat        gyro
///     x_ddot    = r alpha dm/dt                    accelerometer
///
/// Wheels and gyro together see the ratio q only: no turn tells alpha from b_hat, and a straight line at constant speed
/// tells nothing. What separates them is the change of the forward speed, which the accelerometer measures.
///
/// On a real robot q depends on the motion, and on the ground that it has just come to. So
///
///     theta_dot = g f(r n, r m)
///
/// where f is learned over minutes (turn_model.hpp) and the correction g, about 1, over half a second. Each parameter
/// descends the part of the free energy that depends on it,
///
///     F = 1/2 eps_g^2 / Sigma_g + 1/2 eps_v^2 / Sigma_v,    eps_g = theta_dot - g f,    eps_v = A - alpha r W,
///     dg/dt = -kappa_g dF/dg = kappa_g eps_g f / Sigma_g,   dalpha/dt = kappa_alpha eps_v r W / Sigma_v,
///
/// where A and r W are the changes of the forward speed by the accelerometer and by the wheels, both through one
/// washout filter 1/(s + 1/T): comparing speeds instead of accelerations makes a delay between the two sensors
/// harmless. The learning rates kappa are the inverse of the curvature of F summed over a forgetting memory (natural
/// gradient); the turn and alpha are coordinates in which it is diagonal. So alpha learned on a straight line leaves
/// every turn as it was, and b_hat = alpha / (g q_1) follows. Learning is gated on excitation (n, W), so that noise
/// cannot move what is not observed, and bounded. What f learns is taken out of g: the turn in force does not jump.
///
/// g learns from the difference of the believed speeds. Measured ones hold the encoders' noise and resolution as errors
/// in the regressor: they draw g towards zero, on a straight line all the way. An error of the believed difference
/// given what was measured does not; its variance adds (dtheta_dot/dn)^2 Var(n) to Sigma_g, and so does the square of
/// what is measured off it, where that is more than usual: a motor that needs longer than its model is no slip. And it
/// has to be a turn: |n| above five standard deviations, of the belief or of what measurements were lately off it,
/// whichever is larger, so that the steps of an encoder are no turn however coarse they are. Tyres that break away take
/// their time: Sigma_g has the square of what n changed over two standard deviations of the yaw's delay, times the
/// slope, which fades as the body comes after its wheels. f learns in turns that are large beside the steps of an
/// encoder, from the measured speeds: believed ones are led by a wrong model of the drive train, which half a second
/// forgives and minutes do not.
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
  double effective_track;                               ///< b_hat in force, turning in place [m]
  double slip_factor;                                   ///< alpha, ratio of body to wheel circumference speed
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
  double gyro_variance = 2.5e-5;           ///< Sigma_g of the yaw rate [(rad/s)^2]
  double accelerometer_variance = 2.5e-3;  ///< of the forward acceleration [(m/s^2)^2]
  double memory = 0.5;                     ///< excited time over which the correction g is averaged [s]
  double yaw_delay_deviation = 0.05;       ///< standard deviation of the delay of the yaw behind the wheels [s]
  double excitation = 0.5;                 ///< least |n| to learn g from, whatever is known of it [rad/s]
  double range = 1.5;                      ///< factor by which the turn may differ from the configured one
};

/// Belief about b_hat and alpha. Nothing here allocates.
class SlipBelief {
 public:
  static constexpr double kAlphaRange = 2.0;  ///< of alpha, a factor to either side of the configured value
  static constexpr double kTrustTime = 2.0;   ///< time of turning that a sensor which is excluded loses at least [s]

  /// @param configured values to start from and centre of the range; @param wheel_radius r [m].
  SlipBelief(const SlipState& configured, double wheel_radius, const SlipLearning& learning);

  /// Learns the turn from a yaw rate [rad/s] if n is beyond doubt. @param n as believed: its change tells how much a
  /// delay of the yaw falsifies the comparison; @param step since the last measurement [s].
  void learnTrack(double yaw_rate, const WheelDifference& n, double step);

  /// The gyro or an encoder is faulty: what was learned in the last kTrustTime of turning is withdrawn.
  void withdraw();

  /// Part of the last yaw rate's prediction error that learnTrack() removed, 0..1.
  double trackGain() const { return track_gain_; }

  /// Takes a forward acceleration of the body [m/s^2], free of gravity: at standstill it teaches the accelerometer's
  /// offset, else it is filtered for learnAlpha(). @param left, right wheel speeds [rad/s]; @param step since the last
  /// measurement [s].
  void observeAcceleration(double acceleration, double left, double right, double step);

  /// No acceleration was measured, or none that counts, for a step [s]: what the wheels did meanwhile teaches no alpha,
  /// and after half a second nothing does until the robot has rested.
  void missAcceleration(double step);

  /// Learns alpha from the accelerations observed. A turn is left out, because there the accelerometer sees more than
  /// dx_dot/dt.
  void learnAlpha();

  /// Goes on with other trust in its sources.
  void setLearning(const SlipLearning& learning) { learning_ = learning; }

  /// Goes on with other variances of the sensors, as in SlipLearning.
  void setVariances(double gyro, double accelerometer) {
    learning_.gyro_variance = gyro;
    learning_.accelerometer_variance = accelerometer;
  }

  /// What is believed now.
  SlipState state() const { return {effectiveTrack(), alpha_, turn_.coefficients()}; }

  double effectiveTrack() const { return alpha_ / (correction_ * turn_.inPlace()); }  ///< b_hat, turning in place [m]
  double slipFactor() const { return alpha_; }                                        ///< alpha
  const TurnModel& turn() const { return turn_; }                                     ///< f

  /// theta_dot of the body whose wheels turn at these speeds [rad/s].
  double yawRate(double left, double right) const;

  /// theta_dot by f alone, as it was in the minutes before, at these speeds of the wheels [rad/s].
  double usualYawRate(double left, double right) const;

  /// d theta_dot/dn at these speeds of the wheels [rad/s].
  double yawPerDifference(double left, double right) const;

  /// d theta_dot/dt [rad/s^2] at these speeds [rad/s] and accelerations [rad/s^2] of the wheels.
  double yawAcceleration(const WheelVector& speed, const WheelVector& acceleration) const;

  /// Wheel speeds for a forward speed [m/s] and a yaw rate [rad/s] of the body.
  WheelCommand wheelSpeeds(double forward, double yaw_rate) const;

  /// Difference n of the wheel speeds [rad/s] that turns the body with theta_dot [rad/s] at their mean m [rad/s].
  double wheelDifference(double yaw_rate, double mean) const;

  double alphaVariance() const { return 1.0 / alpha_curvature_; }  ///< of alpha

  /// Goes on with what was learned after a time of which nothing is known.
  void forgetMotion();

  /// Goes on from another state, e.g. that of the last run, within the range.
  void setState(const SlipState& state);

  /// Offset of the accelerometer as learned at standstill [m/s^2].
  double accelerometerOffset() const { return offset_; }

 private:
  bool agrees(double yaw_rate, double x, double v, double step);
  bool turns(const WheelDifference& n, double step);
  double changeOf(const WheelDifference& n, double step);
  double boundedAlpha(double alpha) const;
  double boundedCorrection(double correction) const;
  void keep(const WheelDifference& n, double step);
  void learnTurn(double yaw_rate, const WheelDifference& n, double variance, double step);

  SlipState configured_;
  double radius_;
  SlipLearning learning_;
  struct Kept {
    TurnModel turn;
    double correction;
  };
  TurnModel turn_;           // f
  double correction_ = 1.0;  // g
  double alpha_;
  double correction_curvature_;    // sum of f^2 / Sigma_g
  double alpha_curvature_;         // sum of (r W)^2 / Sigma_v
  double mean_speed_ = 0.0;        // of the wheels, at the last sample [rad/s]
  double by_wheels_ = 0.0;         // r W [m/s]
  double by_accelerometer_ = 0.0;  // A [m/s]
  double offset_ = 0.0;
  Kept kept_, recent_;       // turn_ and correction_ of kTrustTime ago at least, and of later
  double trusted_ = 0.0;     // time of turning since recent_ [s]
  TurnAgreement agreement_;  // of gyro and wheels
  double track_gain_ = 0.0;
  double error_variance_ = 0.0;  // of the believed difference of the wheel speeds, as measured [(rad/s)^2]
  double changed_ = 0.0;         // n, since some time ago [rad/s]
  double difference_ = 0.0;      // of the wheel speeds, at the last sample [rad/s]
  double step_ = 0.0;            // to the last sample [s]
  double missed_ = 0.0;          // time without an acceleration that has not been made up for by rest [s]
  bool started_ = false;
};

}  // namespace jackal_aic
