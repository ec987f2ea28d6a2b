#include "jackal_aic/faults/fault_monitor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/square.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

/// Ratio of squared errors from which the yaw rate decides.
constexpr double kClearly = 2.0;

/// Error of the yaw rate by noise and tyres, which decides nothing [rad/s].
constexpr double kNoEvidence = 0.0287;

/// Time that the robot needs to turn after a wheel has stopped [s]. A shorter event, such as a kerb, is no fault.
constexpr double kIsolationTime = 0.2;

/// Longest time for which the body drags a wheel faster than commanded against weak motors [s].
constexpr double kDraggedTime = 2.0 * thresholds::kPatience;

/// Time over which the yaw rate's evidence is averaged [s].
constexpr double kEvidenceMemory = 0.05;

/// Time of known commands before the first sample from which the state of the drive train is known [s].
constexpr double kCommandsKnown = 0.25;

constexpr double kLongestStep = 0.5;  // s between samples; a longer silence says nothing more

bool isFaulty(const ChannelHealth& verdict) { return verdict.state == ChannelState::faulty; }
bool counts(const ChannelHealth& verdict) { return verdict.state == ChannelState::ok; }

Fault faultOf(faults::Hypothesis hypothesis) {
  switch (hypothesis) {
    case faults::kGyroFrozen:
      return Fault::gyro_frozen;
    case faults::kGyroOffset:
      return Fault::gyro_disagrees;
    case faults::kGyroReversed:
      return Fault::gyro_reversed;
    case faults::kAccelerometerFrozen:
      return Fault::accelerometer_frozen;
    case faults::kAccelerometerOffset:
      return Fault::accelerometer_disagrees;
    case faults::kUpsideDown:
      return Fault::imu_upside_down;
    default:
      return Fault::none;
  }
}

}  // namespace

ChannelValidity FaultReport::valid() const {
  return {counts(gyro), counts(wheel_left), counts(wheel_right), counts(accelerometer)};
}

bool FaultReport::blocked() const {
  return wheel_left.fault == Fault::left_wheels_blocked || wheel_right.fault == Fault::right_wheels_blocked;
}

bool FaultReport::turnSensorFaulty() const { return isFaulty(wheel_left) || isFaulty(wheel_right) || isFaulty(gyro); }

Fault FaultReport::fault() const {
  if (wheel_left.fault == Fault::left_wheels_blocked && wheel_right.fault == Fault::right_wheels_blocked)
    return Fault::wheels_blocked;
  Fault gravest = moved ? Fault::moved : stuck ? Fault::stuck : Fault::none;
  for (const ChannelHealth* channel : {&wheel_left, &wheel_right, &gyro, &accelerometer}) {
    if (channel->fault != Fault::none && (gravest == Fault::none || channel->fault < gravest)) gravest = channel->fault;
  }
  return gravest;
}

FaultMonitor::FaultMonitor(const FaultParameters& parameters, const GeometryParameters& geometry,
                           const PlantModel& model)
    : parameters_(parameters),
      geometry_(geometry),
      model_(model),
      rolling_radius_(geometry.wheel_radius * geometry.slip_factor),
      left_(parameters, model, geometry.wheel_radius),
      right_(left_),
      body_(parameters, geometryOf(model, geometry).effective_track, model.on_box),
      witness_(rolling_radius_, geometryOf(model, geometry).effective_track, geometry.track_range) {}

void FaultMonitor::advance(const std::optional<WheelCommand>& known, double duration) {
  if (!known) followed_ = true;
  if (!started_) known_ = known ? known_ + duration : 0.0;
  const WheelCommand applied = known.value_or(followed_command_);
  left_over_ += duration / DriveTrain::kStep;
  for (; left_over_ > 1.0 - thresholds::kRounding; left_over_ -= 1.0) predict(applied);
}

/// Lets a step pass in which a command is applied.
void FaultMonitor::predict(const WheelCommand& command) {
  const WheelRates left = left_.predict(command.left), right = right_.predict(command.right);
  if (model_.on_box) return body_.predict(0.0, {0.0, 0.0}, 0.0, DriveTrain::kStep);  // the body does not follow
  const auto forward = [&](double of_left, double of_right) { return 0.5 * rolling_radius_ * (of_left + of_right); };
  body_.predict(forward(left.believed, right.believed),
                {forward(left.possible.low, right.possible.low), forward(left.possible.high, right.possible.high)},
                rolling_radius_ * (right.believed - left.believed), DriveTrain::kStep);
}

