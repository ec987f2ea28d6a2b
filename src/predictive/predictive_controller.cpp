#include "jackal_aic/predictive/predictive_controller.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/square.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

constexpr double kCertainTurn = 7.0;  // least difference of the wheel speeds to learn from, standard deviations of it
constexpr double kDelayDeviations = 2.0;  // by which the body may follow late

YawRateBeliefParameters yawParameters(const PredictiveParameters& p) {
  return {p.gyro_variance, p.yaw_process_noise, p.yaw_delay_deviation};
}

Turn turnOf(const GeometryParameters& geometry) {
  return Turn({geometry.effective_track, geometry.slip_factor}, geometry.wheel_radius, geometry.track_range);
}

void requirePositive(const char* name, double value) {
  if (value > 0.0 && std::isfinite(value)) return;
  throw ParameterError(fmt::format("slip.{} = {:g}: must be positive", name, value));
}

void requireNotNegative(const char* name, double value, const char* unit) {
  if (value >= 0.0 && std::isfinite(value)) return;
  throw ParameterError(fmt::format("drive_train.{} = {:g} {}: must be 0 or more", name, value, unit));
}

}  // namespace

PredictiveController::PredictiveController(const PredictiveParameters& parameters, const GeometryParameters& geometry,
                                           const PlantModel& model)
    : parameters_(validate(parameters)),
      geometry_(geometry),
      configured_model_(model),
      model_(model),
      inner_steps_(static_cast<int>(std::lround(1.0 / (parameters.belief_rate * WheelBelief::kStep)))),
      left_(parameters, model, geometry.wheel_radius),
      right_(left_),
      sides_(geometryOf(model, geometry), !model.on_box),
      yaw_(yawParameters(parameters)),
      traction_(parameters.turning_centre),
      turn_(turnOf(geometryOf(model, geometry))),
      drive_train_(model, geometry.wheel_radius, parameters.wheel_variance),
      uncertainty_(geometry.wheel_radius, model.on_box) {}

// ---- sense

bool PredictiveController::setSetPoint(const SetPoint& set_point) {
  if (!set_point.vector().allFinite()) return false;
  set_point_ = set_point;
  return true;
}

SampleVerdict PredictiveController::observe(const Observation& observation) {
  if (!observation.finite()) return SampleVerdict::not_finite;
  if (started_ && observation.stamp <= observation_.stamp) return SampleVerdict::stale;
  // Of two measurements within one belief step the later one counts for the wheels, and both for the change of speed.
  if (observed_ && !model_.on_box) correctForwardSpeed(observation_);
  const bool first = !started_;
  observation_step_ = first ? 0.0 : observation.stamp - observation_.stamp;
  observation_ = observation;
  sides_.observe(observation, observation.valid);
  believeMissing(observation_);
  observed_ = started_ = true;
  if (!first) return SampleVerdict::accepted;
  left_.reset(observation_.wheel_left);
  right_.reset(observation_.wheel_right);
  restart();
  return SampleVerdict::restarted;
}

void PredictiveController::believeMissing(Observation& y) const {
  if (y.valid.all()) return;
  if (!y.valid.wheel_left) y.wheel_left = left().speed();
  if (!y.valid.wheel_right) y.wheel_right = right().speed();
  if (!y.valid.yaw_rate) y.yaw_rate = yaw_.yawRate();
  if (!y.valid.acceleration) y.acceleration_x = y.acceleration_y = 0.0;
}

// ---- believe

void PredictiveController::updateBelief() {
  if (!started_) return;
  for (int i = 0; i < inner_steps_; ++i) predict();
  if (observed_) correct(observation_);
  observed_ = false;
}

void PredictiveController::predict() {
  left_.predict();
  right_.predict();
  if (learnsDriveTrain()) drive_train_.predict({left_.effectiveAction(), right_.effectiveAction()});
  yaw_.predict(turn_.yawPerDifference(wheels()) * (right().acceleration() - left().acceleration()), WheelBelief::kStep);
  traction_.predict(WheelBelief::kStep);
  uncertainty_.predict(left().acceleration(), right().acceleration(), WheelBelief::kStep);
}

