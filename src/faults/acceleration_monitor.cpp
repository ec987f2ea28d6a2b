#include "jackal_aic/faults/acceleration_monitor.hpp"

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/gravity.hpp"

namespace jackal_aic {
namespace {

constexpr double kResolution = 1e-6;         // m/s^2; smaller changes are no noise
constexpr double kSteepest = 0.7;            // of the acceleration of gravity: an inclination of 45 degrees
constexpr double kUnknownInclination = 1.0;  // m/s^2, standard deviation at the start (6 degrees)
constexpr double kVibrationMemory = 0.2;     // T [s]
constexpr double kSurprise = 9.0;            // c
constexpr double kWandering = 1.0;           // m/s^2, standard deviation of the inclination after a second
constexpr double kLongAgreement = 10.0;      // s, after which an inclination that came at once is one
constexpr double kLongestJolt = 0.05;        // s, of a collision
constexpr double kLeastFault = 0.1;          // s of suspect samples; a shorter time is a push
constexpr double kRounding = 1e-6;           // s
constexpr double kRebound = 1.3;             // of the speed, that a collision may take
constexpr double kBetweenJolts = 0.5;        // s
constexpr double kStruck = 0.5;              // of the speed, that a collision takes
constexpr double kLeastStrike = 0.1;         // m/s
constexpr double kShaken = 0.2;              // s, for which a body goes on rocking
constexpr double kPush = 0.5;                // of the bound of an outlier, that vibration does not reach
constexpr double kAftermath = 0.3;           // s, in which the body bounces and the tyres slide

}  // namespace

AccelerationMonitor::AccelerationMonitor(const FaultParameters& parameters)
    : parameters_(parameters),
      axes_{{0.0, kUnknownInclination, -kSteepest * kGravity, kSteepest * kGravity, {}},
            {0.0, kUnknownInclination, -(1.0 - kSteepest) * kGravity, (1.0 - kSteepest) * kGravity, {}}},
      alternative_(axes_),
      timing_(parameters.dead_time_deviation),
      persistence_(parameters.persistence()),
      forward_repetition_(parameters.frozen_samples),
      vertical_repetition_(parameters.frozen_samples),
      since_outlier_(2.0 * kShaken),
      since_push_(2.0 * kAtOnce) {}

bool AccelerationMonitor::isFrozen(const Observation& observation, bool moving) {
  const bool frozen = forward_repetition_.update(observation.acceleration_x, moving, false, kResolution);
  if (!observation.acceleration_z) return frozen;
  return vertical_repetition_.update(*observation.acceleration_z, moving, false, kResolution) || frozen;
}

void AccelerationMonitor::predict(const double* forward_rates, const double* lowest, const double* highest,
                                  std::size_t number, double step) {
  TimingVariance timing = timing_;
  double forward_rate = forward_rate_, lowest_rate = lowest_rate_, highest_rate = highest_rate_;
  // What was possible fades slowly: the body follows its wheels late.
  const double fading = step / TimingVariance::kFading;
  for (std::size_t i = 0; i < number; ++i) {
    timing.add((forward_rates[i] - forward_rate) / step, step);
    forward_rate = forward_rates[i];
    lowest_rate = std::min(lowest[i], lowest_rate - fading * lowest_rate);
    highest_rate = std::max(highest[i], highest_rate - fading * highest_rate);
  }
  timing_ = timing;
  forward_rate_ = forward_rate;
  lowest_rate_ = lowest_rate;
  highest_rate_ = highest_rate;
  const double wandered = kWandering * kWandering * static_cast<double>(number) * step;
  Axes& learning = state() == ChannelState::faulty ? alternative_ : axes_;
  for (Axis* axis : {&learning.forward, &learning.vertical}) {
    axis->variance = std::min(axis->variance + wandered, kUnknownInclination * kUnknownInclination);
  }
}

double AccelerationMonitor::Axis::noise(double configured, bool moving) const {
  return moving ? std::max(configured, vibration) : configured;
}

void AccelerationMonitor::Axis::compare(double error_without_offset, double configured, bool moving, double step) {
  const double difference = error_without_offset - offset - error;
  error += difference;
  const double most = kSurprise * std::max(vibration, configured);
  average(vibration, std::min(0.5 * difference * difference, most), step, kVibrationMemory);
  total = variance + noise(configured, moving);
}

void AccelerationMonitor::Axis::correct(double noise) {
  const double gain = variance / (variance + learned.factor() * noise);
  offset = std::clamp(offset + gain * error, lowest, highest);
  variance *= 1.0 - gain;
}

/// True for a sample that takes no more of the speed than there is, and after that for what sliding tyres can do.
bool AccelerationMonitor::Jolt::update(bool suspect, double change, double speed, double step) {
  since += step;
  age += step;
  if (!suspect) return false;
  if (since > kBetweenJolts) *this = Jolt{};
  since = 0.0;
  change_of_speed += change;
  const double taken = speed < 0.0 ? change_of_speed : -change_of_speed;
  const bool takes = age < kLongestJolt - kRounding && taken > 0.0 && taken <= kRebound * std::abs(speed);
  struck = struck || (takes && taken > std::max(kLeastStrike, kStruck * std::abs(speed)));
  return takes || (struck && age < kAftermath && std::abs(change) < kGravity * step);
}

/// Squared Mahalanobis distance of a sample.
double AccelerationMonitor::compare(Axes& axes, const Sample& y) {
  const double left = y.measured - y.rate - axes.forward.offset;
  const double possible =
      std::clamp(left, std::min(0.0, y.lowest_rate - y.rate), std::max(0.0, y.highest_rate - y.rate));
  axes.forward.compare(y.measured - y.rate - possible, y.forward_noise, y.moving, y.step);
  if (!y.vertical_error) return axes.forward.squaredDistance();
  axes.vertical.compare(*y.vertical_error, y.vertical_noise, y.moving, y.step);
  return axes.forward.squaredDistance() + axes.vertical.squaredDistance();
}

void AccelerationMonitor::correct(Axes& axes, const Sample& y) {
  axes.forward.correct(axes.forward.noise(y.forward_noise, y.moving));
  if (y.vertical_error) axes.vertical.correct(axes.vertical.noise(y.vertical_noise, y.moving));
}

void AccelerationMonitor::learn(Axes& axes, const Sample& y, double share) {
  axes.forward.learned.learn(axes.forward.error, axes.forward.total, share);
  if (y.vertical_error) axes.vertical.learned.learn(axes.vertical.error, axes.vertical.total, share);
}

void AccelerationMonitor::check(const Observation& observation, bool moving, double speed, const SampleStep& step) {
  const bool vertical = observation.acceleration_z.has_value();
  Sample sample{observation.acceleration_x,
                forward_rate_,
                lowest_rate_,
                highest_rate_,
                parameters_.accelerometer_variance + timing_.value(),
                parameters_.accelerometer_variance,
                std::nullopt,
                moving,
                step.time};
  if (vertical) sample.vertical_error = *observation.acceleration_z - kGravity;
  const double bound = chebyshevBound(vertical ? 2 : 1, parameters_.false_alarm_rate);
  const bool was_faulty = state() == ChannelState::faulty;
  distance_ = std::sqrt(compare(axes_, sample)) / bound;
  if (was_faulty) agreement_ = std::sqrt(compare(alternative_, sample)) <= bound ? agreement_ + step.time : 0.0;
  frozen_ = isFrozen(observation, moving);

  since_outlier_ = distance_ > 1.0 ? 0.0 : since_outlier_ + step.time;
  since_push_ = distance_ > kPush ? 0.0 : since_push_ + step.time;
  const bool jolt = jolt_.update(distance_ > 1.0, axes_.forward.error * step.time, speed, step.time);
  const bool explained = jolt || (was_faulty && agreement_ > kLongAgreement);
  const bool suspect = (distance_ > 1.0 && !explained) || frozen_;
  if (!persistence_.suspecting()) suspected_ = 0.0;
  if (suspect) suspected_ += step.time;
  persistence_.update(suspect, true, step.time, suspected_ > kLeastFault - kRounding);
  if (frozen_) persistence_.declareFaulty();
  upside_down_ = state() == ChannelState::faulty && (vertical ? *observation.acceleration_z < 0.0 : upside_down_);
  if (state() == ChannelState::outlier || jolt) return;
  if (state() == ChannelState::faulty) {
    if (!was_faulty) {
      alternative_ = axes_;
      agreement_ = 0.0;
    }
    return correct(alternative_, sample);
  }
  if (was_faulty && distance_ > 1.0) axes_ = alternative_;
  correct(axes_, sample);
  learn(axes_, sample, step.share);
}

void AccelerationMonitor::forgive() {
  for (Axis* axis : {&axes_.forward, &axes_.vertical}) axis->variance = kUnknownInclination * kUnknownInclination;
  persistence_.reset();
}

bool AccelerationMonitor::pushed() const { return since_push_ < kAtOnce && state() != ChannelState::faulty; }

bool AccelerationMonitor::shaken() const { return since_outlier_ < kShaken && state() != ChannelState::faulty; }

}  // namespace jackal_aic
