#pragma once

/// @file
/// Belief update (eq. 3-11), one step of fixed length, with two integrators.
///
/// The belief dynamics are linear, d(mu_tilde)/dt = A mu_tilde + b, with
///
///     A = D - kappa_mu (E' Pi_mu E + R_tilde' Pi_y R_tilde)
///     b = kappa_mu (E' Pi_mu mu_d_tilde / tau + R_tilde' Pi_y y_tilde)
///
/// `exact` holds y_tilde and mu_d_tilde over the step h (they are held: measurements come at the sensor rate) and
/// solves the dynamics without error: mu_tilde <- Phi mu_tilde + Gamma b with Phi = exp(A h), Gamma = int_0^h exp(A s)
/// ds. `euler` is the thesis' mu_tilde <- mu_tilde + h d(mu_tilde)/dt (3-16), which diverges once the spectral radius
/// of I + h A exceeds 1, near h kappa_mu Pi_mu / tau^2 = 2. With Phi = I + h A and Gamma = h I it is the same map.
///
/// Gamma b changes only with a measurement, a set point or gains. Phi links no motion with another: forward, lateral
/// and yaw each have a block of their own, because every order is trusted alike on both sides of the robot
/// (generative_model.hpp), so that what the wheels say of forward speed and turn adds up to zero between them.

#include <Eigen/Core>
#include <array>

#include "jackal_aic/aic/generative_model.hpp"
#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Square matrix over the stacked belief (mu, mu', ...), up to 18 x 18, on the stack.
using BeliefMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kBodySize*(kMaxOrders + 1),
                                   kBodySize*(kMaxOrders + 1)>;

/// One step of the belief update. step() neither allocates nor throws.
class BeliefUpdate {
 public:
  /// @param model generative model; @param kappa_mu learning rate; @param step length h of a step [s];
  /// @param integrator exact or euler. Computes Phi and Gamma once.
  BeliefUpdate(const GenerativeModel& model, double kappa_mu, double step, Integrator integrator);

  /// Gamma b: what a measurement and a set point that are held add to the belief in every step, 3 x (p+1).
  GeneralizedBody input(const GeneralizedSensor& measurement, const GeneralizedBody& set_point) const;

  /// Advances the belief by one step. @param input Gamma b, as input() gives it.
  void step(GeneralizedBody& belief, const GeneralizedBody& input) const;

  /// Advances the belief by one step with the measurement and the set point held.
  void step(GeneralizedBody& belief, const GeneralizedSensor& measurement, const GeneralizedBody& set_point) const {
    step(belief, input(measurement, set_point));
  }

  /// A, the continuous belief dynamics, 3(p+1) square.
  const BeliefMatrix& dynamics() const { return A_; }

  /// Map of the belief over one step: Phi for exact, I + h A for euler.
  const BeliefMatrix& transition() const { return transition_; }

  /// Map of b over one step: Gamma for exact, h I for euler.
  const BeliefMatrix& inputTransition() const { return input_transition_; }

  /// Spectral radius of transition() with its uncertainty (spectral_radius.hpp) on top; the belief update converges if
  /// it is below 1.
  double spectralRadius() const;

  /// h kappa_mu Pi_mu / tau^2 of order 0, the thesis' measure of how far Euler is driven (its bound is about 2).
  double eulerNumber() const;

 private:
  GenerativeModel model_;
  double kappa_mu_;
  double step_;
  BeliefMatrix A_;
  BeliefMatrix transition_;
  BeliefMatrix input_transition_;
  std::array<double, kBodySize*(kMaxOrders + 1) * (kMaxOrders + 1)> blocks_{};  // of Phi, (p+1) x (p+1), one by motion
};

}  // namespace jackal_aic
