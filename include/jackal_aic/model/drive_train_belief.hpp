#pragma once

/// @file
/// Belief about the state x = (w, z, d) of a wheel's drive train (drive_train.hpp) and its covariance P, with a fixed
/// model of the motor. The fault detection uses it; wheel_belief.hpp adds learning.
///
///     x <- J x + b u,    P <- J P J' + Q,    J = I at the acceleration limit
///     x <- x + K (y - w),    P <- P - K C P,    K = P C'/(C P C' + Sigma),    C = (1, 0, 0)

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/plant_model.hpp"

namespace jackal_aic {

/// P <- J P J' of a symmetric P and a drive train's J, whose last row is (0, 0, 1).
inline void propagate(const Eigen::Matrix3d& J, Eigen::Matrix3d& P) {
  const Eigen::Matrix<double, 2, 3> JP = J.topRows<2>().lazyProduct(P);
  P.topLeftCorner<2, 2>() = JP.lazyProduct(J.topRows<2>().transpose());
  P.topRightCorner<2, 1>() = JP.col(2);
  P.bottomLeftCorner<1, 2>() = JP.col(2).transpose();
}

/// P <- P - K (PC)', kept symmetric.
inline void correctCovariance(const Eigen::Vector3d& K, const Eigen::Vector3d& PC, Eigen::Matrix3d& P) {
  for (int i = 0; i < 3; ++i) {
    P(i, i) -= K(i) * PC(i);
    for (int j = 0; j < i; ++j) P(i, j) = P(j, i) = 0.5 * (P(i, j) - K(i) * PC(j) + (P(j, i) - K(j) * PC(i)));
  }
}

/// Variances of a DriveTrainBelief.
struct DriveTrainBeliefParameters {
  double measurement_variance = 9e-4;       ///< of a wheel speed that is measured [(rad/s)^2]
  double speed_process_noise = 0.01;        ///< growth of the variance of w [(rad/s)^2/s]
  double disturbance_process_noise = 0.01;  ///< growth of the variance of d [(rad/s)^2/s]
  double disturbance_deviation = 0.3;       ///< initial deviation of d [rad/s]
  double dead_time_deviation = 0.03;  ///< of the dead time; the change of w in it is an error of the measurement [s]
};

/// Largest number of steps of a prediction.
constexpr std::size_t kMostSteps = 32;

/// A quantity in each of some steps.
using PerStep = std::array<double, kMostSteps>;

/// Belief about one wheel, moved by many steps at once. Nothing here allocates.
class DriveTrainBelief {
 public:
  static constexpr double kStep = DriveTrain::kStep;  ///< [s]

  /// @param wheel_radius r [m].
  DriveTrainBelief(const PlantModel& model, double wheel_radius, const DriveTrainBeliefParameters& parameters);

  /// Sets the speed [rad/s], and z and d to zero.
  void reset(double speed);

  /// Moves the belief by steps in which these effective commands [rad/s] act. @param steps at most kMostSteps;
  /// @param[out] speeds w after each [rad/s]; @param[out] rates dw/dt in each [rad/s^2].
  void predict(const PerStep& acting, std::size_t steps, PerStep& speeds, PerStep& rates);

  /// Takes a measured speed [rad/s]. @param added_variance of this measurement, in addition to the usual one
  /// [(rad/s)^2].
  void correct(double measurement, double added_variance);

  double speed() const { return x_(0); }             ///< w [rad/s]
  double speedVariance() const { return P_(0, 0); }  ///< of w [(rad/s)^2]

 private:
  /// Covariance after a number of steps: P <- J P J' + Q.
  struct Growth {
    Eigen::Matrix3d J, Q;
  };
  void grow(std::size_t steps, bool limited);

  DriveTrain drive_train_;
  DriveTrainBeliefParameters parameters_;
  std::array<Growth, 6> growth_;  // of 1, 2, 4, 8, 16 and 32 steps
  double lagging_;                // part of a change that w a time sigma_t ago makes in a step
  Eigen::Vector3d x_;
  Eigen::Matrix3d P_;
  double lagged_;  // w a time sigma_t ago [rad/s]
};

}  // namespace jackal_aic
