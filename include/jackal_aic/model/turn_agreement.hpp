#pragma once

/// @file
/// Whether a body turns as its wheels ask.

#include <cmath>

#include "jackal_aic/model/forgetting.hpp"

namespace jackal_aic {

/// c = sum y a / sum a^2 over a forgetting second of turning, with y the measured yaw rate and a the one that the
/// wheels ask for: 1 where the body follows, 0 where nothing does, -1 where the gyro reads the turn with the wrong
/// sign. Does not allocate.
class TurnAgreement {
 public:
  /// Takes a yaw rate beside the one that the wheels ask for [rad/s]. @param step since the last one [s].
  void update(double yaw_rate, double asked, double step) {
    if (std::abs(asked) < kTurn) return;
    const double kept = keptAfter(step, kMemory);
    product_ = kept * product_ + yaw_rate * asked * step;
    square_ = kept * square_ + asked * asked * step;
    turned_ += step;
  }

  double value() const { return square_ > 0.0 ? product_ / square_ : 0.0; }  ///< c; 0 before the first turn
  double turned() const { return turned_; }                                  ///< time of turning so far [s]

 private:
  static constexpr double kTurn = 0.2;    // least turn that tells the sign [rad/s]
  static constexpr double kMemory = 1.0;  // s
  double product_ = 0.0;                  // sum of y a step [rad^2/s]
  double square_ = 0.0;                   // sum of a^2 step [rad^2/s]
  double turned_ = 0.0;
};

}  // namespace jackal_aic
