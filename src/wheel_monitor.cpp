#include "jackal_aic/wheel_monitor.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

/// Largest standard deviation of a predicted speed [rad/s]. Without measurements the belief knows less and less; beyond
/// this even a dead encoder would seem to agree.
constexpr double kLargestDeviation = 0.3;

/// Time in which the belief learns a gain that is not the model's [s].
constexpr double kMemory = 0.5;

/// Smaller changes of a wheel speed are no noise [rad/s].
constexpr double kResolution = 1e-5;

/// How much earlier than predicted a wheel may move, in standard deviations of the dead time.
constexpr double kEarliest = 2.0;

PlantModel earlier(PlantModel model, double by) {
  model.dead_time = std::max(0.0, model.dead_time - by);
  return model;
}

WheelBeliefParameters beliefParameters(const FaultParameters& p) {
  WheelBeliefParameters belief;
  belief.measurement_variance = p.wheel_variance;
  belief.timing_deviation = p.timing_deviation;
  return belief;
}

}  // namespace

WheelMonitor::WheelMonitor(const FaultParameters& parameters, const PlantModel& model, double wheel_radius)
    : parameters_(parameters),
      belief_(model, wheel_radius, beliefParameters(parameters)),
      early_(earlier(model, kEarliest * parameters.timing_deviation), wheel_radius, beliefParameters(parameters)),
      change_(kMemory),
      timing_(parameters.timing_deviation),
      early_timing_(parameters.timing_deviation),
      learned_(parameters.covariance_memory),
      persistence_(parameters.persistence()),
      repetition_(parameters.frozen_samples),
      bound_(chebyshevBound(1, parameters.false_alarm_rate)) {}

void WheelMonitor::start(double speed) {
  belief_.reset(speed);
  early_.reset(speed);
  persistence_.reset();
}

void WheelMonitor::predict(double command) {
  belief_.predict(command);
  early_.predict(command);
  early_timing_.add(early_.acceleration(), WheelBelief::kStep);
  timing_.add(belief_.acceleration(), WheelBelief::kStep);
  change_.add(belief_.acceleration(), WheelBelief::kStep);
}

double WheelMonitor::speedVariance() const {
  return std::min(belief_.covariance()(0, 0), kLargestDeviation * kLargestDeviation);
}

double WheelMonitor::variance() const {
  const double scaled = parameters_.gain_deviation * change_.value();
  const double timing = std::max(timing_.value(), early_timing_.value());
  return speedVariance() + parameters_.wheel_variance + timing + scaled * scaled;
}

void WheelMonitor::compare(double measurement) {
  error_ = measurement - belief_.speed();
  distance_ = std::sqrt(learned_.squaredDistance(error_, variance())) / bound_;
  // A wheel at rest repeats its speed whatever the reason of its rest: then only the prediction error tells.
  frozen_ = repetition_.update(measurement, std::abs(measurement) < kRestSpeed, kResolution);
  suspect_ = distance_ > 1.0 || frozen_;
}

void WheelMonitor::conclude(double measurement, double step) {
  persistence_.update(suspect_, std::abs(belief_.speed()) > kRestSpeed, step);
  if (frozen_) persistence_.condemn();
  if (state() != ChannelState::ok) return;
  learned_.learn(error_, variance(), step);
  belief_.correct(measurement);
}

}  // namespace jackal_aic
