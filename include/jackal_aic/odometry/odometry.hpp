#pragma once

/// @file
/// Odometry: motion from wheels, gyro and the received commands, and the pose from the motion.
///
///     wheels, gyro, command --> unbiased belief (predictive_controller.hpp) --> motion, covariance --> pose
///
/// The belief of the thesis' structure is drawn towards the set point. For such a controller the odometry has a
/// separate belief.

#include <memory>

#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/odometry/dead_reckoning.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"

namespace jackal_aic {

/// Odometry of a robot. After construction nothing allocates or throws.
class Odometry {
 public:
  /// With the belief of a controller, which has to outlive the odometry.
  explicit Odometry(const PredictiveController& belief) : belief_(&belief) {}

  /// With a separate belief. @param parameters its variances. @throws ParameterError as PredictiveController.
  Odometry(const PredictiveParameters& parameters, const GeometryParameters& geometry, const PlantModel& model);

  /// Takes a measurement for a separate belief. A controller gives its belief the measurement itself.
  void observe(const Observation& observation);

  /// Advances by a time. @param applied the command of the motors in it [rad/s]; @param duration [s]; if negative or
  /// above a second, after a clock jump or a stall, as resetMotion().
  void advance(const WheelCommand& applied, double duration);

  /// Present motion.
  PlanarMotion motion() const;

  /// Pose in the frame of the start.
  const PlanarPose& pose() const { return pose_.pose(); }

  /// Covariance of pose() as (x, y, heading) [m^2, rad^2]; it grows without bound.
  const Eigen::Matrix3d& poseCovariance() const { return pose_.covariance(); }

  /// Forgets the motion; the pose stays.
  void resetMotion();

 private:
  std::unique_ptr<PredictiveController> own_;  // the separate belief, if any
  const PredictiveController* belief_;         // in use
  double left_over_ = 0.0;                     // time that the separate belief has not stepped yet [s]
  PlanarMotion last_;
  DeadReckoning pose_;
};

}  // namespace jackal_aic
