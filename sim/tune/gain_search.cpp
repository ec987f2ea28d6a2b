#include "gain_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <nlopt.hpp>
#include <tuple>
#include <utility>

#include "jackal_aic/certificate/certificate.hpp"
#include "jackal_plant.hpp"
#include "parallel.hpp"

namespace jackal_aic {
namespace {

constexpr double kResponse = 2.5;           // s of a linear response
constexpr double kUnstablePenalty = 100.0;  // s; above every other cost
constexpr double kOvershootPenalty = 20.0;  // s per part of the step
constexpr double kErrorAreaWeight = 0.5;    // 1/s; leads the search where the settling time has no slope
constexpr double kOthersWeight = 0.05;      // of the settling times that are not the longest
constexpr double kReserve = 0.9;            // part of a bar that the search keeps to
constexpr int kRounds = 4;                  // of the local search, each with the trials that the one before missed
constexpr double kSameCost = 1e-3;          // s of settling, less than which ends a local search
constexpr std::size_t kMostJoining = 3;     // trials

double rounded(double value) {
  const double scale = std::pow(10.0, 3.0 - std::floor(std::log10(value)));
  return std::round(value * scale) / scale;
}

/// A gain that is searched, and where.
template <class Parameters>
struct SearchedGain {
  double Parameters::*value;
  Bounds bounds;
};

constexpr SearchedGain<PredictiveParameters> kPredictiveGains[] = {
    {&PredictiveParameters::action_learning_rate, {0.1, 1.0}},
    {&PredictiveParameters::reference_time, {1e-3, 1.0}},
    {&PredictiveParameters::speed_process_noise, {1e-4, 10.0}},
    {&PredictiveParameters::disturbance_process_noise, {1e-4, 10.0}},
    {&PredictiveParameters::yaw_process_noise, {1e-6, 0.1}},
    {&PredictiveParameters::dead_time_deviation, {1e-3, 0.1}},
    {&PredictiveParameters::yaw_delay_deviation, {0.01, 0.5}}};

/// The vector that is searched: logarithms of the gains that searchGains() names.
class SearchSpace {
 public:
  SearchSpace(const Gains& fixed, double sensor_rate) : fixed_(fixed) {
    if (const auto* thesis = std::get_if<ControllerParameters>(&fixed)) {
      bounds_ = {{1e-4, 1.0}, {1e-3, 1e3}, {0.3, 300.0}};  // tau, kappa_mu, kappa_a
      for (int i = 0; i <= thesis->orders; ++i) bounds_.push_back({1e-4, 1e6});
      for (int i = 1; i <= thesis->orders; ++i) {
        bounds_.push_back({lowestSensoryVariance(i, thesis->sensory_variances[0], sensor_rate), 1e12});
      }
    } else {
      for (const auto& gain : kPredictiveGains) bounds_.push_back(gain.bounds);
    }
  }

  std::size_t size() const { return bounds_.size(); }

  Gains controller(const std::vector<double>& x) const {
    Gains controller = fixed_;
    visit(controller, [&](double& value, std::size_t i) { value = rounded(std::exp(x[i])); });
    return controller;
  }

  std::vector<double> vector(Gains controller) const {
    std::vector<double> x(size());
    visit(controller,
          [&](double& value, std::size_t i) { x[i] = std::log(std::clamp(value, bounds_[i].low, bounds_[i].high)); });
    return x;
  }

  /// First step of a local search: from the linear models' gains, or, where there are none, by a factor of 2.
  double initialStep() const { return std::holds_alternative<ControllerParameters>(fixed_) ? 0.15 : std::log(2.0); }

  /// One end of the bounds, as in vector().
  std::vector<double> logarithms(double Bounds::*end) const {
    std::vector<double> list;
    for (const Bounds& bounds : bounds_) list.push_back(std::log(bounds.*end));
    return list;
  }

 private:
  template <class Function>
  static void visit(Gains& controller, const Function& function) {
    std::size_t i = 0;
    if (auto* predictive = std::get_if<PredictiveParameters>(&controller)) {
      for (const auto& gain : kPredictiveGains) function(predictive->*gain.value, i++);
      return;
    }
    auto& thesis = std::get<ControllerParameters>(controller);
    for (double* gain : {&thesis.tau, &thesis.kappa_mu, &thesis.kappa_a}) function(*gain, i++);
    for (double& variance : thesis.state_variances) function(variance, i++);
    for (std::size_t k = 1; k < thesis.sensory_variances.size(); ++k) function(thesis.sensory_variances[k], i++);
  }

