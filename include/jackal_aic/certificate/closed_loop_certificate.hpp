#pragma once

/// @file
/// Stability certificate of the closed loop: what can be known about gains before a wheel turns. Everything here is
/// about the linear system of linear_loop.hpp, with what that leaves out.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/certificate/linear_loop.hpp"
#include "jackal_aic/model/plant_model.hpp"

namespace jackal_aic {

/// Gain margins are searched up to this factor; a larger one is reported as this.
inline constexpr double kLargestGainMargin = 1000.0;

/// Delay margins are searched up to this, and up to 250 action periods; a larger one is reported as the bound [s].
inline constexpr double kLargestDelayMargin = 1.0;

/// Certificate of one mode of the loop.
struct ModeCertificate {
  double spectral_radius;  ///< of the map over one common period, for the worst phase; stable if below 1
  double gain_margin;  ///< nearest factor on kappa_a at which the radius is 1: above 1 if stable, else below (0: none)
  double gain_reduction;  ///< as gain_margin, for a lower kappa_a: below 1 if stable; 0 if none down to 1e-3
  double delay_margin;    ///< extra dead time at which the radius is 1 [s]; negative if unstable, at least -dead_time
};

/// Margins below which a certificate warns, or which a search has to keep.
struct MarginBounds {
  double gain = 1.5;    ///< factor on kappa_a
  double delay = 0.03;  ///< [s]
};

/// Stability certificate of gains on a plant model, for the worst phase between the timers of sensor and action.
struct Certificate {
  double period;                  ///< common period of sensor, belief and action [s]
  double belief_spectral_radius;  ///< of one belief step with the measurement held
  double loop_spectral_radius;    ///< largest over all modes and phases of the loop, over one common period
  double radius_uncertainty;      ///< the true radius is not above loop_spectral_radius, and less than this below it
  ModeCertificate straight;       ///< driving straight
  ModeCertificate turn;           ///< turning
  double gain_margin;             ///< smaller of the two modes'
  double delay_margin;            ///< smaller of the two modes' [s]

  /// True if both the closed loop and the belief update alone, which goes on while the robot is stopped, are stable.
  bool stable() const { return belief_spectral_radius < kStabilityLimit && loop_spectral_radius < kStabilityLimit; }

  /// True if both margins are at least these.
  bool keeps(const MarginBounds& bounds) const { return gain_margin >= bounds.gain && delay_margin >= bounds.delay; }
};

/// Certifies gains on a plant model. Takes some hundred milliseconds at an action rate of 50 Hz; the time grows with
/// the cube of dead time x action rate. @throws ParameterError as LinearLoop.
Certificate certify(const ControllerParameters& controller, const GeometryParameters& geometry,
                    const PlantModel& plant);

/// True if loop and belief are stable with a change of the loop; far cheaper than certify().
bool isStable(const LinearLoop& loop, const LoopChange& change = {});

/// What is thin about a stable loop, in words; empty if both bounds are kept. Needs two evaluations of the loop only.
std::string thinMargin(const LinearLoop& loop, const MarginBounds& bounds = {});

/// Relative sensitivity d ln(rho) / d ln(parameter) of the spectral radius, the belief's if that diverges, else the
/// loop's. Parameters: kappa_a, tau, kappa_mu, state_variances, sensory_variances (all orders by one factor).
struct Sensitivity {
  std::string parameter;
  double value;
};

/// Sensitivities, the largest magnitude first.
std::vector<Sensitivity> sensitivities(const ControllerParameters& controller, const GeometryParameters& geometry,
                                       const PlantModel& plant);

/// Gains whose stable range can be asked for.
enum class Gain { tau, kappa_mu, kappa_a };

/// Words of Gain, in the order of the enumerators.
inline constexpr std::array<const char*, 3> kGainNames{"tau", "kappa_mu", "kappa_a"};

/// Permitted range of a gain.
Bounds gainBounds(Gain gain);

/// @throws ParameterError, as when they are read, if a gain is not finite or out of its range.
void requireInRange(const ControllerParameters& controller);

/// The gain's value in a set of parameters.
double& gainOf(ControllerParameters& controller, Gain gain);

/// An interval of a gain in which loop and belief are stable, the other parameters fixed.
struct StableRange {
  double low;          ///< stable above
  double high;         ///< stable below
  bool low_is_bound;   ///< low is the end of the permitted range, not of stability
  bool high_is_bound;  ///< likewise
};

/// The stable interval that contains the present value, or else the one nearest to it on a logarithmic scale; empty if
/// no permitted value is stable. Found by a scan of 16 points per decade, so that narrower gaps are missed.
std::optional<StableRange> stableRange(const ControllerParameters& controller, const GeometryParameters& geometry,
                                       const PlantModel& plant, Gain gain);

/// One or two plain sentences: what the certificate means and which change helps most.
std::string advice(const Certificate& certificate, const ControllerParameters& controller,
                   const GeometryParameters& geometry, const PlantModel& plant, const MarginBounds& bounds = {});

/// @throws ParameterError, one line with the spectral radius and the parameter most to blame, if loop or belief is
/// unstable on the plant model.
void requireStable(const ControllerParameters& controller, const GeometryParameters& geometry, const PlantModel& plant);

}  // namespace jackal_aic
