#include "jackal_aic/predictive/yaw_rate_belief.hpp"

namespace jackal_aic {

void YawRateBelief::predict(double acceleration, double step) {
  yaw_rate_ += acceleration * step;
  variance_ += parameters_.process_noise * step;
  const double forgotten = parameters_.deviation > step ? step / parameters_.deviation : 1.0;
  unfollowed_ += acceleration * step - forgotten * unfollowed_;
}

double YawRateBelief::correct(double measurement) {
  const double error = measurement - yaw_rate_;
  const double innovation_variance = variance() + parameters_.gyro_variance;
  const double gain = variance() / innovation_variance;
  yaw_rate_ += gain * error;
  variance_ = (1.0 - gain) * variance();
  return 0.5 * error * error / innovation_variance;
}

void YawRateBelief::follow(double yaw_rate, double variance) {
  yaw_rate_ = yaw_rate;
  variance_ = variance;
  unfollowed_ = 0.0;
}

void YawRateBelief::reset(double yaw_rate) { follow(yaw_rate, parameters_.gyro_variance); }

}  // namespace jackal_aic