  Gains fixed_;
  std::vector<Bounds> bounds_;
};

const ControllerParameters& thesisStart(const GainSearchTask& task) {
  return std::get<ControllerParameters>(task.start.controller);
}

SearchSpace searchSpace(const GainSearchTask& task, const Gains& fixed) {
  return {fixed, task.robots.front().plant.model.sensor_rate};
}

std::array<double, 2> endsOfPhase(const LinearLoop& loop) { return {loop.longestPhase(), 0.0}; }

/// The changes under which a loop with these margins is stable, at one phase; the worst first.
std::array<LoopChange, 3> marginChanges(const MarginBounds& margins, double phase) {
  return {LoopChange{margins.gain, 0.0, phase}, LoopChange{1.0, margins.delay, phase}, LoopChange{1.0, 0.0, phase}};
}

double marginViolation(const MarginBounds& margins, const LinearLoop& loop) {
  double radius = loop.beliefSpectralRadius();
  for (const double phase : endsOfPhase(loop)) {
    for (const LoopChange& change : marginChanges(margins, phase)) {
      for (const LoopMode mode : loop.modes()) {
        if (radius < kStabilityLimit) radius = std::max(radius, loop.spectralRadius(mode, change));
      }
    }
  }
  return radius - kStabilityLimit;
}

/// Time [s] from which a response stays within kSearchBand of 1, between its samples, plus a little of its error's
/// area.
double settled(const Eigen::VectorXd& response, double period) {
  double time = 0.0, area = 0.0;
  for (Eigen::Index k = 0; k < response.size(); ++k) {
    const double error = std::abs(response(k) - 1.0);
    area += period * static_cast<double>(k) * period * error;
    if (error <= kSearchBand) continue;
    const double next = k + 1 < response.size() ? std::abs(response(k + 1) - 1.0) : 0.0;
    const double part = (error - kSearchBand) / std::max(error - next, error - kSearchBand + 1e-9);
    time = period * (static_cast<double>(k) + 1.0 + part);
  }
  return std::min(time, kResponse) + kErrorAreaWeight * area;
}

double linearCostOn(const GainSearchTask& task, const LinearLoop& loop) {
  double cost = 0.0;
  for (const double phase : endsOfPhase(loop)) {
    const auto periods = static_cast<int>(kResponse / loop.period());
    const Eigen::VectorXd response = loop.stepResponse(periods, {1.0, 0.0, phase});
    const double overshoot = response.maxCoeff() - 1.0 - 0.005 * task.overshoot_pct;
    cost = std::max(cost, settled(response, loop.period()) + kOvershootPenalty * std::max(0.0, overshoot));
  }
  return cost;
}

TrialController controllerOn(const GainSearchTask& task, const Gains& controller, const SearchRobot& robot) {
  return {controller, task.start.geometry, task.start.limits, robot.plant.model};
}

/// A second for every bar that is not kept, and for as many times as it is exceeded.
double penalty(const sim::StopBars& bars, const sim::StopFigures& figures) {
  double sum = figures.settling ? 0.0 : 2.0;
  const auto add = [&](double figure, double bar) {
    if (figure > kReserve * bar) sum += figure / (kReserve * bar) - (figure > bar ? 0.0 : 1.0);
  };
  add(figures.overshoot_pct, bars.overshoot_pct);
  add(figures.beyond_mps, bars.beyond_mps);
  add(figures.beyond_radps, bars.beyond_radps);
  add(figures.ripple, bars.ripple);
  return sum;
}

/// The gains with two fifths of the largest kappa_a that is stable on every robot.
ControllerParameters withStableAction(const GainSearchTask& task, ControllerParameters gains) {
  double largest = kLargestGainMargin;
  for (const SearchRobot& robot : task.robots) {
    const double margin = certify(gains, task.start.geometry, robot.plant.model).gain_margin;
    if (margin > 0.0) largest = std::min(largest, margin);
  }
  if (largest < kLargestGainMargin) gains.kappa_a *= 0.4 * largest;
  return gains;
}

/// The local search on the simulated robots.
class Descent {
 public:
  Descent(const GainSearchTask& task, const Gains& start, std::vector<SearchTrial> trials,
          std::function<void()> evaluated)
      : task_(task),
        trials_(std::move(trials)),
        space_(searchSpace(task, start)),
        evaluated_(std::move(evaluated)),
        best_(space_.controller(space_.vector(start))) {}

