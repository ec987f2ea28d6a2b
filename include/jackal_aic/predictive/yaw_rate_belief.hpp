#pragma once

/// @file
/// Belief about the yaw rate: the wheels say how it changes, the gyro what it is.
///
/// A skid-steer robot turns as its wheels do only on average: tyres creep, and the body follows the wheels late. So the
/// yaw rate is a state of its own, driven by the wheels' accelerations and corrected by the gyro alone:
///
///     d theta_dot/dt = a + fluctuation,     theta_dot_measured = theta_dot + noise of Sigma_g
///
/// with the acceleration a of the turn that the wheels ask for (SlipBelief::yawAcceleration()). The fluctuation's
/// variance grows by Q per second. Beside it stands what the wheels asked for and the body may not have done yet, e,
/// de/dt = a - e/sigma_y: its square is added to the variance P of the
/// prediction, so that the gyro alone is believed while the robot turns in. A measurement takes the natural gradient of
/// 1/2 (y - theta_dot)^2 / Sigma_g + 1/2 (theta_dot - prior)^2 / P. Whatever track is believed, the estimate is
/// unbiased in a steady turn.

namespace jackal_aic {

/// Trust of a YawRateBelief in its sources.
struct YawRateBeliefParameters {
  double gyro_variance = 2.5e-5;  ///< Sigma_g [(rad/s)^2]
  double process_noise = 1e-4;    ///< Q, growth of the variance [(rad/s)^2/s]
  double deviation = 0.05;        ///< sigma_y, standard deviation of the body's delay behind the wheels [s]
};

/// Belief about the yaw rate of the body. Does not allocate.
class YawRateBelief {
 public:
  /// Begins with a robot that does not turn.
  explicit YawRateBelief(const YawRateBeliefParameters& parameters) : parameters_(parameters) { reset(0.0); }

  /// Moves on by a step [s] in which the wheels ask for this yaw acceleration [rad/s^2].
  void predict(double acceleration, double step);

  /// Takes a measured yaw rate [rad/s]. Returns its part of the free energy.
  double correct(double measurement);

  /// Takes the yaw rate of the wheels [rad/s] where there is no gyro. @param variance of it [(rad/s)^2].
  void follow(double yaw_rate, double variance);

  /// Goes on with other trust in its sources.
  void setParameters(const YawRateBeliefParameters& parameters) { parameters_ = parameters; }

  /// Starts at this yaw rate [rad/s].
  void reset(double yaw_rate);

  double yawRate() const { return yaw_rate_; }                               ///< [rad/s]
  double variance() const { return variance_ + unfollowed_ * unfollowed_; }  ///< of it [(rad/s)^2]

 private:
  YawRateBeliefParameters parameters_;
  double yaw_rate_ = 0.0;
  double variance_ = 0.0;    // after the last measurement, and fluctuation since
  double unfollowed_ = 0.0;  // e [rad/s]
};

}  // namespace jackal_aic
