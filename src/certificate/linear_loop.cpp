#include "jackal_aic/certificate/linear_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "jackal_aic/aic/belief_update.hpp"
#include "jackal_aic/aic/free_energy.hpp"
#include "jackal_aic/aic/generative_model.hpp"
#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"

namespace jackal_aic {
namespace {

using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

constexpr int kMostActionSteps = 50;                             // of a common period
enum { kSpeed, kCorrection, kDisturbance, kMeasured, kStates };  // states of a predictive controller
constexpr int kMostPeriods = 20000;                              // until the belief's gain has converged
constexpr double kConverged = 1e-12;                             // relative change of the gain over a period
constexpr int kPhases = 5;                                       // of the timers, from 0 to the longest
constexpr int kRefinements = 4;                                  // halvings of the distance between two phases
constexpr double kClose = 0.02;  // to a radius of 1: more than the radius changes between two phases

std::int64_t nanoseconds(double seconds) { return std::llround(1e9 * seconds); }

/// Inner step of the predictive belief [ns].
const std::int64_t kTick = nanoseconds(WheelBelief::kStep);

/// @param key of the action rate, for the message.
LoopClock clockOf(double action_rate, int belief_steps_per_action, double sensor_rate, const char* key) {
  const double samples_per_action = sensor_rate / action_rate;
  for (int n = 1; n <= kMostActionSteps; ++n) {
    const double samples = n * samples_per_action;
    if (samples < 0.5 || std::abs(samples - std::round(samples)) > 1e-6) continue;
    const std::int64_t period = nanoseconds(1.0 / action_rate);
    return {period, n, std::lround(samples), std::int64_t{n} * belief_steps_per_action, n * period / kTick};
  }
  throw ParameterError(fmt::format(
      "plant_model.sensor_rate = {:g} Hz: no common period with {} = {:g} Hz within {} action periods; round it",
      sensor_rate, key, action_rate, kMostActionSteps));
}

/// Gains of a belief, in order, once they are the same in every period. @param period runs one, and adds its gains.
template <class Period>
std::vector<Eigen::Vector3d> converged(const Period& period) {
  std::vector<Eigen::Vector3d> gains;
  for (int i = 0; i < kMostPeriods; ++i) {
    const std::vector<Eigen::Vector3d> before = std::exchange(gains, {});
    period(gains);
    const auto same = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
      return (b - a).norm() <= kConverged * b.norm();
    };
    if (std::equal(before.begin(), before.end(), gains.begin(), gains.end(), same)) break;
  }
  return gains;
}

/// Measurement y of a unit wheel speed of a mode.
SensorVector sensorResponse(LoopMode mode, const GeometryParameters& geometry, const PlantModel& robot) {
  SensorVector y = SensorVector::Zero();
  y(kWheelRight) = 1.0;
  y(kWheelLeft) = mode == LoopMode::straight ? 1.0 : -1.0;
  if (mode == LoopMode::turn && !robot.on_box) {
    y(kYawRate) = 2.0 * SkidSteerKinematics(geometryOf(robot, geometry)).yawPerDifference();
  }
  return y;
}

}  // namespace

std::vector<std::pair<std::int64_t, LoopEvent>> LoopClock::events(std::int64_t command_late,
                                                                  std::int64_t sample_early) const {
  std::vector<std::pair<std::int64_t, LoopEvent>> events;
  events.reserve(static_cast<std::size_t>(2 * action_steps + sensor_steps + predict_steps + belief_steps));
  const auto period = static_cast<double>(action_steps * action_period);
  const auto every = [&](std::int64_t count, std::int64_t earlier, LoopEvent event) {
    for (std::int64_t i = 1; i <= count; ++i) {
      const double end = period * static_cast<double>(i) / static_cast<double>(count);
      events.emplace_back(std::llround(end) - earlier, event);
    }
  };
  every(sensor_steps, sample_early, LoopEvent::sensor);
  every(predict_steps, 0, LoopEvent::predict);
  every(belief_steps, 0, LoopEvent::belief);
  every(action_steps, 0, LoopEvent::action);
  for (std::int64_t i = 0; command_late > 0 && i < action_steps; ++i) {
    events.emplace_back(i * action_period + command_late, LoopEvent::command_arrives);
  }
  std::sort(events.begin(), events.end());
  return events;
}

