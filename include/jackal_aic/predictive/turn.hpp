#pragma once

/// @file
/// Turn of a skid-steer body with its wheels, learned on line by one Kalman filter.
///
/// With x = r (w_R - w_L) the difference and v = r (w_L + w_R)/2 the mean of the wheels' circumference speeds,
///
///     theta_dot = q_1 x + q_2 x |v| + q_3 v + q_4 v |x| + h c x
///
/// The slow part q belongs to the robot and is kept for the next start: q_1 is alpha/b_hat of eq. 3-1 turning in place,
/// q_2 its change with the forward speed, q_3 the veer of a straight drive, q_4 the difference of left and right turns.
/// Wheels and gyro determine alpha/b_hat only, so alpha is as configured. The fast part h is the present ground's share
/// of the configured ratio c. It fades to 0, whether the robot turns or rests:
///
///     dh/dt = -h/T_h + noise, so that h has the deviation sigma_h
///
/// A turn updates both by their uncertainty P: a new robot learns q from its first turn, and a robot that has turned
/// for minutes takes a change for the ground. In an arc, veer and ratio look alike. So only a straight line moves q_3,
/// and its uncertainty counts in the innovations of turns (a Schmidt-Kalman filter). What was measured is forgotten
/// over a time T of such motion, down to the prior: dP/dt = (P - P P_0^-1 P) / T. A body that skids chatters: its yaw
/// rate has white noise of spectral density s (c x)^2, which differs by a factor of a hundred between a smooth floor
/// and rough ground. So s is learned: the mean of the squared error that neither the sensors nor P explain, over N
/// times T_h. The ground makes it veer by as much as unlike tyres do, for a time T_h.
///
/// Learning is earned, bounded and taken back. A difference of the wheel speeds that is not significant is a straight
/// line. An error beyond three deviations of what robots and grounds do is a sensor's, and teaches nothing. The ratio
/// stays within `range` of the configured one, the other coefficients within three deviations of their prior. In an arc
/// a lateral acceleration v theta_dot of a body that turns faster than the gyro reads tells slippery ground from a
/// wrong gyro. The last seconds of turning are withdrawn when a sensor proves faulty.

#include <Eigen/Core>
#include <optional>

#include "jackal_aic/model/geometry.hpp"
#include "jackal_aic/model/turn_agreement.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Belief about the coefficients.
struct TurnCoefficients {
  Eigen::Vector4d mean;        ///< q [1/m, s/m^2, 1/m, s/m^2]
  Eigen::Matrix4d covariance;  ///< P; positive definite
};

/// The learned turn, kept for the next start.
struct SlipState {
  double effective_track;                               ///< b_hat on the usual ground, turning in place [m]
  double slip_factor;                                   ///< alpha to which the track belongs
  std::optional<TurnCoefficients> turn = std::nullopt;  ///< dependence of the turn on the motion; empty: unknown
};

/// A measured turn.
struct TurnSample {
  double yaw_rate;     ///< by the gyro [rad/s]
  double lateral;      ///< acceleration of the body to its left [m/s^2]; 0: unknown
  WheelVector wheels;  ///< measured speeds [rad/s]
  WheelVector before;  ///< the same, as believed before the measurement [rad/s]
  double variance;     ///< of the yaw rate minus that of the wheels, by the sensors [(rad/s)^2]
};

/// Belief about the turn of the body with its wheels. Wheel speeds are in rad/s. Nothing here allocates.
class Turn {
 public:
  /// @param configured values to start from and centre of the range; @param wheel_radius r [m];
  /// @param range largest ratio of the learned and the configured turn.
  Turn(const SlipState& configured, double wheel_radius, double range = GeometryParameters::kTrackRange);

  /// theta_dot of the body [rad/s].
  double yawRate(const WheelVector& wheels) const;

  /// theta_dot on the usual ground, h = 0 [rad/s].
  double usualYawRate(const WheelVector& wheels) const;

  /// d theta_dot / d(w_R - w_L); positive, and within the range.
  double yawPerDifference(const WheelVector& wheels) const;

  /// w_R - w_L that turns the body with a yaw rate [rad/s] at a mean of the wheel speeds: the inverse of yawRate().
  double wheelDifference(double yaw_rate, double mean) const;

  /// Wheel speeds for a forward speed [m/s] and a yaw rate [rad/s] of the body.
  WheelVector wheelSpeeds(double forward, double yaw_rate) const;

  /// Advances the ground by a time [s].
  void pass(double step);

  /// Learns from a measurement. @param least significant |w_R - w_L| [rad/s]; @param step since the last
  /// measurement [s].
  void learn(const TurnSample& sample, double least, double step);

  /// The gyro or an encoder is faulty: withdraws what was learned in the last 2 s of turning, or more.
  void withdraw();

  /// Present belief.
  SlipState state() const;

  /// Sets a state, e.g. that of the last run, within the range. @throws ParameterError if a coefficient is not finite
  /// or P is not positive definite.
  void setState(const SlipState& state);

  double slipFactor() const { return slip_factor_; }               ///< alpha
  double effectiveTrack() const;                                   ///< b_hat in force, turning in place [m]
  Eigen::Vector4d mean() const { return belief_.mean.head<4>(); }  ///< q

 private:
  using State = Eigen::Matrix<double, 5, 1>;

  /// Belief about (q, h), and s.
  struct Belief {
    State mean = State::Zero();
    Eigen::Matrix<double, 5, 5> covariance = Eigen::Matrix<double, 5, 5>::Zero();
    double chatter = 0.0;   // s [s]
    double evidence = 0.0;  // N
  };

  State motion(double x, double v) const;
  double ratio(double x, double v, double ground) const;
  bool contradicted(const TurnSample& sample, double v, double step);
  void forget(double step);
  void learnChatter(double unexplained, double step);
  void correct(double error, const State& phi, double variance);
  void bound();
  void keep(double step);

  double slip_factor_;
  double configured_;  // c
  double radius_;
  double range_;
  Eigen::Vector4d prior_;          // variances of q before the first turn
  Belief belief_, recent_, kept_;  // now, and at the last two ends of a kTrustTime
  double trusted_ = 0.0;           // time of turning since recent_ [s]
  TurnAgreement arc_;              // of lateral acceleration and v theta_dot
};

}  // namespace jackal_aic