const FaultReport& FaultMonitor::check(const Observation& observation) {
  if (!observation.finite() || (started_ && observation.stamp <= stamp_)) return report_;
  const double step = started_ ? std::min(observation.stamp - stamp_, kLongestStep) : 0.0;
  if (!started_) start(observation);
  stamp_ = observation.stamp;
  checkWheels(observation, step);
  checkBody(observation, step);
  checkTraction(observation, step);
  return report_;
}

std::array<FaultMonitor::Side, 2> FaultMonitor::sides(const Observation& y) {
  return {{{left_, report_.wheel_left, followed_command_.left, kLeftWheels, y.wheel_left, y.valid.wheel_left},
           {right_, report_.wheel_right, followed_command_.right, kRightWheels, y.wheel_right, y.valid.wheel_right}}};
}

void FaultMonitor::start(const Observation& observation) {
  started_ = true;
  body_.start();
  for (const Side& side : sides(observation)) {
    side.wheel.start(side.valid ? side.measured : 0.0, known_ > kCommandsKnown);
  }
}

void FaultMonitor::checkWheels(const Observation& observation, double step) {
  const std::array<Side, 2> sides = this->sides(observation);
  for (const Side& side : sides) {
    if (!side.valid) continue;
    if (followed_) {
      side.wheel.follow(side.measured);
      side.followed = DeadZone(model_).command(side.measured / model_.gain);
    }
    side.wheel.compare(side.measured, step);
  }
  followed_ = false;
  if (observation.valid.wheel_left && right_.frozen()) left_.freezeWithTheOther();
  if (observation.valid.wheel_right && left_.frozen()) right_.freezeWithTheOther();
  weighEvidence(observation, step);
  for (const Side& side : sides) {
    if (side.valid) side.wheel.conclude(side.measured, step);
  }
  if (concludeMoved()) return;
  for (const Side& side : sides) {
    const bool undecided = side.wheel.state() == ChannelState::faulty && side.verdict.fault == Fault::none;
    if (undecided && !side.wheel.suspecting()) side.wheel.forgive();
    conclude(side, step);
    if (side.wheel.spikes()) blameEncoder(side);
  }
  hearWitnesses(observation, step);
  compareWithModel(observation, step);
}

void FaultMonitor::hearWitnesses(const Observation& y, double step) {
  const ChannelValidity& valid = y.valid;
  const bool told_to_rest = left_.commandedToRest() && right_.commandedToRest();
  if (!valid.wheel_left || !valid.wheel_right || !yawTells(y) || told_to_rest) return witness_.reset();
  witness_.update(y.yaw_rate, {y.wheel_left, left_.nominal(), left_.reachable()},
                  {y.wheel_right, right_.nominal(), right_.reachable()},
                  std::max(left_.longestHold(), right_.longestHold()), step);
  const auto [left, right] = sides(y);
  if (witness_.leftWrong()) blameEncoder(left);
  if (witness_.rightWrong()) blameEncoder(right);
}

void FaultMonitor::blameEncoder(const Side& side) {
  side.wheel.declareWrong();
  if (!isFaulty(side.verdict)) side.verdict = {ChannelState::faulty, side.faults.wrong, side.wheel.distance()};
}

/// Reports a robot that differs from its model.
void FaultMonitor::compareWithModel(const Observation& y, double step) {
  if (off_model_ == 0.0) off_measured_ = off_expected_ = 0.0;
  bool off = false;
  for (const Side& side : sides(y)) {
    const auto [low, high] = side.wheel.reachable();
    if (!side.valid || withinRange(low, high).outside(side.measured) == 0.0) continue;
    const double nominal = side.wheel.nominal();
    off_measured_ += std::copysign(1.0, nominal) * side.measured * step;
    off_expected_ += std::abs(nominal) * step;
    off = true;
  }
  off_model_ = off ? std::min(off_model_ + step, 2.0 * thresholds::kPatience) : std::max(off_model_ - step, 0.0);
  const bool wheels_were_off = report_.wheels_off_model;
  report_.wheels_off_model = off_model_ > (wheels_were_off ? 0.0 : thresholds::kPatience);
  if (report_.wheels_off_model && !wheels_were_off) report_.wheel_share = off_measured_ / off_expected_;
  if (model_.on_box || !y.valid.yaw_rate || !y.valid.wheel_left || !y.valid.wheel_right) return;
  const double asked = rolling_radius_ * (y.wheel_right - y.wheel_left) / geometryOf(model_, geometry_).effective_track;
  turn_.update(y.yaw_rate, asked, step);
  const double range = geometry_.track_range;
  const bool turn_was_off = report_.turn_off_model;
  report_.turn_off_model = turn_.turned() > thresholds::kPatience &&
                           (turn_.value() < 1.0 / range || turn_.value() > range) &&
                           std::abs(asked) > TurnAgreement::kLeastTurn;
  if (report_.turn_off_model && !turn_was_off) report_.turn_share = turn_.value();
}

