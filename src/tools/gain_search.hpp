#pragma once

/// @file
/// Search for gains that settle fastest on a simulated robot and stay robust by their certificate.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
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
  int evaluations = 300;                            ///< simulated candidates per start of the search
  int random_starts = 1;                            ///< starts drawn at random, beside two known ones
  std::uint64_t seed = 1;                           ///< of these
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

/// What is minimised: the settling time of the task's step [s], plus penalties that exceed any settling time gained for
/// margins, overshoot and other speeds that are out of bounds. Gains that miss the margins are not simulated.
/// @param slowest settling times allowed at the other speeds [s].
double gainCost(const GainSearchTask& task, const ControllerParameters& controller, const std::vector<double>& slowest);

/// True if an assessment keeps all bounds of a task. @param slowest as in gainCost().
bool keepsBounds(const GainSearchTask& task, const GainAssessment& assessment, const std::vector<double>& slowest);

/// Settling times at the other speeds that may not be exceeded: those of the task's start; infinity where it never
/// settles.
std::vector<double> slowestAllowed(const GainSearchTask& task);

/// Gains with another number of orders; missing variances repeat the last one.
ControllerParameters withOrders(ControllerParameters controller, int orders);

/// Gains from which damping by the first derivative of the measurement can be found: a precise y' pulls mu' along, the
/// state dynamics pull mu to mu_d - tau mu', and so the integral action gets a proportional part tau y.
ControllerParameters dampedStart(const ControllerParameters& controller, const PlantModel& plant, int orders);

/// Best gains found for one number of orders.
struct GainSearchResult {
  int orders;
  std::optional<GainAssessment> best;  ///< empty if no candidate kept the bounds
};

/// Called with the number of finished evaluations and the number of all; never by two threads at once.
using SearchProgress = std::function<void(std::size_t finished, std::size_t all)>;

/// Searches over tau, kappa_mu, kappa_a and the variances of all orders together, separately for each number of orders,
/// by Subplex (NLopt) on logarithmic scales from several starts. The sensory variance of order 0 stays as it is:
/// scaling all variances and both learning rates together changes nothing, so that it would be one number too many.
/// Same task, same result. @throws ParameterError if the start does not drive the plant.
std::vector<GainSearchResult> searchGains(const GainSearchTask& task, const SearchProgress& progress = {});

}  // namespace jackal_aic
