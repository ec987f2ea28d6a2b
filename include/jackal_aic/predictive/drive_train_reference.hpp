#pragma once

/// @file
/// Reference model of a wheel: a path towards the wanted speed that its drive train can follow.
///
///     dw_ref/dt = clamp((w_d - w_ref) / tau_ref, +- acceleration limit / radius)
///
/// Once in an action period T it computes the input r that takes the drive train of the model along the path. The input
/// is held over the period and solves w(t + T) = w_ref(t + T).

#include <Eigen/Core>
#include <cmath>

#include "jackal_aic/model/plant_model.hpp"

namespace jackal_aic {

/// A path that the drive train of the model can follow: speed and correction of the velocity loop.
class DriveTrainReference {
 public:
  /// @param model drive train; @param wheel_radius r [m]; @param reference_time tau_ref [s]; @param step action period
  /// [s].
  DriveTrainReference(const PlantModel& model, double wheel_radius, double reference_time, double step);

  /// The input r [rad/s] towards a wheel speed [rad/s] in the next action period.
  double input(double wanted) const;

  /// The path of the difference of two wheels with the same drive train.
  DriveTrainReference minus(const DriveTrainReference& other) const;

  /// The input nearest to r [rad/s] from which the path ends at a wheel speed [rad/s] without running beyond it. The
  /// input of an accelerating wheel leads it by its lag, and has to return in time. @param largest_change of an input
  /// in a period [rad/s]. An r that needs no change is returned unchanged.
  double inTime(double wanted, double r, double largest_change) const;

  /// Advances by one action period as the model does under an input r [rad/s], within its acceleration limit.
  void follow(double r);

  /// Repeats the last period with an additional input [rad/s].
  void amend(double more);

  /// Starts at this wheel speed [rad/s].
  void reset(double speed);

  /// Adopts another lag and acceleration limit on the same path.
  void setDriveTrain(const PlantModel& model);

  /// Adopts another time constant tau_ref [s].
  void setReferenceTime(double reference_time) { pull_ = -std::expm1(-step_ / reference_time); }

  /// Wheel speed on the path now [rad/s].
  double speed() const { return state_(0); }

 private:
  bool endsInTime(double wanted, double r, double largest_change) const;

  Eigen::Matrix2d transition_;   // of (w, z) over an action period
  Eigen::Vector2d input_;        // of r held over it
  double step_;                  // action period [s]
  double wheel_radius_;          // [m]
  double largest_change_ = 0.0;  // of w over an action period [rad/s]
  double pull_ = 0.0;            // part of the way to the wanted speed
  Eigen::Vector2d state_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d before_ = Eigen::Vector2d::Zero();  // state before the last period
  double r_ = 0.0;                                    // input of the last period
};

}  // namespace jackal_aic