  /// A round of the search, with further trials.
  void run(const std::vector<SearchTrial>& further) {
    trials_.insert(trials_.end(), further.begin(), further.end());
    best_cost_ = gainCost(task_, best_, trials_);
    nlopt::opt optimizer(nlopt::LN_SBPLX, static_cast<unsigned>(space_.size()));
    optimizer.set_lower_bounds(space_.logarithms(&Bounds::low));
    optimizer.set_upper_bounds(space_.logarithms(&Bounds::high));
    optimizer.set_initial_step(space_.initialStep());
    optimizer.set_xtol_abs(3e-3);
    optimizer.set_ftol_abs(kSameCost);
    optimizer.set_maxeval(task_.evaluations);
    optimizer.set_min_objective(&Descent::objective, this);
    std::vector<double> x = space_.vector(best_);
    double cost = 0.0;
    try {
      optimizer.optimize(x, cost);
    } catch (const nlopt::roundoff_limited&) {  // as good as it gets
    }
  }

  const Gains& best() const { return best_; }

 private:
  static double objective(const std::vector<double>& x, std::vector<double>&, void* self) {
    return static_cast<Descent*>(self)->evaluate(x);
  }

  double evaluate(const std::vector<double>& x) {
    const Gains candidate = space_.controller(x);
    const double cost = gainCost(task_, candidate, trials_, best_cost_);
    if (cost < best_cost_) {  // then it is no lower bound by giving up
      best_cost_ = cost;
      best_ = candidate;
    }
    evaluated_();
    return cost;
  }

  const GainSearchTask& task_;
  std::vector<SearchTrial> trials_;
  SearchSpace space_;
  std::function<void()> evaluated_;
  Gains best_;
  double best_cost_ = 0.0;
};

/// Gains of least linearCost(): a search of the whole space, and local ones from there and from starts of known
/// structure.
class LinearSearch {
 public:
  LinearSearch(const GainSearchTask& task, int orders)
      : task_(task), orders_(orders), space_(searchSpace(task, withOrders(thesisStart(task), orders))) {}

  ControllerParameters run() {
    for (const auto& start : {dampedStart(task_, orders_, 0.2), shapedStart(task_, orders_)}) {
      search(nlopt::LN_SBPLX, space_.vector(start), task_.linear_evaluations / 4);
    }
    const ControllerParameters damped = dampedStart(task_, orders_, 0.2);
    search(nlopt::LN_SBPLX, search(nlopt::GN_CRS2_LM, space_.vector(damped), task_.linear_evaluations),
           task_.linear_evaluations / 4);
    return controller(best_);
  }

 private:
  std::vector<double> search(nlopt::algorithm algorithm, std::vector<double> x, int evaluations) {
    nlopt::srand(static_cast<unsigned long>(task_.seed));
    nlopt::opt optimizer(algorithm, static_cast<unsigned>(space_.size()));
    optimizer.set_lower_bounds(space_.logarithms(&Bounds::low));
    optimizer.set_upper_bounds(space_.logarithms(&Bounds::high));
    optimizer.set_maxeval(evaluations);
    optimizer.set_ftol_abs(1e-5);
    optimizer.set_min_objective(&LinearSearch::objective, this);
    double cost = 0.0;
    try {
      optimizer.optimize(x, cost);
    } catch (const nlopt::roundoff_limited&) {  // as good as it gets
      cost = linearCost(task_, controller(x));
    }
    if (cost < best_cost_) {
      best_cost_ = cost;
      best_ = x;
    }
    return x;
  }

  static double objective(const std::vector<double>& x, std::vector<double>&, void* self) {
    const auto* search = static_cast<const LinearSearch*>(self);
    return linearCost(search->task_, search->controller(x));
  }

  ControllerParameters controller(const std::vector<double>& x) const {
    return std::get<ControllerParameters>(space_.controller(x));
  }

