#pragma once

/// @file
/// Baseline estimator: the steady-state Kalman filter of the predictive controller's generative model.

#include <Eigen/Core>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/model/wheel_belief.hpp"
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

/// A linear model over a number of equal steps.
struct OverSteps {
  Eigen::MatrixXd transition;  ///< of the state
  Eigen::MatrixXd process;     ///< covariance that its fluctuations add
};

/// @param step transition of one step; @param fluctuation variances that it adds to each state.
OverSteps overSteps(const Eigen::MatrixXd& step, const Eigen::VectorXd& fluctuation, long count);

/// Stationary gain P C' (C P C' + R)^-1 of a measurement on the state, by predictionCovariance(). @throws
/// ParameterError as that.
Eigen::MatrixXd stationaryGain(const OverSteps& model, const Eigen::MatrixXd& output, const Eigen::MatrixXd& noise);

/// The same estimator for one wheel by its encoder alone.
class WheelKalmanFilter {
 public:
  /// At rest. @param model drive train; @param wheel_radius r [m]; @param trust variances of encoder and fluctuations,
  /// of which the rest plays no part; @param period of the samples [s]. @throws ParameterError if there is no steady
  /// state.
  WheelKalmanFilter(const PlantModel& model, double wheel_radius, const WheelBeliefParameters& trust, double period);

  /// As if a command had been driving at this speed [rad/s] for long, without a disturbance.
  void reset(double speed);

  /// A step of DriveTrain::kStep passes in which a command [rad/s] is applied.
  void predict(double command) { drive_train_.step(state_, commands_.step(command)); }

  /// Takes a measured speed [rad/s].
  void correct(double speed) { state_ += gain_ * (speed - state_(0)); }

  const Eigen::Vector3d& state() const { return state_; }  ///< (w, z, d) now

  /// (w, z, d) when the command of now begins to act.
  Eigen::Vector3d onArrival() const;

 private:
  DriveTrain drive_train_;
  CommandsUnderWay commands_;
  Eigen::Vector3d gain_;
  Eigen::Vector3d state_ = Eigen::Vector3d::Zero();
};

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
  DeadZone dead_zone_;
  CommandsUnderWay left_, right_;  // effective ones through the dead time
  SkidSteerKinematics kinematics_;
  Eigen::MatrixXd output_;                                                   // C, 2 or 3 channels by 6 states
  Eigen::MatrixXd gain_;                                                     // 6 by 2 or 3
  Eigen::Matrix<double, 6, 1> state_ = Eigen::Matrix<double, 6, 1>::Zero();  // (w, z, d) of the left, then the right
};

}  // namespace jackal_aic::sim
