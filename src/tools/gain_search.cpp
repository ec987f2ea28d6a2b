#include "gain_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <nlopt.hpp>
#include <optional>

#include "closed_loop.hpp"
#include "parallel.hpp"
#include "timed_controller.hpp"

namespace jackal_aic {
namespace {

constexpr double kResponse = 2.5;            // s simulated after a step
constexpr double kOvershootReserve = 1.5;    // percent left to noise that the search has not seen
constexpr double kUnstablePenalty = 100.0;   // s; above every simulated cost
constexpr double kOvershootPenalty = 0.2;    // s per percent
constexpr double kErrorAreaWeight = 1.0;     // 1/s; leads the search where the settling time has no slope
constexpr double kOtherSpeedsWeight = 0.02;  // tells equally fast gains apart

constexpr std::size_t kPartsPerBisection = 40;  // of the progress, in simulated candidates

double settlingOf(const sim::ResponseMetrics& response) {
  if (!response.stable) return 2.0 * kResponse;
  return response.settling.value_or(kResponse);
}

double rounded(double value) {
  const double scale = std::pow(10.0, 3.0 - std::floor(std::log10(value)));
  return std::round(value * scale) / scale;
}

/// The vector that is searched: logarithms of tau, kappa_mu, kappa_a, the state variances and the sensory variances
/// from order 1.
class SearchSpace {
 public:
  explicit SearchSpace(const ControllerParameters& fixed) : fixed_(fixed) {}

  std::size_t size() const { return 3 + 2 * static_cast<std::size_t>(fixed_.orders) + 1; }

  /// Bounds [low, high] of a coordinate before the logarithm.
  static Bounds bounds(std::size_t index) {
    constexpr std::array<Bounds, 3> kGains{{{1e-4, 1.0}, {1e-3, 1e2}, {0.3, 300.0}}};  // tau, kappa_mu, kappa_a
    return index < kGains.size() ? kGains[index] : Bounds{1e-3, 1e8};
  }

  ControllerParameters controller(const std::vector<double>& x) const {
    ControllerParameters controller = fixed_;
    visit(controller, [&](double& value, std::size_t i) { value = rounded(std::exp(x[i])); });
    return controller;
  }

  std::vector<double> vector(ControllerParameters controller) const {
    std::vector<double> x(size());
    visit(controller,
          [&](double& value, std::size_t i) { x[i] = std::log(std::clamp(value, bounds(i).low, bounds(i).high)); });
    return x;
  }

  std::vector<double> logarithms(double Bounds::*end) const {
    std::vector<double> list(size());
    for (std::size_t i = 0; i < list.size(); ++i) list[i] = std::log(bounds(i).*end);
    return list;
  }

 private:
  template <class Function>
  static void visit(ControllerParameters& controller, const Function& function) {
    std::size_t i = 0;
    for (double* gain : {&controller.tau, &controller.kappa_mu, &controller.kappa_a}) function(*gain, i++);
    for (double& variance : controller.state_variances) function(variance, i++);
    for (std::size_t k = 1; k < controller.sensory_variances.size(); ++k)
      function(controller.sensory_variances[k], i++);
  }

