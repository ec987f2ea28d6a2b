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

/// How much earlier or later than predicted a wheel may move, in standard deviations of the dead time.
constexpr double kTimingBound = 3.0;

std::size_t steps(double time) { return static_cast<std::size_t>(std::lround(time / WheelBelief::kStep)); }

/// The time by which a second prediction can run ahead: what is commanded now is not yet driven.
double lead(const FaultParameters& p, const PlantModel& model) {
  return std::min(kTimingBound * p.timing_deviation, model.dead_time);
}

/// Width of the envelope, in standard deviations of the error, up to which an error tells of the noise.
constexpr double kNarrow = 3.0;

PlantModel earlier(PlantModel model, double by) {
  model.dead_time -= by;
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
      early_(earlier(model, lead(parameters, model)), wheel_radius, beliefParameters(parameters)),
      envelope_(steps(kTimingBound * parameters.timing_deviation), steps(lead(parameters, model))),
      change_(kMemory),
      learned_(parameters.covariance_memory),
      persistence_(parameters.persistence()),
      repetition_(parameters.frozen_samples),
      bound_(chebyshevBound(1, parameters.false_alarm_rate)) {}

void WheelMonitor::start(double speed) {
  belief_.reset(speed);
  early_.reset(speed);
  envelope_.start(speed, speed);
  persistence_.reset();
}

void WheelMonitor::predict(double command) {
  belief_.predict(command);
  early_.predict(command);
  envelope_.add(belief_.speed(), early_.speed());
  change_.add(belief_.acceleration(), WheelBelief::kStep);
}

double WheelMonitor::speedVariance() const {
  return std::min(belief_.covariance()(0, 0), kLargestDeviation * kLargestDeviation);
}

double WheelMonitor::uncertainty() const {
  const double width = envelope_.width();
  return speedVariance() + width * width;
}

double WheelMonitor::variance() const {
  const double scaled = parameters_.gain_deviation * change_.value();
  return speedVariance() + parameters_.wheel_variance + scaled * scaled;
}

void WheelMonitor::compare(double measurement) {
  error_ = envelope_.error(measurement);
  distance_ = std::sqrt(learned_.squaredDistance(error_, variance())) / bound_;
  // A wheel at rest repeats its speed whatever the reason of its rest: then only the prediction error tells.
  frozen_ = repetition_.update(measurement, std::abs(measurement) < kRestSpeed, kResolution);
  suspect_ = distance_ > 1.0 || frozen_;
}

void WheelMonitor::conclude(double measurement, double step) {
  persistence_.update(suspect_, std::abs(belief_.speed()) > kRestSpeed, step);
  if (frozen_) persistence_.condemn();
  if (state() != ChannelState::ok) return;
  const double width = envelope_.width();
  const double deviation = std::sqrt(learned_.factor() * variance());
  if (width < kNarrow * deviation) learned_.learn(measurement - belief_.speed(), variance(), step);
  // While the wheel is under way somewhere, its speed says little about the drive train.
  belief_.correct(measurement, width * width);
}

}  // namespace jackal_aic
