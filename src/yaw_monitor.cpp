#include "jackal_aic/yaw_monitor.hpp"

#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kResolution = 1e-7;  // rad/s; smaller changes are no noise

/// Time over which a change of the motion makes the slip uncertain [s].
constexpr double kMemory = 0.5;

/// A forward acceleration takes grip from the tyres and changes the slip at once. What changes the speed by kGripScale
/// within kGripMemory (2 m/s^2) makes 1/b_hat uncertain by one slip_deviation.
constexpr double kGripMemory = 0.05;  // s
constexpr double kGripScale = 0.1;    // m/s

/// Standard deviation of the bias of a gyro that was found faulty [rad/s].
constexpr double kFaultyBias = 0.5;

YawBeliefParameters beliefParameters(const FaultParameters& p) {
  YawBeliefParameters belief;
  belief.gyro_variance = p.gyro_variance;
  belief.slip_deviation = p.slip_deviation;
  belief.bias_deviation = 0.5 * p.largest_bias;
  return belief;
}

}  // namespace

YawMonitor::YawMonitor(const FaultParameters& parameters, double effective_track)
    : parameters_(parameters),
      belief_(effective_track, beliefParameters(parameters)),
      forward_change_(kMemory),
      difference_change_(kMemory),
      timing_(parameters.yaw_deviation),
      grip_(kGripMemory),
      learned_(parameters.covariance_memory),
      persistence_(parameters.persistence()),
      repetition_(parameters.frozen_samples),
      bound_(chebyshevBound(1, parameters.false_alarm_rate)) {}

void YawMonitor::predict(double forward_rate, double difference_rate, double step) {
  forward_change_.add(forward_rate, step);
  difference_change_.add(difference_rate, step);
  timing_.add(belief_.slope() * difference_rate, step);
  grip_.add(forward_rate, step);
  const double change =
      (std::abs(forward_change_.value()) + std::abs(difference_change_.value())) / YawBelief::kMotionScale;
  belief_.predict(change, kMemory, step);
}

bool YawMonitor::plausible() const { return std::abs(belief_.bias()) < parameters_.largest_bias; }

void YawMonitor::check(double yaw_rate, const DifferenceSpeed& x, double step) {
  const double error = belief_.error(yaw_rate, x.value);
  const double skid = parameters_.slip_deviation * belief_.slope() * x.value / kGripScale;
  const double variance = belief_.variance(x.value, x.variance) + timing_.value() + skid * skid * grip_.value();
  distance_ = std::sqrt(learned_.squaredDistance(error, variance)) / bound_;
  frozen_ = repetition_.update(yaw_rate, false, kResolution);
  const bool suspect = distance_ > 1.0 || frozen_ || !plausible();
  const bool was_faulty = state() == ChannelState::faulty;
  // A bias that is not known yet may be the fault still.
  const bool informative = 2.0 * std::sqrt(belief_.covariance()(1, 1)) < parameters_.largest_bias;
  persistence_.update(suspect, informative, step);
  if (frozen_) persistence_.condemn();
  if (state() == ChannelState::outlier) return;
  if (state() == ChannelState::ok) learned_.learn(error, variance, step);
  // Slip or bias? A belief that may learn either finds out when the motion changes.
  if (state() == ChannelState::faulty && (!was_faulty || distance_ > 1.0)) belief_.loosen(kFaultyBias);
  belief_.correct(yaw_rate, x.value, x.variance, learned_.factor());
}

}  // namespace jackal_aic
