#include "jackal_aic/certificate/linear_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
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

/// Gains of the corrections in a period of a clock, in order, to which the covariance of a belief converges.
std::vector<Eigen::Vector3d> convergedGains(WheelBelief& belief, const LoopClock& clock, std::int64_t phase) {
  const auto events = clock.events(0, phase);
  std::vector<Eigen::Vector3d> gains;
  for (int i = 0; i < kMostPeriods; ++i) {
    const std::vector<Eigen::Vector3d> before = std::exchange(gains, {});
    bool fresh = false;
    for (const auto& [time, event] : events) {
      if (event == LoopEvent::sensor) fresh = true;
      if (event == LoopEvent::predict) belief.predict(0.0);
      if (event != LoopEvent::belief || !std::exchange(fresh, false)) continue;
      gains.push_back(belief.gain());
      belief.correct(0.0);
    }
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

MatrixXd LinearLoop::mapOf(const Equations& equations, const LoopChange& change, const Gains& gains,
                           int least_commands) const {
  PlantModel robot = robot_;
  robot.gain *= change.gain;
  const std::int64_t period = clock_.action_period;
  const std::int64_t dead_time = std::max<std::int64_t>(0, nanoseconds(robot.dead_time + change.extra_dead_time));
  const std::int64_t model_dead_time = belief_ ? static_cast<std::int64_t>(belief_->delay()) * kTick : -period;
  const int whole = static_cast<int>(dead_time / period);  // action periods of the robot's dead time
  const std::int64_t remainder = dead_time % period;
  // Rows of the states: the controller's, the action, earlier commands, the wheel speed and its correction.
  const int past_commands =
      std::max({whole + (remainder > 0 ? 1 : 0), static_cast<int>(model_dead_time / period) + 1, least_commands});
  const auto action = static_cast<int>(equations.act.size()), wheel = action + past_commands + 1;
  MatrixXd states = MatrixXd::Identity(wheel + 2, wheel + 2);  // a trajectory in every column
  auto x = states.topRows(action);
  std::int64_t now = 0;
  bool fresh = false;             // a sample waits for the belief
  bool arrived = remainder == 0;  // the newer of the two commands of this action period acts
  std::size_t samples = 0;        // that the belief has taken
  const auto drive = [&](std::int64_t time) {
    if (time == now) return;
    const DriveTrainResponse response = driveTrainResponse(robot, 1e-9 * static_cast<double>(time - now));
    const auto acting = states.row(action + (arrived ? whole : whole + 1));
    auto driven = states.middleRows<2>(wheel);
    driven = (response.transition * driven + robot.gain * response.input * acting).eval();
    now = time;
  };
  /// The command that acts in the model during the inner step that ends at a time, in action steps before the last one.
  const auto believed = [&](std::int64_t time) {
    const auto steps = [&](std::int64_t until) {
      return static_cast<int>(std::floor(static_cast<double>(until) / static_cast<double>(period)));
    };
    return steps(time - 1) - steps(time - kTick - model_dead_time);
  };
  for (const auto& [time, event] : clock_.events(remainder, phaseOf(change))) {
    // The belief depends on the wheel only through the sensor, so the robot is not advanced to belief steps.
    switch (event) {
      case LoopEvent::sensor:
        drive(time);
        x = (equations.sense.lazyProduct(x) + equations.sense_wheel * states.row(wheel)).eval();
        fresh = true;
        break;
      case LoopEvent::predict:
        x = (equations.predict.lazyProduct(x) + equations.predict_command * states.row(action + believed(time))).eval();
        break;
      case LoopEvent::belief:
        if (!belief_) {
          x = equations.believe.lazyProduct(x).eval();
        } else if (std::exchange(fresh, false) && samples < gains.size()) {
          // x ← x + K (y − w)
          x.topRows<3>() += gains[samples++] * (x.row(kMeasured) - x.row(kSpeed)).eval();
        }
        break;
      case LoopEvent::action:
        drive(time);
        for (int k = past_commands; k > 0; --k) states.row(action + k) = states.row(action + k - 1);
        states.row(action) = (equations.keep * states.row(action) + equations.act * x).eval();
        arrived = remainder == 0;
        break;
      case LoopEvent::command_arrives:
        drive(time);
        arrived = true;
    }
  }
  return states;
}

LinearLoop::LinearLoop(const ControllerParameters& controller, const GeometryParameters& geometry,
                       const PlantModel& robot)
    : robot_(robot), action_gain_(controller.kappa_a), modes_{LoopMode::straight, LoopMode::turn} {
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
  belief_.emplace(model, 1.0, wheelBeliefParameters(parameters, model));
  clock_ =
      clockOf(parameters.action_rate, parameters.beliefStepsPerAction(), robot.sensor_rate, "predictive.action_rate");
  WheelBelief belief = *belief_;
  gains_ = convergedGains(belief, clock_, 0);
  equations_.push_back(predictiveEquations());
  // The error of the belief is the belief about a robot at rest without commands.
  Equations observing = equations_.front();
  observing.act.setZero();
  belief_radius_ = jackal_aic::spectralRadius(mapOf(observing, {}, gains_).topLeftCorner<kStates, kStates>());
}

LinearLoop::Equations LinearLoop::thesisEquations(const ControllerParameters& controller,
                                                  const GeometryParameters& geometry, LoopMode mode) const {
  const int orders = controller.orders + 1;
  const int channel = mode == LoopMode::straight ? kForward : kYaw;
  const WheelVector projection = mode == LoopMode::straight ? WheelVector{0.5, 0.5} : WheelVector{-0.5, 0.5};
  const SensorVector response = sensorResponse(mode, geometry, robot_);
  const GenerativeModel model(controller, geometry);
  const BeliefUpdate update(model, controller.kappa_mu, controller.beliefStep(), controller.integrator);
  VectorXd scale(orders);
  for (int i = 0; i < orders; ++i) scale(i) = std::pow(robot_.sensor_rate, -i);

  // Taken from the controller's own functions, unit by unit, so that the certificate cannot differ from the controller.
  MatrixXd believe = MatrixXd::Identity(2 * orders, 2 * orders);
  RowVectorXd act(2 * orders);
  for (int i = 0; i < orders; ++i) {
    GeneralizedBody belief = model.still(), moved = model.still();
    GeneralizedSensor measurement = model.silence();
    belief(channel, i) = 1.0 / scale(i);
    measurement.col(i) = response / scale(i);
    act(i) = projection.dot(actionGradient(model, sensoryPredictionError(model, belief, model.silence())));
    act(orders + i) = projection.dot(actionGradient(model, measurement));
    update.step(belief, model.silence(), model.still());
    update.step(moved, measurement, model.still());
    believe.col(i).head(orders) = scale.cwiseProduct(belief.row(channel).transpose());
    believe.col(orders + i).head(orders) = scale.cwiseProduct(moved.row(channel).transpose());
  }

  Equations equations;
  // y^(i) ← y^(i-1) − y_old^(i-1), the recursion 3-22 in units of (sensor period)^i
  equations.sense = MatrixXd::Identity(2 * orders, 2 * orders);
  equations.sense.bottomRightCorner(orders, orders).setZero();
  equations.sense.bottomRightCorner(orders, orders).triangularView<Eigen::StrictlyLower>().setConstant(-1.0);
  equations.sense_wheel = VectorXd::Zero(2 * orders);
  equations.sense_wheel.tail(orders).setOnes();
  equations.believe = believe;  // μ̃ ← Φ μ̃ + Γ b (3-11)
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
  // a ← (1 − κ_a) a − κ_a d/g
  equations.keep = 1.0 - action_gain_;
  equations.act = RowVectorXd::Zero(kStates);
  equations.act(kDisturbance) = -action_gain_ / model_->gain;
  return equations;
}

const LinearLoop::Equations& LinearLoop::equationsOf(LoopMode mode) const {
  return mode == LoopMode::straight ? equations_.front() : equations_.back();
}

MatrixXd LinearLoop::periodMap(LoopMode mode, const LoopChange& change) const {
  // With one sample in a period its gain is the same at any phase.
  if (!belief_ || clock_.sensor_steps == 1) return mapOf(equationsOf(mode), change, gains_);
  WheelBelief belief = *belief_;
  return mapOf(equationsOf(mode), change, convergedGains(belief, clock_, phaseOf(change)));
}

std::int64_t LinearLoop::phaseOf(const LoopChange& change) const {
  return std::clamp<std::int64_t>(nanoseconds(change.phase), 0, nanoseconds(longestPhase()));
}

double LinearLoop::spectralRadius(LoopMode mode, const LoopChange& change) const {
  return jackal_aic::spectralRadius(periodMap(mode, change));
}

double LinearLoop::longestPhase() const { return std::min(1.0 / robot_.sensor_rate, actionPeriod()); }

/// Largest over a grid of phases, and between the neighbours of its largest value where that is close to the limit of
/// stability, so that the verdict does not depend on the grid. @param enough radius at which the search ends.
LinearLoop::WorstPhase LinearLoop::worstPhase(LoopMode mode, LoopChange change, double enough) const {
  WorstPhase worst{-HUGE_VAL, 0.0};
  const auto evaluate = [&](double phase) {
    if (worst.radius >= enough || phase < 0.0 || phase > longestPhase()) return;
    change.phase = phase;
    const double radius = spectralRadius(mode, change);
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

double LinearLoop::worstSpectralRadius(LoopMode mode, LoopChange change) const {
  change.phase = worstPhase(mode, change, HUGE_VAL).phase;
  return spectralRadius(mode, change);
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

MatrixXd LinearLoop::jitteredMap(const LoopChange& change, const std::optional<Eigen::Vector3d>& gain,
                                 double longest_extra) const {
  if (!belief_ || clock_.action_steps != 1 || clock_.sensor_steps != 1) {
    throw ParameterError("plant_model.sensor_rate: must be predictive.action_rate for a search of irregular samples");
  }
  const auto commands = std::ceil((robot_.dead_time + longest_extra) / actionPeriod() - 1e-6);
  return mapOf(equations_.front(), change, gain ? Gains{*gain} : Gains{}, static_cast<int>(commands));
}

std::vector<Eigen::Vector3d> LinearLoop::irregularGains(int most_periods) const {
  std::vector<Eigen::Vector3d> all;
  for (int periods = 1; periods <= most_periods; ++periods) {
    WheelBelief belief = *belief_;
    const LoopClock rare{clock_.action_period, periods, 1, 1, periods * clock_.predict_steps};
    const Gains gains = convergedGains(belief, rare, 0);
    if (periods == 1) all.push_back(belief.gain());
    all.insert(all.end(), gains.begin(), gains.end());
  }
  return all;
}

}  // namespace jackal_aic
