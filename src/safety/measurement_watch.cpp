#include "jackal_aic/safety/measurement_watch.hpp"

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

/// An outlier excludes a sample, but its channel is not lost.
bool works(const ChannelHealth& verdict) { return verdict.state != ChannelState::faulty; }

constexpr double kLargestAcceleration = 100.0;  // m/s^2, about 10 g

/// Time in which the second source may follow the first at the start [s].
constexpr double kLongestStart = 1.0;

/// Every loss as a cause to stop.
StopCauses lossCauses(const SensorHealth& health) {
  StopCauses causes;
  causes.add(StopCause::unpaired, health.unpaired)
      .add(StopCause::imu_frozen, health.imu.frozen)
      .add(StopCause::imu_late, health.imu.late)
      .add(StopCause::imu_missing, health.imu.missing)
      .add(StopCause::wheels_frozen, health.wheels.frozen)
      .add(StopCause::wheels_late, health.wheels.late)
      .add(StopCause::wheels_missing, health.wheels.missing);
  return causes;
}

ChannelValidity channelsOf(const SensorHealth& health) {
  const bool imu = !health.imu.lost(), wheels = !health.wheels.lost();
  return {imu, wheels, wheels, imu};
}

bool seesTheMotion(const ChannelValidity& valid) { return valid.yaw_rate + valid.wheel_left + valid.wheel_right >= 2; }

}  // namespace

MeasurementWatch::MeasurementWatch(const MeasurementWatchParameters& parameters) : parameters_(parameters) {
  if (parameters.faults && parameters.plant_model) {
    monitor_.emplace(*parameters.faults, parameters.geometry, *parameters.plant_model);
  }
}

void MeasurementWatch::advance(const std::optional<WheelCommand>& command, double duration) {
  imu_at_rest_.advance(!command || *command == WheelCommand{}, duration);
  if (monitor_) monitor_->advance(command, duration);
}

void MeasurementWatch::judge(Observation& observation, const SensorHealth& health, double now) {
  // With a stamp that is not finite no time passes.
  const double step = std::min(std::max(0.0, observation.stamp - stamp_), thresholds::kGap);
  stamp_ = observation.stamp;
  const ChannelValidity possible = excludeImpossible(observation, step);
  observation.valid = observation.valid & channelsOf(health);
  imu_at_rest_.calibrate(observation, step);
  if (monitor_ && !recoversFromStall(now)) {
    const Fault before = fault();
    observation.valid = observation.valid & monitor_->check(observation).valid();
    if (fault() != before && monitor_->report().faulty()) ++detected_;
  }
  observation.valid = observation.valid & possible;
  observation.valid.acceleration = observation.valid.acceleration && imu_at_rest_.accelerometerCounts(observation);
  wheels_repeating_ = wheelsRepeat() ? wheels_repeating_ + step : 0.0;
  const bool sees = seesTheMotion(observation.valid);
  blind_ = sees ? 0.0 : blind_ + step;
  if (!sees) return;
  last_sight_ = now;
  started_ = true;
}

/// The channels with possible values. The monitor judges an encoder that reads too much, too. Beyond the bound only the
/// logarithm of the excess counts: no square overflows, and different readings stay different.
ChannelValidity MeasurementWatch::excludeImpossible(Observation& observation, double step) {
  const auto within = [](double value, double bound) { return std::abs(value) <= bound; };
  ChannelValidity possible;
  possible.wheel_left = within(observation.wheel_left, parameters_.largest_wheel_speed);
  possible.wheel_right = within(observation.wheel_right, parameters_.largest_wheel_speed);
  possible.yaw_rate = within(observation.yaw_rate, parameters_.largest_yaw_rate);
  possible.acceleration = within(observation.acceleration_x, kLargestAcceleration) &&
                          within(observation.acceleration_y, kLargestAcceleration) &&
                          within(observation.acceleration_z.value_or(0.0), kLargestAcceleration);
  // A single outlier is not a loss: the monitor decides within some samples.
  const auto count = [step](bool valid, double& excluded) { excluded = valid ? 0.0 : excluded + step; };
  count(observation.valid.yaw_rate && possible.yaw_rate, excluded_.yaw_rate);
  count(observation.valid.wheel_left && possible.wheel_left, excluded_.wheel_left);
  count(observation.valid.wheel_right && possible.wheel_right, excluded_.wheel_right);
  ChannelValidity judged = possible;
  judged.wheel_left = std::isfinite(observation.wheel_left);
  judged.wheel_right = std::isfinite(observation.wheel_right);
  observation.valid = observation.valid & judged;
  for (double* wheel : {&observation.wheel_left, &observation.wheel_right}) {
    const double excess = std::abs(*wheel) - parameters_.largest_wheel_speed;
    if (excess > 0.0) *wheel = std::copysign(parameters_.largest_wheel_speed + std::log1p(excess), *wheel);
  }
  return possible;
}

