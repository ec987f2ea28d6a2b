#pragma once

/// @file
/// Odometry: what the robot does by wheels, gyro and the commands that it got, and where that has brought it.
///
///     wheels, gyro, command --> unbiased belief (predictive_controller.hpp) --> motion, covariance --> dead reckoning
///
/// The belief of the thesis' structure holds the goal and is no estimate of the motion: for such a controller the
/// odometry has a belief of its own.

#include <memory>

#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/odometry/dead_reckoning.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"

namespace jackal_aic {

/// Odometry of a robot. After construction nothing allocates or throws.
class Odometry {
 public:
  /// By the belief of a controller, which has to outlive the odometry.
  explicit Odometry(const PredictiveController& belief) : belief_(&belief) {}

  /// By a belief of its own. @param parameters its variances. @throws ParameterError as PredictiveController.
  Odometry(const PredictiveParameters& parameters, const GeometryParameters& geometry, const PlantModel& model);

  /// A measurement came; of no effect on the belief of a controller, which takes it itself.
  void observe(const Observation& observation);

  /// Goes on by a time. @param applied the command that the motors had in it [rad/s]; @param duration [s]. Less than
  /// nothing or more than a second, a clock that jumps or a stall, tells nothing: as forgetMotion().
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
  double left_over_ = 0.0;                     // of the steps of the own belief [s]
  PlanarMotion last_;
  DeadReckoning reckoning_;
};

}  // namespace jackal_aic
