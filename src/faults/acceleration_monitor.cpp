#include "jackal_aic/faults/acceleration_monitor.hpp"

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/gravity.hpp"

namespace jackal_aic {
namespace {

constexpr double kResolution = 1e-6;         // m/s^2; smaller changes are no noise
constexpr double kSteepest = 0.7;            // of the acceleration of gravity: an inclination of 45 degrees
constexpr double kUnknownInclination = 1.0;  // m/s^2, standard deviation at the start (6 degrees)
constexpr double kVibrationMemory = 0.2;     // T [s]
constexpr double kSurprise = 9.0;            // c
constexpr double kWandering = 1.0;           // m/s^2, standard deviation of the inclination after a second
constexpr int kLongestJolt = 3;              // samples of a collision
constexpr double kRebound = 1.3;             // of the speed, that a collision may take
constexpr double kBetweenJolts = 0.5;        // s
constexpr double kStruck = 0.5;              // of the speed, that a collision takes
constexpr double kLeastStrike = 0.1;         // m/s
constexpr double kShaken = 0.2;              // s, for which a body goes on rocking
constexpr double kAftermath = 0.3;           // s, in which the body bounces and the tyres slide

}  // namespace

AccelerationMonitor::AccelerationMonitor(const FaultParameters& parameters)
    : parameters_(parameters),
      forward_{0.0, kUnknownInclination, -kSteepest * kGravity, kSteepest * kGravity,
               LearnedVariance(parameters.covariance_time_constant)},
      vertical_{0.0, kUnknownInclination, -(1.0 - kSteepest) * kGravity, (1.0 - kSteepest) * kGravity,
                LearnedVariance(parameters.covariance_time_constant)},
      timing_(parameters.dead_time_deviation),
      persistence_(parameters.persistence()),
      repetition_at_rest_{RepetitionTest(parameters.frozen_samples), RepetitionTest(parameters.frozen_samples)},
      repetition_moving_(repetition_at_rest_),
      since_outlier_(2.0 * kShaken) {}

bool AccelerationMonitor::Repetition::update(const Observation& observation, bool other) {
  const double explained = other ? RepetitionTest::kAnyChange : 0.0;
  const bool frozen = forward.update(observation.acceleration_x, other, kResolution, explained);
  if (!observation.acceleration_z) return frozen;
  return vertical.update(*observation.acceleration_z, other, kResolution, explained) || frozen;
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
  for (Axis* axis : {&forward_, &vertical_}) {
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
  vibration += (std::min(0.5 * difference * difference, most) - vibration) * -std::expm1(-step / kVibrationMemory);
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
  const bool takes = ++samples <= kLongestJolt && taken > 0.0 && taken <= kRebound * std::abs(speed);
  struck = struck || (takes && taken > std::max(kLeastStrike, kStruck * std::abs(speed)));
  return takes || (struck && age < kAftermath && std::abs(change) < kGravity * step);
}

void AccelerationMonitor::check(const Observation& observation, bool moving, double speed, double step) {
  const bool vertical = observation.acceleration_z.has_value();
  const double forward_noise = parameters_.accelerometer_variance + timing_.value();
  const double left = observation.acceleration_x - forward_rate_ - forward_.offset;
  const double possible =
      std::clamp(left, std::min(0.0, lowest_rate_ - forward_rate_), std::max(0.0, highest_rate_ - forward_rate_));
  forward_.compare(observation.acceleration_x - forward_rate_ - possible, forward_noise, moving, step);
  if (vertical)
    vertical_.compare(*observation.acceleration_z - kGravity, parameters_.accelerometer_variance, moving, step);
  double squared = forward_.learned.squaredDistance(forward_.error, forward_.total);
  if (vertical) squared += vertical_.learned.squaredDistance(vertical_.error, vertical_.total);
  distance_ = std::sqrt(squared) / chebyshevBound(vertical ? 2 : 1, parameters_.false_alarm_rate);
  const bool frozen_at_rest = repetition_at_rest_.update(observation, moving);
  frozen_ = repetition_moving_.update(observation, !moving) || frozen_at_rest;

  since_outlier_ = distance_ > 1.0 ? 0.0 : since_outlier_ + step;
  const bool jolt = jolt_.update(distance_ > 1.0, forward_.error * step, speed, step);
  persistence_.update((distance_ > 1.0 && !jolt) || frozen_, true, step);
  if (frozen_) persistence_.declareFaulty();
  upside_down_ = state() == ChannelState::faulty && (vertical ? *observation.acceleration_z < 0.0 : upside_down_);
  if (state() == ChannelState::outlier || jolt) return;
  forward_.correct(forward_.noise(forward_noise, moving));
  if (vertical) vertical_.correct(vertical_.noise(parameters_.accelerometer_variance, moving));
  if (state() == ChannelState::faulty) return;
  forward_.learned.learn(forward_.error, forward_.total, step);
  if (vertical) vertical_.learned.learn(vertical_.error, vertical_.total, step);
}

bool AccelerationMonitor::shaken() const { return since_outlier_ < kShaken && state() != ChannelState::faulty; }

}  // namespace jackal_aic
