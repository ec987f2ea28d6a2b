#include "jackal_aic/predictive_controller.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <unsupported/Eigen/MatrixFunctions>

namespace jackal_aic {
namespace {

bool isWhole(double ratio) { return ratio >= 1.0 - 1e-9 && std::abs(ratio - std::round(ratio)) < 1e-9 * ratio; }

WheelBeliefParameters wheelParameters(const PredictiveParameters& p) {
  return {p.wheel_variance, p.speed_fluctuation, p.disturbance_fluctuation, p.timing_deviation, p.kappa_mu};
}

PredictiveParameters validated(const PredictiveParameters& parameters) {
  validate(parameters);
  return parameters;
}

SlipLearning slipLearning(const PredictiveParameters& p) {
  return {p.gyro_variance, p.accelerometer_variance, p.slip_memory, p.yaw_deviation, p.slip_excitation};
}

SlipBelief slipBelief(const PredictiveParameters& p, const GeometryParameters& geometry, const PlantModel& model) {
  const double track = model.effective_track > 0.0 ? model.effective_track : geometry.effective_track;
  return SlipBelief({track, geometry.slip}, geometry.wheel_radius, slipLearning(p));
}

void requirePositive(const char* name, double value) {
  if (value > 0.0 && std::isfinite(value)) return;
  std::ostringstream message;
  message << "slip." << name << " = " << value << ": must be positive";
  throw ParameterError(message.str());
}

void requireSameRate(const char* key, double wanted, double running) {
  if (wanted == running) return;
  std::ostringstream message;
  message << "predictive." << key << " = " << wanted << " Hz: must stay " << running << " Hz while the controller runs";
  throw ParameterError(message.str());
}

}  // namespace

int PredictiveParameters::beliefStepsPerAction() const {
  return static_cast<int>(std::lround(belief_rate / action_rate));
}

void validate(const PredictiveParameters& parameters) {
  std::ostringstream message;
  if (!isWhole(parameters.belief_rate / parameters.action_rate)) {
    message << "predictive.belief_rate = " << parameters.belief_rate
            << " Hz: must be a whole multiple of predictive.action_rate = " << parameters.action_rate << " Hz";
  } else if (!isWhole(1.0 / (parameters.belief_rate * WheelBelief::kStep))) {
    message << "predictive.belief_rate = " << parameters.belief_rate << " Hz: must divide 1000 Hz";
  } else {
    return;
  }
  throw ParameterError(message.str());
}

DriveTrainReference::DriveTrainReference(const PlantModel& model, double wheel_radius, double reference_time,
                                         double step)
    : step_(step), largest_change_(step * model.acceleration_limit / wheel_radius) {
  setReferenceTime(reference_time);
  transition_ << 0.0, 0.0, 0.0, 0.0;
  input_ << 1.0, 0.0;
  if (model.lag <= 0.0) return;
  Eigen::Matrix3d augmented = Eigen::Matrix3d::Zero();
  augmented.row(0) << -1.0 / model.lag, 1.0 / model.lag, 1.0 / model.lag;
  augmented.row(1) << -model.velocity_loop_integral, 0.0, model.velocity_loop_integral;
  const Eigen::Matrix3d exponential = (step * augmented).exp();
  transition_ = exponential.topLeftCorner<2, 2>();
  input_ = exponential.topRightCorner<2, 1>();
}

double DriveTrainReference::advance(double wanted) {
  const double change = std::clamp(pull_ * (wanted - state_(0)), -largest_change_, largest_change_);
  before_ = state_;
  r_ = (state_(0) + change - transition_.row(0).dot(state_)) / input_(0);
  state_ = transition_ * before_ + input_ * r_;
  return r_;
}

void DriveTrainReference::follow(double r) {
  before_ = state_;
  r_ = r;
  state_ = transition_ * before_ + input_ * r_;
  const double change = state_(0) - before_(0);
  if (std::abs(change) <= largest_change_) return;
  state_ = {before_(0) + std::copysign(largest_change_, change), before_(1)};  // at the limit z rests
}

void DriveTrainReference::amend(double more) {
  state_ = before_;
  follow(r_ + more);
}

void DriveTrainReference::reset(double speed) {
  state_ << speed, 0.0;
  before_ = state_;
  r_ = speed;
}

PredictiveController::PredictiveController(const PredictiveParameters& parameters, const GeometryParameters& geometry,
                                           const PlantModel& model)
    : parameters_(validated(parameters)),
      geometry_(geometry),
      model_(model),
      inner_steps_(static_cast<int>(std::lround(1.0 / (parameters.belief_rate * WheelBelief::kStep)))),
      left_(model, geometry.wheel_radius, wheelParameters(parameters)),
      right_(left_),
      slip_(slipBelief(parameters, geometry, model)),
      reference_left_(model, geometry.wheel_radius, parameters.reference_time, 1.0 / parameters.action_rate),
      reference_right_(reference_left_) {}

bool PredictiveController::setSetPoint(const SetPoint& set_point) {
  if (!set_point.vector().allFinite()) return false;
  set_point_ = set_point;
  return true;
}

SampleVerdict PredictiveController::observe(const Observation& observation) {
  if (!observation.vector().allFinite() || !std::isfinite(observation.stamp)) return SampleVerdict::not_finite;
  if (started_ && observation.stamp <= observation_.stamp) return SampleVerdict::stale;
  const bool first = !started_;
  if (started_) learn(observation);
  observation_ = observation;
  observed_ = started_ = true;
  if (!first) return SampleVerdict::accepted;
  restart();
  return SampleVerdict::restarted;
}

void PredictiveController::learn(const Observation& y) {
  if (slip_frozen_ || model_.on_box) return;  // on a box neither gyro nor accelerometer notices the wheels
  const double step = y.stamp - observation_.stamp;
  if (parameters_.learn_slip) {
    slip_.learnTrack(y.yaw_rate, y.wheel_right - y.wheel_left, right_.acceleration() - left_.acceleration(), step);
  }
  if (parameters_.learn_alpha) slip_.learnAlpha(y.acceleration_x, y.wheel_left, y.wheel_right, step);
}

void PredictiveController::setSlip(const SlipState& state) {
  requirePositive("effective_track", state.effective_track);
  requirePositive("alpha", state.alpha);
  slip_.setState(state);
}

void PredictiveController::updateBelief() {
  if (!started_) return;
  for (int i = 0; i < inner_steps_; ++i) {
    left_.predict(applied_.left);
    right_.predict(applied_.right);
  }
  if (!observed_) return;
  errors_(kYawRate) = observation_.yaw_rate - believedVelocity()(kYaw);
  free_energy_ = left_.correct(observation_.wheel_left) + right_.correct(observation_.wheel_right);
  errors_(kWheelLeft) = left_.predictionError();
  errors_(kWheelRight) = right_.predictionError();
  observed_ = false;
}

double PredictiveController::act(double wanted, DriveTrainReference& reference, const WheelBelief& wheel,
                                 double action) const {
  // a ← a − κ_a (∂²F/∂a²)⁻¹ ∂F/∂a with F = ½ ε_a²/Σ_a, ε_a = g a + d − w*
  const double error = model_.gain * action + wheel.disturbance() - reference.advance(wanted);
  return action - parameters_.kappa_a * error / model_.gain;
}

WheelCommand PredictiveController::updateAction() {
  if (!started_) return applied_;
  const WheelCommand wanted = kinematics().wheelSpeeds(set_point_.forward, set_point_.yaw_rate);
  applied_ = {act(wanted.left, reference_left_, left_, applied_.left),
              act(wanted.right, reference_right_, right_, applied_.right)};
  return applied_;
}

void PredictiveController::hold(const WheelCommand& applied) {
  if (applied == applied_) return;
  reference_left_.amend(model_.gain * (applied.left - applied_.left));
  reference_right_.amend(model_.gain * (applied.right - applied_.right));
  applied_ = applied;
}

void PredictiveController::overrule(const WheelCommand& applied) {
  reference_left_.follow(model_.gain * applied.left + left_.disturbance());
  reference_right_.follow(model_.gain * applied.right + right_.disturbance());
  applied_ = applied;
}

void PredictiveController::adoptGains(const PredictiveParameters& parameters) {
  validate(parameters);
  requireSameRate("belief_rate", parameters.belief_rate, parameters_.belief_rate);
  requireSameRate("action_rate", parameters.action_rate, parameters_.action_rate);
  parameters_ = parameters;
  for (WheelBelief* wheel : {&left_, &right_}) wheel->setParameters(wheelParameters(parameters));
  for (DriveTrainReference* path : {&reference_left_, &reference_right_}) {
    path->setReferenceTime(parameters.reference_time);
  }
  slip_.setLearning(slipLearning(parameters));
}

void PredictiveController::restart() {
  applied_ = {};
  reference_left_.reset(observation_.wheel_left);
  reference_right_.reset(observation_.wheel_right);
  left_.reset(observation_.wheel_left);
  right_.reset(observation_.wheel_right);
}

void PredictiveController::reset() {
  observation_ = {};
  observed_ = started_ = false;
  set_point_ = {};
  slip_ = slipBelief(parameters_, geometry_, model_);
  free_energy_ = 0.0;
  errors_.setZero();
  restart();
}

SkidSteerKinematics PredictiveController::kinematics() const {
  GeometryParameters believed = geometry_;
  believed.effective_track = slip_.state().effective_track;
  believed.slip = slip_.state().alpha;
  return SkidSteerKinematics(believed);
}

BodyVector PredictiveController::believedVelocity() const {
  return kinematics().bodyVelocity({left_.speed(), right_.speed()});
}

Eigen::Matrix2d PredictiveController::velocityCovariance() const {
  // x_dot = r alpha (w_L + w_R)/2,  theta_dot = r q (w_R - w_L)
  const double r = geometry_.wheel_radius;
  const SlipState slip = slip_.state();
  const double forward = 0.5 * r * slip.alpha, yaw = r * slip.alpha / slip.effective_track;
  Eigen::Matrix2d J;
  J << forward, forward, -yaw, yaw;
  const Eigen::Vector2d wheels(left_.covariance()(0, 0), right_.covariance()(0, 0));
  Eigen::Matrix2d covariance = J * wheels.asDiagonal() * J.transpose();
  const double mean = 0.5 * (left_.speed() + right_.speed()), difference = right_.speed() - left_.speed();
  if (parameters_.learn_alpha) covariance(0, 0) += r * r * mean * mean * slip_.alphaVariance();
  if (parameters_.learn_slip) covariance(1, 1) += r * r * difference * difference * slip_.ratioVariance();
  return covariance;
}

}  // namespace jackal_aic
