#pragma once

/// @file
/// Baseline estimator: the steady-state Kalman filter of the predictive controller's generative model.

#include <Eigen/Core>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/predictive/predictive_parameters.hpp"

namespace jackal_aic::sim {

/// Solution P of the filter's algebraic Riccati equation
///
///     P = A P A' - A P C' (C P C' + R)^-1 C P A' + Q,
///
/// the covariance of the prediction at steady state, by the structure-preserving doubling algorithm (Chu, Fan, Lin,
/// Wang 2004), which converges quadratically. @param transition A, n x n; @param output C, m x n; @param process Q, n x
/// n; @param noise R, m x m, positive definite. @throws ParameterError if it does not converge: (A, C) has to be
/// detectable and (A, Q^1/2) stabilisable.
Eigen::MatrixXd predictionCovariance(const Eigen::MatrixXd& transition, const Eigen::MatrixXd& output,
                                     const Eigen::MatrixXd& process, const Eigen::MatrixXd& noise);

/// The best linear estimator with a constant gain for the model of drive_train.hpp: both wheels' speed w, correction z
/// and input disturbance d, driven by the commands after the dead time, with the same random fluctuations. It measures
/// both wheel speeds and, unless the model stands on a box, the yaw rate r alpha (w_R - w_L)/b_hat. In contrast to the
/// controller's belief it knows b_hat from the start, and its gain does not change while the wheels accelerate.
class SteadyStateKalmanFilter {
 public:
  /// Step of the prediction [s].
  static constexpr double kStep = DriveTrain::kStep;

  /// At rest. @param parameters variances of the sensors and fluctuations of the model; @param geometry r and alpha;
  /// @param model drive train, with its effective track (0 stands for that of the geometry).
  /// @throws ParameterError if the filter has no steady state.
  SteadyStateKalmanFilter(const PredictiveParameters& parameters, const GeometryParameters& geometry,
                          const PlantModel& model);

  /// Moves the estimate by one step during which the command [rad/s] is applied.
  void predict(const WheelCommand& command);

  /// Takes a measurement made now.
  void correct(const Observation& observation);

  /// Estimated body velocity (base_link).
  BodyVector velocity() const { return kinematics_.bodyVelocity({state_(0), state_(3)}); }

 private:
  DriveTrain drive_train_;
  CommandsUnderWay left_, right_;  // through the dead time
  SkidSteerKinematics kinematics_;
  Eigen::MatrixXd output_;                                                   // C, 2 or 3 channels by 6 states
  Eigen::MatrixXd gain_;                                                     // 6 by 2 or 3
  Eigen::Matrix<double, 6, 1> state_ = Eigen::Matrix<double, 6, 1>::Zero();  // (w, z, d) of the left, then the right
};

}  // namespace jackal_aic::sim
