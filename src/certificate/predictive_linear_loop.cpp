#include <algorithm>
#include <cmath>
#include <map>

#include "jackal_aic/aic/spectral_radius.hpp"
#include "jackal_aic/certificate/predictive_certificate.hpp"
#include "periodic_system.hpp"

namespace jackal_aic {
namespace {

constexpr int kMostPeriods = 20000;      // until the belief's gain has converged
constexpr double kConverged = 1e-12;     // relative change of the gain over a period
constexpr std::int64_t kTick = 1000000;  // inner step of the belief [ns]

WheelBelief wheelBelief(const PredictiveParameters& p, const PlantModel& model) {
  validate(p);
  return WheelBelief(model, 1.0, wheelBeliefParameters(p));
}

/// What happens at a time of the period, in the order in which it happens at one and the same time.
enum class Event { sensor, predict, belief, action, command_arrives };

}  // namespace

/// State of one wheel, a trajectory in every column, moved through the events of a period.
class PredictiveLinearLoop::Trajectories {
 public:
  Trajectories(const PredictiveLinearLoop& loop, const RobotChange& change)
      : loop_(loop), robot_(loop.robot_), action_period_(nanoseconds(1.0 / loop.parameters_.action_rate)) {
    robot_.gain *= change.gain;
    phase_ = std::clamp<std::int64_t>(nanoseconds(change.phase), 0, nanoseconds(loop.longestPhase()));
    // With one correction in a period its gain is the same whenever it comes.
    gains_ = loop.sensor_steps_ == 1 ? loop.converged_.gains : loop.convergedBelief(phase_).gains;
    const std::int64_t dead_time = std::max<std::int64_t>(0, nanoseconds(robot_.dead_time + change.extra_dead_time));
    whole_periods_ = static_cast<int>(dead_time / action_period_);
    remainder_ = dead_time % action_period_;
    model_delay_ = static_cast<std::int64_t>(loop.belief_.delay()) * kTick;
    past_commands_ = static_cast<int>(std::max((dead_time - 1) / action_period_, model_delay_ / action_period_)) + 1;
    states_ = Eigen::MatrixXd::Identity(correctionRow() + 1, correctionRow() + 1);
  }

  Eigen::MatrixXd afterOnePeriod() {
    arrived_ = remainder_ == 0;
    std::int64_t now = 0;
    for (const auto& [time, event] : loop_.schedule(remainder_, phase_)) {
      drive(time - now);
      now = time;
      happen(static_cast<Event>(event), now);
    }
    return states_;
  }

 private:
  static constexpr int kBelief = 3;
  int measurementRow() const { return kBelief; }
  int actionRow() const { return kBelief + 1; }
  /// Row of the command sent `back` action steps ago.
  int commandRow(int back) const { return actionRow() + back; }
  int wheelRow() const { return actionRow() + past_commands_ + 1; }
  int correctionRow() const { return wheelRow() + 1; }

  void happen(Event event, std::int64_t now) {
    switch (event) {
      case Event::sensor:
        states_.row(measurementRow()) = states_.row(wheelRow());
        fresh_ = true;
        return;
      case Event::predict:
        return predict(now);
      case Event::belief:
        return believe();
      case Event::action:
        return act();
      case Event::command_arrives:
        arrived_ = true;
        return;
    }
  }

  /// The robot's wheel follows the command that acts.
  void drive(std::int64_t time) {
    if (time == 0) return;
    const auto [entry, is_new] = responses_.try_emplace(time);
    if (is_new) entry->second = wheelResponse(robot_, 1e-9 * static_cast<double>(time));
    const int acting = commandRow(arrived_ ? whole_periods_ : whole_periods_ + 1);
    auto wheel = states_.middleRows<2>(wheelRow());
    wheel = (entry->second.transition * wheel + entry->second.input * states_.row(acting)).eval();
  }

  /// x ← J x + b u, u the command sent last before the inner step that ends now, less the dead time of the model.
  void predict(std::int64_t now) {
    const auto actions_before = [&](std::int64_t time) {
      return time >= 0 ? time / action_period_ : -((-time + action_period_ - 1) / action_period_);
    };
    const auto back = actions_before(now - 1) - actions_before(now - kTick - model_delay_);
    auto belief = states_.topRows<kBelief>();
    belief =
        (loop_.belief_.transition() * belief + loop_.belief_.input() * states_.row(commandRow(static_cast<int>(back))))
            .eval();
  }

  /// x ← x + K (y − w)
  void believe() {
    if (!fresh_) return;
    fresh_ = false;
    const Eigen::RowVectorXd error = states_.row(measurementRow()) - states_.row(0);
    states_.topRows<kBelief>() += gains_[correction_++] * error;
  }

  /// a ← (1 − κ_a) a − κ_a d/g, after the commands under way moved on by one.
  void act() {
    const PredictiveParameters& p = loop_.parameters_;
    for (int back = past_commands_; back > 0; --back) states_.row(commandRow(back)) = states_.row(commandRow(back - 1));
    states_.row(actionRow()) *= 1.0 - p.action_learning_rate;
    states_.row(actionRow()) -= p.action_learning_rate / loop_.model_.gain * states_.row(2);
    arrived_ = remainder_ == 0;
  }

