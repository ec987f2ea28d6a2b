#include "measurement_watch.hpp"

#include <ros/console.h>

#include <algorithm>
#include <cmath>
#include <variant>

namespace jackal_aic {
namespace {

bool counts(const ChannelVerdict& verdict) { return verdict.state != ChannelState::faulty; }

constexpr double kLargestAcceleration = 100.0;  // m/s^2, about 10 g

/// Time in which the second source may follow the first at the start [s].
constexpr double kLongestStart = 1.0;

/// Samples in a row of which too few channels count before the robot stops: 0.3 s at 50 Hz; the monitor isolates a
/// fault sooner.
constexpr int kMostBlind = 15;

/// Samples for which both encoders may repeat until the source's own deadline has decided: 0.3 s at 50 Hz.
constexpr int kMostRepeating = 15;

constexpr double kStallRecovery = 0.3;  // s, dead time and acceleration after a stall

/// Samples in a row without a channel that make it lost: 0.2 s at 50 Hz.
constexpr int kMostExcluded = 10;

void count(bool valid, int& excluded) { excluded = valid ? 0 : std::min(excluded + 1, kMostExcluded); }

bool seesTheMotion(const ChannelValidity& valid) { return valid.yaw_rate + valid.wheel_left + valid.wheel_right >= 2; }

}  // namespace

MeasurementWatch::MeasurementWatch(const NodeParameters& parameters)
    : policy_(parameters.on_loss),
      largest_wheel_speed_(parameters.gate.watchdog.belief_bound * parameters.gate.limits.wheel_speed),
      largest_yaw_rate_(parameters.gate.watchdog.belief_bound * parameters.gate.limits.angular_speed),
      predictive_(std::holds_alternative<PredictiveParameters>(parameters.controller)),
      on_box_(parameters.plant_model && parameters.plant_model->on_box) {
  if (parameters.plant_model) monitor_.emplace(parameters.faults, parameters.geometry, *parameters.plant_model);
}

void MeasurementWatch::advance(const WheelCommand& command, double duration) {
  if (monitor_) monitor_->advance(command, duration);
}

void MeasurementWatch::judge(Observation& observation, double now) {
  excludeImpossible(observation);
  if (imu_lost_) observation.valid.yaw_rate = observation.valid.acceleration = false;
  if (wheels_lost_) observation.valid.wheel_left = observation.valid.wheel_right = false;
  if (monitor_ && !trustsBlindly(now)) {
    const std::string before = monitor_->report().reason();
    observation.valid = observation.valid & monitor_->check(observation).valid();
    tell(before);
  }
  wheels_repeating_ = wheelsRepeat() ? std::min(wheels_repeating_ + 1, kMostRepeating + 1) : 0;
  blind_samples_ = seesTheMotion(observation.valid) ? 0 : std::min(blind_samples_ + 1, kMostBlind + 1);
  if (blind_samples_ > 0) return;
  last_sight_ = now;
  started_ = true;
}

void MeasurementWatch::tell(const std::string& before) {
  const std::string reason = monitor_->report().reason();
  if (reason == before) return;
  if (monitor_->report().faulty()) {
    ++detected_;
    ROS_WARN("Fault detected: %s", reason.c_str());
  } else if (reason.empty()) {
    ROS_INFO("Over: %s", before.c_str());
  } else {
    ROS_INFO("The robot is %s", reason.c_str());
  }
}

void MeasurementWatch::excludeImpossible(Observation& observation) {
  const auto within = [](double value, double bound) { return std::abs(value) <= bound; };
  ChannelValidity possible;
  possible.wheel_left = within(observation.wheel_left, largest_wheel_speed_);
  possible.wheel_right = within(observation.wheel_right, largest_wheel_speed_);
  possible.yaw_rate = within(observation.yaw_rate, largest_yaw_rate_);
  possible.acceleration = within(observation.acceleration_x, kLargestAcceleration) &&
                          within(observation.acceleration_y, kLargestAcceleration) &&
                          within(observation.acceleration_z.value_or(0.0), kLargestAcceleration);
  observation.valid = observation.valid & possible;
  // An outlier is no loss: the monitor decides within some samples what it was.
  count(possible.yaw_rate, excluded_.yaw_rate);
  count(possible.wheel_left, excluded_.wheel_left);
  count(possible.wheel_right, excluded_.wheel_right);
}

void MeasurementWatch::applyPolicy(StopCauses& causes, double now, bool at_rest) {
  if (starting(causes, now)) return;
  noteSources(causes);
  const LossDecision decision = decideOnLoss(policy_, tolerance(), remaining(), now - last_sight_, on_box_);
  const bool lost = imu_lost_ || wheels_lost_;
  // What is lost and not tolerated is a cause of its own already.
  loss_ = lost && decision.action == LossAction::stop ? "" : decision.reason;
  if (lost && decision.action == LossAction::drive) {
    causes.remove({StopCause::unpaired, StopCause::imu_frozen, StopCause::imu_late, StopCause::imu_missing,
                   StopCause::wheels_frozen, StopCause::wheels_late, StopCause::wheels_missing});
  }
  const bool unclear = *decision.reason == '\0' && blind();
  if (unclear) loss_ = "too few channels count";
  const bool source_decides = wheelsRepeat() && wheels_repeating_ <= kMostRepeating;
  const bool too_little = !lost && !source_decides && (decision.action == LossAction::stop || unclear);
  const bool blocked = monitor_ && (monitor_->report().drive_left || monitor_->report().drive_right);
  causes.add(StopCause::sensor_fault, !at_rest && (too_little || blocked))
      .add(StopCause::moved, monitor_ && monitor_->report().moved);
}

/// Before the first measurement nothing is lost; a source that does not come at all is, after a while.
bool MeasurementWatch::starting(const StopCauses& causes, double now) {
  if (started_) return false;
  const bool no_imu = causes.hasAny({StopCause::imu_missing}), no_wheels = causes.hasAny({StopCause::wheels_missing});
  if (no_imu && no_wheels) return true;
  if (first_source_ == 0.0) first_source_ = now;
  started_ = (!no_imu && !no_wheels) || now - first_source_ > kLongestStart;
  return !started_;
}

bool MeasurementWatch::blind() const {
  const bool moved = monitor_ && monitor_->report().moved;
  return !moved && blind_samples_ > kMostBlind;
}

void MeasurementWatch::noteSources(const StopCauses& causes) {
  const bool imu_was_lost = imu_lost_, wheels_were_lost = wheels_lost_;
  imu_silent_ = causes.hasAny({StopCause::imu_late, StopCause::imu_missing});
  wheels_silent_ = causes.hasAny({StopCause::wheels_late, StopCause::wheels_missing});
  imu_lost_ = imu_silent_ || causes.hasAny({StopCause::imu_frozen});
  wheels_lost_ = wheels_silent_ || causes.hasAny({StopCause::wheels_frozen});
  // What was found out about a source that has come back is of the past.
  const bool back = (imu_was_lost && !imu_lost_) || (wheels_were_lost && !wheels_lost_);
  if (!back) return;
  excluded_ = {};
  blind_samples_ = wheels_repeating_ = 0;
  if (monitor_) monitor_->reset();
}

bool MeasurementWatch::wheelsRepeat() const {
  return monitor_ && monitor_->report().wheel_left.cause == FaultCause::frozen &&
         monitor_->report().wheel_right.cause == FaultCause::frozen;
}

ChannelValidity MeasurementWatch::remaining() const {
  ChannelValidity valid;
  if (monitor_) {
    const FaultReport& report = monitor_->report();
    valid = {counts(report.gyro), counts(report.wheel_left), counts(report.wheel_right), counts(report.accelerometer)};
  }
  if (imu_lost_) valid.yaw_rate = valid.acceleration = false;
  if (wheels_lost_) valid.wheel_left = valid.wheel_right = false;
  // A source that speaks without telling anything, sample after sample, is as good as lost.
  valid.yaw_rate = valid.yaw_rate && excluded_.yaw_rate < kMostExcluded;
  valid.wheel_left = valid.wheel_left && excluded_.wheel_left < kMostExcluded;
  valid.wheel_right = valid.wheel_right && excluded_.wheel_right < kMostExcluded;
  return valid;
}

LossTolerance MeasurementWatch::tolerance() const {
  return predictive_ ? LossTolerance::model : LossTolerance::one_of_three;
}

std::string MeasurementWatch::reason() const {
  const std::string fault = monitor_ && monitor_->report().faulty() ? monitor_->report().reason() : "";
  return fault.empty() ? loss_ : fault;
}

void MeasurementWatch::reset() {
  if (monitor_) monitor_->reset();
  imu_silent_ = wheels_silent_ = imu_lost_ = wheels_lost_ = false;
  last_sight_ = 0.0;
  stalled_until_ = 0.0;
  excluded_ = {};
  blind_samples_ = wheels_repeating_ = 0;
  loss_ = "";
}

void MeasurementWatch::restart() {
  reset();
  started_ = false;
  first_source_ = 0.0;
}

void MeasurementWatch::forgiveStall(double now) {
  reset();
  last_sight_ = now;
  stalled_until_ = now + kStallRecovery;
}

}  // namespace jackal_aic
