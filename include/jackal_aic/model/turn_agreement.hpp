#pragma once

/// @file
/// Agreement of the body's turn with its wheels.

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {

/// c = sum y a / sum a^2 over a second of turning with forgetting, with y the measured yaw rate and a that of the
/// wheels: 1 if the body follows, 0 if it does not turn, -1 if the gyro has the wrong sign. Does not allocate.
class TurnAgreement {
 public:
  static constexpr double kLeastTurn = 0.2;  ///< least turn of a known sign [rad/s]; of v theta_dot [m/s^2]

  /// Compares a measured yaw rate with that of the wheels [rad/s]. @param step since the last one [s].
  void update(double yaw_rate, double asked, double step) {
    if (std::abs(asked) < kLeastTurn) return;
    const double kept = keptAfter(step, thresholds::kNoiseMemory);
    product_ = kept * product_ + yaw_rate * asked * step;
    square_ = kept * square_ + asked * asked * step;
    measured_ = kept * measured_ + yaw_rate * yaw_rate * step;
    remembered_ = kept * remembered_ + step;
    step_ = step;
    turned_ += step;
  }

  double value() const { return square_ > 0.0 ? product_ / square_ : 0.0; }  ///< c; 0 before the first turn

  /// Standard deviation of c by the noise of y.
  double deviation() const {
    if (square_ == 0.0) return HUGE_VAL;
    const double unexplained = std::max(0.0, measured_ / square_ - value() * value());
    return std::sqrt(unexplained * step_ / remembered_);
  }

  double turned() const { return turned_; }  ///< time of turning so far [s]

 private:
  double product_ = 0.0;     // sum of y a step [rad^2/s]
  double square_ = 0.0;      // sum of a^2 step [rad^2/s]
  double measured_ = 0.0;    // sum of y^2 step [rad^2/s]
  double remembered_ = 0.0;  // sum of step [s]
  double step_ = 0.0;        // [s]
  double turned_ = 0.0;
};

}  // namespace jackal_aic