/// A loop followed through the events of one common period, a trajectory in every column.
class LinearLoop::Period {
 public:
  /// @param least_commands past commands to keep in addition to the action.
  Period(const LinearLoop& loop, Equations equations, const LoopChange& change, int least_commands = 0)
      : clock_(loop.clock_), robot_(loop.robot_), equations_(std::move(equations)), phase_(phaseOf(loop, change)) {
    robot_.gain *= change.gain;
    if (loop.belief_) model_delay_ = static_cast<std::int64_t>(loop.belief_->delay()) * kTick;
    const std::int64_t dead_time = std::max<std::int64_t>(0, nanoseconds(robot_.dead_time + change.extra_dead_time));
    whole_periods_ = static_cast<int>(dead_time / clock_.action_period);
    remainder_ = dead_time % clock_.action_period;
    past_commands_ = std::max(whole_periods_ + (remainder_ > 0 ? 1 : 0), least_commands);
    if (loop.belief_) {
      past_commands_ = std::max(past_commands_, static_cast<int>(model_delay_ / clock_.action_period) + 1);
    }
    action_ = static_cast<int>(equations_.act.size());
    states_ = MatrixXd::Identity(wheelRow() + 2, wheelRow() + 2);
  }

  static std::int64_t phaseOf(const LinearLoop& loop, const LoopChange& change) {
    return std::clamp<std::int64_t>(nanoseconds(change.phase), 0, nanoseconds(loop.longestPhase()));
  }

  /// Map of the states over the period.
  MatrixXd map() {
    arrived_ = remainder_ == 0;
    std::int64_t now = 0;
    for (const auto& [time, event] : clock_.events(remainder_, phase_)) {
      // The belief depends on the wheel only through the sensor, so the robot is not advanced to belief steps.
      if (event != LoopEvent::predict && event != LoopEvent::belief) {
        drive(time - now);
        now = time;
      }
      happen(event, time);
    }
    return states_;
  }

 private:
  int commandRow(int back) const { return action_ + back; }  // of the command sent `back` action steps ago
  int wheelRow() const { return action_ + past_commands_ + 1; }

  void happen(LoopEvent event, std::int64_t now) {
    auto x = states_.topRows(action_);
    switch (event) {
      case LoopEvent::sensor:
        x = (equations_.sense.lazyProduct(x) + equations_.sense_wheel * states_.row(wheelRow())).eval();
        return;
      case LoopEvent::predict:
        if (equations_.predict.size() == 0) return;
        x = (equations_.predict.lazyProduct(x) + equations_.predict_command * states_.row(believedCommand(now))).eval();
        return;
      case LoopEvent::belief: {
        const MatrixXd& update = equations_.believe[updates_++ % equations_.believe.size()];
        if (update.size() > 0) x = update.lazyProduct(x).eval();
        return;
      }
      case LoopEvent::action:
        for (int k = past_commands_; k > 0; --k) states_.row(commandRow(k)) = states_.row(commandRow(k - 1));
        states_.row(action_) = (equations_.keep * states_.row(action_) + equations_.act * x).eval();
        arrived_ = remainder_ == 0;
        return;
      case LoopEvent::command_arrives:
        arrived_ = true;
    }
  }

  /// Row of the command that acts in the model during the inner step that ends now.
  int believedCommand(std::int64_t now) const {
    const auto actions_before = [&](std::int64_t time) {
      return time >= 0 ? time / clock_.action_period : -((-time + clock_.action_period - 1) / clock_.action_period);
    };
    return commandRow(static_cast<int>(actions_before(now - 1) - actions_before(now - kTick - model_delay_)));
  }

  /// The wheel follows the command that acts.
  void drive(std::int64_t time) {
    if (time == 0) return;
    const auto [entry, is_new] = responses_.try_emplace(time);
    if (is_new) entry->second = driveTrainResponse(robot_, 1e-9 * static_cast<double>(time));
    const int acting = commandRow(arrived_ ? whole_periods_ : whole_periods_ + 1);
    auto wheel = states_.middleRows<2>(wheelRow());
    wheel = (entry->second.transition * wheel + robot_.gain * entry->second.input * states_.row(acting)).eval();
  }

  const LoopClock& clock_;
  PlantModel robot_;
  Equations equations_;
  std::int64_t phase_;
  std::int64_t model_delay_ = 0;  // dead time of the model [ns]
  int whole_periods_ = 0;         // of the robot's dead time, in action periods
  std::int64_t remainder_ = 0;    // of the robot's dead time [ns]
  int past_commands_ = 0;         // kept in addition to the action
  int action_ = 0;                // its row
  std::size_t updates_ = 0;       // of the belief so far
  bool arrived_ = false;          // the newer of the two commands of this action period acts
  MatrixXd states_;
  std::map<std::int64_t, DriveTrainResponse> responses_;
};