  const GainSearchTask& task_;
  int orders_;
  SearchSpace space_;
  std::vector<double> best_;
  double best_cost_ = std::numeric_limits<double>::infinity();
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
  /// Takes parts that turn out not to be needed from the work: the share that is done grows, but does not jump to all.
  void skip(std::size_t parts) {
    const std::lock_guard<std::mutex> lock(mutex_);
    all_ = std::max(done_, all_ - std::min(all_, parts));
    if (progress_) progress_(done_, all_);
  }

  void finish() { add(all_ - done_); }

 private:
  std::size_t all_;
  const SearchProgress& progress_;
  std::size_t done_ = 0;
  std::mutex mutex_;
};

/// Of some trials those that gains miss, the worst.
std::vector<SearchTrial> worstMissed(const GainSearchTask& task, const Gains& controller,
                                     const std::vector<SearchTrial>& trials) {
  std::vector<std::pair<double, SearchTrial>> missed;
  for (const SearchTrial& t : trials) {
    const double excess =
        penalty(t.trial.bars, drive(t.trial, controllerOn(task, controller, task.robots[t.robot]), task.urdf));
    if (excess >= 1.0) missed.emplace_back(excess, t);
  }
  std::stable_sort(missed.begin(), missed.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<SearchTrial> worst;
  for (std::size_t i = 0; i < std::min(missed.size(), kMostJoining); ++i) worst.push_back(missed[i].second);
  return worst;
}

/// Trials that gains miss, as further trials: of the robots without masses, and where these miss none, of the others.
std::vector<SearchTrial> missedTrials(const GainSearchTask& task, const Gains& controller) {
  if (!(marginViolation(task, controller) < 0.0)) return {};  // no trial helps that
  std::vector<SearchTrial> rolling, rigid;
  for (std::size_t i = 0; i < task.robots.size(); ++i) {
    for (Trial& trial : trialsOf(task, task.robots[i])) {
      rigid.push_back({trial, i});
      trial.rolling_track = task.robots[i].rolling_track;
      if (trial.rolling_track) rolling.push_back({std::move(trial), i});
    }
  }
  const std::vector<SearchTrial> missed = worstMissed(task, controller, rolling);
  return missed.empty() ? worstMissed(task, controller, rigid) : missed;
}

/// The rounds of the local search from a start.
Gains searchFrom(const GainSearchTask& task, const Gains& start, WorkCounter& work) {
  const auto evaluations = static_cast<std::size_t>(task.evaluations);
  std::size_t used = 0;  // of a round
  const auto count = [&] {
    if (used++ < evaluations) work.add(1);
  };
  Descent descent(task, start, firstTrials(task), count);
  std::vector<SearchTrial> further;
  for (int round = 0; round < kRounds; ++round) {
    used = 0;
    descent.run(further);
    if (used < evaluations) work.skip(evaluations - used);
    further = missedTrials(task, descent.best());
    if (!further.empty()) continue;
    work.skip(static_cast<std::size_t>(kRounds - round - 1) * evaluations);
    break;
  }
  return descent.best();
}

/// The whole search for one number of orders.
Gains searchOrders(const GainSearchTask& task, int orders, WorkCounter& work) {
  const ControllerParameters linear = LinearSearch(task, orders).run();
  work.add(static_cast<std::size_t>(task.evaluations));
  return searchFrom(task, linear, work);
}

/// The loop of gains on a robot that need not be the model that their controller has.
LinearLoop loopOf(const GainSearchTask& task, const Gains& gains, const PlantModel& model, const PlantModel& robot) {
  if (const auto* predictive = std::get_if<PredictiveParameters>(&gains)) return {*predictive, model, robot};
  return {std::get<ControllerParameters>(gains), task.start.geometry, robot};
}

/// The worst of verdict and margins at the corners of the robot's confidence box.
void assessRobustness(const GainSearchTask& task, const Gains& gains, const PlantModel& robot,
                      RobotAssessment& result) {
  const PlantModel model = drivenModel(robot);
  const Certificate nominal = certify(loopOf(task, gains, model, model));
  result.stable = nominal.stable();
  result.margins = nominal;
  for (const PlantModel& corner : confidenceBox(model)) {
    const Certificate certificate = certify(loopOf(task, gains, model, corner));
    result.stable = result.stable && certificate.stable();
    result.margins.gain_margin = std::min(result.margins.gain_margin, certificate.gain_margin);
    result.margins.delay_margin = std::min(result.margins.delay_margin, certificate.delay_margin);
  }
}

void assessOn(const GainSearchTask& task, const SearchRobot& robot, unsigned jobs, GainAssessment& assessment) {
  const std::size_t missed_before = assessment.missed.size();
  RobotAssessment result;
  assessRobustness(task, assessment.controller, robot.plant.model, result);
  if (!result.stable || !result.margins.keeps(task.margins)) {
    assessment.missed.push_back(robot.name + ": margins");
  }
  const std::vector<Trial> trials = trialsOf(task, robot);
  std::vector<sim::StopFigures> figures(trials.size());
  sim::parallelFor(trials.size(), jobs, [&](std::size_t i) {
    figures[i] = drive(trials[i], controllerOn(task, assessment.controller, robot), task.urdf);
  });
  result.settling_first = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < trials.size(); ++i) {
    (trials[i].nominal ? result.as_it_is : result.otherwise).worsen(figures[i]);
    const std::string missed = trials[i].bars.missed(figures[i]);
    if (!missed.empty()) assessment.missed.push_back(trials[i].name + ": " + missed);
    const bool searched = trials[i].set_point.forward == task.speed && trials[i].set_point.yaw_rate == 0.0;
    if (!trials[i].nominal || !searched) continue;
    const double settling = figures[i].settling.value_or(std::numeric_limits<double>::infinity());
    result.settling_first = std::min(result.settling_first, settling);
    result.settling_last = std::max(result.settling_last, settling);
  }
  result.missed = assessment.missed.size() - missed_before;
  assessment.robots.push_back(result);
}

}  // namespace

double GainAssessment::settling() const {
  double longest = 0.0;
  for (const RobotAssessment& robot : robots) longest = std::max(longest, robot.settling_last);
  return longest;
}

std::vector<Trial> trialsOf(const GainSearchTask& task, const SearchRobot& robot) {
  std::vector<Trial> trials = allTrials(robot.plant.simulation, robot.name, task.overshoot_pct);
  const auto drawn = drawnTrials(robot.plant.simulation, robot.name, task.overshoot_pct, task.draws, task.seed);
  const auto box = boxTrials(robot.plant, robot.name, task.overshoot_pct);
  trials.insert(trials.end(), drawn.begin(), drawn.end());
  trials.insert(trials.end(), box.begin(), box.end());
  return trials;
}

GainAssessment assessGains(const GainSearchTask& task, const Gains& controller, unsigned jobs) {
  GainAssessment assessment{controller, {}, {}};
  for (const SearchRobot& robot : task.robots) assessOn(task, robot, jobs, assessment);
  return assessment;
}

double marginViolation(const GainSearchTask& task, const Gains& controller) {
  double violation = -1.0;
  const auto add = [&](const PlantModel& model, const PlantModel& robot) {
    violation = std::max(violation, marginViolation(task.margins, loopOf(task, controller, model, robot)));
  };
  for (const SearchRobot& robot : task.robots) {
    const PlantModel model = drivenModel(robot.plant.model);
    add(model, model);
    for (const PlantModel& corner : confidenceBox(model)) add(model, corner);
  }
  return violation;
}

double linearCost(const GainSearchTask& task, const ControllerParameters& controller) {
  double cost = 0.0;
  for (const SearchRobot& robot : task.robots) {
    const LinearLoop loop(controller, task.start.geometry, robot.plant.model);
    const double violation = marginViolation(task.margins, loop);
    if (!(violation < 0.0)) return kUnstablePenalty + std::min(violation, 1e3);
    cost = std::max(cost, linearCostOn(task, loop));
  }
  return cost;
}

std::vector<SearchTrial> firstTrials(const GainSearchTask& task) {
  std::vector<SearchTrial> first, others;
  for (std::size_t i = 0; i < task.robots.size(); ++i) {
    const sim::PlantParameters& plant = task.robots[i].plant.simulation;
    for (Trial& trial : searchedTrials(plant, task.robots[i].name, task.overshoot_pct, task.speed)) {
      trial.rolling_track = task.robots[i].rolling_track;
      const bool searched = trial.nominal && trial.set_point.forward == task.speed;
      (searched ? first : others).push_back({trial, i});
    }
  }
  first.insert(first.end(), others.begin(), others.end());
  return first;
}

double gainCost(const GainSearchTask& task, const Gains& controller, const std::vector<SearchTrial>& trials,
                double give_up) {
  const double violation = marginViolation(task, controller);
  if (!(violation < 0.0)) return kUnstablePenalty + std::min(violation, 1e3);
  double longest = 0.0, others = 0.0;
  for (const SearchTrial& t : trials) {
    const SearchRobot& robot = task.robots[t.robot];
    const sim::StopFigures figures = drive(t.trial, controllerOn(task, controller, robot), task.urdf);
    const bool searched =
        t.trial.nominal && t.trial.set_point.forward == task.speed && t.trial.set_point.yaw_rate == 0.0;
    const double settling = figures.settling.value_or(0.0);
    if (searched) longest = std::max(longest, settling);
    if (searched) others += kOthersWeight * settling;
    others += penalty(t.trial.bars, figures);
    if (longest + others > give_up) break;
  }
  return longest + others;
}

ControllerParameters withOrders(ControllerParameters controller, int orders) {
  const auto size = static_cast<std::size_t>(orders) + 1;
  controller.orders = orders;
  for (auto* variances : {&controller.state_variances, &controller.sensory_variances}) {
    variances->resize(size, variances->back());
  }
  return controller;
}

double lowestSensoryVariance(int order, double variance, double sensor_rate) {
  double difference = variance;  // of white noise: C(2 order, order) times the variance, per sensor period^(2 order)
  for (int i = 1; i <= order; ++i) difference *= sensor_rate * sensor_rate * (4.0 - 2.0 / i);
  return std::clamp(1e-5 * difference, 1e-3, 1e11);
}

ControllerParameters dampedStart(const GainSearchTask& task, int orders, double relative_tau) {
  ControllerParameters damped = withOrders(thesisStart(task), orders);
  double delay = 0.0;
  for (const SearchRobot& robot : task.robots) {
    delay = std::max(delay, robot.plant.model.dead_time + robot.plant.model.lag + damped.actionStep());
  }
  damped.tau = std::max(1e-4, relative_tau * delay);
  damped.kappa_mu = 10.0;
  damped.state_variances[0] = 0.01;
  for (std::size_t i = 1; i < damped.sensory_variances.size(); ++i) damped.sensory_variances[i] = i == 1 ? 10.0 : 1e12;
  return withStableAction(task, damped);
}

ControllerParameters shapedStart(const GainSearchTask& task, int orders) {
  ControllerParameters shaped = withOrders(thesisStart(task), orders);
  shaped.tau = 3e-4;
  shaped.kappa_mu = 2e-3;
  std::fill(shaped.state_variances.begin(), shaped.state_variances.end(), 9.5e5);
  shaped.state_variances[0] = 300.0;
  for (std::size_t i = 1; i < shaped.sensory_variances.size(); ++i) shaped.sensory_variances[i] = i == 1 ? 0.1 : 1e12;
  return withStableAction(task, shaped);
}

std::vector<GainSearchResult> searchGains(GainSearchTask task, const SearchProgress& progress) {
  for (SearchRobot& robot : task.robots) robot.rolling_track = rollingTrack(robot.plant.simulation, task.urdf);
  if (std::holds_alternative<PredictiveParameters>(task.start.controller)) {
    WorkCounter work(static_cast<std::size_t>(kRounds * task.evaluations), progress);
    const Gains best = searchFrom(task, task.start.controller, work);
    work.finish();
    return {{"predictive", assessGains(task, best, task.jobs)}};
  }
  const auto count = static_cast<std::size_t>(task.highest_orders - task.lowest_orders) + 1;
  WorkCounter work(count * static_cast<std::size_t>((1 + kRounds) * task.evaluations), progress);
  std::vector<Gains> best(count);
  const auto orders = [&](std::size_t i) { return task.lowest_orders + static_cast<int>(i); };
  sim::parallelFor(count, task.jobs, [&](std::size_t i) { best[i] = searchOrders(task, orders(i), work); });
  work.finish();
  std::vector<GainSearchResult> results;
  for (std::size_t i = 0; i < count; ++i) {
    results.push_back({fmt::format("orders {}", orders(i)), assessGains(task, best[i], task.jobs)});
  }
  return results;
}

}  // namespace jackal_aic
