#pragma once

/// @file
/// Belief about the forward speed with the accelerometer mapped to its first order.
///
/// The wheels say what the speed is, v_w = r alpha (w_L + w_R)/2 of variance Sigma_w; the accelerometer says how it
/// changes. A point of the body sees the centripetal acceleration beside dx_dot/dt,
///
///     a_x = dx_dot/dt - theta_dot y_dot,    y_dot = -l theta_dot,
///
/// because the robot turns about a centre that lies l ahead of the IMU. So the belief x_dot descends
///
///     F = 1/2 (v_w - x_dot)^2 / Sigma_w + 1/2 (x_dot - x_dot_prior)^2 / P,
///     x_dot_prior = x_dot + h (a_x - l theta_dot^2)
///
/// over a period h, to the minimum x_dot = v_w + weight (x_dot_prior - v_w), weight = Sigma_w / (Sigma_w + P). The
/// weight is chosen: how far wheels can be trusted depends on the ground, which no noise tells. Kept is the difference
/// from the wheels, so that weight 0 is the wheels' speed to the bit, and the belief moves on with them between two
/// measurements.

namespace jackal_aic {

/// Trust of a ForwardSpeedBelief in the accelerometer.
struct ForwardSpeedBeliefParameters {
  double weight = 0.0;          ///< of the accelerometer's prediction, 0 (wheels alone) to below 1
  double turning_centre = 0.0;  ///< l, how far the centre of turning lies ahead of the IMU [m]
};

/// Belief about the forward speed of the body. Does not allocate.
class ForwardSpeedBelief {
 public:
  /// Longest time that one acceleration stands for [s]; after a longer one the wheels are believed.
  static constexpr double kLongestStep = 0.1;

  /// Begins with the speed of the wheels.
  explicit ForwardSpeedBelief(const ForwardSpeedBeliefParameters& parameters) : parameters_(parameters) {}

  /// Takes a forward acceleration free of gravity [m/s^2], of variance [(m/s^2)^2]. @param wheels v_w now
  /// [m/s]; @param yaw_rate theta_dot [rad/s]; @param step since the last measurement [s].
  void correct(double wheels, double acceleration, double variance, double yaw_rate, double step);

  /// Goes on with other trust in the accelerometer.
  void setParameters(const ForwardSpeedBeliefParameters& parameters) { parameters_ = parameters; }

  /// Believes the wheels, v_w [m/s].
  void reset(double wheels);

  double difference() const { return difference_; }  ///< x_dot - v_w [m/s]
  double variance() const { return variance_; }      ///< of it, by the accelerometer's noise [(m/s)^2]

 private:
  ForwardSpeedBeliefParameters parameters_;
  double wheels_ = 0.0;  // v_w at the last measurement [m/s]
  double difference_ = 0.0;
  double variance_ = 0.0;
};

}  // namespace jackal_aic
