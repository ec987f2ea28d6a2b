#include "jackal_aic/predictive/motion_uncertainty.hpp"

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/square.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {

void MotionUncertainty::learn(double& factor, double free_energy, double step) {
  average(factor, std::min(2.0 * free_energy, square(thresholds::kSure) * factor), step, thresholds::kNoiseMemory);
  factor = std::clamp(factor, kLeastFactor, kLargestFactor);
}

void MotionUncertainty::predict(double left_acceleration, double right_acceleration, double step) {
  if (on_box_) return;
  // T ds/dt = T dv/dt − s of each side, by the implicit Euler step
  const WheelVector faster = step * wheel_radius_ * WheelVector(left_acceleration, right_acceleration);
  slip_ = keptAfter(step, kSlipTime) * (slip_ + faster);
}

void MotionUncertainty::learnTurn(double yaw_rate, double usual, double step) {
  if (on_box_ || std::abs(usual) < thresholds::kTurning) return;
  const double deviation = std::abs(yaw_rate / usual - 1.0);
  average(turn_, deviation > kUsualTurn ? square(deviation) : 0.0, step, thresholds::kSensorMemory);
}

double MotionUncertainty::forwardVariance(double believed, const BodyVector& velocity, double ahead) const {
  if (on_box_) return wheels_ * believed + square(ahead);
  const double slip = square(std::max(1.0, wheels_)) * 0.5 * slip_.squaredNorm();
  const double centre = square(kCentreDeviation) + square(kCentrePerTurn) * turn_;  // c² = c₀² + l² q²
  // φ P + φ² ½ (s_L² + s_R²) + Δẋ² + c² θ̇² + ρ² ẋ²
  return wheels_ * believed + slip + square(ahead) + centre * square(velocity(kYaw)) +
         square(kRadiusDeviation * velocity(kForward));
}

double MotionUncertainty::yawVariance(double believed, const BodyVector& velocity, double ahead) const {
  if (on_box_) return wheels_ * believed + square(ahead);
  // φ P + Δθ̇² + (m q θ̇)²
  return gyro_ * believed + square(ahead) + square(kYawPerTurn * velocity(kYaw)) * turn_;
}

void MotionUncertainty::resetMotion() {
  slip_.setZero();
  wheels_ = gyro_ = 1.0;
}

}  // namespace jackal_aic
