#include "jackal_aic/aic/generalized_motion.hpp"

#include <cmath>

namespace jackal_aic {

Generalization::Generalization(int orders, double longest_gap)
    : y_(GeneralizedSensor::Zero(kSensorSize, orders + 1)), longest_gap_(longest_gap) {}

SampleVerdict Generalization::update(const Observation& observation) {
  const SensorVector sample = observation.vector();
  if (!sample.allFinite() || !std::isfinite(observation.stamp)) return SampleVerdict::not_finite;

  const double h = observation.stamp - stamp_;
  if (!started_ || h > longest_gap_) {
    y_.setZero();
    y_.col(0) = sample;
    stamp_ = observation.stamp;
    started_ = true;
    return SampleVerdict::restarted;
  }
  if (h <= 0.0) return SampleVerdict::stale;

  // y_k^(i) = (y_k^(i-1) - y_{k-1}^(i-1)) / h                                   (3-22)
  SensorVector current = sample;
  for (Eigen::Index i = 0; i < y_.cols(); ++i) {
    const SensorVector previous = y_.col(i);
    y_.col(i) = current;
    current = (current - previous) / h;
  }
  stamp_ = observation.stamp;
  return SampleVerdict::accepted;
}

void Generalization::reset() {
  y_.setZero();
  stamp_ = 0.0;
  started_ = false;
}

}  // namespace jackal_aic
