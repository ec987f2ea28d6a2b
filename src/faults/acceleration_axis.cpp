#include "jackal_aic/faults/acceleration_axis.hpp"

namespace jackal_aic::faults {

AccelerationAxis::AccelerationAxis(double least, double steepest, double lever) : noise_(least), steepest_(steepest) {
  P_ << square(kUnknown), 0.0, 0.0, square(lever);
}

AxisEvidence AccelerationAxis::weigh(double measured, double error, double doubt, double speed, double yaw_rate,
                                     Repetition::Kind kind, double step) {
  P_(0, 0) = std::min(P_(0, 0) + square(kWandering) * step, square(kUnknown));
  row_ << 1.0, square(yaw_rate);
  speed_squared_ = square(speed) + square(thresholds::kSlow);
  variance_ = row_.dot(P_ * row_) + std::max(noise_.variance(), vibration_ * speed_squared_) + doubt;
  error_ = error;
  measured_ = measured;
  kind_ = kind;
  const double chance = repetition_.logChance(measured, kind);
  const double jolt = variance_ + square(kJolt) * noise_.variance() + square(kOffset);
  AxisEvidence p{logStudent(square(error_), variance_), logStudent(square(error_), jolt),
                 offset_.stays(error_, variance_), offset_.begins(error_, variance_), kImpossible};
  const double best = std::max({p.healthy, p.jolted, p.offset, p.offset_begins});
  for (double* density : {&p.healthy, &p.jolted, &p.offset, &p.offset_begins})
    *density = chance + (repeats(measured) ? logUnless(repetition_.held(measured), *density - best) : *density);
  if (repeats(measured)) p.frozen = 0.0;
  return p;
}

void AccelerationAxis::learn(double explained, double range, double healthy, double fresh, bool excluded, double step) {
  offset_.update(error_, variance_, fresh);
  const double measured = 1.0 - repetition_.held(measured_);
  const double weight =
      (excluded ? 1.0 : healthy) * measured * studentWeight(square(error_), variance_) / (variance_ + square(range));
  Eigen::Vector2d Ph = P_ * row_;
  if (excluded) Ph(1) = 0.0;
  theta_ += weight * error_ * Ph;
  const double most = excluded ? std::min(kLeastOffset, steepest_) : steepest_;
  theta_(0) = std::clamp(theta_(0), -most, most);
  P_ -= weight * Ph * Ph.transpose();
  noise_.update(error_, -std::expm1(-step / thresholds::kMotionMemory), healthy);
  const double largest = kLargestRatio * std::max(vibration_ * speed_squared_, noise_.variance());
  vibration_ -= healthy * std::expm1(-step / kVibrationMemory) *
                (std::min(square(error_), largest) / speed_squared_ - vibration_);
  repetition_.update(measured_, explained, kind_, healthy);
}

}  // namespace jackal_aic::faults