void PredictiveController::correct(const Observation& y) {
  watchTurn();
  errors_(kYawRate) = y.yaw_rate - yaw_.yawRate();
  learnTurn(y);
  free_energy_ = correctWheels(y);
  const double of_yaw_rate = correctYawRate(y);
  free_energy_ += of_yaw_rate;
  if (y.valid.yaw_rate) {
    uncertainty_.learnGyro(of_yaw_rate, observation_step_);
    uncertainty_.learnTurn(y.yaw_rate, turn_.usualYawRate(wheels()), observation_step_);
  }
  if (!model_.on_box) correctForwardSpeed(y);
  learnDriveTrain(y);
}

void PredictiveController::learnTurn(const Observation& y) {
  turn_.pass(observation_step_);
  // On a box the gyro does not measure the turn of the wheels.
  if (!parameters_.learn_track || frozen_ || shaken_ || model_.on_box || sides_.contradicted()) return;
  if (!y.valid.wheel_left || !y.valid.wheel_right || !y.valid.yaw_rate || observation_step_ == 0.0) return;
  // Coarse encoders and late wheels are no turn, and noise of the regressor would draw the ratio towards zero.
  const WheelVector measured(y.wheel_left, y.wheel_right), errors = measured - wheels();
  const double of_wheels = left().speedVariance() + right().speedVariance() + innovation_variance_;
  // After its use: a weight that depends on the error of the same sample is biased.
  average(innovation_variance_, square(errors(1) - errors(0)), observation_step_, thresholds::kNoiseMemory);
  const double least = std::max(parameters_.slip_excitation, kCertainTurn * std::sqrt(of_wheels));
  // A body that is late is late for the deviation of its delay: that many samples have the same error.
  const double slope = turn_.yawPerDifference(wheels()), late = kDelayDeviations * yaw_.unfollowed();
  const double lasts = std::max(1.0, parameters_.yaw_delay_deviation / observation_step_);
  const double variance = parameters_.gyro_variance + slope * slope * of_wheels + lasts * late * late;
  // Without attitude a slope would count as lateral acceleration.
  const double lateral = y.valid.acceleration && y.level ? y.acceleration_y : 0.0;
  turn_.learn({y.yaw_rate, lateral, measured, wheels(), variance}, least, observation_step_);
}

void PredictiveController::learnDriveTrain(const Observation& y) {
  if (!learnsDriveTrain()) return;
  if (!y.valid.wheel_left || !y.valid.wheel_right) return withdrawGain();
  if (drive_train_.correct({y.wheel_left, y.wheel_right}, observation_step_)) setTiming(drive_train_.timing());
}

void PredictiveController::withdrawGain() {
  if (learnsDriveTrain() && drive_train_.withdrawGain()) setTiming(drive_train_.timing());
}

void PredictiveController::setTiming(const DriveTrainTiming& timing) {
  model_.dead_time = timing.dead_time;
  model_.lag = timing.lag;
  model_.acceleration_limit = timing.acceleration_limit;
  model_.gain = configured_model_.gain * timing.gain_share;
  left_.setDriveTrain(model_, geometry_.wheel_radius);
  right_.setDriveTrain(model_, geometry_.wheel_radius);
}

/// Share of the turn, now or recently, that loads the motors.
void PredictiveController::watchTurn() {
  if (model_.on_box) return;
  const double difference = std::abs(right().speed() - left().speed());
  turning_ = std::max(difference, turning_ * keptAfter(observation_step_, thresholds::kPatience));
  const double share = std::clamp(turning_ / thresholds::kMoving - 1.0, 0.0, 1.0);
  left_.setTurning(share);
  right_.setTurning(share);
}

double PredictiveController::correctWheels(const Observation& y) {
  // An invalid channel leaves its belief to the model, or to the yaw rate and the other wheel.
  const bool one_stands_in = y.valid.yaw_rate && !model_.on_box && y.valid.wheel_left != y.valid.wheel_right;
  const double difference = one_stands_in ? turn_.wheelDifference(y.yaw_rate, wheels().mean()) : 0.0;
  double free_energy = 0.0;
  int known = 0;
  const auto correct = [&](WheelController& wheel, bool valid, double measured, double stand_in, double& error) {
    error = valid ? measured - wheel.belief().speed() : 0.0;
    if (!valid && !one_stands_in) return;
    free_energy += valid ? wheel.correct(measured) : wheel.correct(stand_in, standInVariance());
    ++known;
  };
  correct(left_, y.valid.wheel_left, y.wheel_left, y.wheel_right - difference, errors_(kWheelLeft));
  correct(right_, y.valid.wheel_right, y.wheel_right, y.wheel_left + difference, errors_(kWheelRight));
  if (known > 0) uncertainty_.learnWheels(free_energy / known, observation_step_);
  return free_energy;
}

