#include "jackal_aic/model/drive_train_belief.hpp"

#include <cmath>

namespace jackal_aic {

DriveTrainBelief::DriveTrainBelief(const PlantModel& model, double wheel_radius,
                                   const DriveTrainBeliefParameters& parameters)
    : drive_train_(model, wheel_radius),
      parameters_(parameters),
      lagging_(parameters.dead_time_deviation > 0.0 ? -std::expm1(-kStep / parameters.dead_time_deviation) : 1.0) {
  Growth growth{drive_train_.transition(), Eigen::Matrix3d::Zero()};
  growth.Q(0, 0) = parameters.speed_process_noise * kStep;
  growth.Q(2, 2) = parameters.disturbance_process_noise * kStep;
  for (Growth& power : growth_) {
    power = growth;
    // J² P J²' + J Q J' + Q
    propagate(power.J, growth.Q);
    growth.Q += power.Q;
    growth.J = power.J * power.J;
  }
  reset(0.0);
}

void DriveTrainBelief::reset(double speed) {
  x_ << speed, 0.0, 0.0;
  P_.setZero();
  P_(0, 0) = parameters_.measurement_variance;
  P_(2, 2) = parameters_.disturbance_deviation * parameters_.disturbance_deviation;
  lagged_ = speed;
}

void DriveTrainBelief::predict(const PerStep& acting, std::size_t steps, PerStep& speeds, PerStep& rates) {
  const DriveTrain drive_train = drive_train_;
  Eigen::Vector3d x = x_;
  double lagged = lagged_;
  bool was_limited = false;
  std::size_t equal_steps = 0;  // steps whose covariance is still to grow
  for (std::size_t i = 0; i < steps; ++i) {
    const auto [change, limited] = drive_train.step(x, acting[i]);
    if (limited != was_limited) grow(std::exchange(equal_steps, 0), std::exchange(was_limited, limited));
    ++equal_steps;
    // w(t) − w(t − σ_t) of a first-order filter
    lagged += lagging_ * (x(0) - lagged);
    speeds[i] = x(0);
    rates[i] = change / kStep;
  }
  grow(equal_steps, was_limited);
  x_ = x;
  lagged_ = lagged;
}

/// At the limit the speed does not depend on z and d: J = I.
void DriveTrainBelief::grow(std::size_t steps, bool limited) {
  if (limited) {
    P_ += static_cast<double>(steps) * growth_[0].Q;
    return;
  }
  for (std::size_t i = 0; steps >> i != 0; ++i) {
    if ((steps >> i & 1) == 0) continue;
    propagate(growth_[i].J, P_);
    P_ += growth_[i].Q;
  }
}

void DriveTrainBelief::correct(double measurement, double added_variance) {
  const double late = x_(0) - lagged_;
  const Eigen::Vector3d PC = P_.col(0);
  const Eigen::Vector3d K = PC / (PC(0) + late * late + (parameters_.measurement_variance + added_variance));
  const Eigen::Vector3d change = (measurement - x_(0)) * K;
  x_ += change;
  lagged_ += change(0);  // a correction is not a motion
  correctCovariance(K, PC, P_);
}

}  // namespace jackal_aic