StopCauses MeasurementWatch::causes(const SensorHealth& health, double now, bool at_rest) {
  if (parameters_.open_loop) return {};
  if (starting(health, now)) return lossCauses(health);
  resetReturnedSources(health);

  const bool on_box = parameters_.plant_model && parameters_.plant_model->on_box;
  const LossDecision decision = decideOnLoss(parameters_.on_loss, remaining(health), now - last_sight_, on_box);
  const bool lost = health.imu.lost() || health.wheels.lost();
  const bool stop = decision.action == LossAction::stop;
  const bool unclear = decision.loss == Loss::none && tooFewCount();
  // A loss that the policy does not tolerate already has a cause.
  loss_ = lost && stop ? Loss::none : unclear ? Loss::unclear : decision.loss;

  const bool source_decides = wheelsRepeat() && wheels_repeating_ <= thresholds::kPatience + thresholds::kRounding;
  const bool too_little = !lost && !source_decides && (stop || unclear);
  const bool blocked = monitor_ && monitor_->report().blocked();
  StopCauses causes = lost && !stop ? StopCauses{} : lossCauses(health);
  causes.add(StopCause::sensor_fault, !at_rest && (too_little || blocked))
      .add(StopCause::moved, monitor_ && monitor_->report().moved);
  return causes;
}

/// Before the first measurement nothing is lost. A source that stays silent is lost after a while.
bool MeasurementWatch::starting(const SensorHealth& health, double now) {
  if (started_) return false;
  if (health.imu.missing && health.wheels.missing) return true;
  if (first_source_ == 0.0) first_source_ = now;
  started_ = (!health.imu.missing && !health.wheels.missing) || now - first_source_ > kLongestStart;
  return !started_;
}

/// Findings about a source that has come back are obsolete.
void MeasurementWatch::resetReturnedSources(const SensorHealth& health) {
  const bool back = (imu_was_lost_ && !health.imu.lost()) || (wheels_were_lost_ && !health.wheels.lost());
  imu_was_lost_ = health.imu.lost();
  wheels_were_lost_ = health.wheels.lost();
  if (!back) return;
  excluded_ = {};
  blind_ = wheels_repeating_ = 0.0;
  if (monitor_) monitor_->restart();
}

bool MeasurementWatch::tooFewCount() const {
  const bool moved = monitor_ && monitor_->report().moved;
  return !moved && blind_ > thresholds::kPatience + thresholds::kRounding;
}

bool MeasurementWatch::wheelsRepeat() const {
  return monitor_ && monitor_->report().wheel_left.fault == Fault::left_encoder_frozen &&
         monitor_->report().wheel_right.fault == Fault::right_encoder_frozen;
}

ChannelValidity MeasurementWatch::remaining(const SensorHealth& health) const {
  ChannelValidity valid;
  if (monitor_) {
    const FaultReport& report = monitor_->report();
    valid = {works(report.gyro), works(report.wheel_left), works(report.wheel_right), works(report.accelerometer)};
  }
  valid = valid & channelsOf(health);
  // A channel whose samples are excluded for longer than kGap counts as lost.
  const auto counts = [](double excluded) { return excluded < thresholds::kGap - thresholds::kRounding; };
  valid.yaw_rate = valid.yaw_rate && counts(excluded_.yaw_rate);
  valid.wheel_left = valid.wheel_left && counts(excluded_.wheel_left);
  valid.wheel_right = valid.wheel_right && counts(excluded_.wheel_right);
  return valid;
}

Fault MeasurementWatch::fault() const {
  const Fault found = monitor_ ? monitor_->report().fault() : Fault::none;
  if (found != Fault::none) return found;
  if (imu_at_rest_.accelerometerWrong()) return Fault::no_gravity;
  if (monitor_ && monitor_->report().wheels_off_model) return Fault::wheels_off_model;
  return monitor_ && monitor_->report().turn_off_model ? Fault::turn_off_model : Fault::none;
}

double MeasurementWatch::share() const {
  const Fault found = fault();
  if (found == Fault::wheels_off_model) return monitor_->report().wheel_share;
  return found == Fault::turn_off_model ? monitor_->report().turn_share : 1.0;
}

void MeasurementWatch::reset() {
  if (monitor_) monitor_->reset();
  resetLosses();
}

void MeasurementWatch::resetLosses() {
  imu_was_lost_ = wheels_were_lost_ = false;
  last_sight_ = 0.0;
  stalled_until_ = 0.0;
  excluded_ = {};
  blind_ = wheels_repeating_ = 0.0;
  loss_ = Loss::none;
}

void MeasurementWatch::restart(double now) {
  restartAfterStall(now);
  started_ = false;
  first_source_ = 0.0;
}

void MeasurementWatch::resetSensors() {
  imu_at_rest_.reset();
  if (monitor_) monitor_->forgetEncoders();
}

void MeasurementWatch::restartAfterStall(double now) {
  if (monitor_) monitor_->restart();
  resetLosses();
  last_sight_ = now;
  stalled_until_ = now + thresholds::kPatience;
}

}  // namespace jackal_aic
