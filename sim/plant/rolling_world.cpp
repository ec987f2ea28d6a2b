#include "rolling_world.hpp"

#include "jackal_aic/model/gravity.hpp"
#include "jackal_plant.hpp"

namespace jackal_aic::sim {

RollingWorld::RollingWorld(const RobotModel& model, double effective_track, bool fixed_chassis)
    : gravity_(0.0, 0.0, -kGravity),
      centre_(model.chassis.centre),
      effective_track_(effective_track),
      fixed_chassis_(fixed_chassis),
      base_(Eigen::Vector3d::Zero()) {
  for (std::size_t i = 0; i < radius_.size(); ++i) {
    radius_[i] = model.wheels[i].radius;
    base_.z() += 0.25 * (radius_[i] - model.wheels[i].hub.z());
  }
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  chassis_ = {base_ + centre_, Eigen::Quaterniond::Identity(), zero, zero, zero, zero};
}

void RollingWorld::step(double step) {
  speed_ = reference_;
  if (fixed_chassis_) return;
  const auto rolled = [this](Wheel front, Wheel rear) {
    return 0.5 * (radius_[front] * speed_[front] + radius_[rear] * speed_[rear]);
  };
  const double left = rolled(kFrontLeft, kRearLeft), right = rolled(kFrontRight, kRearRight);
  const Eigen::Vector3d angular_velocity(0.0, 0.0, (right - left) / effective_track_);
  heading_ += step * angular_velocity.z();
  const Eigen::Quaterniond orientation(Eigen::AngleAxisd(heading_, Eigen::Vector3d::UnitZ()));
  const Eigen::Vector3d base_velocity = orientation * Eigen::Vector3d(0.5 * (left + right), 0.0, 0.0);
  base_ += step * base_velocity;
  const Eigen::Vector3d arm = orientation * centre_;
  const Eigen::Vector3d velocity = base_velocity + angular_velocity.cross(arm);
  chassis_ = {base_ + arm,
              orientation,
              velocity,
              angular_velocity,
              (velocity - chassis_.velocity) / step,
              (angular_velocity - chassis_.angular_velocity) / step};
}

}  // namespace jackal_aic::sim