double PredictiveController::standInVariance() const {
  // omega_L = omega_R - theta_dot / slope, where theta_dot comes late by the yaw's delay
  const double slope = turn_.yawPerDifference(wheels());
  const double late = parameters_.yaw_delay_deviation * (right().acceleration() - left().acceleration());
  return parameters_.gyro_variance / (slope * slope) + late * late;
}

double PredictiveController::correctYawRate(const Observation& y) {
  if (!model_.on_box && y.valid.yaw_rate) return yaw_.correct(y.yaw_rate);
  // Without a gyro, or on a box, only the wheels measure the turn.
  const double slope = turn_.yawPerDifference(wheels());
  yaw_.follow(turn_.yawRate(wheels()), slope * slope * (left().speedVariance() + right().speedVariance()));
  return 0.0;
}

void PredictiveController::correctForwardSpeed(const Observation& y) {
  if (!y.valid.acceleration) return traction_.miss(observation_step_);
  // The raw accelerometer: its offset at resting wheels may come from a robot that slides on locked wheels. The
  // measured wheels: they may differ from the model.
  const double wheels = forwardSpeedOf(y.wheel_left + y.wheel_right);
  traction_.correct(wheels, y.acceleration_x, parameters_.accelerometer_variance, yaw_.yawRate(), observation_step_);
}

// ---- act

WheelCommand PredictiveController::updateAction() {
  if (!started_) return action();
  const auto effective = [this] { return WheelVector(left_.effectiveAction(), right_.effectiveAction()); };
  const WheelVector input = inputs(), before = effective();
  left_.act(input(0));
  right_.act(input(1));
  const WheelVector sides = sides_.bound(before, effective(), input / configured_model_.gain);
  left_.limit(sides(0));
  right_.limit(sides(1));
  const bool has_to_stand = set_point_.forward == 0.0 && set_point_.yaw_rate == 0.0;
  // Within the dead zone an effective command of zero is a large command without effect.
  const double most = standstill_.largestCommand(has_to_stand, sides, wheels(), 1.0 / parameters_.action_rate);
  if (std::isfinite(most)) {
    left_.rest(most);
    right_.rest(most);
  }
  return action();
}

WheelVector PredictiveController::inputs() const {
  const WheelVector wanted = turn_.wheelSpeeds(set_point_.forward, set_point_.yaw_rate);
  const WheelVector input(left_.input(wanted(0)), right_.input(wanted(1)));
  if (turn_acceleration_ <= 0.0) return input;
  const double turn = input(1) - input(0);
  const double configured = SkidSteerKinematics(geometry_).yawPerDifference();  // as in the limits of the command
  const double largest_change = model_.gain * turn_acceleration_ / (parameters_.action_rate * configured);
  const double in_time = right_.path().minus(left_.path()).inTime(wanted(1) - wanted(0), turn, largest_change);
  return input + 0.5 * (in_time - turn) * WheelVector(-1.0, 1.0);
}

void PredictiveController::hold(const WheelCommand& applied) {
  if (applied == action()) return;
  left_.hold(applied.left);
  right_.hold(applied.right);
}

void PredictiveController::overrule(const WheelCommand& applied) {
  left_.overrule(applied.left);
  right_.overrule(applied.right);
  // Another source drives, so the robot does not count as standing at the hand-over.
  standstill_.largestCommand(false, applied.vector(), wheels(), 1.0 / parameters_.action_rate);
  drive_train_.resetMotion();
}

void PredictiveController::setTurnLimits(double acceleration, double deceleration) {
  const bool both = acceleration > 0.0 && deceleration > 0.0;
  turn_acceleration_ = both ? std::min(acceleration, deceleration) : std::max(acceleration, deceleration);
}

