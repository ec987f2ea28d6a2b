#pragma once

/// @file
/// Stability certificate of the closed loop: stability of gains on a robot, and their margins. It holds for the linear
/// system of linear_loop.hpp, within its assumptions.

#include <string>

#include "jackal_aic/certificate/linear_loop.hpp"

namespace jackal_aic {

/// Gain margins are searched up to this factor; a larger one is reported as this.
inline constexpr double kLargestGainMargin = 1000.0;

/// Delay margins are searched up to this, and up to 250 action periods [s].
inline constexpr double kLargestDelayMargin = 1.0;

/// Delay margin up to which a loop is searched; a larger one is reported as this [s].
double largestDelayMargin(const LinearLoop& loop);

/// Margins below which a certificate warns, or which a search has to keep.
struct MarginBounds {
  double gain = 1.5;    ///< factor on the gain
  double delay = 0.03;  ///< [s]
};

/// Spectral radius of a loop and its margins to the limit of stability. A walk in steps of a tenth of the gain, and of
/// a quarter of an action period or a tenth of the extra dead time, finds the first change of the verdict; a narrower
/// gap is missed.
struct Margins {
  double spectral_radius = 0.0;  ///< of the map over one common period, for the worst phase
  double gain_margin = 1.0;  ///< factor on the gain at which the radius is 1: above 1 if stable, else below (0: none);
                             ///< at most kLargestGainMargin
  double gain_reduction = 1.0;   ///< as gain_margin, for a lower gain: below 1 if stable; 0 if none down to 1e-3
  double delay_margin = 0.0;     ///< extra dead time at which the radius is 1 [s]; negative if unstable, at least
                                 ///< -dead_time
  double delay_reduction = 0.0;  ///< of a stable loop: largest decrease of the robot's dead time [s], at most all of it

  /// True if gain and delay margin are at least these.
  bool keeps(const MarginBounds& bounds) const { return gain_margin >= bounds.gain && delay_margin >= bounds.delay; }
};

/// Stability certificate, for the worst phase between the timers of sensor and action: of both modes the larger radius
/// and the smaller margins.
struct Certificate : Margins {
  double belief_spectral_radius = 0.0;  ///< of the belief alone, which also runs while the robot is stopped
  double period = 0.0;                  ///< common period of sensor, belief and action [s]
  Margins straight;                     ///< driving straight
  Margins turn;                         ///< turning; the same as straight in the predictive structure

  /// True if belief and loop are stable.
  bool stable() const { return belief_spectral_radius < kStabilityLimit && spectral_radius < kStabilityLimit; }
};

/// Certifies a loop. Takes some tens of milliseconds at an action rate of 50 Hz; the time grows with the cube of dead
/// time x action rate.
Certificate certify(const LinearLoop& loop);

/// Certifies gains of the thesis' structure on a plant model. @throws ParameterError as LinearLoop.
Certificate certify(const ControllerParameters& controller, const GeometryParameters& geometry,
                    const PlantModel& robot);

/// Certifies the predictive controller on a robot that need not be its model. @throws ParameterError as LinearLoop.
Certificate certify(const PredictiveParameters& parameters, const PlantModel& model, const PlantModel& robot);

/// One or two sentences: the meaning of a certificate, and what to change.
std::string advice(const Certificate& certificate, const LinearLoop& loop, const MarginBounds& bounds = {});

/// @throws ParameterError, one line with the spectral radius and stable gains, if loop or belief is unstable.
void requireStable(const LinearLoop& loop);

}  // namespace jackal_aic
