#pragma once

/// @file
/// Interval observer of a wheel: all speeds that any drive train in a range may reach.
///
///     dw/dt = clamp((r - w) / T, +- L),    r = gain u(t - t_d),    t_d, T and L each within a range
///
/// The right side falls with w and rises with r (a monotone system), so the extreme solutions bound all others. The
/// upper one uses the fastest rise, the slowest fall and the highest r within the range of dead times.

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/robot_range.hpp"

namespace jackal_aic {

/// Range of drive trains about a model.
struct DriveTrainRange {
  double earlier = 0.0;               ///< by which the dead time may be shorter [s]
  double later = 0.0;                 ///< by which the dead time may be longer [s]
  double shortest_lag = 0.0;          ///< T [s]
  double longest_lag = 0.0;           ///< T [s]
  double slowest_acceleration = 1.0;  ///< L in multiples of the model's
  double fastest_acceleration = 1.0;  ///< L in multiples of the model's
};

/// Interval of one wheel, from its commands alone. Allocates in the constructor only.
class ReachableSpeeds {
 public:
  /// @param wheel_radius r [m].
  ReachableSpeeds(const PlantModel& model, double wheel_radius, const DriveTrainRange& range);

  /// Starts at steady state at a speed [rad/s].
  void start(double speed);

  /// Starts at a speed [rad/s] and keeps the commands within the dead time. @param misfit steady-state error of the
  /// model [rad/s]; commands that lead within it may have been reached already.
  void seed(double speed, double misfit = 0.0);

  /// Advances by DriveTrain::kStep under a command u [rad/s]. Returns the range of dw/dt at any speed in the interval
  /// [rad/s^2].
  Range predict(double command);

  /// Effective command [rad/s] that acts after the model's dead time.
  double acting() const { return commands_.at(model_delay_); }

  /// Speed that the newest command asks for, at steady state [rad/s].
  double commanded() const { return gain_ * commands_.at(0); }

  Range speeds() const { return {low_, high_}; }  ///< the interval [rad/s]

  /// Largest speed, forwards or backwards [rad/s].
  double largest() const { return std::max(std::abs(low_), std::abs(high_)); }

  /// Speed of the model itself, between the two [rad/s].
  double nominal() const { return nominal_; }

 private:
  Range reference() const;

  double gain_;
  DeadZone dead_zone_;
  std::size_t model_delay_, shortest_delay_;  // [steps]
  CommandsUnderWay commands_;                 // effective ones, as old as the longest dead time
  Pace slow_, nominal_pace_, fast_;
  double low_ = 0.0, nominal_ = 0.0, high_ = 0.0;
};

}  // namespace jackal_aic