void PredictiveController::adoptGains(const PredictiveParameters& parameters) {
  validate(parameters);
  requireUnchanged("predictive.belief_rate", parameters.belief_rate, parameters_.belief_rate);
  requireUnchanged("predictive.action_rate", parameters.action_rate, parameters_.action_rate);
  parameters_ = parameters;
  left_.setParameters(parameters, configured_model_);
  right_.setParameters(parameters, configured_model_);
  yaw_.setParameters(yawParameters(parameters));
  traction_.setTurningCentre(parameters.turning_centre);
  drive_train_.setWheelVariance(parameters.wheel_variance);
  if (!learnsDriveTrain()) drive_train_.resetMotion();
}

void PredictiveController::freezeLearning(bool frozen) {
  frozen_ = frozen;
  if (!learnsDriveTrain()) drive_train_.resetMotion();
}

// ---- restart

void PredictiveController::restart() {
  left_.restart(observation_.wheel_left);
  right_.restart(observation_.wheel_right);
  yaw_.reset(model_.on_box ? turn_.yawRate({observation_.wheel_left, observation_.wheel_right})
                           : observation_.yaw_rate);
  traction_.restart();
  drive_train_.resetMotion();
  uncertainty_.resetMotion();
  sides_.reset();
}

void PredictiveController::reset() {
  drive_train_.setTiming({configured_model_.dead_time, configured_model_.lag, configured_model_.acceleration_limit});
  turn_ = turnOf(geometryOf(model_, geometry_));
  traction_ = TractionBelief(parameters_.turning_centre);
  uncertainty_ = {geometry_.wheel_radius, model_.on_box};
  resetMotion();
}

void PredictiveController::resetMotion() {
  setTiming(drive_train_.timing());
  observation_ = {};
  observed_ = started_ = shaken_ = false;
  set_point_ = {};
  standstill_ = {};
  free_energy_ = innovation_variance_ = turning_ = 0.0;
  errors_.setZero();
  restart();
}

void PredictiveController::setLearned(const LearnedModel& learned) {
  requirePositive("effective_track", learned.slip.effective_track);
  requirePositive("slip_factor", learned.slip.slip_factor);
  if (learned.timing) {
    requireNotNegative("dead_time", learned.timing->dead_time, "s");
    requireNotNegative("lag", learned.timing->lag, "s");
    requireNotNegative("acceleration_limit", learned.timing->acceleration_limit, "m/s^2");
  }
  turn_.setState(learned.slip);
  if (!learned.timing) return;
  drive_train_.setTiming({std::min(learned.timing->dead_time, kLongestTiming.dead_time),
                          std::min(learned.timing->lag, kLongestTiming.lag),
                          std::min(learned.timing->acceleration_limit, kLongestTiming.acceleration_limit)});
  setTiming(drive_train_.timing());
}

// ---- report

double PredictiveController::forwardSpeedOf(double sum_of_wheels) const {
  return 0.5 * geometry_.wheel_radius * turn_.slipFactor() * sum_of_wheels;
}

BodyVector PredictiveController::believedVelocity() const {
  return {traction_.speed(forwardSpeedOf(left().speed() + right().speed())), 0.0, yaw_.yawRate()};
}

WheelVector PredictiveController::changeAhead() const {
  // The path is a dead time and a lag ahead of the wheels; only the learned part of it is uncertain.
  const double ahead = model_.dead_time + model_.lag;
  const double learned = ahead - configured_model_.dead_time - configured_model_.lag;
  const double part = std::clamp(learned / std::max(ahead, WheelBelief::kStep), -1.0, 1.0);
  return part * (WheelVector(left_.path().speed(), right_.path().speed()) - wheels());
}

Eigen::Matrix2d PredictiveController::motionCovariance() const {
  // x_dot = r alpha (w_L + w_R)/2; the yaw rate is a belief of its own, which the wheels only move.
  const double per_wheel = 0.5 * geometry_.wheel_radius * turn_.slipFactor();
  double forward = per_wheel * per_wheel * (left().speedVariance() + right().speedVariance());
  forward += traction_.variance();
  const BodyVector velocity = believedVelocity();
  const WheelVector ahead = changeAhead();
  const double turn = turn_.yawPerDifference(wheels()) * (ahead(1) - ahead(0));
  return Eigen::Vector2d(uncertainty_.forwardVariance(forward, velocity, forwardSpeedOf(ahead.sum())),
                         uncertainty_.yawVariance(yaw_.variance(), velocity, turn))
      .asDiagonal();
}

}  // namespace jackal_aic
