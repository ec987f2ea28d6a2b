#include "gain_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <nlopt.hpp>
#include <random>

#include "closed_loop.hpp"
#include "parallel.hpp"
#include "velocity_controller.hpp"

namespace jackal_aic {
namespace {

constexpr double kResponse = 2.5;            // s simulated after a step
constexpr double kOvershootReserve = 1.0;    // percent left to noise that the search has not seen
constexpr double kUnstablePenalty = 100.0;   // s; above every simulated cost
constexpr double kOvershootPenalty = 0.2;    // s per percent
constexpr double kOtherSpeedsWeight = 0.02;  // tells equally fast gains apart

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
  double radius = std::max(loop.beliefSpectralRadius(), loop.spectralRadius());
  for (const LoopChange& change : {LoopChange{task.margins.gain, 0.0}, LoopChange{1.0, task.margins.delay}}) {
    radius = std::max(
        {radius, loop.spectralRadius(LoopMode::straight, change), loop.spectralRadius(LoopMode::turn, change)});
  }
  return radius - kStabilityLimit;
}

sim::ResponseMetrics respond(const GainSearchTask& task, const ControllerParameters& controller, double speed) {
  sim::JackalPlant plant(task.urdf, task.plant.simulation);
  sim::ActiveInferenceVelocityController driver({controller, task.start.geometry, task.start.limits});
  const sim::SetPointProfile profile = sim::stepProfile(speed, 0.0, kResponse);
  return sim::assess(sim::runClosedLoop(plant, driver, profile, task.plant.simulation.support, task.start.geometry),
                     profile);
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
    const double cost = gainCost(task_, candidate, slowest_);
    if (cost < best_cost_) {
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

/// Random gains that keep the margins, of some thousand draws the first; else the last drawn.
ControllerParameters randomStart(const GainSearchTask& task, int orders, std::mt19937_64& random) {
  const ControllerParameters start = withOrders(task.start.controller, orders);
  const SearchSpace space(start);
  const std::vector<double> low = space.logarithms(&Bounds::low), high = space.logarithms(&Bounds::high);
  std::vector<double> x(space.size());
  ControllerParameters drawn = start;
  for (int i = 0; i < 3000; ++i) {
    for (std::size_t k = 0; k < x.size(); ++k) x[k] = std::uniform_real_distribution<double>(low[k], high[k])(random);
    drawn = space.controller(x);
    if (marginViolation(task, drawn) < 0.0) break;
  }
  return drawn;
}

std::vector<ControllerParameters> startsOf(const GainSearchTask& task, int orders) {
  std::vector<ControllerParameters> starts{withOrders(task.start.controller, orders),
                                           dampedStart(task.start.controller, task.plant.model, orders)};
  std::mt19937_64 random(task.seed + static_cast<std::uint64_t>(orders));
  for (int i = 0; i < task.random_starts; ++i) starts.push_back(randomStart(task, orders, random));
  return starts;
}

}  // namespace

GainAssessment assessGains(const GainSearchTask& task, const ControllerParameters& controller) {
  GainAssessment assessment{controller, {task.speed}, {}, {}};
  assessment.speeds.insert(assessment.speeds.end(), task.other_speeds.begin(), task.other_speeds.end());
  for (const double speed : assessment.speeds) assessment.responses.push_back(respond(task, controller, speed));
  assessment.certificate = certify(controller, task.start.geometry, task.plant.model);
  return assessment;
}

double gainCost(const GainSearchTask& task, const ControllerParameters& controller,
                const std::vector<double>& slowest) {
  const double violation = marginViolation(task, controller);
  if (!(violation < 0.0)) return kUnstablePenalty + std::min(violation, 1e3);
  const sim::ResponseMetrics response = respond(task, controller, task.speed);
  const double too_much = response.overshoot_pct - (task.overshoot_pct - kOvershootReserve);
  double cost = settlingOf(response) + kOvershootPenalty * std::max(0.0, too_much);
  for (std::size_t i = 0; i < task.other_speeds.size(); ++i) {
    const double settling = settlingOf(respond(task, controller, task.other_speeds[i]));
    cost += 2.0 * std::max(0.0, settling - slowest[i]) + kOtherSpeedsWeight * settling;
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

ControllerParameters dampedStart(const ControllerParameters& controller, const PlantModel& plant, int orders) {
  ControllerParameters damped = withOrders(controller, orders);
  const double delay = plant.dead_time + plant.lag + controller.actionStep();
  damped.tau = std::max(1e-4, 0.25 * delay);
  damped.kappa_mu = 10.0;
  damped.kappa_a = 0.8 * controller.sensory_variances[0] / (delay * plant.gain);
  damped.state_variances[0] = 0.01;
  if (orders > 0) damped.sensory_variances[1] = 0.05;
  for (std::size_t i = 2; i < damped.sensory_variances.size(); ++i) damped.sensory_variances[i] = 1e6;
  return damped;
}

std::vector<GainSearchResult> searchGains(const GainSearchTask& task, const SearchProgress& progress) {
  const std::vector<double> slowest = slowestAllowed(task);
  std::vector<ControllerParameters> starts;
  for (int orders = task.lowest_orders; orders <= task.highest_orders; ++orders) {
    for (const auto& start : startsOf(task, orders)) starts.push_back(start);
  }

  const std::size_t all = starts.size() * static_cast<std::size_t>(task.evaluations);
  std::size_t finished = 0;
  std::mutex mutex;
  std::vector<Descent> descents;
  for (const auto& start : starts) {
    descents.emplace_back(task, slowest, start, [&] {
      const std::lock_guard<std::mutex> lock(mutex);
      if (progress) progress(++finished, all);
    });
  }
  sim::parallelFor(descents.size(), task.jobs, [&](std::size_t i) { descents[i].run(); });
  if (progress && finished < all) progress(all, all);

  std::vector<GainSearchResult> results;
  for (int orders = task.lowest_orders; orders <= task.highest_orders; ++orders) {
    const Descent* best = nullptr;
    for (const Descent& descent : descents) {
      if (descent.best().orders != orders || (best != nullptr && descent.bestCost() >= best->bestCost())) continue;
      best = &descent;
    }
    GainAssessment assessment = assessGains(task, best->best());
    results.push_back({orders, std::nullopt});
    if (keepsBounds(task, assessment, slowest)) results.back().best = std::move(assessment);
  }
  return results;
}

}  // namespace jackal_aic
