#pragma once

/// @file
/// Belief update (eq. 3-11), one step of fixed length, with two integrators.
///
/// The belief dynamics are linear, d(mu_tilde)/dt = A mu_tilde + b, with
///
///     A = D - kappa_mu (E' Pi_mu E + R_tilde' Pi_y R_tilde)
///     b = kappa_mu (E' Pi_mu mu_d_tilde / tau + R_tilde' Pi_y y_tilde)
///
/// Both are mu_tilde <- Phi mu_tilde + Gamma b with b held over the step h. `exact` has Phi = exp(A h) and Gamma =
/// int_0^h exp(A s) ds, without error. `euler` (3-16) has Phi = I + h A and Gamma = h I, and diverges once the spectral
/// radius of Phi exceeds 1: of Table C-1 at h kappa_mu Pi_mu / tau^2 = 1.75.

#include <Eigen/Core>

#include "jackal_aic/aic/free_energy.hpp"
#include "jackal_aic/aic/generative_model.hpp"
#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/aic/spectral_radius.hpp"

namespace jackal_aic {

/// [Phi Gamma] of dynamics A over a step [s].
Eigen::MatrixXd integrated(const Eigen::MatrixXd& A, double step, Integrator integrator);

/// Pseudo-inverse of R: the state that measurements show, by least squares.
Eigen::MatrixXd leastSquares(const Eigen::MatrixXd& sensory_map);

/// One step of the belief update. step() does not throw, and with fixed-size models does not allocate.
template <class Model>
class BeliefUpdate {
  static constexpr int kSize = Model::Belief::MaxSizeAtCompileTime;

 public:
  using Belief = typename Model::Belief;            ///< mu_tilde
  using Measurement = typename Model::Measurement;  ///< y_tilde

  /// Square matrix over the stacked belief (mu, mu', ...).
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kSize, kSize>;

  /// @param model generative model; @param kappa_mu learning rate; @param step length h of a step [s];
  /// @param integrator exact or euler. Computes Phi and Gamma once.
  BeliefUpdate(const Model& model, double kappa_mu, double step, Integrator integrator)
      : model_(model), kappa_mu_(kappa_mu), step_(step), A_(model.beliefSize(), model.beliefSize()) {
    const int n = model.beliefSize();
    // Column by column the derivative of a unit belief without measurement and set point: A cannot differ from 3-11.
    for (int i = 0; i < n; ++i) {
      Belief unit = model.still();
      unit(i) = 1.0;
      const Belief column = beliefDerivative(model, kappa_mu, unit, model.silence(), model.still());
      A_.col(i) = Eigen::Map<const Eigen::VectorXd>(column.data(), n);
    }
    const Eigen::MatrixXd maps = integrated(A_, step, integrator);
    transition_ = maps.leftCols(n);
    input_transition_ = maps.rightCols(n);
  }

  /// Gamma b: the change of the belief in every step by the held measurement and set point.
  Belief input(const Measurement& measurement, const Belief& set_point) const {
    // b = κ_μ (E' Π_μ μ̃_d/τ + R' Π_y ỹ): what 3-11 gives for a zero belief
    Belief input = model_.still();
    const Belief b = beliefDerivative(model_, kappa_mu_, input, measurement, set_point);
    Eigen::Map<Stacked>(input.data(), input.size()).noalias() =
        input_transition_.lazyProduct(Eigen::Map<const Stacked>(b.data(), b.size()));
    return input;
  }

  /// Advances the belief by one step. @param input Gamma b, as input() gives it.
  void step(Belief& belief, const Belief& input) const {
    // μ̃ ← Φ μ̃ + Γ b
    Eigen::Map<Stacked> mu(belief.data(), belief.size());
    const Stacked driven = transition_.lazyProduct(mu);
    mu = driven + Eigen::Map<const Stacked>(input.data(), input.size());
  }

  /// Advances the belief by one step with the measurement and the set point held.
  void step(Belief& belief, const Measurement& measurement, const Belief& set_point) const {
    step(belief, input(measurement, set_point));
  }

  const Matrix& dynamics() const { return A_; }                        ///< A, the continuous belief dynamics
  const Matrix& transition() const { return transition_; }             ///< Phi
  const Matrix& inputTransition() const { return input_transition_; }  ///< Gamma

  /// Spectral radius of transition(); the belief update converges if it is below 1.
  double spectralRadius() const { return jackal_aic::spectralRadius(transition_); }

  /// h kappa_mu Pi_mu / tau^2 of order 0: Euler diverges beyond a bound of at most 2.
  double eulerNumber() const { return step_ * kappa_mu_ * model_.state_precision(0, 0) / (model_.tau * model_.tau); }

 private:
  using Stacked = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kSize, 1>;

  Model model_;
  double kappa_mu_;
  double step_;
  Matrix A_;
  Matrix transition_;
  Matrix input_transition_;
};

extern template class BeliefUpdate<GenerativeModel>;

}  // namespace jackal_aic
