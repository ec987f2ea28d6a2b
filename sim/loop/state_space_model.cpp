#include "state_space_model.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "jackal_aic/aic/spectral_radius.hpp"

namespace jackal_aic {
namespace {

/// Pi over the orders 0..p, diag(1/Sigma).
Eigen::MatrixXd precisions(const std::vector<double>& variances, const ControllerParameters& p, const char* name) {
  if (static_cast<int>(variances.size()) <= p.orders) {
    throw ParameterError(
        fmt::format("{} has {} entries: {} needed for orders 0..{}", name, variances.size(), p.orders + 1, p.orders));
  }
  return Eigen::Map<const Eigen::VectorXd>(variances.data(), p.orders + 1).cwiseInverse().asDiagonal();
}

/// E = D + I/tau, the Jacobian of eps_mu with respect to the belief.
Eigen::MatrixXd stateErrorJacobian(Eigen::Index size, double tau) {
  Eigen::MatrixXd e = Eigen::MatrixXd::Identity(size, size) / tau;
  e.diagonal(1).setOnes();
  return e;
}

void requirePositive(const char* name, double value) {
  if (!(value > 0.0) || !std::isfinite(value)) {
    throw ParameterError(fmt::format("{} = {:g}: must be positive", name, value));
  }
}

/// First sample above a level, or -1.
Eigen::Index firstAbove(const Eigen::RowVectorXd& ratio, double level) {
  for (Eigen::Index k = 0; k < ratio.size(); ++k) {
    if (ratio(k) > level) return k;
  }
  return -1;
}

void addErrors(const StateSpaceModel& model, double set_point, StateSpaceResponse& response) {
  const int n = model.size();
  const auto beliefs = response.states.topRows(n);
  response.sensory_errors = response.states.bottomRows(n) - beliefs;
  response.state_errors = stateErrorJacobian(n, model.tau) * beliefs;
  response.state_errors.row(0).array() -= set_point / model.tau;
}

}  // namespace

StateSpaceModel stateSpaceModel(const ControllerParameters& parameters) {
  if (parameters.orders < 0 || parameters.orders > kMaxOrders) {
    throw ParameterError(fmt::format("orders = {}: must be in [0, {}]", parameters.orders, kMaxOrders));
  }
  requirePositive("tau", parameters.tau);
  const Eigen::Index n = parameters.orders + 1;
  const double kappa_mu = parameters.kappa_mu;
  const Eigen::MatrixXd pi_mu = precisions(parameters.state_variances, parameters, "state_variances");
  const Eigen::MatrixXd pi_y = precisions(parameters.sensory_variances, parameters, "sensory_variances");
  const Eigen::MatrixXd e = stateErrorJacobian(n, parameters.tau);
  Eigen::MatrixXd shift = Eigen::MatrixXd::Zero(n, n);
  shift.diagonal(1).setOnes();

  StateSpaceModel model;
  model.orders = parameters.orders;
  model.tau = parameters.tau;
  model.a.resize(2 * n, 2 * n);
  model.a << shift - kappa_mu * (e.transpose() * pi_mu * e + pi_y), kappa_mu * pi_y,  //
      parameters.kappa_a * pi_y, -parameters.kappa_a * pi_y;
  model.b = Eigen::VectorXd::Zero(2 * n);
  model.b.head(n) = kappa_mu / parameters.tau * (e.transpose() * pi_mu).col(0);
  model.c = Eigen::RowVectorXd::Unit(2 * n, n);
  return model;
}

double spectralRadius(const StateSpaceModel& model, double dt) {
  const Eigen::MatrixXd step = Eigen::MatrixXd::Identity(model.a.rows(), model.a.cols()) + dt * model.a;
  return spectralRadiusOf(step).upper();
}

StateSpaceResponse simulate(const StateSpaceModel& model, const StateSpaceRun& run) {
  requirePositive("dt", run.dt);
  requirePositive("duration", run.duration);
  requirePositive("inner_iterations", run.inner_iterations);
  if (run.set_point == 0.0 || !std::isfinite(run.set_point))
    throw ParameterError("set_point: must be finite, not zero");

  const auto samples = static_cast<Eigen::Index>(std::llround(run.duration / run.dt));
  const double step = run.divide_step ? run.dt / run.inner_iterations : run.dt;
  StateSpaceResponse response;
  response.states.resize(model.a.rows(), samples);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(model.a.rows());
  for (Eigen::Index k = 0; k < samples; ++k) {
    response.time.push_back(static_cast<double>(k) * run.dt);
    response.states.col(k) = x;
    for (int i = 0; i < run.inner_iterations; ++i) x += step * (model.a * x + model.b * run.set_point);
  }
  response.output = model.c * response.states;
  addErrors(model, run.set_point, response);

  const Eigen::RowVectorXd ratio = response.output / run.set_point;
  const Eigen::Index low = firstAbove(ratio, 0.1);
  const Eigen::Index high = firstAbove(ratio, 0.9);
  if (low >= 0 && high >= 0) response.rise_time = response.time[high] - response.time[low];
  return response;
}

}  // namespace jackal_aic