/// Wheels that turn against a zero command are turned from outside: pushed, or lifted and spun. Their samples do not
/// count, so that the controller does not act against it.
bool FaultMonitor::concludeMoved() {
  const auto turns = [](const WheelMonitor& w) {
    return w.state() == ChannelState::faulty && !w.frozen() && w.fasterThanCommanded();
  };
  const bool suspecting = left_.suspecting() || right_.suspecting();
  // Uses the command before the suspicion: the controller may react to the push.
  if (!suspecting) was_to_stand_ = left_.commandedToRest() && right_.commandedToRest();
  const bool found_before = report_.wheel_left.fault != Fault::none || report_.wheel_right.fault != Fault::none;
  const bool were_turned = wheels_turned_;
  wheels_turned_ = was_to_stand_ && (were_turned ? suspecting : (turns(left_) || turns(right_)) && !found_before);
  report_.moved = wheels_turned_;
  if (were_turned && !wheels_turned_) {
    left_.forgive();
    right_.forgive();
    evidence_ = Evidence{};
  }
  if (!wheels_turned_) return false;
  report_.wheel_left = {ChannelState::outlier, Fault::none, left_.distance()};
  report_.wheel_right = {ChannelState::outlier, Fault::none, right_.distance()};
  return true;
}

bool FaultMonitor::wheelsTurn() const {
  return std::max(std::abs(left_.speed()), std::abs(right_.speed())) > thresholds::kMoving;
}

bool FaultMonitor::yawTells(const Observation& observation) const {
  return observation.valid.yaw_rate && !model_.on_box && !isFaulty(report_.gyro) && !isFaulty(report_.accelerometer);
}

void FaultMonitor::weighEvidence(const Observation& observation, double step) {
  if (!left_.suspect() && !right_.suspect()) {
    if (!left_.suspecting() && !right_.suspecting()) evidence_ = Evidence{};
    return;
  }
  yaw_tells_ = yawTells(observation) && observation.valid.wheel_left && observation.valid.wheel_right;
  // A wheel that returns to its prediction follows its command.
  const auto stays_away = [](const WheelMonitor& wheel) { return wheel.suspect() && !wheel.recovering(); };
  if (stays_away(left_) || stays_away(right_)) evidence_.time += step;
  if (!yaw_tells_) return;
  const double measured = rolling_radius_ * (observation.wheel_right - observation.wheel_left);
  const double asked = rolling_radius_ * (right_.speed() - left_.speed());
  const double measured_error = body_.yawError(observation.yaw_rate, measured, forwardSpeed());
  const double predicted_error = body_.yawError(observation.yaw_rate, asked, forwardSpeed());
  average(evidence_.against_measured, square(measured_error), step, kEvidenceMemory);
  average(evidence_.against_predicted, square(predicted_error), step, kEvidenceMemory);
}

