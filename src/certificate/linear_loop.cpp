#include "jackal_aic/certificate/linear_loop.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "jackal_aic/aic/belief_update.hpp"
#include "jackal_aic/aic/free_energy.hpp"
#include "jackal_aic/aic/generative_model.hpp"
#include "jackal_aic/aic/spectral_radius.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "loop_trajectories.hpp"
#include "periodic_system.hpp"

namespace jackal_aic {
namespace {

constexpr int kModes = 3;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// How a unit of a mode's wheel speed shows in the measurement y.
SensorVector sensorResponse(LoopMode mode, const GeometryParameters& geometry, const PlantModel& plant) {
  SensorVector y = SensorVector::Zero();
  if (mode == LoopMode::lateral) return y;
  y(kWheelRight) = 1.0;
  y(kWheelLeft) = mode == LoopMode::straight ? 1.0 : -1.0;
  if (mode == LoopMode::turn && !plant.on_box) {
    y(kYawRate) = 2.0 * SkidSteerKinematics(geometryOf(plant, geometry)).yawPerDifference();
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

}  // namespace

/// States of one mode.
class LinearLoop::Trajectories : public LoopTrajectories {
 public:
  Trajectories(const LinearLoop& loop, const ModeEquations& equations, const LoopChange& change)
      : LoopTrajectories(loop.clock_, loop.plant_, change, loop.longestPhase(), 2 * (loop.controller_.orders + 1), 0),
        equations_(equations),
        gain_(change.gain),
        orders_(loop.controller_.orders + 1) {
    push();
  }

 private:
  int measurementRow() const { return orders_; }

  /// y^(i) ← y^(i-1) − y_old^(i-1), the recursion 3-22 in units of (sensor period)^i.
  void measure() override {
    Eigen::RowVectorXd current = states_.row(wheelRow());
    for (int i = 0; i < orders_; ++i) {
      const Eigen::RowVectorXd previous = states_.row(measurementRow() + i);
      states_.row(measurementRow() + i) = current;
      current -= previous;
    }
    push();
  }

  /// μ̃ ← Φ μ̃ + Γ b (3-11)
  void believe() override {
    auto belief = states_.topRows(orders_);
    belief = (equations_.belief.lazyProduct(belief) + push_).eval();
  }

  /// Γ b
  void push() { push_ = equations_.measurement * states_.middleRows(measurementRow(), orders_); }

  /// a ← a − h κ_a K Π_y ε_y (3-13)
  void act() override {
    states_.row(actionRow()) +=
        gain_ * (equations_.action_from_belief * states_.topRows(orders_) +
                 equations_.action_from_measurement * states_.middleRows(measurementRow(), orders_));
  }

  const ModeEquations& equations_;
  double gain_;  // factor on κ_a
  int orders_;
  Eigen::MatrixXd push_;  // the same from one sample to the next
};

LinearLoop::LinearLoop(const ControllerParameters& controller, const GeometryParameters& geometry,
                       const PlantModel& plant)
    : controller_(controller), geometry_(geometry), plant_(plant) {
  validate(controller, geometry, Divergence::allowed);
  const int actions = commonActionSteps(controller.action_rate, plant.sensor_rate, "controller.action_rate");
  clock_ = {nanoseconds(controller.actionStep()), actions,
            std::lround(actions * plant.sensor_rate / controller.action_rate),
            std::int64_t{actions} * controller.beliefStepsPerAction()};
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

double LinearLoop::period() const { return static_cast<double>(clock_.action_steps) * controller_.actionStep(); }

Eigen::MatrixXd LinearLoop::periodMap(LoopMode mode, const LoopChange& change) const {
  return Trajectories(*this, modes_[static_cast<std::size_t>(mode)], change).afterOnePeriod();
}

double LinearLoop::spectralRadius(LoopMode mode, const LoopChange& change) const {
  // Without an action the lateral belief is all there is; the rest of that map is an integrator that nothing drives.
  if (mode == LoopMode::lateral)
    return std::pow(spectralRadiusOf(modes_.back().belief).upper(), static_cast<int>(clock_.belief_steps));
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

WorstPhase LinearLoop::worstPhase(LoopMode mode, LoopChange change, double enough) const {
  const auto radius = [&](double phase) {
    change.phase = phase;
    return spectralRadiusBeside(kStabilityLimit, periodMap(mode, change));
  };
  return worstOverPhase(radius, longestPhase(), enough);
}

double LinearLoop::worstSpectralRadius(LoopMode mode, LoopChange change) const {
  if (mode == LoopMode::lateral) return spectralRadius(mode);
  const auto radius = [&](double phase) {
    change.phase = phase;
    return spectralRadius(mode, change);
  };
  return worstOverPhase(radius, longestPhase(), kInfinity).radius;
}

bool LinearLoop::stable(LoopMode mode, const LoopChange& change) const {
  if (mode == LoopMode::lateral) return spectralRadius(mode) < kStabilityLimit;
  return worstPhase(mode, change, kStabilityLimit).radius < kStabilityLimit;
}

double LinearLoop::worstSpectralRadius() const {
  const WorstPhase straight = worstPhase(LoopMode::straight, {}, kInfinity);
  const WorstPhase turn = worstPhase(LoopMode::turn, {}, kInfinity);
  const double worse = straight.radius > turn.radius ? spectralRadius(LoopMode::straight, {1.0, 0.0, straight.phase})
                                                     : spectralRadius(LoopMode::turn, {1.0, 0.0, turn.phase});
  return std::max(worse, spectralRadius(LoopMode::lateral));
}

double LinearLoop::radiusUncertainty() const {
  const auto uncertainty = [&](double phase) {
    return 2.0 * std::max(spectralRadiusOf(periodMap(LoopMode::straight, {1.0, 0.0, phase})).uncertainty,
                          spectralRadiusOf(periodMap(LoopMode::turn, {1.0, 0.0, phase})).uncertainty);
  };
  return worstOverPhase(uncertainty, longestPhase(), kInfinity).radius;
}

double LinearLoop::spectralRadius() const {
  return std::max(
      {spectralRadius(LoopMode::straight), spectralRadius(LoopMode::turn), spectralRadius(LoopMode::lateral)});
}

}  // namespace jackal_aic