  ControllerParameters fixed_;
};

/// How far the spectral radius is above what the margins ask for; 0 or less if they are kept.
double marginViolation(const GainSearchTask& task, const ControllerParameters& controller) {
  const LinearLoop loop(controller, task.start.geometry, task.plant.model);
  double radius = std::max(loop.beliefSpectralRadius(), loop.worstSpectralRadius());
  for (const LoopChange& change : {LoopChange{task.margins.gain, 0.0}, LoopChange{1.0, task.margins.delay}}) {
    radius = std::max({radius, loop.worstSpectralRadius(LoopMode::straight, change),
                       loop.worstSpectralRadius(LoopMode::turn, change)});
  }
  return radius - kStabilityLimit;
}

std::vector<sim::Sample> simulate(const GainSearchTask& task, const ControllerParameters& controller,
                                  const sim::SetPointProfile& profile) {
  sim::JackalPlant plant(task.urdf, task.plant.simulation);
  const auto driver = sim::makeTimedController(
      sim::ActiveInferenceSetup{controller, task.start.geometry, task.start.limits, task.plant.model});
  return sim::runClosedLoop(plant, *driver, profile, task.plant.simulation.support, task.start.geometry);
}

sim::ResponseMetrics respond(const GainSearchTask& task, const ControllerParameters& controller, double speed) {
  const sim::SetPointProfile profile = sim::stepProfile(speed, 0.0, kResponse);
  return sim::assess(simulate(task, controller, profile), profile);
}

/// A response as the search judges it.
struct SearchedResponse {
  double settled;        ///< time since the step from which it stays within kSearchBand [s]
  double overshoot_pct;  ///< of the step
  double error_area;     ///< integral of time x |error| relative to the step [s^2], which changes without jumps
};

SearchedResponse searchedResponse(const GainSearchTask& task, const ControllerParameters& controller, double speed) {
  const sim::SetPointProfile profile = sim::stepProfile(speed, 0.0, kResponse);
  const std::vector<sim::Sample> samples = simulate(task, controller, profile);
  const sim::ResponseMetrics metrics = sim::assess(samples, profile);
  if (!metrics.stable) return {2.0 * kResponse, 0.0, 0.5 * kResponse * kResponse};
  SearchedResponse response{0.0, metrics.overshoot_pct, 0.0};
  for (const sim::Sample& sample : samples) {
    const double time = sample.time - profile.assessed_from;
    const double error = std::abs(sample.velocity - speed) / speed;
    if (time < 0.0) continue;
    if (error > kSearchBand) response.settled = time;
    response.error_area += time * error * sim::JackalPlant::kStep;
  }
  return response;
}

/// One start of the search.
class Descent {
 public:
  Descent(const GainSearchTask& task, const std::vector<double>& slowest, const ControllerParameters& start,
          std::function<void()> evaluated)
      : task_(task), slowest_(slowest), space_(start), evaluated_(std::move(evaluated)), best_(start) {
    best_cost_ = gainCost(task, best_, slowest);
  }

  void run() {
    nlopt::opt optimizer(nlopt::LN_SBPLX, static_cast<unsigned>(space_.size()));
    optimizer.set_lower_bounds(space_.logarithms(&Bounds::low));
    optimizer.set_upper_bounds(space_.logarithms(&Bounds::high));
    optimizer.set_initial_step(0.3);
    optimizer.set_xtol_abs(1e-3);
    optimizer.set_maxeval(task_.evaluations);
    optimizer.set_min_objective(&Descent::objective, this);
    std::vector<double> x = space_.vector(best_);
    double cost = 0.0;
    try {
      optimizer.optimize(x, cost);
    } catch (const nlopt::roundoff_limited&) {  // as good as it gets
    }
  }

  const ControllerParameters& best() const { return best_; }
  double bestCost() const { return best_cost_; }

 private:
  static double objective(const std::vector<double>& x, std::vector<double>&, void* self) {
    return static_cast<Descent*>(self)->evaluate(x);
  }

  double evaluate(const std::vector<double>& x) {
    const ControllerParameters candidate = space_.controller(x);
    const double cost = gainCost(task_, candidate, slowest_, best_cost_);
    if (cost < best_cost_) {  // then it is no lower bound by giving up
      best_cost_ = cost;
      best_ = candidate;
    }
    evaluated_();
    return cost;
  }

  const GainSearchTask& task_;
  const std::vector<double>& slowest_;
  SearchSpace space_;
  std::function<void()> evaluated_;
  ControllerParameters best_;
  double best_cost_ = 0.0;
};

/// Finds gains on the linear model, which takes a thousandth of the time of a simulation. The settling time itself
/// jumps where a ripple leaves the band; so for a given time the largest error after it is minimised, and the shortest
/// time at which that fits the band is found by bisection.
class LinearSearch {
 public:
  static constexpr int kBisections = 6;

  LinearSearch(const GainSearchTask& task, int orders)
      : task_(task), orders_(orders), space_(withOrders(task.start.controller, orders)) {}

  /// @param step_done called kBisections times.
  ControllerParameters run(const std::function<void()>& step_done) {
    ControllerParameters best = dampedStart(task_, orders_, 0.2);
    double too_fast = task_.plant.model.dead_time, reached = std::min(kResponse, too_fast + kSlowest);
    for (int i = 0; i < kBisections; ++i) {
      settled_ = 0.5 * (too_fast + reached);
      if (const auto candidate = settledGains(best)) {
        reached = settled_;
        best = *candidate;
      } else {
        too_fast = settled_;
      }
      step_done();
    }
    return best;
  }