  const PredictiveLinearLoop& loop_;
  PlantModel robot_;
  std::int64_t action_period_;  // ns
  std::int64_t model_delay_;    // ns
  std::int64_t phase_;          // ns
  std::vector<Eigen::Vector3d> gains_;
  int whole_periods_;       // of the robot's dead time, in action periods
  std::int64_t remainder_;  // of the robot's dead time [ns]
  int past_commands_;       // kept beside the action
  bool arrived_ = false;    // the newer of the two commands of this action period acts
  bool fresh_ = false;      // a measurement waits for the next belief update
  std::size_t correction_ = 0;
  Eigen::MatrixXd states_;
  std::map<std::int64_t, WheelResponse> responses_;
};

PredictiveLinearLoop::PredictiveLinearLoop(const PredictiveParameters& parameters, const PlantModel& model,
                                           const PlantModel& robot)
    : parameters_(parameters),
      model_(model),
      robot_(robot),
      belief_(wheelBelief(parameters, model)),
      action_steps_(commonActionSteps(parameters.action_rate, robot.sensor_rate, "predictive.action_rate")),
      sensor_steps_(static_cast<int>(std::lround(action_steps_ * robot.sensor_rate / parameters.action_rate))) {
  converged_ = convergedBelief(0);
}

std::vector<std::pair<std::int64_t, int>> PredictiveLinearLoop::schedule(std::int64_t remainder,
                                                                         std::int64_t phase) const {
  std::vector<std::pair<std::int64_t, int>> events;
  const std::int64_t action_period = nanoseconds(1.0 / parameters_.action_rate);
  const std::int64_t length = action_steps_ * action_period;
  const auto every = [&](std::int64_t count, std::int64_t earlier, Event event) {
    for (std::int64_t i = 1; i <= count; ++i) {
      const double end = static_cast<double>(length) * static_cast<double>(i) / static_cast<double>(count);
      events.emplace_back(std::llround(end) - earlier, static_cast<int>(event));
    }
  };
  every(sensor_steps_, phase, Event::sensor);
  every(length / kTick, 0, Event::predict);
  every(std::int64_t{action_steps_} * parameters_.beliefStepsPerAction(), 0, Event::belief);
  every(action_steps_, 0, Event::action);
  for (int i = 0; remainder > 0 && i < action_steps_; ++i) {
    events.emplace_back(i * action_period + remainder, static_cast<int>(Event::command_arrives));
  }
  std::sort(events.begin(), events.end());
  return events;
}

PredictiveLinearLoop::Belief PredictiveLinearLoop::convergedBelief(std::int64_t phase) const {
  const auto events = schedule(0, phase);
  WheelBelief belief = belief_;
  Belief result{};
  for (int period = 0; period < kMostPeriods; ++period) {
    const std::vector<Eigen::Vector3d> before = result.gains;
    result.gains.clear();
    Eigen::Matrix3d error = Eigen::Matrix3d::Identity();
    bool fresh = false;
    for (const auto& [time, event] : events) {
      if (event == static_cast<int>(Event::sensor)) fresh = true;
      if (event == static_cast<int>(Event::predict)) {
        belief.predict(0.0);
        error = (belief.transition() * error).eval();
      }
      if (event != static_cast<int>(Event::belief) || !fresh) continue;
      result.gains.push_back(belief.gain());
      error -= (result.gains.back() * error.row(0)).eval();
      belief.correct(0.0);
      fresh = false;
    }
    // Without an integral z stays at rest: it is no mode of the loop.
    if (model_.velocity_loop_integral <= 0.0) error.row(1).setZero();
    result.spectral_radius = spectralRadiusOf(error).upper();
    double change = before.size() == result.gains.size() ? 0.0 : 1.0;
    for (std::size_t i = 0; i < before.size() && i < result.gains.size(); ++i) {
      change = std::max(change, (result.gains[i] - before[i]).norm() / result.gains[i].norm());
    }
    if (change < kConverged) break;
  }
  return result;
}

double PredictiveLinearLoop::period() const { return action_steps_ / parameters_.action_rate; }

Eigen::MatrixXd PredictiveLinearLoop::periodMap(const RobotChange& change) const {
  Eigen::MatrixXd map = Trajectories(*this, change).afterOnePeriod();
  if (model_.velocity_loop_integral <= 0.0) map.row(1).setZero();
  return map;
}

double PredictiveLinearLoop::longestPhase() const {
  return std::min(1.0 / robot_.sensor_rate, 1.0 / parameters_.action_rate);
}

double PredictiveLinearLoop::worstSpectralRadius(RobotChange change) const {
  return worstOverPhase(
      [&](double phase) {
        change.phase = phase;
        return spectralRadius(change);
      },
      longestPhase());
}

double PredictiveLinearLoop::radiusUncertainty() const {
  return worstOverPhase(
      [&](double phase) {
        return 2.0 * spectralRadiusOf(periodMap({1.0, 0.0, phase})).uncertainty;
      },
      longestPhase());
}

double PredictiveLinearLoop::spectralRadius(const RobotChange& change) const {
  return spectralRadiusOf(periodMap(change)).upper();
}

}  // namespace jackal_aic
