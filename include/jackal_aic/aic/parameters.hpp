#pragma once

/// @file
/// One plain struct per part of the controller: default, unit, range, source. YAML holds variances (Sigma); precisions
/// (Pi = 1/Sigma) exist only inside the code.

#include <array>
#include <string>
#include <vector>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/geometry.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// How the belief update (3-11) is integrated over one step.
enum class Integrator {
  exact,  ///< zero-order hold of the measurement and set point, by matrix exponential (unconditionally stable)
  euler   ///< forward Euler, eq. 3-16 (the thesis' choice; diverges unless h kappa_mu Pi_mu / tau^2 is well below 2)
};

/// Words of Integrator, in the order of the enumerators.
inline constexpr std::array<const char*, 2> kIntegratorNames{"exact", "euler"};

/// Gains of the active inference controller (Table C-1). YAML prefix `controller`.
struct ControllerParameters {
  double belief_rate = 50.0;                  ///< rate of the belief update (3-11) [Hz]
  double action_rate = 50.0;                  ///< rate of the action update (3-13) [Hz]; belief_rate is a multiple
  Integrator integrator = Integrator::exact;  ///< integrator of the belief update
  int orders = 3;                             ///< highest generalised order p, 0..5
  double tau = 0.03;                          ///< temporal parameter of the state dynamics (2-3) [s]
  double kappa_mu = 0.01;                     ///< learning rate of the belief update
  double kappa_a = 8.0;                       ///< learning rate of the action update
  bool printed = false;                       ///< action as the thesis prints it: no action bound, no standstill
  std::vector<double> state_variances = {1.5, 2.0, 4.0, 8.0};    ///< Sigma_mu of orders 0..p
  std::vector<double> sensory_variances = {2.0, 2.0, 1e5, 1e5};  ///< Sigma_y of orders 0..p

  /// Step of the belief update, h = 1/belief_rate [s].
  double beliefStep() const { return 1.0 / belief_rate; }

  /// Step of the action update [s].
  double actionStep() const { return 1.0 / action_rate; }

  /// Belief updates per action update.
  int beliefStepsPerAction() const;
};

/// Lists the fields of ControllerParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, ControllerParameters& p) {
  v.field("belief_rate", p.belief_rate, {1.0, 1000.0}, "Hz", Presence::required);
  v.field("action_rate", p.action_rate, {1.0, 1000.0}, "Hz", Presence::required);
  v.field("integrator", p.integrator, kIntegratorNames, Presence::optional);
  v.field("orders", p.orders, {0, kMaxOrders}, "", Presence::required);
  v.field("tau", p.tau, {1e-5, 10.0}, "s", Presence::required);
  v.field("kappa_mu", p.kappa_mu, {1e-9, 1e3}, "", Presence::required);
  v.field("kappa_a", p.kappa_a, {0.0, 1e4}, "", Presence::required);
  v.field("printed", p.printed, Presence::optional);
  v.field("state_variances", p.state_variances, {1e-6, 1e12}, 6, "", Presence::required);
  v.field("sensory_variances", p.sensory_variances, {1e-6, 1e12}, 6, "", Presence::required);
}

/// Treatment of gains with a diverging belief update: refused for driving, allowed for experiments that show it.
enum class Divergence { refused, allowed };

/// True if a ratio is a whole number from 1 on, but for rounding.
bool isWhole(double ratio);

/// @throws ParameterError if the belief rate of a section is not a whole multiple of its action rate [Hz].
void requireWholeRatio(const char* section, double belief_rate, double action_rate);

/// Checks what single ranges cannot: belief_rate a whole multiple of action_rate, a variance for each order 0..p, and a
/// belief update that converges with the chosen integrator, rate and gains on this geometry. Returns the same gains.
/// @throws ParameterError naming the key, the value and the bound.
const ControllerParameters& validate(const ControllerParameters& controller, const GeometryParameters& geometry,
                                     Divergence divergence = Divergence::refused);

}  // namespace jackal_aic