LinearLoop::LinearLoop(const ControllerParameters& controller, const GeometryParameters& geometry,
                       const PlantModel& robot)
    : robot_(robot),
      action_gain_(controller.kappa_a),
      bounded_(!controller.printed),
      modes_{LoopMode::straight, LoopMode::turn} {
  validate(controller, geometry, Divergence::allowed);
  clock_ =
      clockOf(controller.action_rate, controller.beliefStepsPerAction(), robot.sensor_rate, "controller.action_rate");
  clock_.predict_steps = 0;
  for (const LoopMode mode : modes_) equations_.push_back(thesisEquations(controller, geometry, mode));
  belief_radius_ = BeliefUpdate(GenerativeModel(controller, geometry), controller.kappa_mu, controller.beliefStep(),
                                controller.integrator)
                       .spectralRadius();
}

LinearLoop::LinearLoop(const PredictiveParameters& parameters, const PlantModel& model, const PlantModel& robot)
    : robot_(robot), model_(model), action_gain_(parameters.action_learning_rate), modes_{LoopMode::straight} {
  validate(parameters);
  belief_.emplace(model, 1.0, wheelBeliefParameters(parameters));
  clock_ =
      clockOf(parameters.action_rate, parameters.beliefStepsPerAction(), robot.sensor_rate, "predictive.action_rate");
  gains_ = convergedGains(0);
  equations_.push_back(predictiveEquations());
  belief_radius_ = beliefErrorRadius();
}

LinearLoop::Equations LinearLoop::thesisEquations(const ControllerParameters& controller,
                                                  const GeometryParameters& geometry, LoopMode mode) const {
  const int orders = controller.orders + 1;
  const int channel = mode == LoopMode::straight ? kForward : kYaw;
  const WheelVector projection = mode == LoopMode::straight ? WheelVector{0.5, 0.5} : WheelVector{-0.5, 0.5};
  const SensorVector response = sensorResponse(mode, geometry, robot_);
  const GenerativeModel model(controller, geometry);
  const BeliefUpdate update(model, controller.kappa_mu, controller.beliefStep(), controller.integrator);
  const GeneralizedBody no_belief = GeneralizedBody::Zero(kBodySize, orders);
  const GeneralizedSensor no_measurement = GeneralizedSensor::Zero(kSensorSize, orders);
  VectorXd scale(orders);
  for (int i = 0; i < orders; ++i) scale(i) = std::pow(robot_.sensor_rate, -i);

  // Taken from the controller's own functions, unit by unit, so that the certificate cannot differ from the controller.
  MatrixXd transition(orders, orders), input_transition(orders, orders), input(orders, orders);
  RowVectorXd act(2 * orders);
  for (int i = 0; i < orders; ++i) {
    for (int j = 0; j < orders; ++j) {
      transition(i, j) = update.transition()(kBodySize * i + channel, kBodySize * j + channel);
      input_transition(i, j) = update.inputTransition()(kBodySize * i + channel, kBodySize * j + channel);
    }
    GeneralizedBody unit_belief = no_belief;
    unit_belief(channel, i) = 1.0 / scale(i);
    GeneralizedSensor unit = no_measurement;
    unit.col(i) = response;
    input.col(i) = beliefDerivative(model, controller.kappa_mu, no_belief, unit, no_belief).row(channel).transpose();
    unit.col(i) /= scale(i);
    act(i) = projection.dot(actionGradient(model, sensoryPredictionError(model, unit_belief, no_measurement)));
    act(orders + i) = projection.dot(actionGradient(model, unit));
  }
  const auto scaled = [&](const MatrixXd& m) -> MatrixXd {
    return scale.asDiagonal() * m * scale.cwiseInverse().asDiagonal();
  };

  Equations equations;
  // y^(i) ← y^(i-1) − y_old^(i-1), the recursion 3-22 in units of (sensor period)^i
  equations.sense = MatrixXd::Identity(2 * orders, 2 * orders);
  equations.sense.bottomRightCorner(orders, orders).setZero();
  equations.sense.bottomRightCorner(orders, orders).triangularView<Eigen::StrictlyLower>().setConstant(-1.0);
  equations.sense_wheel = VectorXd::Zero(2 * orders);
  equations.sense_wheel.tail(orders).setOnes();
  // μ̃ ← Φ μ̃ + Γ b (3-11)
  MatrixXd believe = MatrixXd::Identity(2 * orders, 2 * orders);
  believe.topRows(orders) << scaled(transition), scaled(input_transition * input);
  equations.believe.push_back(believe);
  // a ← a − h κ_a K Π_y ε_y (3-13)
  equations.keep = 1.0;
  equations.act = -controller.actionStep() * controller.kappa_a * act;
  equations.rest = VectorXd::Zero(2 * orders);
  equations.rest(0) = -act(orders) / act(0);  // belief at which the action rests
  equations.rest(orders) = 1.0;
  return equations;
}

