#pragma once

/// @file
/// Watches the accelerometer against the wheels' acceleration and the direction of gravity.
///
///     a_x = dv/dt + g_x + noise,    a_z = g + g_z + noise
///
/// g_x and g_z stand for the inclination of the ground (g_x only where the IMU gives no attitude that has taken gravity
/// out of a_x) and the accelerometer's bias; both are learned and wander. The noise of a robot that moves is mostly
/// vibration, tens of times that of one at rest and growing with the speed. What successive errors e differ by tells
/// it,
///
///     D <- D + (1 - exp(-step/T)) (min((e_k - e_k-1)^2 / 2, c D) - D)
///
/// (von Neumann's estimate of a variance): an offset or a drift, which a fault would be, does not enter it, and one
/// jump counts for no more than the factor c.
///
/// While it is faulty, the belief about g_x and g_z of before waits, and another one learns which inclination would
/// explain it. It counts again when it agrees with the first, as after a jolt, or with the second for long: an
/// inclination that comes at once is an offset of the sensor or a steep ramp, and only a ramp comes to an end.
///
/// A body that hits something loses its speed within a moment. Such a jolt, against the motion and of no more than
/// the speed there is, counts: it is how the speed belief knows of the collision. So does what follows it for
/// a moment, in which the body bounces and its tyres slide.

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "jackal_aic/faults/channel_monitor.hpp"
#include "jackal_aic/faults/fault_parameters.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Prediction, comparison and verdict for the accelerometer. Nothing here allocates.
class AccelerationMonitor {
 public:
  /// @param parameters thresholds, and the noise of the sensors.
  explicit AccelerationMonitor(const FaultParameters& parameters);

  /// Lets a step pass [s]. @param forward_rate dv/dt of the wheels' predictions; @param lowest, highest what it
  /// may also be, as the drive train is uncertain [m/s^2].
  void predict(double forward_rate, double lowest, double highest, double step) {
    predict(&forward_rate, &lowest, &highest, 1, step);
  }

  /// The same for a number of steps with a rate each.
  void predict(const double* forward_rates, const double* lowest, const double* highest, std::size_t number,
               double step);

  /// Judges a sample; its vertical part only if it is known. @param step since the last sample.
  /// @param moving the wheels turn: the noise differs from that at rest. @param speed of the wheels, forward [m/s].
  void check(const Observation& observation, bool moving, double speed, const SampleStep& step);

  bool upsideDown() const { return upside_down_; }               ///< faulty, and gravity points upwards
  bool frozen() const { return frozen_; }                        ///< an axis of the last sample repeats exactly
  double distance() const { return distance_; }                  ///< in multiples of the bound
  ChannelState state() const { return persistence_.state(); }    ///< verdict with the last sample
  bool suspecting() const { return persistence_.suspecting(); }  ///< an outlier is among the last samples

  /// The ground has just shaken the robot: an outlier came within the last moment, and the accelerometer is in order.
  bool shaken() const;

  /// The body has just been pushed, by less than an outlier and by more than vibration does: within the last few
  /// samples, and the accelerometer is in order.
  bool pushed() const;

  /// Standard deviation of the forward acceleration by noise and vibration, over kVibrationMemory [m/s^2].
  double vibration() const { return std::sqrt(axes_.forward.vibration); }

  /// Believes at once what inclination explains a faulty one: the robot is moved from one ground to another.
  void follow() {
    if (state() == ChannelState::faulty) axes_ = alternative_;
  }

  /// Lets it count again: the robot was moved, and may stand on other ground.
  void forgive();

  /// Restarts after a time in which anything may have happened: it counts again, against what was believed of it
  /// before.
  void restart() { persistence_.reset(); }

 private:
  /// Slowly wandering part of one axis.
  struct Axis {
    double offset = 0.0;     // g_x or g_z [m/s^2]
    double variance;         // of the offset
    double lowest, highest;  // of the offset: an inclination that the robot can stand on
    LearnedVariance learned;
    double vibration = 0.0;  // D [(m/s^2)^2]
    double error = 0.0;
    double total = 0.0;  // variance of the error

    void compare(double error_without_offset, double noise, bool moving, double step);
    double noise(double configured, bool moving) const;
    double squaredDistance() const { return learned.squaredDistance(error, total); }
    void correct(double noise);
  };

  /// What is believed of the accelerometer.
  struct Axes {
    Axis forward, vertical;
  };
  /// A sample, and what is known of it without the inclination.
  struct Sample {
    double measured, rate, lowest_rate, highest_rate;  // forward [m/s^2]
    double forward_noise, vertical_noise;              // variances [(m/s^2)^2]
    std::optional<double> vertical_error;              // [m/s^2]
    bool moving;
    double step;  // [s]
  };
  bool isFrozen(const Observation& observation, bool moving);
  static double compare(Axes& axes, const Sample& sample);
  static void correct(Axes& axes, const Sample& sample);
  static void learn(Axes& axes, const Sample& sample, double share);

  FaultParameters parameters_;
  Axes axes_;
  Axes alternative_;        // while it is faulty: learns what inclination would explain it
  double agreement_ = 0.0;  // time for which one has [s]
  double forward_rate_ = 0.0;
  double lowest_rate_ = 0.0;   // since the last sample
  double highest_rate_ = 0.0;  // since the last sample
  TimingVariance timing_;
  Persistence persistence_;
  double suspected_ = 0.0;  // time of the samples that made it suspect lately [s]
  /// Samples that may be those of a collision.
  struct Jolt {
    double since = 0.0;            // the last one [s]
    double age = 0.0;              // since the first one [s]
    double change_of_speed = 0.0;  // by them [m/s]
    bool struck = false;           // they took much of the speed

    bool update(bool suspect, double change, double speed, double step);
  };

  Jolt jolt_;
  MotionRepetitionTest forward_repetition_;
  MotionRepetitionTest vertical_repetition_;  // of a_z, which a live attitude leaves as it was measured
  double distance_ = 0.0;
  double since_outlier_;  // [s]
  double since_push_;     // [s]
  bool upside_down_ = false;
  bool frozen_ = false;
};

}  // namespace jackal_aic
