#include "jackal_aic/predictive/forward_speed_belief.hpp"

namespace jackal_aic {

void ForwardSpeedBelief::correct(double wheels, double acceleration, double variance, double yaw_rate, double step) {
  if (step > kLongestStep) return reset(wheels);
  const double change = step * (acceleration - parameters_.turning_centre * yaw_rate * yaw_rate);
  difference_ = parameters_.weight * (difference_ + change - (wheels - wheels_));
  variance_ = parameters_.weight * parameters_.weight * (variance_ + step * step * variance);
  wheels_ = wheels;
}

void ForwardSpeedBelief::reset(double wheels) {
  wheels_ = wheels;
  difference_ = 0.0;
  variance_ = 0.0;
}

}  // namespace jackal_aic
