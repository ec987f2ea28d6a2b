#include "jackal_aic/aic/generalized_motion.hpp"

#include <cmath>

namespace jackal_aic {

Generalization::Generalization(int orders, double shortest_gap, double longest_gap)
    : y_(GeneralizedSensor::Zero(kSensorSize, orders + 1)), shortest_gap_(shortest_gap), longest_gap_(longest_gap) {}

SampleVerdict Generalization::update(const Observation& observation) {
  const SensorVector sample = observation.vector();
  if (!sample.allFinite() || !std::isfinite(observation.stamp)) return SampleVerdict::not_finite;

  if (started_ && observation.stamp <= stamp_) return SampleVerdict::stale;
  const bool restarts = !started_ || observation.stamp - stamp_ > longest_gap_;
  stamp_ = observation.stamp;
  if (restarts) {
    y_.setZero();
    y_.col(0) = differenced_ = sample;
    differenced_at_ = stamp_;
    started_ = true;
    return SampleVerdict::restarted;
  }
  const double h = stamp_ - differenced_at_;
  if (h < shortest_gap_) {
    y_.col(0) = sample;
    return SampleVerdict::accepted;
  }
  // y_k^(i) = (y_k^(i-1) - y_{k-1}^(i-1)) / h                                   (3-22)
  y_.col(0) = differenced_;
  SensorVector current = sample;
  for (Eigen::Index i = 0; i < y_.cols(); ++i) {
    const SensorVector previous = y_.col(i);
    y_.col(i) = current;
    current = (current - previous) / h;
  }
  differenced_ = sample;
  differenced_at_ = stamp_;
  return SampleVerdict::accepted;
}

void Generalization::reset() {
  y_.setZero();
  stamp_ = differenced_at_ = 0.0;
  started_ = false;
}

}  // namespace jackal_aic
