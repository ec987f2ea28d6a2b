#pragma once

/// @file
/// The simplified state-space model of the active inference controller: chapter 4 and Appendix A of the thesis. The
/// robot is a point mass without dynamics (y = a, g(mu) = mu), so that only the controller itself moves.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "jackal_aic/aic/parameters.hpp"

namespace jackal_aic {

/// Linear model x_dot = A x + B mu_d, y = C x of eq. 4-7 with the state
/// x = (mu, mu', ..., mu^(p), a, a', ..., a^(p)): beliefs [m/s per s^i] and actions [m/s per s^i] of one degree of
/// freedom.
///
///     A = [ D - k_mu E' Pi_mu E - k_mu Pi_y     k_mu Pi_y ]     B = [ k_mu E' Pi_mu e_0 / tau ]     E = D + I/tau
///         [ k_a Pi_y                           -k_a Pi_y  ]         [ 0                       ]
///
/// Interpretations where the print is damaged or contradicts itself:
/// - Pi = 1/Sigma: 4-3 has Sigma^-1 and is right; 4-4 to 4-6 write Sigma in place of the precision.
/// - The `tau_mat` of Appendix A is not printed; it is E', as in eq. 3-12 and 4-3. Line 29 of the appendix lost its
///   comma and one minus; eq. 4-4 shows their places.
/// - B of the appendix has two belief rows for every p; for p = 0 the second one would drive the action. Here B
///   comes from E', which gives the same two rows for p >= 1 and one for p = 0.
/// - Actions of all orders: 4-6 gives the model p + 1 actions a, a', ..., each with its own gradient. It uses a^(i) as
///   the i-th derivative of the output, although the model does not integrate one into the next. The model here does
///   the same, because the thesis analyses it; the controller that drives a robot has one action of order 0.
struct StateSpaceModel {
  int orders = 0;        ///< highest generalised order p
  double tau = 0.0;      ///< temporal parameter [s], for the error terms
  Eigen::MatrixXd a;     ///< system matrix A, 2(p+1) x 2(p+1) [1/s between states of one order]
  Eigen::VectorXd b;     ///< input vector B, 2(p+1)
  Eigen::RowVectorXd c;  ///< output vector C, 2(p+1): selects the action a of order 0

  /// Orders kept, p + 1.
  int size() const { return orders + 1; }
};

/// Builds the model from tau, kappa_mu, kappa_a, the orders and the variances of a controller; the rates are not used.
/// @throws ParameterError if orders is outside 0..5 or a variance of an order 0..p is missing.
StateSpaceModel stateSpaceModel(const ControllerParameters& parameters);

/// Spectral radius of I + dt A with its uncertainty (spectral_radius.hpp) on top: the simulation below diverges if it
/// exceeds 1. @param dt Euler step [s].
double spectralRadius(const StateSpaceModel& model, double dt);

/// How one simulation of the model runs.
struct StateSpaceRun {
  double dt = 0.001;         ///< time between samples [s]
  double duration = 2.0;     ///< T_end [s]; the samples are at 0, dt, ..., duration - dt
  double set_point = 1.0;    ///< mu_d [m/s], constant; the state starts at zero
  int inner_iterations = 1;  ///< Euler iterations per sample; the thesis' `dgrd` makes 5
  /// True: each iteration advances dt/inner_iterations, so that the samples lie dt apart in the model's time too.
  /// False: each advances a whole dt, as Appendix A does, by which the model runs inner_iterations times faster than
  /// its time axis says.
  bool divide_step = true;
};

/// Response of the model; column k of every matrix belongs to time[k].
struct StateSpaceResponse {
  std::vector<double> time;         ///< [s]
  Eigen::MatrixXd states;           ///< x, 2(p+1) x n
  Eigen::RowVectorXd output;        ///< y = C x, n [m/s]
  Eigen::MatrixXd sensory_errors;   ///< eps_y^(i) = a^(i) - mu^(i), (p+1) x n (eq. 4-2)
  Eigen::MatrixXd state_errors;     ///< eps_mu^(i) of eq. 4-1, (p+1) x n, with mu^(p+1) = 0
  std::optional<double> rise_time;  ///< from the first sample above 10 % of the set point to the first above 90 % [s]
};

/// Simulates a step response by forward Euler, as Appendix A does. A diverging model returns numbers that are not
/// finite. Three corrections of the printed code: the error terms have all orders 0..p (the print omits eps_y of order
/// 0 and eps_mu of order p). eps_mu^(i) adds mu^(i)/tau of the same sample (the print subtracts that of the first
/// sample). The time axis ends at the duration (the print runs to T_end/dt seconds).
/// @throws ParameterError if dt, duration or inner_iterations is not positive, or the set point is zero or not finite.
StateSpaceResponse simulate(const StateSpaceModel& model, const StateSpaceRun& run);

}  // namespace jackal_aic
