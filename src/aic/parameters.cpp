#include "jackal_aic/aic/parameters.hpp"

#include <fmt/format.h>

#include <cmath>

#include "jackal_aic/aic/belief_update.hpp"
#include "jackal_aic/aic/generative_model.hpp"

namespace jackal_aic {
namespace {

void checkVariances(const char* key, const std::vector<double>& variances, int orders) {
  const std::size_t needed = static_cast<std::size_t>(orders) + 1;
  if (variances.size() >= needed) return;
  throw ParameterError(
      fmt::format("{} has {} values: controller.orders = {} needs at least {}, one for each of the orders 0..{}", key,
                  variances.size(), orders, needed, orders));
}

void checkConvergence(const ControllerParameters& controller, const GeometryParameters& geometry) {
  const BeliefUpdate update(GenerativeModel(controller, geometry), controller.kappa_mu, controller.beliefStep(),
                            controller.integrator);
  const double radius = update.spectralRadius();
  if (radius < 1.0) return;
  throw ParameterError(fmt::format(
      "controller.integrator = '{}': the belief update diverges with belief_rate = {:.4g} Hz, tau = {:.4g} s, kappa_mu "
      "= {:.4g}: spectral radius {:.4g}, must be below 1 (h kappa_mu Pi_mu / tau^2 = {:.4g}, must be below 2){}",
      kIntegratorNames[static_cast<std::size_t>(controller.integrator)], controller.belief_rate, controller.tau,
      controller.kappa_mu, radius, update.eulerNumber(),
      controller.integrator == Integrator::euler ? "; use integrator: exact" : ""));
}

}  // namespace

int ControllerParameters::beliefStepsPerAction() const {
  return static_cast<int>(std::lround(belief_rate / action_rate));
}

bool isWhole(double ratio) { return ratio >= 1.0 - 1e-9 && std::abs(ratio - std::round(ratio)) < 1e-9 * ratio; }

void requireWholeRatio(const char* section, double belief_rate, double action_rate) {
  if (isWhole(belief_rate / action_rate)) return;
  throw ParameterError(fmt::format("{0}.belief_rate = {1:g} Hz: must be a whole multiple of {0}.action_rate = {2:g} Hz",
                                   section, belief_rate, action_rate));
}

const ControllerParameters& validate(const ControllerParameters& controller, const GeometryParameters& geometry,
                                     Divergence divergence) {
  requireWholeRatio("controller", controller.belief_rate, controller.action_rate);
  checkVariances("controller.state_variances", controller.state_variances, controller.orders);
  checkVariances("controller.sensory_variances", controller.sensory_variances, controller.orders);
  if (divergence == Divergence::refused) checkConvergence(controller, geometry);
  return controller;
}

}  // namespace jackal_aic