LinearLoop::Equations LinearLoop::predictiveEquations() const {
  Equations equations;
  // y ← w of the robot
  equations.sense = MatrixXd::Identity(kStates, kStates);
  equations.sense(kMeasured, kMeasured) = 0.0;
  equations.sense_wheel = VectorXd::Unit(kStates, kMeasured);
  // x ← J x + b u
  equations.predict = MatrixXd::Identity(kStates, kStates);
  equations.predict.topLeftCorner<3, 3>() = belief_->transition();
  equations.predict_command = VectorXd::Zero(kStates);
  equations.predict_command.head<3>() = belief_->input();
  // Without an integral z stays zero, so it is not a mode of the loop.
  if (model_->velocity_loop_integral <= 0.0) equations.predict.row(kCorrection).setZero();
  equations.believe = corrections(gains_, 0);
  // a ← (1 − κ_a) a − κ_a d/g
  equations.keep = 1.0 - action_gain_;
  equations.act = RowVectorXd::Zero(kStates);
  equations.act(kDisturbance) = -action_gain_ / model_->gain;
  return equations;
}

/// x ← x + K (y − w) at the belief updates that have a new sample.
std::vector<MatrixXd> LinearLoop::corrections(const std::vector<Eigen::Vector3d>& gains, std::int64_t phase) const {
  std::vector<MatrixXd> updates;
  auto gain = gains.begin();
  bool fresh = false;
  for (const auto& [time, event] : clock_.events(0, phase)) {
    if (event == LoopEvent::sensor) fresh = true;
    if (event != LoopEvent::belief) continue;
    updates.emplace_back();
    if (fresh && gain != gains.end()) {
      updates.back() = MatrixXd::Identity(kStates, kStates);
      updates.back().block<3, 1>(0, kSpeed) -= *gain;
      updates.back().block<3, 1>(0, kMeasured) += *gain++;
    }
    fresh = false;
  }
  return updates;
}

/// Gains of the corrections in a period, in order, to which the covariance of the belief converges.
std::vector<Eigen::Vector3d> LinearLoop::convergedGains(std::int64_t phase) const {
  const auto events = clock_.events(0, phase);
  WheelBelief belief = *belief_;
  return converged([&](std::vector<Eigen::Vector3d>& gains) {
    bool fresh = false;
    for (const auto& [time, event] : events) {
      if (event == LoopEvent::sensor) fresh = true;
      if (event == LoopEvent::predict) belief.predict(0.0);
      if (event != LoopEvent::belief || !std::exchange(fresh, false)) continue;
      gains.push_back(belief.gain());
      belief.correct(0.0);
    }
  });
}

/// Map of the belief's error, which is autonomous.
double LinearLoop::beliefErrorRadius() const {
  const Equations& equations = equations_.front();
  MatrixXd error = MatrixXd::Identity(kStates, kStates);
  error(kMeasured, kMeasured) = 0.0;
  std::size_t updates = 0;
  for (const auto& [time, event] : clock_.events(0, 0)) {
    if (event == LoopEvent::predict) error = (equations.predict * error).eval();
    if (event != LoopEvent::belief) continue;
    const MatrixXd& update = equations.believe[updates++];
    if (update.size() > 0) error = (update * error).eval();
  }
  return spectralRadiusOf(error).upper();
}

const LinearLoop::Equations& LinearLoop::equationsOf(LoopMode mode) const {
  return mode == LoopMode::straight ? equations_.front() : equations_.back();
}

MatrixXd LinearLoop::periodMap(LoopMode mode, const LoopChange& change) const {
  Equations equations = equationsOf(mode);
  // With one sample in a period its gain is the same at any phase.
  const std::int64_t phase = Period::phaseOf(*this, change);
  if (belief_ && phase > 0) {
    equations.believe = corrections(clock_.sensor_steps == 1 ? gains_ : convergedGains(phase), phase);
  }
  return Period(*this, std::move(equations), change).map();
}

