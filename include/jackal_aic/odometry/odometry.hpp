#pragma once

/// @file
/// Odometry: what the robot does by wheels, gyro and the commands that it got, and where that has brought it.
///
///     wheels, gyro, command --> unbiased belief (predictive_controller.hpp) --> motion, covariance --> dead reckoning
///
/// The belief of the thesis' structure holds the goal and is no estimate of the motion: beside such a controller the
/// odometry has a belief of its own.
///
/// The belief knows the wheels; that they slip while they pull the body along, v_w - x_dot ~ T dv_w/dt, it does not.
/// With the circumference's acceleration of each side the variance of x_dot has
///
///     1/2 T^2 ((dv_L/dt)^2 + (dv_R/dt)^2)
///
/// more than that of the wheels. T is chosen so that the error is within its 95 % bounds 95 % of the time on the
/// simulated ground.

#include <memory>

#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/odometry/dead_reckoning.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"

namespace jackal_aic {

/// Odometry of a robot. After construction nothing allocates or throws.
class Odometry {
 public:
  /// T, slip of a wheel by its acceleration [s].
  static constexpr double kSlipTime = 0.018;

  /// By the belief of a controller, which has to outlive the odometry. @param geometry, model as it has
  /// them.
  Odometry(const PredictiveController& belief, const GeometryParameters& geometry, const PlantModel& model);

  /// By a belief of its own. @param parameters its variances. @throws ParameterError as PredictiveController.
  Odometry(const PredictiveParameters& parameters, const GeometryParameters& geometry, const PlantModel& model);

  /// A measurement came; of no effect on the belief of a controller, which takes it itself.
  void observe(const Observation& observation);

  /// Goes on by a time. @param applied the command that the motors had in it [rad/s]; @param duration [s].
  void advance(const WheelCommand& applied, double duration);

  /// What the robot does now.
  PlanarMotion motion() const;

  /// Where it is since the start, in the frame of the start.
  const PlanarPose& pose() const { return reckoning_.pose(); }

  /// Covariance of pose() as (x, y, heading) [m^2, rad^2]; it grows without bound.
  const Eigen::Matrix3d& poseCovariance() const { return reckoning_.covariance(); }

  /// Forgets the motion; the pose stays.
  void forgetMotion();

 private:
  std::unique_ptr<PredictiveController> own_;  // if it has one
  const PredictiveController* belief_;         // that it goes by
  double slip_;                                // of the circumference by the wheel's acceleration, T r [s m]
  double left_over_ = 0.0;                     // of the steps of the own belief [s]
  PlanarMotion last_;
  DeadReckoning reckoning_;
};

}  // namespace jackal_aic
