#include "jackal_aic/certificate/linear_loop.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "jackal_aic/aic/belief_update.hpp"
#include "jackal_aic/aic/free_energy.hpp"
#include "jackal_aic/aic/generative_model.hpp"
#include "jackal_aic/aic/spectral_radius.hpp"
#include "periodic_system.hpp"

namespace jackal_aic {
namespace {

constexpr int kModes = 3;

/// How a unit of a mode's wheel speed shows in the measurement y.
SensorVector sensorResponse(LoopMode mode, const GeometryParameters& geometry, const PlantModel& plant) {
  SensorVector y = SensorVector::Zero();
  if (mode == LoopMode::lateral) return y;
  y(kWheelRight) = 1.0;
  y(kWheelLeft) = mode == LoopMode::straight ? 1.0 : -1.0;
  if (mode == LoopMode::turn && !plant.on_box) {
    const double track =
        plant.effective_track > 0.0 ? plant.effective_track : geometry.effective_track / geometry.slip_factor;
    y(kYawRate) = 2.0 * geometry.wheel_radius / track;
  }
  return y;
}

/// How much of each wheel's action belongs to a mode.
WheelVector actionProjection(LoopMode mode) {
  if (mode == LoopMode::straight) return {0.5, 0.5};
  if (mode == LoopMode::turn) return {-0.5, 0.5};
  return WheelVector::Zero();
}

BodyChannel bodyChannel(LoopMode mode) {
  if (mode == LoopMode::straight) return kForward;
  return mode == LoopMode::turn ? kYaw : kLateral;
}

/// What happens at a time of the period, in the order in which it happens at one and the same time.
enum class Event { sensor, belief, action, command_arrives };

}  // namespace

/// States of one mode, a trajectory in every column, moved through the events of a period.
class LinearLoop::Trajectories {
 public:
  Trajectories(const LinearLoop& loop, const ModeEquations& equations, const LoopChange& change)
      : loop_(loop),
        equations_(equations),
        action_gain_(change.action_gain),
        orders_(loop.controller_.orders + 1),
        action_period_(nanoseconds(loop.controller_.actionStep())) {
    const std::int64_t dead_time =
        std::max<std::int64_t>(0, nanoseconds(loop.plant_.dead_time + change.extra_dead_time));
    phase_ = std::clamp<std::int64_t>(nanoseconds(change.phase), 0, nanoseconds(loop.longestPhase()));
    whole_periods_ = static_cast<int>(dead_time / action_period_);
    remainder_ = dead_time % action_period_;
    past_commands_ = whole_periods_ + (remainder_ > 0 ? 1 : 0);
    const int size = correctionRow() + 1;
    states_ = Eigen::MatrixXd::Identity(size, size);
  }

  Eigen::MatrixXd afterOnePeriod() {
    arrived_ = remainder_ == 0;
    std::int64_t now = 0;
    for (const auto& [time, event] : schedule()) {
      if (event != Event::belief) {
        drive(time - now);
        now = time;
      }
      happen(event);
    }
    return states_;
  }

 private:
  int measurementRow() const { return orders_; }
  int actionRow() const { return 2 * orders_; }
  /// Row of the command sent `back` action steps ago.
  int commandRow(int back) const { return actionRow() + back; }
  int wheelRow() const { return actionRow() + past_commands_ + 1; }
  int correctionRow() const { return wheelRow() + 1; }

  /// Events of a period, in order; those at its beginning belong to the period before.
  std::vector<std::pair<std::int64_t, Event>> schedule() const {
    std::vector<std::pair<std::int64_t, Event>> events;
    const std::int64_t period = loop_.action_steps_ * action_period_;
    const auto every = [&](int count, std::int64_t earlier, Event event) {
      for (int i = 1; i <= count; ++i) {
        events.emplace_back(std::llround(static_cast<double>(period) * i / count) - earlier, event);
      }
    };
    every(loop_.sensor_steps_, phase_, Event::sensor);
    every(loop_.belief_steps_, 0, Event::belief);
    every(loop_.action_steps_, 0, Event::action);
    for (int i = 0; remainder_ > 0 && i < loop_.action_steps_; ++i) {
      events.emplace_back(i * action_period_ + remainder_, Event::command_arrives);
    }
    std::sort(events.begin(), events.end());
    return events;
  }

