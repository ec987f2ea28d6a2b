#include "jackal_aic/aic/belief_update.hpp"

#include <unsupported/Eigen/MatrixFunctions>

#include "jackal_aic/aic/free_energy.hpp"
#include "jackal_aic/aic/generalized_motion.hpp"
#include "jackal_aic/aic/spectral_radius.hpp"

namespace jackal_aic {
namespace {

/// A, column by column: the derivative of a unit belief when nothing is measured (y_tilde = 0) and nothing wanted
/// (mu_d_tilde = 0). This way the matrix cannot differ from 3-11 as free_energy.cpp writes it.
BeliefMatrix beliefDynamics(const GenerativeModel& model, double kappa_mu) {
  const int size = model.beliefSize();
  const GeneralizedSensor no_measurement = GeneralizedSensor::Zero(kSensorSize, model.orders() + 1);
  const GeneralizedBody no_set_point = GeneralizedBody::Zero(kBodySize, model.orders() + 1);
  BeliefMatrix A(size, size);
  for (int i = 0; i < size; ++i) {
    GeneralizedBody unit = no_set_point;
    unit(i) = 1.0;
    const GeneralizedBody column = beliefDerivative(model, kappa_mu, unit, no_measurement, no_set_point);
    A.col(i) = Eigen::Map<const Eigen::VectorXd>(column.data(), size);
  }
  return A;
}

}  // namespace

BeliefUpdate::BeliefUpdate(const GenerativeModel& model, double kappa_mu, double step, Integrator integrator)
    : model_(model), kappa_mu_(kappa_mu), step_(step), integrator_(integrator), A_(beliefDynamics(model, kappa_mu)) {
  const Eigen::Index n = model.beliefSize();
  if (integrator == Integrator::euler) {
    transition_ = BeliefMatrix::Identity(n, n) + step * A_;
    input_transition_ = step * BeliefMatrix::Identity(n, n);
    return;
  }
  // exp([A I; 0 0] h) = [Phi Gamma; 0 I] (Van Loan), which needs no inverse of A.
  Eigen::MatrixXd augmented = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  augmented.topLeftCorner(n, n) = step * A_;
  augmented.topRightCorner(n, n) = step * Eigen::MatrixXd::Identity(n, n);
  const Eigen::MatrixXd exponential = augmented.exp();
  transition_ = exponential.topLeftCorner(n, n);
  input_transition_ = exponential.topRightCorner(n, n);
}

void BeliefUpdate::step(GeneralizedBody& belief, const GeneralizedSensor& measurement,
                        const GeneralizedBody& set_point) const {
  if (integrator_ == Integrator::euler) {
    belief += step_ * beliefDerivative(model_, kappa_mu_, belief, measurement, set_point);  // (3-16)
    return;
  }
  // b = κ_μ (E' Π_μ μ̃_d/τ + R' Π_y ỹ): what 3-11 gives for a zero belief
  const GeneralizedBody nothing = GeneralizedBody::Zero(kBodySize, belief.cols());
  const GeneralizedBody b = beliefDerivative(model_, kappa_mu_, nothing, measurement, set_point);

  // μ̃ ← Φ μ̃ + Γ b
  using Stacked = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kBodySize*(kMaxOrders + 1), 1>;
  Eigen::Map<Stacked> mu(belief.data(), belief.size());
  Stacked next = transition_.lazyProduct(mu);
  next.noalias() += input_transition_.lazyProduct(Eigen::Map<const Stacked>(b.data(), b.size()));
  mu = next;
}

double BeliefUpdate::spectralRadius() const { return spectralRadiusOf(transition_).upper(); }

double BeliefUpdate::eulerNumber() const {
  return step_ * kappa_mu_ * model_.state_precision(0, 0) * model_.order_precision(0, 0) / (model_.tau * model_.tau);
}

}  // namespace jackal_aic
