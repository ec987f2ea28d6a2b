#include "jackal_aic/model/acceleration_pairing.hpp"

#include <algorithm>

#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

constexpr double kLongest = 0.15;    // s between two samples; beyond it one between them was lost
constexpr int kFrozen = 8;           // samples of a source that does not change
constexpr double kLargestShare = 4;  // of D, in multiples of h
constexpr double kLatest = 0.025;    // s by which an IMU sample may be later than the one it is paired with

}  // namespace

void AccelerationPairing::add(const Eigen::Vector3d& acceleration, double stamp) {
  if (end_ - first_ == kMostWaiting) count(waiting_[first_++ % kMostWaiting]);
  waiting_[end_++ % kMostWaiting] = {acceleration, stamp};
}

void AccelerationPairing::count(const Sample& sample) {
  const auto& [acceleration, stamp] = sample;
  if (!started_) {
    usual_ = newest_ = acceleration;
    last_stamp_ = stamp;
    started_ = true;
  }
  // An acceleration that repeats exactly, for longer than a collision can saturate the sensor, is passed on unchanged.
  repeats_ = (acceleration.array() == newest_.array()).select(repeats_ + 1, 0);
  usual_ = (repeats_ >= kFrozen).select(acceleration, usual_);
  newest_ = acceleration;
  mean_ += (acceleration - mean_) / ++count_;
  stamp_ = stamp;
}

Eigen::Vector3d AccelerationPairing::take(double stamp) {
  while (first_ < end_ && (!started_ || waiting_[first_ % kMostWaiting].stamp <= stamp + kLatest)) {
    count(waiting_[first_++ % kMostWaiting]);
  }
  const double step = stamp - taken_, lasted = count_ > 0 ? stamp_ - last_stamp_ : 0.0;
  const bool known = taken_once_ && step > 0.0 && step < kLongest && lasted >= 0.0 && lasted < kLongest;
  const double share = count_ == 0 ? 0.0 : known ? std::min(lasted / step, kLargestShare) : 1.0;
  const Eigen::Vector3d paired = usual_ + share * (mean_ - usual_);
  if (count_ > 0)
    usual_ += std::max(lasted, 0.0) / (std::max(lasted, 0.0) + thresholds::kMotionMemory) * (mean_ - usual_);
  mean_.setZero();
  count_ = 0;
  last_stamp_ = stamp_;
  taken_ = stamp;
  taken_once_ = true;
  return paired;
}

}  // namespace jackal_aic
