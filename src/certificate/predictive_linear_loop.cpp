#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "jackal_aic/aic/spectral_radius.hpp"
#include "jackal_aic/certificate/predictive_certificate.hpp"
#include "loop_trajectories.hpp"
#include "periodic_system.hpp"

namespace jackal_aic {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMostPeriods = 20000;      // until the belief's gain has converged
constexpr double kConverged = 1e-12;     // relative change of the gain over a period
constexpr std::int64_t kTick = 1000000;  // inner step of the belief [ns]

WheelBelief wheelBelief(const PredictiveParameters& p, const PlantModel& model) {
  validate(p);
  return WheelBelief(model, 1.0, wheelBeliefParameters(p));
}

LoopClock clockOf(const PredictiveParameters& p, const PlantModel& robot) {
  const std::int64_t actions = commonActionSteps(p.action_rate, robot.sensor_rate, "predictive.action_rate");
  const std::int64_t action_period = nanoseconds(1.0 / p.action_rate);
  return {action_period, actions, std::lround(static_cast<double>(actions) * robot.sensor_rate / p.action_rate),
          actions * p.beliefStepsPerAction(), actions * action_period / kTick};
}

}  // namespace

/// State of one wheel: belief (w, z, d) and last measurement, then that of the robot.
class PredictiveLinearLoop::Trajectories : public LoopTrajectories {
 public:
  static constexpr int kBelief = 3;

  Trajectories(const PredictiveLinearLoop& loop, const LoopChange& change) : Trajectories(loop, change, {}, 0) {
    gains_ = gainsAt(loop, phase());
  }

  /// @param gains of the corrections, none if the sample is lost; @param commands at least this many of the past.
  Trajectories(const PredictiveLinearLoop& loop, const LoopChange& change, std::vector<Eigen::Vector3d> gains,
               int commands)
      : LoopTrajectories(loop.clock_, withGain(loop.robot_, change.gain), change, loop.longestPhase(), kBelief + 1,
                         std::max(commands, static_cast<int>(modelDelay(loop) / loop.clock_.action_period) + 1)),
        loop_(loop),
        gains_(std::move(gains)) {}

  static int measurementRow() { return kBelief; }

 private:
  /// With one correction in a period its gain is the same whenever it comes.
  static std::vector<Eigen::Vector3d> gainsAt(const PredictiveLinearLoop& loop, std::int64_t phase) {
    return loop.clock_.sensor_steps == 1 ? loop.converged_.gains : loop.convergedBelief(phase).gains;
  }

  static PlantModel withGain(PlantModel robot, double factor) {
    robot.gain *= factor;
    return robot;
  }

  static std::int64_t modelDelay(const PredictiveLinearLoop& loop) {
    return static_cast<std::int64_t>(loop.belief_.delay()) * kTick;
  }

  void measure() override {
    states_.row(measurementRow()) = states_.row(wheelRow());
    fresh_ = true;
  }

  /// x ← J x + b u, u the command sent last before the inner step that ends now, less the dead time of the model.
  void predict(std::int64_t now) override {
    const std::int64_t period = loop_.clock_.action_period;
    const auto actions_before = [&](std::int64_t time) {
      return time >= 0 ? time / period : -((-time + period - 1) / period);
    };
    const auto back = actions_before(now - 1) - actions_before(now - kTick - modelDelay(loop_));
    const Eigen::Matrix3d J = loop_.belief_.transition();
    const Eigen::Vector3d b = loop_.belief_.input();
    const int command = commandRow(static_cast<int>(back));
    for (Eigen::Index i = 0; i < states_.cols(); ++i) {
      auto x = states_.col(i).head<kBelief>();
      x = (J.col(0) * x(0) + J.col(1) * x(1) + J.col(2) * x(2) + b * states_(command, i)).eval();
    }
  }

  /// x ← x + K (y − w)
  void believe() override {
    if (!fresh_ || correction_ == gains_.size()) return;
    fresh_ = false;
    const Eigen::RowVectorXd error = states_.row(measurementRow()) - states_.row(0);
    states_.topRows<kBelief>() += gains_[correction_++] * error;
  }

  /// a ← (1 − κ_a) a − κ_a d/g
  void act() override {
    const double rate = loop_.parameters_.action_learning_rate;
    states_.row(actionRow()) *= 1.0 - rate;
    states_.row(actionRow()) -= rate / loop_.model_.gain * states_.row(2);
  }

  const PredictiveLinearLoop& loop_;
  std::vector<Eigen::Vector3d> gains_;
  bool fresh_ = false;  // a measurement waits for the next belief update
  std::size_t correction_ = 0;
};

PredictiveLinearLoop::PredictiveLinearLoop(const PredictiveParameters& parameters, const PlantModel& model,
                                           const PlantModel& robot)
    : parameters_(parameters),
      model_(model),
      robot_(robot),
      belief_(wheelBelief(parameters, model)),
      clock_(clockOf(parameters, robot)),
      converged_(convergedBelief(0)) {}