 private:
  static constexpr double kSlowest = 1.0;  // s after the dead time
  static constexpr std::uint64_t kSearchesPerTime = 3;

  /// Gains that are settled by the time in question; empty if none of the searches finds any.
  std::optional<ControllerParameters> settledGains(const ControllerParameters& start) {
    for (std::uint64_t i = 0; i < kSearchesPerTime; ++i) {
      const auto [candidate, error] = leastError(start, task_.seed + i);
      if (error <= kSearchBand) return candidate;
    }
    return std::nullopt;
  }

  std::pair<ControllerParameters, double> leastError(const ControllerParameters& start, std::uint64_t seed) {
    nlopt::srand(static_cast<unsigned long>(seed));
    nlopt::opt optimizer(nlopt::GN_CRS2_LM, static_cast<unsigned>(space_.size()));
    optimizer.set_lower_bounds(space_.logarithms(&Bounds::low));
    optimizer.set_upper_bounds(space_.logarithms(&Bounds::high));
    optimizer.set_maxeval(task_.linear_evaluations);
    optimizer.set_stopval(0.5 * kSearchBand);
    optimizer.set_ftol_abs(1e-7);
    optimizer.set_min_objective(&LinearSearch::objective, this);
    std::vector<double> x = space_.vector(start);
    double error = 0.0;
    optimizer.optimize(x, error);
    return {space_.controller(x), error};
  }

  static double objective(const std::vector<double>& x, std::vector<double>&, void* self) {
    const auto* search = static_cast<const LinearSearch*>(self);
    return search->largestError(search->space_.controller(x));
  }

  /// Largest error after the time in question, relative to the step, plus what overshoots before it.
  double largestError(const ControllerParameters& candidate) const {
    const double violation = marginViolation(task_, candidate);
    if (!(violation < 0.0)) return kUnstablePenalty + std::min(violation, 1e3);
    const LinearLoop loop(candidate, task_.start.geometry, task_.plant.model);
    const Eigen::VectorXd value = loop.stepResponse(LoopMode::straight, static_cast<int>(kResponse / loop.period()));
    const auto settled = static_cast<Eigen::Index>(settled_ / loop.period());
    const double overshoot = value.maxCoeff() - 1.0 - 0.01 * (task_.overshoot_pct - kOvershootReserve);
    return (value.tail(value.size() - settled).array() - 1.0).abs().maxCoeff() + 5.0 * std::max(0.0, overshoot);
  }

  const GainSearchTask& task_;
  int orders_;
  SearchSpace space_;
  double settled_ = 0.0;
};

/// Reports parts of the work from any thread.
class WorkCounter {
 public:
  WorkCounter(std::size_t all, const SearchProgress& progress) : all_(all), progress_(progress) {}
  void add(std::size_t parts) {
    const std::lock_guard<std::mutex> lock(mutex_);
    done_ = std::min(all_, done_ + parts);
    if (progress_) progress_(done_, all_);
  }
  void finish() { add(all_ - done_); }

