#pragma once

/// @file
/// Odometry: what the robot does by wheels, gyro and the commands that it got, and where that has brought it.
///
///     wheels, gyro, command --> unbiased belief (predictive_controller.hpp) --> motion, covariance --> dead reckoning
///
/// The belief of the thesis' structure holds the goal and is no estimate of the motion: beside such a controller the
/// odometry has a belief of its own.
///
/// The belief knows the wheels; how they slip while they pull the body along it does not (body_slip.hpp); and a robot
/// that turns about a centre that lies c beside its middle moves at c theta_dot while the mean of its wheels stands. So
/// the variance of x_dot has
///
///     1/2 (s_L^2 + s_R^2) + c^2 theta_dot^2
///
/// more than that of the wheels. T and c are chosen so that the error is within its 95 % bounds 95 % of the time in
/// driving cycles of hard steps on the simulated ground.

#include <memory>

#include "jackal_aic/model/body_slip.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/odometry/dead_reckoning.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"

namespace jackal_aic {

/// Odometry of a robot. After construction nothing allocates or throws.
class Odometry {
 public:
  /// T, lag of the body behind its wheels [s].
  static constexpr double kSlipTime = 0.02;

  /// c, deviation of the centre of turning from the middle of the robot [m].
  static constexpr double kCentreDeviation = 0.004;

  /// By the belief of a controller, which has to outlive the odometry. @param geometry, model as it has
  /// them.
  Odometry(const PredictiveController& belief, const GeometryParameters& geometry, const PlantModel& model);

  /// By a belief of its own. @param parameters its variances. @throws ParameterError as PredictiveController.
  Odometry(const PredictiveParameters& parameters, const GeometryParameters& geometry, const PlantModel& model);

  /// A measurement came; of no effect on the belief of a controller, which takes it itself.
  void observe(const Observation& observation);

  /// Goes on by a time. @param applied the command that the motors had in it [rad/s]; @param duration [s]. More than a
  /// second, a stall or a clock that jumps, tells nothing: as forgetMotion().
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
  double wheel_radius_;                        // m; 0 on the box, where nothing slips
  BodySlip slip_{kSlipTime};
  double left_over_ = 0.0;  // of the steps of the own belief [s]
  PlanarMotion last_;
  DeadReckoning reckoning_;
};

}  // namespace jackal_aic
