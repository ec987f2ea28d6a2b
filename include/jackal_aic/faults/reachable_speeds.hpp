#pragma once

/// @file
/// Every speed that a wheel may have now, for all drive trains that its robot may have: an interval observer.
///
///     dw/dt = clamp((r - w) / T, +- L),    r = gain u(t - t_d),    t_d, T and L each within a range
///
/// The right side falls with w and rises with r, so that the extreme solutions bound all others: the highest one rises
/// as fast and falls as slowly as any drive train may, towards the highest r that any dead time lets through, and the
/// lowest one the other way round.

#include <cstddef>

#include "jackal_aic/faults/sliding_range.hpp"
#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/drive_train_belief.hpp"
#include "jackal_aic/model/plant_model.hpp"

namespace jackal_aic {

/// What a drive train may be, around its model.
struct DriveTrainRange {
  double earlier = 0.0;               ///< by which the dead time may be shorter [s]
  double later = 0.0;                 ///< by which the dead time may be longer [s]
  double shortest_lag = 0.0;          ///< T [s]
  double longest_lag = 0.0;           ///< T [s]
  double slowest_acceleration = 1.0;  ///< L in multiples of the model's
  double fastest_acceleration = 1.0;  ///< L in multiples of the model's
};

/// The interval of one wheel. It never sees a measurement. Allocates when it is made, and not after.
class ReachableSpeeds {
 public:
  /// Longest dead time, uncertainty included [s]; a longer one counts as this.
  static constexpr double kLongestDeadTime = 4.0;

  /// @param wheel_radius r [m].
  ReachableSpeeds(const PlantModel& model, double wheel_radius, const DriveTrainRange& range);

  /// Starts at a speed [rad/s] with a command under way that has been driving it for long.
  void start(double speed);

  /// Believes a speed [rad/s]; the commands of the last dead time are still under way. @param misfit by which a drive
  /// train may be off its model at steady state [rad/s]: where commands lead that are no farther away, the wheel may be
  /// already, and on its way it misses no motion.
  void seed(double speed, double misfit = 0.0);

  /// What happens in each of some steps.
  struct Steps {
    PerStep acting;        ///< effective command that acts after the model's dead time [rad/s]
    PerStep lowest_rate;   ///< of dw/dt, at any speed in the interval [rad/s^2]
    PerStep highest_rate;  ///< the highest [rad/s^2]
  };

  /// Goes on by steps of DriveTrain::kStep during which a command u [rad/s] is applied. @param number of steps, at most
  /// kMostSteps; @param[out] steps what happens in them.
  void predict(double command, std::size_t number, Steps& steps);

  /// Effective command [rad/s] of some time ago [steps], which is not longer than the longest dead time
  /// and kMostSteps.
  double commandBefore(std::size_t age) const { return commands_.at(age); }

  /// Speed that the newest command asks for, at steady state [rad/s].
  double commanded() const { return gain_ * commands_.at(0); }

  double low() const { return low_; }    ///< lowest speed [rad/s]
  double high() const { return high_; }  ///< highest speed [rad/s]

  /// Speed of the model itself, between the two [rad/s].
  double nominal() const { return nominal_; }

 private:
  double gain_;
  DeadZone dead_zone_;
  std::size_t model_delay_;  // [steps]
  SlidingRange commands_;    // effective ones that may act now, one per step
  Pace slow_, nominal_pace_, fast_;
  double low_ = 0.0, nominal_ = 0.0, high_ = 0.0;
};

}  // namespace jackal_aic