 private:
  std::size_t all_;
  const SearchProgress& progress_;
  std::size_t done_ = 0;
  std::mutex mutex_;
};

/// The whole search for one number of orders.
ControllerParameters searchOrders(const GainSearchTask& task, const std::vector<double>& slowest, int orders,
                                  WorkCounter& work) {
  const ControllerParameters linear = LinearSearch(task, orders).run([&] { work.add(kPartsPerBisection); });
  ControllerParameters best = linear;
  double best_cost = std::numeric_limits<double>::infinity();
  for (const ControllerParameters& start : {linear, withOrders(task.start.controller, orders)}) {
    Descent descent(task, slowest, start, [&] { work.add(1); });
    descent.run();
    if (descent.bestCost() >= best_cost) continue;
    best = descent.best();
    best_cost = descent.bestCost();
  }
  return best;
}

}  // namespace

GainAssessment assessGains(const GainSearchTask& task, const ControllerParameters& controller) {
  GainAssessment assessment{controller, {task.speed}, {}, {}};
  assessment.speeds.insert(assessment.speeds.end(), task.other_speeds.begin(), task.other_speeds.end());
  for (const double speed : assessment.speeds) assessment.responses.push_back(respond(task, controller, speed));
  assessment.certificate = certify(controller, task.start.geometry, task.plant.model);
  return assessment;
}

GainSearchTask withoutNoise(GainSearchTask task) {
  task.plant.simulation.noise_scale = 0.0;
  return task;
}

double gainCost(const GainSearchTask& task, const ControllerParameters& controller, const std::vector<double>& slowest,
                double give_up) {
  const double violation = marginViolation(task, controller);
  if (!(violation < 0.0)) return kUnstablePenalty + std::min(violation, 1e3);
  const SearchedResponse step = searchedResponse(task, controller, task.speed);
  const double too_much = std::max(0.0, step.overshoot_pct - (task.overshoot_pct - kOvershootReserve));
  double cost = step.settled + kErrorAreaWeight * step.error_area + kOvershootPenalty * too_much;
  for (std::size_t i = 0; i < task.other_speeds.size() && cost < give_up; ++i) {
    const double settled = searchedResponse(task, controller, task.other_speeds[i]).settled;
    cost += 2.0 * std::max(0.0, settled - slowest[i]) + kOtherSpeedsWeight * settled;
  }
  return cost;
}

bool keepsBounds(const GainSearchTask& task, const GainAssessment& assessment, const std::vector<double>& slowest) {
  const sim::ResponseMetrics& step = assessment.responses.front();
  if (!assessment.certificate.stable() || !assessment.certificate.keeps(task.margins)) return false;
  if (!step.stable || !step.settling || step.overshoot_pct > task.overshoot_pct) return false;
  for (std::size_t i = 0; i < slowest.size(); ++i) {
    if (settlingOf(assessment.responses[i + 1]) > slowest[i]) return false;
  }
  return true;
}

std::vector<double> slowestAllowed(const GainSearchTask& task) {
  std::vector<double> slowest;
  for (const double speed : task.other_speeds) {
    const sim::ResponseMetrics response = respond(task, task.start.controller, speed);
    const bool settles = response.stable && response.settling;
    slowest.push_back(settles ? *response.settling : std::numeric_limits<double>::infinity());
  }
  return slowest;
}

ControllerParameters withOrders(ControllerParameters controller, int orders) {
  const auto size = static_cast<std::size_t>(orders) + 1;
  controller.orders = orders;
  for (auto* variances : {&controller.state_variances, &controller.sensory_variances}) {
    variances->resize(size, variances->back());
  }
  return controller;
}

ControllerParameters dampedStart(const GainSearchTask& task, int orders, double relative_tau) {
  ControllerParameters damped = withOrders(task.start.controller, orders);
  const PlantModel& plant = task.plant.model;
  damped.tau = std::max(1e-4, relative_tau * (plant.dead_time + plant.lag + damped.actionStep()));
  damped.kappa_mu = 10.0;
  damped.state_variances[0] = 0.01;
  for (std::size_t i = 1; i < damped.sensory_variances.size(); ++i) damped.sensory_variances[i] = i == 1 ? 0.05 : 1e6;
  const auto stable = stableRange(damped, task.start.geometry, plant, Gain::kappa_a);
  if (stable && !stable->high_is_bound) damped.kappa_a = 0.4 * stable->high;
  return damped;
}

std::vector<GainSearchResult> searchGains(const GainSearchTask& noisy_task, const SearchProgress& progress) {
  const GainSearchTask task = withoutNoise(noisy_task);
  const std::vector<double> slowest = slowestAllowed(task);
  const auto count = static_cast<std::size_t>(task.highest_orders - task.lowest_orders) + 1;
  WorkCounter work(
      count * (kPartsPerBisection * LinearSearch::kBisections + 2 * static_cast<std::size_t>(task.evaluations)),
      progress);
  std::vector<ControllerParameters> best(count);
  sim::parallelFor(count, task.jobs, [&](std::size_t i) {
    best[i] = searchOrders(task, slowest, task.lowest_orders + static_cast<int>(i), work);
  });
  work.finish();

  std::vector<GainSearchResult> results;
  for (const ControllerParameters& controller : best) {
    GainAssessment assessment = assessGains(task, controller);
    const bool keeps = keepsBounds(task, assessment, slowest);
    results.push_back({controller.orders, std::move(assessment), keeps});
  }
  return results;
}

}  // namespace jackal_aic
