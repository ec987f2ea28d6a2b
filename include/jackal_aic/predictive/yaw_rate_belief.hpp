#pragma once

/// @file
/// Belief about the yaw rate: predicted by the wheels' accelerations, corrected by the gyro.
///
/// A skid-steer robot turns with its wheels only on average: tyres creep, and the body follows late. So the yaw rate is
/// a separate state, driven by the acceleration a of the wheels' turn and corrected by the gyro:
///
///     d theta_dot/dt = a + fluctuation,     theta_dot_measured = theta_dot + noise of Sigma_g
///
/// The fluctuation's variance grows by Q per second. The part of the turn that the body may not have followed yet is e,
/// de/dt = a - e/sigma_y. Its square is added to the variance P of the prediction, so that the gyro alone counts while
/// the robot turns in. The estimate is unbiased in a steady turn with any believed track.

namespace jackal_aic {

/// Variances of a YawRateBelief.
struct YawRateBeliefParameters {
  double gyro_variance = 2.5e-5;  ///< Sigma_g [(rad/s)^2]
  double process_noise = 1e-4;    ///< Q, growth of the variance [(rad/s)^2/s]
  double deviation = 0.05;        ///< sigma_y, standard deviation of the body's delay behind the wheels [s]
};

/// Belief about the yaw rate of the body. Does not allocate.
class YawRateBelief {
 public:
  /// Starts with a yaw rate of zero.
  explicit YawRateBelief(const YawRateBeliefParameters& parameters) : parameters_(parameters) { reset(0.0); }

  /// Advances by a step [s] with this yaw acceleration of the wheels [rad/s^2].
  void predict(double acceleration, double step) {
    yaw_rate_ += acceleration * step;
    variance_ += parameters_.process_noise * step;
    const double followed = parameters_.deviation > step ? step / parameters_.deviation : 1.0;
    unfollowed_ += acceleration * step - followed * unfollowed_;
  }

  /// Takes a measured yaw rate [rad/s]. Returns its part of the free energy.
  double correct(double measurement) {
    const double error = measurement - yaw_rate_, S = variance() + parameters_.gyro_variance;
    const double gain = variance() / S;
    yaw_rate_ += gain * error;
    variance_ = (1.0 - gain) * variance();
    return 0.5 * error * error / S;
  }

  /// Takes the yaw rate of the wheels [rad/s] in place of the gyro. @param variance of it [(rad/s)^2].
  void follow(double yaw_rate, double variance) {
    yaw_rate_ = yaw_rate;
    variance_ = variance;
    unfollowed_ = 0.0;
  }

  /// Adopts other variances.
  void setParameters(const YawRateBeliefParameters& parameters) { parameters_ = parameters; }

  /// Starts at this yaw rate [rad/s].
  void reset(double yaw_rate) { follow(yaw_rate, parameters_.gyro_variance); }

  double yawRate() const { return yaw_rate_; }                               ///< [rad/s]
  double unfollowed() const { return unfollowed_; }                          ///< e [rad/s]
  double variance() const { return variance_ + unfollowed_ * unfollowed_; }  ///< of the yaw rate [(rad/s)^2]

 private:
  YawRateBeliefParameters parameters_;
  double yaw_rate_ = 0.0;
  double variance_ = 0.0;  // after the last measurement, and fluctuation since
  double unfollowed_ = 0.0;
};

}  // namespace jackal_aic