double LinearLoop::spectralRadius(LoopMode mode, const LoopChange& change) const {
  return spectralRadiusOf(periodMap(mode, change)).upper();
}

double LinearLoop::longestPhase() const { return std::min(1.0 / robot_.sensor_rate, actionPeriod()); }

/// Largest over a grid of phases, and between the neighbours of its largest value where that is close to the limit of
/// stability, so that the verdict does not depend on the grid. @param enough radius at which the search ends.
LinearLoop::WorstPhase LinearLoop::worstPhase(LoopMode mode, LoopChange change, double enough) const {
  WorstPhase worst{-HUGE_VAL, 0.0};
  const auto evaluate = [&](double phase) {
    if (worst.radius >= enough || phase < 0.0 || phase > longestPhase()) return;
    change.phase = phase;
    const double radius = jackal_aic::spectralRadius(periodMap(mode, change));
    if (radius > worst.radius) worst = {radius, phase};
  };
  double distance = longestPhase() / (kPhases - 1);
  for (int i = 0; i < kPhases; ++i) evaluate(i * distance);
  for (int i = 0; i < kRefinements && std::abs(worst.radius - 1.0) < kClose; ++i) {
    distance *= 0.5;
    const double centre = worst.phase;
    evaluate(centre - distance);
    evaluate(centre + distance);
  }
  return worst;
}

SpectralRadius LinearLoop::worstSpectralRadius(LoopMode mode, const LoopChange& change) const {
  LoopChange worst = change;
  worst.phase = worstPhase(mode, change, HUGE_VAL).phase;
  return spectralRadiusOf(periodMap(mode, worst));
}

bool LinearLoop::stable(LoopMode mode, const LoopChange& change) const {
  return worstPhase(mode, change, kStabilityLimit).radius < kStabilityLimit;
}

bool LinearLoop::stable(const LoopChange& change) const {
  return belief_radius_ < kStabilityLimit &&
         std::all_of(modes_.begin(), modes_.end(), [&](LoopMode mode) { return stable(mode, change); });
}

VectorXd LinearLoop::stepResponse(int periods, const LoopChange& change) const {
  // The deviation from the steady state of the new set point follows the map; at first it is that whole state.
  const MatrixXd map = periodMap(LoopMode::straight, change);
  const VectorXd& rest = equations_.front().rest;
  const Eigen::Index wheel = map.rows() - 2;
  VectorXd deviation = VectorXd::Zero(map.rows());
  deviation.head(rest.size()) = -rest;
  deviation.segment(rest.size(), wheel - rest.size()).setConstant(-1.0 / (robot_.gain * change.gain));
  deviation(wheel) = -1.0;
  VectorXd response(periods);
  for (int k = 0; k < periods; ++k) {
    deviation = (map * deviation).eval();
    response(k) = 1.0 + deviation(wheel);
  }
  return response;
}

MatrixXd LinearLoop::jitteredMap(const JitteredPeriod& period, double longest_extra) const {
  if (!belief_ || clock_.action_steps != 1 || clock_.sensor_steps != 1) {
    throw ParameterError("plant_model.sensor_rate: must be predictive.action_rate for a search of irregular samples");
  }
  const LoopChange change{1.0, period.extra_dead_time, period.phase};
  Equations equations = equations_.front();
  std::vector<Eigen::Vector3d> gains;
  if (period.gain) gains.push_back(*period.gain);
  equations.believe = corrections(gains, Period::phaseOf(*this, change));
  const auto commands = std::ceil((robot_.dead_time + longest_extra) / actionPeriod() - 1e-6);
  return Period(*this, std::move(equations), change, static_cast<int>(commands)).map();
}

std::vector<Eigen::Vector3d> LinearLoop::irregularGains(int most_periods) const {
  std::vector<Eigen::Vector3d> all;
  for (int periods = 1; periods <= most_periods; ++periods) {
    WheelBelief belief = *belief_;
    const auto gains = converged([&](std::vector<Eigen::Vector3d>& gains) {
      for (std::int64_t i = 0; i < periods * clock_.predict_steps; ++i) belief.predict(0.0);
      gains.push_back(belief.gain());
      belief.correct(0.0);
    });
    if (periods == 1) all.push_back(belief.gain());
    all.insert(all.end(), gains.begin(), gains.end());
  }
  return all;
}

}  // namespace jackal_aic
