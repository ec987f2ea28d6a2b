#include "regulators.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic::sim {
namespace {

constexpr double kPeriod = WheelLaw::kPeriod;

PlantModel prompt(PlantModel model) {
  model.dead_time = 0.0;
  return model;
}

}  // namespace

PidGains simcGains(const PlantModel& model, double tau_c, bool derivative) {
  const double theta = model.dead_time + 0.5 * kPeriod;
  // An integral controller is the limit of τ₁ → 0; a lag far below the period is as good as that.
  const double lag = std::max(model.lag, 0.05 * kPeriod);
  const double gain = lag / (model.gain * (tau_c + theta));
  const double integral_time = std::min(lag, 4.0 * (tau_c + theta));
  const double derivative_time = derivative ? theta / 3.0 : 0.0;
  // K (1 + 1/(τ_I s)) (1 + τ_D s) in parallel form
  return {gain * (1.0 + derivative_time / integral_time), gain / integral_time, gain * derivative_time};
}

double Pid::act() {
  integral_ += kPeriod * deviation_;
  const double rate = (deviation_ - last_) / kPeriod;
  last_ = deviation_;
  // v = −(k_p e + k_i ∫e dt + k_d de/dt)
  return -(gains_.proportional * deviation_ + gains_.integral * integral_ + gains_.derivative * rate);
}

SmithPredictor::SmithPredictor(const PlantModel& model, double wheel_radius, const PidGains& gains)
    : pi_(gains), delayed_(model, wheel_radius), prompt_(prompt(model), wheel_radius) {}

void SmithPredictor::reset() {
  pi_.reset();
  delayed_.reset(0.0);
  prompt_.reset(0.0);
  deviation_ = 0.0;
}

void SmithPredictor::predict(double v) {
  delayed_.predict(v);
  prompt_.predict(v);
}

void SmithPredictor::correct(double e) { deviation_ = e - delayed_.speed(); }

double SmithPredictor::act() {
  pi_.correct(deviation_ + prompt_.speed());
  return pi_.act();
}

Eigen::RowVectorXd regulatorGain(const Eigen::MatrixXd& transition, const Eigen::VectorXd& input,
                                 const Eigen::MatrixXd& state_weight, double input_weight) {
  // The Riccati equation of the filter of (A', B') is that of the regulator of (A, B).
  const Eigen::MatrixXd noise = Eigen::MatrixXd::Constant(1, 1, input_weight);
  const Eigen::MatrixXd P = predictionCovariance(transition.transpose(), input.transpose(), state_weight, noise);
  const double scale = input_weight + input.dot(P * input);
  return input.transpose() * P * transition / scale;
}

Lqg::Lqg(const PlantModel& model, double wheel_radius, const LqgWeights& weights)
    : command_gain_(model.gain), filter_(model, wheel_radius, weights.noise, kPeriod) {
  const DriveTrainResponse response = driveTrainResponse(model, kPeriod);
  const Eigen::MatrixXd state_weight = Eigen::Vector2d(weights.speed, 0.0).asDiagonal();
  gain_ = regulatorGain(response.transition, response.input, state_weight, weights.command);
}

double Lqg::act() {
  const Eigen::Vector3d state = filter_.onArrival();
  // v = −(d + K x(t + θ))/g
  return -(state(2) + gain_.dot(state.head<2>())) / command_gain_;
}

Adrc::Adrc(const PlantModel& model, const AdrcTuning& tuning)
    : tuning_(tuning), commands_(model.dead_time, model.dead_time) {}

void Adrc::reset() {
  commands_.fill(0.0);
  speed_ = disturbance_ = 0.0;
}

void Adrc::predict(double v) { speed_ += WheelLaw::kStep * (disturbance_ + tuning_.input_gain * commands_.step(v)); }

void Adrc::correct(double e) {
  const double beta = std::exp(-tuning_.observer_bandwidth * kPeriod), error = e - speed_;
  speed_ += (1.0 - beta * beta) * error;
  disturbance_ += (1.0 - beta) * (1.0 - beta) / kPeriod * error;
}

double Adrc::act() {
  // v = −(ω_c w + f)/b₀
  return -(tuning_.controller_bandwidth * speed_ + disturbance_) / tuning_.input_gain;
}

DelayedInference::DelayedInference(const PlantModel& model, double wheel_radius, const DelayedInferenceGains& gains)
    : gains_(gains), drive_train_(model, wheel_radius), commands_(model.dead_time, model.dead_time) {
  for (std::size_t i = 0; i < commands_.delay(); ++i) on_arrival_ = drive_train_.transition() * on_arrival_;
}

void DelayedInference::reset() {
  commands_.fill(0.0);
  belief_.setZero();
  predicted_.setZero();
  integral_ = deviation_ = 0.0;
}

void DelayedInference::predict(double v) {
  drive_train_.step(belief_, commands_.step(v));
  drive_train_.step(predicted_, v);
}

void DelayedInference::correct(double e) {
  deviation_ = e;
  // ∂F/∂μ = 0: μ = μ_p + Σ_μ/(Σ_μ + Σ_y) (e − μ_p), and μ(t + θ) changes by e^(Aθ) of that
  const double change = gains_.prediction_share * (e - belief_(0));
  belief_(0) += change;
  predicted_ += change * on_arrival_;
}

double DelayedInference::act() {
  integral_ += kPeriod * deviation_;
  // ∂F/∂v = 0: v = v_p
  return -(gains_.proportional * predicted_(0) + gains_.integral * integral_);
}

}  // namespace jackal_aic::sim
