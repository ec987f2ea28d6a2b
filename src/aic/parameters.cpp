#include "jackal_aic/aic/parameters.hpp"

#include <cmath>
#include <sstream>

#include "jackal_aic/aic/belief_update.hpp"
#include "jackal_aic/aic/generative_model.hpp"

namespace jackal_aic {
namespace {

void checkVariances(const char* key, const std::vector<double>& variances, int orders) {
  const std::size_t needed = static_cast<std::size_t>(orders) + 1;
  if (variances.size() >= needed) return;
  std::ostringstream message;
  message << key << " has " << variances.size() << " values: controller.orders = " << orders << " needs at least "
          << needed << ", one for each of the orders 0.." << orders;
  throw ParameterError(message.str());
}

void checkRates(const ControllerParameters& controller) {
  const double ratio = controller.belief_rate / controller.action_rate;
  if (ratio >= 1.0 && std::abs(ratio - std::round(ratio)) < 1e-9 * ratio) return;
  std::ostringstream message;
  message << "controller.belief_rate = " << controller.belief_rate
          << " Hz: must be a whole multiple of controller.action_rate = " << controller.action_rate << " Hz";
  throw ParameterError(message.str());
}

void checkConvergence(const ControllerParameters& controller, const GeometryParameters& geometry) {
  const BeliefUpdate update(GenerativeModel(controller, geometry), controller.kappa_mu, controller.beliefStep(),
                            controller.integrator);
  const double radius = update.spectralRadius();
  if (radius < 1.0) return;
  std::ostringstream message;
  message.precision(4);
  message << "controller.integrator = '" << kIntegratorNames[static_cast<std::size_t>(controller.integrator)]
          << "': the belief update diverges with belief_rate = " << controller.belief_rate
          << " Hz, tau = " << controller.tau << " s, kappa_mu = " << controller.kappa_mu << ": spectral radius "
          << radius << ", must be below 1 (h kappa_mu Pi_mu / tau^2 = " << update.eulerNumber() << ", bound about 2)";
  if (controller.integrator == Integrator::euler) message << "; use integrator: exact";
  throw ParameterError(message.str());
}

}  // namespace

int ControllerParameters::beliefStepsPerAction() const {
  return static_cast<int>(std::lround(belief_rate / action_rate));
}

void validate(const ControllerParameters& controller, const GeometryParameters& geometry, Divergence divergence) {
  checkRates(controller);
  checkVariances("controller.state_variances", controller.state_variances, controller.orders);
  checkVariances("controller.sensory_variances", controller.sensory_variances, controller.orders);
  if (divergence == Divergence::refused) checkConvergence(controller, geometry);
}

}  // namespace jackal_aic
