#pragma once

/// @file
/// Anti-windup of the integrating action.
///
/// The action integrates the prediction error (3-13). While a motor is at its acceleration limit, the robot would
/// overshoot, or run back after a stop. So the action is bounded by
///
///     followed   the command that a motor at the model's acceleration limit has followed so far: the action leads it
///                by one period's ramp at most. One factor on the change of both wheels keeps the curvature
///     under way  a wheel that accelerates towards its goal, or still turns after a stop: its action stays between
///                where it is and the goal. The error of a slow or weak motor is integrated once it drives steadily.
///                While it accelerates, its action advances no larger part of its way than that of the other wheel
///     stop       after a stop the action falls no faster than to zero in thresholds::kPatience from the present speed
///     range      what a robot near its model needs for the goal (robot_range.hpp)
///     sides      what its left and right wheels may need differently (side_balance.hpp)
///
/// Well below the acceleration limit the loop stays the linear loop of the certificate.

#include <array>
#include <limits>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/side_balance.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Bounds of the action of both wheels. Nothing here allocates.
class ActionBound {
 public:
  /// @param model drive train of the robot; @param period of the action [s].
  ActionBound(const PlantModel& model, const GeometryParameters& geometry, double period);

  /// Takes a measurement with a value in every channel. @param measured the channels that were measured; a wheel
  /// without a measured speed has an unknown acceleration.
  void observe(const Observation& observation, const ChannelValidity& measured);

  /// Forgets the measurements; the next one starts a new history.
  void resetMeasurements();

  /// Takes the command of an action period [rad/s].
  void apply(const WheelVector& applied);

  /// The action within the bounds that is nearest to the wanted one. @param action of the last period; @param goal
  /// wheel speeds of the set point [rad/s].
  WheelVector bound(const WheelVector& action, const WheelVector& wanted, const WheelVector& goal) const;

  /// Forgets everything.
  void reset();

 private:
  struct Wheel {
    double stamp = -std::numeric_limits<double>::infinity();  // of the last measurement [s]
    double speed = 0.0;                                       // rad/s
    double acceleration = 0.0;                                // rad/s^2; 0: unknown

    void observe(double measured_at, double measured);
  };

  double commandOf(double speed) const { return dead_zone_.command(speed / gain_); }
  WheelVector followable(const WheelVector& action, const WheelVector& wanted, bool stop) const;
  bool acceleratesTo(double goal, const Wheel& wheel) const;

  double period_;                               // s
  double acceleration_;                         // limit of a motor [rad/s^2]
  double gain_;                                 // wheel speed / effective command
  DeadZone dead_zone_;                          // of the motors
  double ramp_;                                 // of a motor at its limit, in a period [rad/s]
  WheelVector followed_ = WheelVector::Zero();  // effective command [rad/s]
  SideBalance sides_;
  std::array<Wheel, 2> wheels_;  // left and right
};

}  // namespace jackal_aic