  void happen(Event event) {
    switch (event) {
      case Event::sensor:
        return measure();
      case Event::belief:
        return believe();
      case Event::action:
        return act();
      case Event::command_arrives:
        arrived_ = true;
        return;
    }
  }

  /// The wheels follow the command that acts.
  void drive(std::int64_t time) {
    if (time == 0) return;
    const auto [entry, is_new] = responses_.try_emplace(time);
    if (is_new) entry->second = wheelResponse(loop_.plant_, 1e-9 * static_cast<double>(time));
    const int acting = commandRow(arrived_ ? whole_periods_ : whole_periods_ + 1);
    auto wheel = states_.middleRows<2>(wheelRow());
    wheel = (entry->second.transition * wheel + entry->second.input * states_.row(acting)).eval();
  }

  /// y^(i) ← y^(i-1) − y_old^(i-1), the recursion 3-22 in units of (sensor period)^i.
  void measure() {
    Eigen::RowVectorXd current = states_.row(wheelRow());
    for (int i = 0; i < orders_; ++i) {
      const Eigen::RowVectorXd previous = states_.row(measurementRow() + i);
      states_.row(measurementRow() + i) = current;
      current -= previous;
    }
  }

  /// μ̃ ← Φ μ̃ + Γ b (3-11)
  void believe() {
    auto belief = states_.topRows(orders_);
    belief =
        (equations_.belief * belief + equations_.measurement * states_.middleRows(measurementRow(), orders_)).eval();
  }

  /// a ← a − h κ_a K Π_y ε_y (3-13), after the commands under way moved on by one.
  void act() {
    for (int back = past_commands_; back > 0; --back) states_.row(commandRow(back)) = states_.row(commandRow(back - 1));
    states_.row(actionRow()) +=
        action_gain_ * (equations_.action_from_belief * states_.topRows(orders_) +
                        equations_.action_from_measurement * states_.middleRows(measurementRow(), orders_));
    arrived_ = remainder_ == 0;
  }

