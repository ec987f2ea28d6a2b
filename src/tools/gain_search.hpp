#pragma once

/// @file
/// Search for gains that settle fastest on a simulated robot and stay robust by their certificate.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "jackal_aic/closed_loop_certificate.hpp"
#include "response_metrics.hpp"
#include "tool_files.hpp"

namespace jackal_aic {

/// What gains are searched for, and within which bounds.
struct GainSearchTask {
  ControllerFile start;  ///< gains to begin with and to be no slower than; its rates, integrator and geometry stay
  PlantFile plant;       ///< robot to search on, with its noise
  std::string urdf;      ///< of the simulated robot
  MarginBounds margins{2.0, 0.05};                  ///< to be kept
  double overshoot_pct = 5.0;                       ///< largest overshoot of the step to `speed`
  double speed = 0.5;                               ///< step whose settling time is minimised [m/s]
  std::vector<double> other_speeds{0.1, 0.3, 1.0};  ///< steps that may not settle later than with `start` [m/s]
  int lowest_orders = 1;                            ///< generalised orders p to search, from
  int highest_orders = 5;                           ///< to
  int linear_evaluations = 20000;                   ///< candidates of each global search on the linear model
  int evaluations = 300;                            ///< simulated candidates of each local search
  std::uint64_t seed = 1;                           ///< of the global searches
  unsigned jobs = 0;                                ///< threads; 0 is one per core; no influence on the result
};

/// Responses and certificate of one set of gains.
struct GainAssessment {
  ControllerParameters controller;
  std::vector<double> speeds;                   ///< [m/s]: the task's speed, then the others
  std::vector<sim::ResponseMetrics> responses;  ///< to steps to these speeds
  Certificate certificate;
};

/// Simulates the steps of a task with these gains.
GainAssessment assessGains(const GainSearchTask& task, const ControllerParameters& controller);

/// The task with the noise of its robot switched off, which is what gains are searched on.
GainSearchTask withoutNoise(GainSearchTask task);

/// What the simulated robot minimises: the time [s] from which the step to the task's speed stays within kSearchBand of
/// the set point, plus a little of the area of the error, which leads where that time has no slope, plus penalties that
/// exceed what they could gain for margins, overshoot and other speeds that are out of bounds. Gains that miss the
/// margins are not simulated.
/// @param slowest times allowed at the other speeds [s]; @param give_up cost above which the other speeds are left out.
double gainCost(const GainSearchTask& task, const ControllerParameters& controller, const std::vector<double>& slowest,
                double give_up = std::numeric_limits<double>::infinity());

/// Band of the search, relative to the step: narrower than the 5 % of the settling time, so that noise cannot push a
/// response out of those again.
inline constexpr double kSearchBand = 0.035;

/// True if an assessment keeps all bounds of a task. @param slowest settling times allowed at the other speeds [s].
bool keepsBounds(const GainSearchTask& task, const GainAssessment& assessment, const std::vector<double>& slowest);

/// Settling times [s] of the task's start at the other speeds, which may not be exceeded; infinity where it never
/// settles.
std::vector<double> slowestAllowed(const GainSearchTask& task);

/// Gains with another number of orders; missing variances repeat the last one.
ControllerParameters withOrders(ControllerParameters controller, int orders);

/// Gains from which damping by the first derivative of the measurement can be found: a precise y' pulls mu' along, the
/// state dynamics pull mu to mu_d - tau mu', and so the integral action gets a proportional part tau y. kappa_a is half
/// of what is stable. @param relative_tau tau as a part of dead time, lag and action period together.
ControllerParameters dampedStart(const GainSearchTask& task, int orders, double relative_tau);

/// Best gains found for one number of orders.
struct GainSearchResult {
  int orders;
  GainAssessment best;  ///< of least cost
  bool keeps_bounds;    ///< whether it keeps the bounds of the task
};

/// Called with the finished part of the work and all of it; never by two threads at once.
using SearchProgress = std::function<void(std::size_t finished, std::size_t all)>;

/// Searches over tau, kappa_mu, kappa_a and the variances of all orders together on logarithmic scales, separately for
/// each number of orders. First on the linear model and in the whole space (NLopt, controlled random search), then,
/// from there and from the start, on the simulated robot without its noise (NLopt, Subplex). The sensory variance of
/// order 0 stays as it is: scaling all variances and both learning rates together changes nothing, so that it would be
/// one number too many. Same task, same result. @throws ParameterError if the start is invalid for the plant.
std::vector<GainSearchResult> searchGains(const GainSearchTask& task, const SearchProgress& progress = {});

}  // namespace jackal_aic
