#pragma once

/// @file
/// A simulated robot and the monitor that watches it, for the tests of the fault detection.

#include <cmath>
#include <optional>
#include <random>
#include <utility>

#include "jackal_aic/faults/fault_monitor.hpp"
#include "jackal_aic/model/gravity.hpp"
#include "jackal_aic/model/wheel_belief.hpp"

namespace jackal_aic {

constexpr double kPeriod = 0.02;                // s, of a sample
constexpr int kSecond = 50;                     // samples
constexpr double kRadius = 0.098;               // m
constexpr double kTrack = 0.55;                 // m
constexpr double kPerWheel = kRadius / kTrack;  // yaw rate by difference of the wheels
constexpr WheelCommand kStand{}, kStraight{5.0, 5.0}, kFast{10.0, 10.0}, kTurn{-1.4, 1.4};

inline PlantModel model() {
  PlantModel m;
  m.dead_time = 0.08;
  m.lag = 0.01;
  m.acceleration_limit = 1.65;
  m.effective_track = kTrack;
  return m;
}

/// A changed copy, as in changed(model(), [](PlantModel& m) { m.gain = 0.8; }).
template <class T, class Change>
T changed(T value, Change change) {
  change(value);
  return value;
}

/// A model that nobody identified on this robot.
inline PlantModel assumedModel() {
  return changed(model(), [](PlantModel& m) { m.identified = false; });
}

inline PlantModel boxModel() {
  return changed(model(), [](PlantModel& m) { m.on_box = true; });
}

/// Parameters that leave nothing of the drive train open.
inline FaultParameters exactParameters() {
  FaultParameters p;
  p.dead_time_deviation = 0.0;
  p.slowest_acceleration = p.fastest_acceleration = 1.0;
  return p;
}

/// A robot that does what its model says, with noise, and its monitor.
class Robot {
 public:
  explicit Robot(const FaultParameters& parameters = {}, const PlantModel& told = model(),
                 const GeometryParameters& geometry = {})
      : Robot(parameters, told, told, geometry) {}

  Robot(const FaultParameters& parameters, const PlantModel& told, const PlantModel& real,
        const GeometryParameters& geometry = {})
      : monitor(parameters, geometry, told), geometry_(geometry), left_(real, kRadius, {}), right_(left_) {}

  /// Drives for some samples. @param fault changes the samples.
  template <class Fault>
  const FaultReport& drive(const WheelCommand& command, int samples, Fault fault) {
    for (; samples > 0; --samples) {
      pass(command, kPeriod);
      Observation y = sample();
      fault(y);
      monitor.check(y);
    }
    return monitor.report();
  }

  const FaultReport& drive(const WheelCommand& command, int samples) {
    return drive(command, samples, [](Observation&) {});
  }

  /// Lets time pass [s].
  void pass(const WheelCommand& command, double duration) {
    for (long k = std::lround(duration / 0.001); k > 0; --k) {
      time_ += 0.001;
      monitor.advance(known ? std::optional(command) : std::nullopt, 0.001);
      left_.predict(command.left);
      right_.predict(command.right);
    }
  }

  /// A sample now.
  Observation sample() {
    Observation y;
    y.stamp = time_;
    y.wheel_left = left_.speed() + noise * 0.03 * normal_(random_);
    y.wheel_right = right_.speed() + noise * 0.03 * normal_(random_);
    const double radius = kRadius * geometry_.slip_factor;
    y.yaw_rate = radius * (right_.speed() - left_.speed()) / kTrack + noise * 0.005 * normal_(random_);
    y.acceleration_x = radius * 0.5 * (left_.acceleration() + right_.acceleration()) + noise * 0.05 * normal_(random_);
    y.acceleration_z = kGravity + noise * 0.05 * normal_(random_);
    return y;
  }

  FaultMonitor monitor;
  double noise = 1.0;  // in multiples of the usual one
  bool known = true;   // the commands

 private:
  GeometryParameters geometry_;
  WheelBelief left_;
  WheelBelief right_;
  double time_ = 0.0;
  std::mt19937 random_{5};
  std::normal_distribution<double> normal_{0.0, 1.0};
};

/// A robot without noise that has been driving for long.
inline Robot settled(const WheelCommand& command = kStraight, const FaultParameters& parameters = {},
                     const PlantModel& told = model()) {
  Robot robot(parameters, told);
  robot.noise = 0.0;
  robot.drive(command, 6 * kSecond);
  return robot;
}

/// Exchanges the sides.
inline Observation mirrored(Observation y) {
  std::swap(y.wheel_left, y.wheel_right);
  std::swap(y.valid.wheel_left, y.valid.wheel_right);
  y.yaw_rate = -y.yaw_rate;
  return y;
}

/// The wheel of a side, measured, and its verdict.
inline double& wheelOf(Observation& y, bool left) { return left ? y.wheel_left : y.wheel_right; }
inline const ChannelHealth& wheelOf(const Robot& robot, bool left) {
  const FaultReport& report = robot.monitor.report();
  return left ? report.wheel_left : report.wheel_right;
}

/// Left wheel off its prediction, and the part of the turn that this would make which the gyro sees.
struct Off {
  double speed, part, turn = 1.0;  // of that of a narrower robot
  void operator()(Observation& y) const {
    y.wheel_left += speed;
    y.yaw_rate -= part * turn * kPerWheel * speed;
  }
};

/// The same on the side that is given.
inline auto offOn(bool left, double speed, double part) {
  return [=](Observation& y) {
    Off{speed, part}(y);
    if (!left) y = mirrored(y);
  };
}

}  // namespace jackal_aic
