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

/// μ ← Φ μ + u for each motion, of a number of orders that the compiler knows. @param blocks (p+1) x (p+1) of each.
template <int orders>
void stepMotions(const double* blocks, const double* input, double* belief) {
  using Block = Eigen::Matrix<double, orders, orders>;
  using Motion = Eigen::Matrix<double, orders, 1>;
  using Stride = Eigen::InnerStride<kBodySize>;
  for (int motion = 0; motion < kBodySize; ++motion) {
    const Eigen::Map<const Block> Phi(blocks + motion * orders * orders);
    Eigen::Map<Motion, 0, Stride> mu(belief + motion);
    Motion next = Eigen::Map<const Motion, 0, Stride>(input + motion);
    next.noalias() += Phi * mu;
    mu = next;
  }
}

}  // namespace

BeliefUpdate::BeliefUpdate(const GenerativeModel& model, double kappa_mu, double step, Integrator integrator)
    : model_(model), kappa_mu_(kappa_mu), step_(step), A_(beliefDynamics(model, kappa_mu)) {
  const Eigen::Index n = model.beliefSize();
  if (integrator == Integrator::euler) {  // (3-16)
    transition_ = BeliefMatrix::Identity(n, n) + step * A_;
    input_transition_ = step * BeliefMatrix::Identity(n, n);
  } else {
    // exp([A I; 0 0] h) = [Phi Gamma; 0 I] (Van Loan), which needs no inverse of A.
    Eigen::MatrixXd augmented = Eigen::MatrixXd::Zero(2 * n, 2 * n);
    augmented.topLeftCorner(n, n) = step * A_;
    augmented.topRightCorner(n, n) = step * Eigen::MatrixXd::Identity(n, n);
    const Eigen::MatrixXd exponential = augmented.exp();
    transition_ = exponential.topLeftCorner(n, n);
    input_transition_ = exponential.topRightCorner(n, n);
  }
  const Eigen::Index orders = model.orders() + 1;
  for (int motion = 0; motion < kBodySize; ++motion) {
    using Stride = Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>;
    Eigen::Map<Eigen::MatrixXd>(blocks_.data() + motion * orders * orders, orders, orders) =
        Eigen::Map<const Eigen::MatrixXd, 0, Stride>(transition_.data() + motion * (n + 1), orders, orders,
                                                     Stride(kBodySize * n, kBodySize));
  }
}

GeneralizedBody BeliefUpdate::input(const GeneralizedSensor& measurement, const GeneralizedBody& set_point) const {
  // b = κ_μ (E' Π_μ μ̃_d/τ + R' Π_y ỹ): what 3-11 gives for a zero belief
  GeneralizedBody input = GeneralizedBody::Zero(kBodySize, set_point.cols());
  const GeneralizedBody b = beliefDerivative(model_, kappa_mu_, input, measurement, set_point);

  using Stacked = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kBodySize*(kMaxOrders + 1), 1>;
  Eigen::Map<Stacked>(input.data(), input.size()).noalias() =
      input_transition_.lazyProduct(Eigen::Map<const Stacked>(b.data(), b.size()));
  return input;
}

void BeliefUpdate::step(GeneralizedBody& belief, const GeneralizedBody& input) const {
  // μ̃ ← Φ μ̃ + Γ b
  static constexpr std::array<void (*)(const double*, const double*, double*), kMaxOrders + 1> kStep{
      stepMotions<1>, stepMotions<2>, stepMotions<3>, stepMotions<4>, stepMotions<5>, stepMotions<6>};
  kStep[belief.cols() - 1](blocks_.data(), input.data(), belief.data());
}

double BeliefUpdate::spectralRadius() const { return spectralRadiusOf(transition_).upper(); }

double BeliefUpdate::eulerNumber() const {
  return step_ * kappa_mu_ * model_.state_precision(0, 0) / (model_.tau * model_.tau);
}

}  // namespace jackal_aic
