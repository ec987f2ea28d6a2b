#pragma once

/// @file
/// Bounds of the integrating action by what the motors can follow (anti-windup).
///
/// The action integrates the prediction error (3-13). A motor at its acceleration limit does not become faster by more
/// of it; what is integrated meanwhile has to be taken back afterwards, and the robot overshoots, or runs back after a
/// stop. So
///
///     ramp      the action leads a motor that ramps at the model's acceleration limit by one period's ramp at most;
///               one factor on the change of both wheels keeps the curvature
///     goal      an action that ramped stays between where it is and the wheel speed of the set point while its wheel
///               still accelerates towards that: what it is short of is on its way
///     lateness  so does that of a wheel that accelerates, but is behind what it was commanded a dead time ago: its
///               motor is slower than the model's, or its gain less, which tells once it rests. Nor is its action on
///               its way from one set point to the next any further than that of the other wheel: the curvature stays
///     stop      after the set point became zero the action goes to zero no faster than along a straight line of
///               kShortestStop, and not past zero until its wheel rests: a robot told to stop does not drive backwards
///     range     and it stays within what a robot near its model needs for the goal (robot_range.hpp)
///
/// Otherwise the action is that of the equation, to the bit: below the limit, at rest and in steady driving the loop is
/// the linear one that the certificate is about.

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Tells from its commands and measured speeds whether a wheel is late: it accelerates behind what it was commanded.
class WheelLateness {
 public:
  /// @param model drive train; @param acceleration its limit [rad/s^2]; @param period of the commands [s].
  WheelLateness(const PlantModel& model, double acceleration, double period);

  /// Takes the command of an action period [rad/s].
  void command(double speed);

  /// Takes a measured speed [rad/s] of a time [s], later than the last one.
  void observe(double stamp, double speed);

  /// The speeds to come have nothing to do with those so far.
  void forgetMeasurements();

  /// Forgets everything.
  void reset();

  /// 1 if the wheel is late on its way up (forward is positive), -1 on its way down, 0 if it is not late.
  int late() const { return late_; }

  /// 1 or -1 if it speeds up or slows down by more than a little of the motor's limit, else 0.
  int accelerating() const { return accelerating_; }

  /// Of the wheel behind its command, in periods.
  std::size_t delay() const { return delay_; }

 private:
  static constexpr std::size_t kSamples = 5;  // of which a slope is taken: 80 ms at 50 Hz
  struct Sample {
    double stamp = 0.0;  // s
    double speed = 0.0;  // rad/s
  };
  struct Line {
    double slope;  // rad/s^2
    double speed;  // at the last sample [rad/s]
  };

  Line measured() const;
  double commandAgo(std::size_t periods) const;

  double acceleration_;                     // rad/s^2
  double gain_;                             // wheel speed / effective command
  DeadZone dead_zone_;                      // of the motors
  std::size_t delay_;                       // of the wheel behind its command, in periods
  std::vector<double> commands_;            // ring, as the wheel's speeds [rad/s]
  std::size_t head_ = 0;                    // of the last command
  std::array<Sample, kSamples> samples_{};  // ring
  std::size_t count_ = 0;                   // of the samples so far
  int late_ = 0;
  int accelerating_ = 0;  // by the slope of the samples
};

/// Bounds of the action of both wheels; none without a plant model. Nothing but construction allocates.
class ActionBound {
 public:
  /// Shortest time in which the action goes to zero after a stop [s].
  static constexpr double kShortestStop = 0.4;

  /// @param model drive train of the robot, if it is known; @param wheel_radius r [m]; @param period of the action [s].
  ActionBound(const std::optional<PlantModel>& model, double wheel_radius, double period);

  /// Takes a measurement of which every channel has a value. @param measured which of them were measured; a wheel whose
  /// speed was not is not judged.
  void observe(const Observation& observation, const ChannelValidity& measured);

  /// The measurements to come have nothing to do with those so far.
  void forgetMeasurements();

  /// Takes what is driven in an action period [rad/s].
  void apply(const WheelVector& applied);

  /// The action nearest to the wanted one that the bounds allow, once per action period. @param action of the period
  /// before; @param goal wheel speeds of the set point [rad/s].
  WheelVector bound(const WheelVector& action, const WheelVector& wanted, const WheelVector& goal);

  /// Forgets everything.
  void reset();

 private:
  static constexpr double kUnbounded = std::numeric_limits<double>::infinity();

  void watchStop(const WheelVector& action, bool told_to_stop);
  void watchRamp(bool bounded);
  WheelVector together(const WheelVector& action, const WheelVector& next, const WheelVector& goal) const;
  double room(const WheelVector& action, const WheelVector& change) const;
  double towardsGoal(int wheel, double action, double next, double goal) const;
  double possible(double action, double next, double goal) const;

  double period_;                               // s
  double gain_ = 1.0;                           // wheel speed / effective command
  DeadZone dead_zone_{PlantModel{}};            // of the motors
  double ramp_ = kUnbounded;                    // of a motor in a period [rad/s]
  std::vector<WheelLateness> wheels_;           // left and right; none without a model
  WheelVector followed_ = WheelVector::Zero();  // where a motor at its limit is, as effective command [rad/s]
  WheelVector speed_ = WheelVector::Zero();     // measured last [rad/s]
  bool told_to_stop_ = true;                    // the last set point was zero
  WheelVector goal_ = WheelVector::Zero();      // of the last period [rad/s]
  WheelVector start_ = WheelVector::Zero();     // action when the set point came [rad/s]
  bool ramped_ = false;                         // since the wheels last rested or drove steadily
  int since_ramp_ = 0;                          // periods
  double stop_change_ = kUnbounded;             // largest change of the action in a period of the present stop [rad/s]
};

}  // namespace jackal_aic
