#include "jackal_aic/model/imu_at_rest.hpp"

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/gravity.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

constexpr double kRestSpeed = 0.15;  // of a wheel that stands, mean over kMotionMemory [rad/s]

/// Share of a sample in a mean over the time so far, and at most over the memory.
double shareOf(double step, double& time) {
  time = std::min(time + step, thresholds::kSensorMemory);
  return time > 0.0 ? step / time : 0.0;
}

}  // namespace

void ImuAtRest::calibrate(Observation& observation, double step) {
  watchWheels(observation, step);
  if (rested_ > thresholds::kPatience) learn(observation, step);
  observation.yaw_rate = withoutBias(observation.yaw_rate);
  if (accelerometerWrong()) observation.valid.acceleration = false;
}

void ImuAtRest::watchWheels(const Observation& y, double step) {
  if (y.valid.wheel_left) average(wheels_(0), y.wheel_left, step, thresholds::kMotionMemory);
  if (y.valid.wheel_right) average(wheels_(1), y.wheel_right, step, thresholds::kMotionMemory);
  if (wheels_.cwiseAbs().maxCoeff() > kRestSpeed) rested_ = 0.0;
}

void ImuAtRest::learn(const Observation& y, double step) {
  if (y.valid.yaw_rate && std::abs(y.yaw_rate) <= kLargestBias) {
    const double share = shareOf(step, biased_), off = y.yaw_rate - bias_;
    bias_ += share * off;
    spread_ += share * ((1.0 - share) * off * off - spread_);
    mean_variance_ = share * spread_;  // of a mean of 1/share samples
  }
  if (!y.valid.acceleration || !y.acceleration_z) return;
  const Eigen::Vector3d force(y.acceleration_x, y.acceleration_y, *y.acceleration_z);
  force_ += shareOf(step, weighed_) * (force - force_);
}

bool ImuAtRest::readsGravity() const {
  return std::abs(force_.norm() - kGravity) <= kGravityTolerance * kGravity &&
         std::abs(force_.z()) >= kLeastVertical * kGravity;
}

}  // namespace jackal_aic