  const LinearLoop& loop_;
  const ModeEquations& equations_;
  double action_gain_;
  int orders_;
  std::int64_t action_period_;  // ns
  int whole_periods_;           // of the dead time, in action periods
  std::int64_t remainder_;      // of the dead time [ns]
  std::int64_t phase_;          // ns
  int past_commands_;           // kept beside the action
  bool arrived_ = false;        // the newer of the two commands of this action period acts
  Eigen::MatrixXd states_;
  std::map<std::int64_t, WheelResponse> responses_;
};

LinearLoop::LinearLoop(const ControllerParameters& controller, const GeometryParameters& geometry,
                       const PlantModel& plant)
    : controller_(controller), geometry_(geometry), plant_(plant) {
  validate(controller, geometry, Divergence::allowed);
  action_steps_ = commonActionSteps(controller.action_rate, plant.sensor_rate, "controller.action_rate");
  belief_steps_ = action_steps_ * controller.beliefStepsPerAction();
  sensor_steps_ = static_cast<int>(std::lround(action_steps_ * plant.sensor_rate / controller.action_rate));
  const GenerativeModel model(controller, geometry);
  const BeliefUpdate update(model, controller.kappa_mu, controller.beliefStep(), controller.integrator);
  belief_radius_ = update.spectralRadius();
  for (int mode = 0; mode < kModes; ++mode) modes_.push_back(equations(static_cast<LoopMode>(mode), model, update));
}

LinearLoop::ModeEquations LinearLoop::equations(LoopMode mode, const GenerativeModel& model,
                                                const BeliefUpdate& update) const {
  const int orders = controller_.orders + 1;
  const int channel = bodyChannel(mode);
  const SensorVector response = sensorResponse(mode, geometry_, plant_);
  const GeneralizedBody no_belief = GeneralizedBody::Zero(kBodySize, orders);
  const GeneralizedSensor no_measurement = GeneralizedSensor::Zero(kSensorSize, orders);

  // Taken from the controller's own functions, unit by unit, so that the certificate cannot differ from what is run.
  Eigen::MatrixXd transition(orders, orders), input_transition(orders, orders), input(orders, orders);
  for (int i = 0; i < orders; ++i) {
    for (int j = 0; j < orders; ++j) {
      transition(i, j) = update.transition()(kBodySize * i + channel, kBodySize * j + channel);
      input_transition(i, j) = update.inputTransition()(kBodySize * i + channel, kBodySize * j + channel);
    }
    GeneralizedSensor unit = no_measurement;
    unit.col(i) = response;
    input.col(i) = beliefDerivative(model, controller_.kappa_mu, no_belief, unit, no_belief).row(channel).transpose();
  }
  Eigen::VectorXd scale(orders);
  for (int i = 0; i < orders; ++i) scale(i) = std::pow(plant_.sensor_rate, -i);
  const auto scaled = [&](const Eigen::MatrixXd& m) -> Eigen::MatrixXd {
    return scale.asDiagonal() * m * scale.cwiseInverse().asDiagonal();
  };

  const double rate = -controller_.actionStep() * controller_.kappa_a;
  Eigen::RowVectorXd action_from_belief(orders), action_from_measurement(orders);
  for (int i = 0; i < orders; ++i) {
    GeneralizedBody unit_belief = no_belief;
    unit_belief(channel, i) = 1.0 / scale(i);
    GeneralizedSensor unit_measurement = no_measurement;
    unit_measurement.col(i) = response / scale(i);
    const GeneralizedSensor belief_error = sensoryPredictionError(model, unit_belief, no_measurement);
    action_from_belief(i) = rate * actionProjection(mode).dot(actionGradient(model, belief_error));
    action_from_measurement(i) = rate * actionProjection(mode).dot(actionGradient(model, unit_measurement));
  }
  return {scaled(transition), scaled(input_transition * input), action_from_belief, action_from_measurement};
}

double LinearLoop::period() const { return action_steps_ * controller_.actionStep(); }

Eigen::MatrixXd LinearLoop::periodMap(LoopMode mode, const LoopChange& change) const {
  return Trajectories(*this, modes_[static_cast<std::size_t>(mode)], change).afterOnePeriod();
}

double LinearLoop::spectralRadius(LoopMode mode, const LoopChange& change) const {
  // Without an action the lateral belief is all there is; the rest of that map is an integrator that nothing drives.
  if (mode == LoopMode::lateral) return std::pow(spectralRadiusOf(modes_.back().belief).upper(), belief_steps_);
  return spectralRadiusOf(periodMap(mode, change)).upper();
}

Eigen::VectorXd LinearLoop::stepResponse(LoopMode mode, int periods, const LoopChange& change) const {
  // The deviation from the steady state of the new set point follows the map; at first it is that whole state.
  const Eigen::MatrixXd map = periodMap(mode, change);
  const ModeEquations& equations = modes_[static_cast<std::size_t>(mode)];
  const Eigen::Index orders = controller_.orders + 1;
  const Eigen::Index wheel = map.rows() - 2;
  Eigen::VectorXd deviation = Eigen::VectorXd::Zero(map.rows());
  deviation(0) =
      equations.action_from_measurement(0) / equations.action_from_belief(0);  // belief at which the action rests
  deviation(orders) = deviation(wheel) = -1.0;
  deviation.segment(2 * orders, wheel - 2 * orders).setConstant(-1.0 / plant_.gain);
  Eigen::VectorXd response(periods);
  for (int k = 0; k < periods; ++k) {
    deviation = (map * deviation).eval();
    response(k) = 1.0 + deviation(wheel);
  }
  return response;
}

double LinearLoop::longestPhase() const { return std::min(1.0 / plant_.sensor_rate, controller_.actionStep()); }

double LinearLoop::worstSpectralRadius(LoopMode mode, LoopChange change) const {
  if (mode == LoopMode::lateral) return spectralRadius(mode);
  return worstOverPhase(
      [&](double phase) {
        change.phase = phase;
        return spectralRadius(mode, change);
      },
      longestPhase());
}

double LinearLoop::worstSpectralRadius() const {
  return std::max({worstSpectralRadius(LoopMode::straight), worstSpectralRadius(LoopMode::turn),
                   spectralRadius(LoopMode::lateral)});
}

double LinearLoop::radiusUncertainty() const {
  const auto uncertainty = [&](double phase) {
    return 2.0 * std::max(spectralRadiusOf(periodMap(LoopMode::straight, {1.0, 0.0, phase})).uncertainty,
                          spectralRadiusOf(periodMap(LoopMode::turn, {1.0, 0.0, phase})).uncertainty);
  };
  return worstOverPhase(uncertainty, longestPhase());
}

double LinearLoop::spectralRadius() const {
  return std::max(
      {spectralRadius(LoopMode::straight), spectralRadius(LoopMode::turn), spectralRadius(LoopMode::lateral)});
}

}  // namespace jackal_aic
