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

/// Certificate of one mode of the loop.
struct ModeCertificate : Margins {
  double spectral_radius = 0.0;  ///< of the map over one common period, for the worst phase; stable if below 1
};

/// Stability certificate of gains on a plant model, for the worst phase between the timers of sensor and action; its
/// margins are the smaller ones of both modes.
struct Certificate : LoopVerdict, Margins {
  ModeCertificate straight;  ///< driving straight
  ModeCertificate turn;      ///< turning
};

/// Certifies gains on a plant model. Takes some ten milliseconds at an action rate of 50 Hz; the time grows with the
/// cube of dead time x action rate. @throws ParameterError as LinearLoop.
Certificate certify(const ControllerParameters& controller, const GeometryParameters& geometry,
                    const PlantModel& plant);

/// True if loop and belief are stable with a change of the loop; far cheaper than certify().
bool isStable(const LinearLoop& loop, const LoopChange& change = {});

/// Radii of a loop, without margins.
LoopVerdict verdictOn(const LinearLoop& loop);

/// The bound that a stable loop does not keep. Needs two evaluations of the loop only.
ThinMargin thinMarginOf(const LinearLoop& loop, const MarginBounds& bounds = {});

/// Sensitivities to kappa_a, tau, kappa_mu, state_variances, sensory_variances (all orders by one factor), the largest
/// magnitude first; those that are zero are left out.
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

/// The stable interval that contains the present value, or else the one nearest to it on a logarithmic scale; empty if
/// no permitted value is stable. Found by a scan of 16 points per decade, so that narrower gaps are missed.
std::optional<StableRange> stableRange(const ControllerParameters& controller, const GeometryParameters& geometry,
                                       const PlantModel& plant, Gain gain);

/// The gain that is most to blame for an instability, with the range in which it is stable. The variances are only in
/// the list of sensitivities: the gains do all they can. @param running gains before a change, if they were changed.
std::optional<Culprit> culpritOf(const ControllerParameters& controller, const GeometryParameters& geometry,
                                 const PlantModel& plant, const ControllerParameters* running = nullptr);

}  // namespace jackal_aic
