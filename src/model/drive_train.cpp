#include "jackal_aic/model/drive_train.hpp"

#include <algorithm>
#include <cmath>
#include <unsupported/Eigen/MatrixFunctions>

namespace jackal_aic {

Pace paceOf(double lag, double limit, double time) {
  return {lag > 0.0 ? -std::expm1(-time / lag) : 1.0, limit * time};
}

/// A shorter lag counts as zero, because 1/T would exceed the precision of the other terms [s].
constexpr double kShortestLag = 1e-9;

DriveTrainResponse driveTrainResponse(const PlantModel& model, double time) {
  DriveTrainResponse response{Eigen::Matrix2d::Zero(), {1.0, 0.0}};
  if (model.lag < kShortestLag) return response;  // w = r, which leaves z at rest
  Eigen::Matrix3d augmented = Eigen::Matrix3d::Zero();
  augmented.row(0) << -1.0 / model.lag, 1.0 / model.lag, 1.0 / model.lag;
  augmented.row(1) << -model.velocity_loop_integral, 0.0, model.velocity_loop_integral;
  const Eigen::Matrix3d exponential = (time * augmented).exp();
  response.transition = exponential.topLeftCorner<2, 2>();
  if (model.velocity_loop_integral <= 0.0) response.transition.col(1).setZero();  // no z; a constant one is no mode
  response.input = exponential.topRightCorner<2, 1>();
  return response;
}

CommandsUnderWay::CommandsUnderWay(double dead_time, double longest)
    : delay_(stepsOf(std::min(dead_time, longest))), commands_(stepsOf(longest) + 1) {}

void CommandsUnderWay::setDeadTime(double dead_time) {
  const std::size_t delay = std::min(stepsOf(dead_time), commands_.size() - 1);
  const auto begin = commands_.begin(), end = begin + static_cast<std::ptrdiff_t>(delay_ + 1);
  std::rotate(begin, begin + static_cast<std::ptrdiff_t>(head_), end);  // the oldest first
  if (delay < delay_) {
    std::copy(end - static_cast<std::ptrdiff_t>(delay + 1), end, begin);
  } else {
    const auto later = static_cast<std::ptrdiff_t>(delay - delay_);
    std::copy_backward(begin, end, end + later);
    std::fill(begin, begin + later, *begin);
  }
  delay_ = delay;
  head_ = 0;
}

DriveTrain::DriveTrain(const PlantModel& model, double wheel_radius)
    : gain_(model.gain), limit_(model.acceleration_limit / wheel_radius) {
  const double response = paceOf(model.lag, limit_, kStep).response;
  const double k = model.velocity_loop_integral * kStep;
  // w ← w + ρ (r + z − w), z ← z + k (r − w − ½ρ (r + z − w)), d ← d
  const Eigen::Vector3d of_r(response, k * (1.0 - 0.5 * response), 0.0);
  transition_ << 1.0 - response, response, of_r(0),                    //
      -k * (1.0 - 0.5 * response), 1.0 - 0.5 * k * response, of_r(1),  //
      0.0, 0.0, 1.0;
  input_ = model.gain * of_r;
}

}  // namespace jackal_aic
