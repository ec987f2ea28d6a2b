#pragma once

/// @file
/// Search for gains that settle fastest on simulated robots, stay robust by their certificates, and pass everything
/// that users drive (gain_trial.hpp).

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "gain_trial.hpp"
#include "jackal_aic/certificate/certificate.hpp"
#include "parameters/node_parameters.hpp"
#include "plant_file.hpp"

namespace jackal_aic {

/// A robot on which gains have to hold.
struct SearchRobot {
  std::string name;  ///< in words
  PlantFile plant;   ///< with its noise
  std::optional<double> rolling_track =
      std::nullopt;  ///< with which searchGains() first drives the robot without masses
};

/// What gains are searched for, and within which bounds.
struct GainSearchTask {
  ControllerFile start;             ///< gains to begin with, of the structure that is searched; its rates, integrator,
                                    ///< learning and geometry stay
  std::vector<SearchRobot> robots;  ///< on each of which the gains have to hold
  std::string urdf;                 ///< of the simulated robots
  MarginBounds margins{2.0, 0.05};  ///< to be kept
  double overshoot_pct = 10.0;      ///< largest overshoot of the robot as it is; half as much again with its spread
  double speed = 0.5;               ///< step whose settling time is minimised [m/s]
  int lowest_orders = 1;            ///< generalised orders p to search, from; the predictive structure has none
  int highest_orders = 5;           ///< to
  int linear_evaluations = 4000;    ///< candidates of each global search, on the linear models of the thesis' structure
  int evaluations = 80;             ///< simulated candidates of each round of the local search
  int draws = 50;                   ///< random trials of each robot that gains have to pass
  std::uint64_t seed = 1;           ///< of the global searches and of the random trials
  unsigned jobs = 0;                ///< threads; 0 is one per core; no influence on the result
};

/// What gains do on one robot.
struct RobotAssessment {
  double settling_first = 0.0;  ///< of the step to the task's speed, shortest over the phase [s]; 0 if it never settles
  double settling_last = 0.0;   ///< and longest
  sim::StopFigures as_it_is;    ///< worst of the trials of the robot as it is
  sim::StopFigures otherwise;   ///< worst of its spread, of coarse encoders and of the random trials
  Margins margins;              ///< the smallest at the corners of the confidence box
  bool stable = false;          ///< at each of them
  std::size_t missed = 0;       ///< margins and trials that miss a bound
};

/// What gains do on every robot of a task.
struct GainAssessment {
  Gains controller;
  std::vector<RobotAssessment> robots;  ///< in the task's order
  std::vector<std::string> missed;      ///< in words, what is not kept: margins first, then trials

  /// Longest settling time over robots and phase [s]; infinity if it never settles.
  double settling() const;
};

/// Drives every trial of a task with these gains. @param jobs threads.
GainAssessment assessGains(const GainSearchTask& task, const Gains& controller, unsigned jobs);

/// The trials of a task on one of its robots, the random ones and those of its confidence box included.
std::vector<Trial> trialsOf(const GainSearchTask& task, const SearchRobot& robot);

/// How far the spectral radius of the worst robot is above what the margins ask for, at both ends of the phase and at
/// the corners of its confidence box; 0 or less if they are kept.
double marginViolation(const GainSearchTask& task, const Gains& controller);

/// What the global search for the thesis' structure minimises, on the linear models: the longest time [s], over robots
/// and both ends of the phase, from which a step stays within kSearchBand, plus penalties for margins and overshoot.
double linearCost(const GainSearchTask& task, const ControllerParameters& controller);

/// Band of the linear search, relative to the step: narrower than the 5 % of the settling time.
inline constexpr double kSearchBand = 0.035;

/// A trial and the robot of the task that it is about.
struct SearchTrial {
  Trial trial;
  std::size_t robot;
};

/// Trials by which a candidate is first judged: steps to the task's speed at both ends of the phase, a fast and a
/// coarse one, without masses where the robot has a rolling track. Those of the task's speed come first.
std::vector<SearchTrial> firstTrials(const GainSearchTask& task);

/// What the local search minimises: the longest settling time [s] of the trials to the task's speed, plus a second for
/// every trial whose bars are not kept and for as many times as they are exceeded. Gains that miss the margins are not
/// driven. @param give_up cost above which no further trial is driven.
double gainCost(const GainSearchTask& task, const Gains& controller, const std::vector<SearchTrial>& trials,
                double give_up = std::numeric_limits<double>::infinity());

/// Gains with another number of orders; missing variances repeat the last one.
ControllerParameters withOrders(ControllerParameters controller, int orders);

/// Gains from which damping by the first derivative of the measurement can be found: a precise y' pulls mu' along, the
/// state dynamics pull mu to mu_d - tau mu', and so the integral action gets a proportional part tau y. kappa_a is two
/// fifths of what is stable. @param relative_tau tau as a part of dead time, lag and action period together.
ControllerParameters dampedStart(const GainSearchTask& task, int orders, double relative_tau);

/// Gains whose belief shapes the step: it follows the set point within a few milliseconds, and a mu' that drifts slowly
/// after y' holds it back while the robot still accelerates, so that the integral action does not overshoot. kappa_a as
/// of dampedStart().
ControllerParameters shapedStart(const GainSearchTask& task, int orders);

/// Lowest sensory variance of an order that is searched: a thousandth of what white noise of the encoders with the
/// variance of order 0 has in that difference. More precise ones amplify the steps of encoders into limit cycles.
double lowestSensoryVariance(int order, double variance, double sensor_rate);

/// Best gains found in one search; they hold if nothing is missed.
struct GainSearchResult {
  std::string name;  ///< "orders 3" or "predictive"
  GainAssessment best;
};

/// Called with the finished part of the work and all of it; never by two threads at once.
using SearchProgress = std::function<void(std::size_t finished, std::size_t all)>;

/// Searches on logarithmic scales, all gains together.
///
/// Of the thesis' structure: tau, kappa_mu, kappa_a and the variances of all orders, separately for each number of
/// orders. First on the linear models and in the whole space (NLopt, controlled random search), then from there on the
/// simulated robots (NLopt, Subplex), where trials that a best candidate does not pass join those by which the next
/// round judges: without masses, and with them where it passes all of these. The sensory variance of order 0 stays as
/// it is: scaling all variances and both learning rates together changes nothing, so that it would be one number too
/// many.
///
/// Of the predictive structure: kappa_a, the time constant of the reference, the process noises, and the deviations of
/// the dead time and of the yaw's delay, on the simulated robots from the start. The sensors' variances stay: they are
/// measured, not tuned.
///
/// Same task, same result. @throws ParameterError if the start is invalid for a robot.
std::vector<GainSearchResult> searchGains(GainSearchTask task, const SearchProgress& progress = {});

}  // namespace jackal_aic