void FaultMonitor::conclude(const Side& side, double step) const {
  WheelMonitor& wheel = side.wheel;
  ChannelHealth& verdict = side.verdict;
  verdict.distance = wheel.distance();
  if (wheel.state() != ChannelState::faulty) {
    verdict.state = wheel.state();
    verdict.fault = Fault::none;
    return;
  }
  if (verdict.fault != Fault::none) return;
  verdict.state = wheel.suspect() && !wheel.recovering() ? ChannelState::outlier : ChannelState::ok;
  if (wheel.frozen()) {
    verdict.state = ChannelState::faulty;
    verdict.fault = side.faults.frozen;
  } else if (wheel.suspect() && evidence_.time >= kIsolationTime) {
    const double doubt = std::max(kClearly * evidence_.against_predicted, kNoEvidence * kNoEvidence);
    const bool as_measured = !yaw_tells_ || evidence_.against_measured <= doubt;
    // The tyres of a dragged wheel may slide. Then neither speed explains the yaw rate.
    const bool as_predicted = !as_measured && evidence_.against_predicted <= kNoEvidence * kNoEvidence;
    if (!as_predicted && wheel.fasterThanCommanded() && evidence_.time < kDraggedTime) return;
    if (as_measured && yaw_tells_ && wheel.slowed()) {
      wheel.acceptMeasured(step);
      verdict.state = ChannelState::ok;
      return;
    }
    verdict.state = as_measured ? ChannelState::ok : ChannelState::faulty;
    verdict.fault = as_measured ? side.faults.blocked : side.faults.wrong;
  }
}

double FaultMonitor::forwardSpeed() const { return 0.5 * rolling_radius_ * (left_.speed() + right_.speed()); }

void FaultMonitor::checkBody(const Observation& observation, double step) {
  // While a wheel is suspect, the wheels do not judge the gyro.
  const bool trusted = !witness_.clearsGyro() && !left_.suspect() && !right_.suspect() && !report_.blocked();
  faults::WheelMotion wheels;
  const faults::Normal left = left_.turns(observation.valid.wheel_left && !isFaulty(report_.wheel_left));
  const faults::Normal right = right_.turns(observation.valid.wheel_right && !isFaulty(report_.wheel_right));
  const double variance = square(rolling_radius_) * (left.variance + right.variance);
  if (!model_.on_box) wheels.difference = {rolling_radius_ * (right.mean - left.mean), variance};
  wheels.forward = {0.5 * rolling_radius_ * (left.mean + right.mean), model_.on_box ? 0.0 : 0.25 * variance};
  wheels.turn = wheelsTurn();
  wheels.trusted = trusted || isFaulty(report_.wheel_left) || isFaulty(report_.wheel_right);
  wheels.to_stand = was_to_stand_ && !left_.suspecting() && !right_.suspecting();
  wheels.pushed = wheels_turned_;
  body_.check(observation, wheels, step);
  report_.gyro = {body_.gyro(), faultOf(body_.gyroFault()), 0.0, body_.gyroFaulty()};
  report_.accelerometer = {body_.accelerometer(), faultOf(body_.accelerometerFault()), 0.0,
                           body_.accelerometerFaulty()};
  report_.suspicion = body_.mostLikely();
  report_.shaken = body_.shaken();
  report_.moved = report_.moved || body_.moved();
}

/// Uses the measured wheels and an accelerometer that counts.
void FaultMonitor::checkTraction(const Observation& observation, double step) {
  if (model_.on_box) return;
  const double left = observation.valid.wheel_left ? observation.wheel_left : left_.speed();
  const double right = observation.valid.wheel_right ? observation.wheel_right : right_.speed();
  const double wheels = 0.5 * rolling_radius_ * (left + right);
  if (report_.moved || !observation.valid.acceleration || isFaulty(report_.accelerometer)) {
    traction_.restart();
  } else {
    const double yaw_rate = observation.valid.yaw_rate ? observation.yaw_rate : 0.0;
    traction_.setWheelsHold(std::max(left_.longestHold(), right_.longestHold()));
    traction_.correct(wheels, observation.acceleration_x, parameters_.accelerometer_variance, yaw_rate, step);
  }
  report_.stuck = traction_.traction() == Traction::stands;
}

void FaultMonitor::restart() {
  started_ = was_to_stand_ = wheels_turned_ = false;
  known_ = 0.0;
  followed_ = false;
  followed_command_ = {};
  report_ = FaultReport{};
  evidence_ = Evidence{};
  yaw_tells_ = false;
  body_.restart();
  traction_.restart();
  witness_.reset();
  turn_ = TurnAgreement();
  off_model_ = 0.0;
}

void FaultMonitor::forgetEncoders() {
  left_.forget();
  right_.forget();
}

void FaultMonitor::reset() {
  restart();
  forgetEncoders();
  body_ = faults::BodyMonitor(parameters_, geometryOf(model_, geometry_).effective_track, model_.on_box);
  traction_ = TractionBelief(0.0);
}

}  // namespace jackal_aic
