#pragma once

/// @file
/// How near every preset comes to what no controller can beat on a robot with this dead time, acceleration limit and
/// sampling.
///
/// Settling to within 5 % of a step of the wheels' circumference speed by dv: nothing happens for the dead time, and
/// after it the speed changes at most with the acceleration limit a,
///
///     t >= dead_time + 0.95 dv / a.
///
/// In a turn on the ground the body comes behind its wheels by a lag of its own: there the bound is the time at which
/// the simulated robot turns with 95 % of the set point when its wheels are told to run apart as fast as they can.
///
/// Integral of the absolute error (IAE) after a disturbance d of the motors at time 0. With e_0(t) the error if the
/// command stays what it was, u the change of the command by the controller and G the linear response to it, the error
/// is e = e_0 + G u. Until the first action after the first sample that shows the disturbance, u cannot depend on it,
/// and that action has an effect after the dead time alone, at t_1 in all. What is done before t_1 to be ready for d
/// costs as much under -d: |e_0 + G u| + |-e_0 + G u| >= 2 |e_0|, so that the worse of the two has
///
///     int_0^t1 |e| dt >= int_0^t1 |e_0| dt   and   |e(t_1)| >= |e_0(t_1)|.
///
/// From there the speed changes with at most a: |e(t)| >= |e_0(t_1)| - a (t - t_1), the integral of which is
/// e_0(t_1)^2 / (2 a). Together
///
///     IAE >= int_0^t1 |e_0| dt + e_0(t_1)^2 / (2 a).
///
/// Noise would only add to both sides; there is none in this table.

#include <optional>
#include <string>
#include <vector>

#include "loop_setup.hpp"

namespace jackal_aic::sim {

/// Between samples, and between actions, of the robot that is reckoned with [s].
inline constexpr double kActionPeriod = 0.02;

/// A step from rest, or a disturbance of the motors while driving with a set point.
struct BoundedCase {
  const char* name;     ///< in words
  SetPoint set_point;   ///< forward or yaw rate, the other zero
  double gain = 1.0;    ///< of the motors after the disturbance
  double offset = 0.0;  ///< by which the wheels then turn slower than asked [rad/s]

  /// True if the motors change, false if it is the step that is looked at.
  bool disturbed() const { return gain != 1.0 || offset != 0.0; }
};

/// Steps of 0.1 to 2 m/s and 0.5 to 2 rad/s; at 0.5 m/s a gain of 0.8 and of 1.2 from one moment to the next, and a
/// load under which the wheels turn slower by 0.5 rad/s.
const std::vector<BoundedCase>& boundedCases();

/// A figure beside its bound.
struct BoundedFigure {
  std::optional<double> value;  ///< settling time [s], or IAE [m]; empty: it does not settle
  double bound = 0.0;           ///< the least it can be

  /// Value / bound; infinity without a value.
  double ofBound() const;
};

/// Least settling time of a change of the wheels' circumference speed [m/s].
double leastSettling(const PlantParameters& plant, double change);

/// Least settling time of a step from rest.
double leastSettling(const LoopSetup& setup, const SetPoint& set_point);

/// Least IAE [m]. @param uncorrected error e_0 in steps of JackalPlant::kStep from the disturbance on [m/s], at least
/// until t_1 [s]; @param limit a [m/s^2].
double leastIae(const std::vector<double>& uncorrected, double t_1, double limit);

/// Settling time after a step, or IAE over 2 s, mean over four moments of the disturbance between two samples, beside
/// its bound. Without noise. @param controller a preset or a file, which acts at 50 Hz; @param plant box or ground.
BoundedFigure runBounded(const PackageFiles& files, const std::string& controller, const std::string& plant,
                         const BoundedCase& bounded);

/// The figure of a setup without noise; empty: it does not settle.
std::optional<double> figureOf(const LoopSetup& setup, const BoundedCase& bounded);

/// Its bound. @param open_loop the open loop on the same plant, without noise.
double boundOf(const LoopSetup& open_loop, const BoundedCase& bounded);

/// What is asked of `predictive` (acceptance.yaml): a settling time in multiples of the bound and one action period
/// beside, an IAE in multiples of the bound.
double barOf(const PackageFiles& files, const BoundedCase& bounded, double bound);

/// Runs every case by every preset and writes bounds.csv into a directory; returns how many bars `predictive` misses.
/// @param jobs threads; 0: one per core.
std::size_t writeBoundsTable(const PackageFiles& files, const std::string& directory, unsigned jobs);

}  // namespace jackal_aic::sim
