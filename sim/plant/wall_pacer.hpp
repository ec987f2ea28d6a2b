#pragma once

/// @file
/// Holds simulated time to wall time.

#include <ros/time.h>

namespace jackal_aic::sim {

/// Lets simulated time pass at a chosen multiple of wall time.
class WallPacer {
 public:
  /// @param real_time_factor simulated seconds per wall second; 0 does not wait at all.
  explicit WallPacer(double real_time_factor) : factor_(real_time_factor) { restart(0.0); }

  /// Continues simulated time from now.
  void restart(double simulated_time) {
    wall_start_ = ros::WallTime::now();
    simulated_start_ = simulated_time;
  }

  /// Sleeps until a simulated time [s] is due on the wall. After a long stall it continues from here without catching
  /// up, because no controller on the simulated clock could follow that.
  void waitFor(double simulated_time) {
    if (factor_ <= 0.0) return;
    const ros::WallTime due = wall_start_ + ros::WallDuration((simulated_time - simulated_start_) / factor_);
    const double late = (ros::WallTime::now() - due).toSec();
    if (late > kLongestCatchUp) {
      restart(simulated_time);
    } else if (late < 0.0) {
      ros::WallTime::sleepUntil(due);
    }
  }

 private:
  static constexpr double kLongestCatchUp = 0.1;  ///< wall time [s]

  double factor_;
  ros::WallTime wall_start_;
  double simulated_start_ = 0.0;
};

}  // namespace jackal_aic::sim
