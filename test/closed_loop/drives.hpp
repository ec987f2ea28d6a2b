#pragma once

/// @file
/// Robots, drives and faults that several tests of the closed loop share.

#include <cstdint>
#include <random>

#include "monitored_loop.hpp"

namespace jackal_aic::sim {

/// The package as it lies in the source tree.
inline const PackageFiles& files() {
  static const PackageFiles files;
  return files;
}

/// When the faults of sensorFault() begin [s].
inline constexpr double kFaultTime = 3.0;

/// A sensor that is faulty from kFaultTime on.
inline Faults sensorFault(FaultKind kind, FaultChannel channel, double value = 0.0) {
  return {{kind, channel, value, kFaultTime}};
}

/// The assumed model of a Jackal that was not identified.
inline PlantModel assumedModel() {
  ParameterMap map = files().configuration("jackal_model");
  return readPlantModel(map);
}

/// Joystick driving (sim/lab/motions.py): targets up to 1.5 m/s and 2 rad/s that change every few seconds, and a stick
/// that follows them with a lag. @param duration [s].
inline SetPointProfile joystickDriving(std::uint64_t seed, double duration) {
  std::mt19937_64 generator(seed * 1000003);
  const auto between = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(generator() >> 11) * 0x1p-53;
  };
  const auto sign = [&] { return generator() % 2 == 0 ? 1.0 : -1.0; };
  SetPointProfile profile;
  profile.duration = duration;
  SetPoint target, stick;
  double until = kRestTime, agility = 1.0;
  for (double time = kRestTime; time < duration; time += 0.05) {
    if (time >= until) {
      const auto kind = generator() % 5;
      const double speed = between(0.1, 1.5), fastest = std::min(2.0, 2.0 / speed);
      const double forward = sign() * speed;
      const double side = sign();
      const double yaw_rate = side * between(0.1, fastest);
      target = {kind == 0 || kind == 1 ? 0.0 : forward, 0.0, kind == 0 || kind == 2 ? 0.0 : yaw_rate};
      until = time + between(0.2, 5.0);
      agility = between(0.1, 1.0);
    }
    stick.forward += agility * (target.forward - stick.forward);
    stick.yaw_rate += agility * (target.yaw_rate - stick.yaw_rate);
    if ((target.vector() - stick.vector()).norm() < 0.02) stick = target;
    profile.changes.push_back({time, stick});
  }
  return profile;
}

}  // namespace jackal_aic::sim
