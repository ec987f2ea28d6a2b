#pragma once

/// @file
/// Model predictive control of a wheel with the acceleration limit of its motor.

#include <Eigen/Core>

#include "kalman_filter.hpp"
#include "wheel_law.hpp"

namespace jackal_aic::sim {

/// Tuning of the model predictive controller.
struct MpcTuning {
  WheelBeliefParameters noise;  ///< variances of encoder, speed and disturbance; nothing else of it
  double change_weight = 0.1;   ///< rho, of the squared change of the input from period to period
};

/// Looks kHorizon action periods ahead from the state x that the model reaches when the command of now begins to act,
/// and gives the first input r = g u + d of the sequence with the least
///
///     sum (w_k - w_d)^2 + rho (r_k - r_(k-1))^2   such that   |w_k - w_(k-1)| <= a T / radius,
///
/// with the disturbance d of the Kalman filter, so that there is no steady-state error. The quadratic program is solved
/// in its dual by Hildreth's procedure.
class ModelPredictive : public WheelLaw {
 public:
  static constexpr int kHorizon = 15;  ///< N [action periods]

  /// @param model drive train with its acceleration limit; @param wheel_radius r [m].
  ModelPredictive(const PlantModel& model, double wheel_radius, const MpcTuning& tuning);

  void reset(double speed) override;
  void predict() override { filter_.predict(command_); }
  void correct(double measurement) override { filter_.correct(measurement); }
  double act(double wanted) override;
  void hold(double applied) override { command_ = applied; }
  void overrule(double applied) override { command_ = applied; }
  double command() const override { return command_; }

 private:
  using Inputs = Eigen::Matrix<double, kHorizon, 1>;
  using Square = Eigen::Matrix<double, kHorizon, kHorizon>;
  using Bounds = Eigen::Matrix<double, 2 * kHorizon, 1>;

  Inputs withinLimit(const Inputs& free, const Bounds& bound) const;

  double gain_;            // g
  double largest_change_;  // a T / radius [rad/s]
  double change_weight_;   // rho
  WheelKalmanFilter filter_;
  Eigen::Matrix<double, kHorizon, 2> from_state_;           // of w_1..N
  Square from_input_;                                       // of w_1..N
  Square inverse_;                                          // of the Hessian
  Eigen::Matrix<double, 2 * kHorizon, kHorizon> of_limit_;  // rows of the constraints, upper then lower
  double command_ = 0.0;                                    // u [rad/s]
};

}  // namespace jackal_aic::sim