PredictiveLinearLoop::Belief PredictiveLinearLoop::convergedBelief(std::int64_t phase) const {
  const auto events = clock_.events(0, phase);
  // Of the inner steps and the corrections of a period, in order.
  const auto in_order = [&](const auto& predict, const auto& correct) {
    bool fresh = false;
    for (const auto& [time, event] : events) {
      if (event == LoopEvent::sensor) fresh = true;
      if (event == LoopEvent::predict) predict();
      if (event != LoopEvent::belief || !fresh) continue;
      correct();
      fresh = false;
    }
  };
  WheelBelief belief = belief_;
  Belief result{};
  for (int period = 0; period < kMostPeriods; ++period) {
    const std::vector<Eigen::Vector3d> before = std::exchange(result.gains, {});
    in_order([&] { belief.predict(0.0); },
             [&] {
               result.gains.push_back(belief.gain());
               belief.correct(0.0);
             });
    double change = before.size() == result.gains.size() ? 0.0 : 1.0;
    for (std::size_t i = 0; i < before.size() && i < result.gains.size(); ++i) {
      change = std::max(change, (result.gains[i] - before[i]).norm() / result.gains[i].norm());
    }
    if (change < kConverged) break;
  }
  Eigen::Matrix3d error = Eigen::Matrix3d::Identity();  // over a period
  auto gain = result.gains.begin();
  in_order([&] { error = (belief.transition() * error).eval(); }, [&] { error -= (*gain++ * error.row(0)).eval(); });
  // Without an integral z stays at rest: it is no mode of the loop.
  if (model_.velocity_loop_integral <= 0.0) error.row(1).setZero();
  result.spectral_radius = spectralRadiusOf(error).upper();
  return result;
}

double PredictiveLinearLoop::period() const {
  return static_cast<double>(clock_.action_steps) / parameters_.action_rate;
}

Eigen::MatrixXd PredictiveLinearLoop::periodMap(const LoopChange& change) const {
  Eigen::MatrixXd map = Trajectories(*this, change).afterOnePeriod();
  if (model_.velocity_loop_integral <= 0.0) map.row(1).setZero();
  return map;
}

Eigen::MatrixXd PredictiveLinearLoop::jitteredMap(const JitteredPeriod& period, double longest_extra) const {
  if (clock_.action_steps != 1 || clock_.sensor_steps != 1) {
    throw ParameterError("plant_model.sensor_rate: must be that of the action for a certificate of irregular samples");
  }
  std::vector<Eigen::Vector3d> gains;
  if (period.gain) gains.push_back(*period.gain);
  const std::int64_t longest = nanoseconds(robot_.dead_time + longest_extra);
  const int commands = static_cast<int>((longest + clock_.action_period - 1) / clock_.action_period);
  Trajectories trajectories(*this, {1.0, period.extra_dead_time, period.phase}, std::move(gains), commands);
  Eigen::MatrixXd map = trajectories.afterOnePeriod();
  if (model_.velocity_loop_integral <= 0.0) map.row(1).setZero();
  // Without the last measurement.
  const Eigen::Index row = Trajectories::measurementRow(), after = map.rows() - 1 - row;
  Eigen::MatrixXd kept(map.rows() - 1, map.cols() - 1);
  kept << map.topLeftCorner(row, row), map.topRightCorner(row, after), map.bottomLeftCorner(after, row),
      map.bottomRightCorner(after, after);
  return kept;
}

std::vector<Eigen::Vector3d> PredictiveLinearLoop::irregularGains(int most_periods) const {
  std::vector<Eigen::Vector3d> gains;
  for (int periods = 1; periods <= most_periods; ++periods) {
    WheelBelief belief = belief_;
    Eigen::Vector3d gain = Eigen::Vector3d::Zero();
    for (int sample = 0; sample < kMostPeriods; ++sample) {
      for (std::int64_t i = 0; i < periods * clock_.predict_steps; ++i) belief.predict(0.0);
      const Eigen::Vector3d before = gain;
      gain = belief.gain();
      belief.correct(0.0);
      if ((gain - before).norm() < kConverged * gain.norm()) break;
    }
    if (periods == 1) gains.push_back(belief.gain());
    gains.push_back(gain);
  }
  return gains;
}

double PredictiveLinearLoop::longestPhase() const {
  return std::min(1.0 / robot_.sensor_rate, 1.0 / parameters_.action_rate);
}

WorstPhase PredictiveLinearLoop::worstPhase(LoopChange change, double enough) const {
  const auto radius = [&](double phase) {
    change.phase = phase;
    return spectralRadiusBeside(kStabilityLimit, periodMap(change));
  };
  return worstOverPhase(radius, longestPhase(), enough);
}

double PredictiveLinearLoop::worstSpectralRadius(LoopChange change) const {
  change.phase = worstPhase(change, kInfinity).phase;
  return spectralRadius(change);
}

bool PredictiveLinearLoop::stable(const LoopChange& change) const {
  return worstPhase(change, kStabilityLimit).radius < kStabilityLimit;
}

double PredictiveLinearLoop::radiusUncertainty() const {
  return worstOverPhase(
             [&](double phase) {
               return 2.0 * spectralRadiusOf(periodMap({1.0, 0.0, phase})).uncertainty;
             },
             longestPhase(), kInfinity)
      .radius;
}

double PredictiveLinearLoop::spectralRadius(const LoopChange& change) const {
  return spectralRadiusOf(periodMap(change)).upper();
}

}  // namespace jackal_aic
