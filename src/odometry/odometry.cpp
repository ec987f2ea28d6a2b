#include "jackal_aic/odometry/odometry.hpp"

#include "jackal_aic/model/square.hpp"

namespace jackal_aic {
namespace {

constexpr double kRounding = 1e-9;  // s
constexpr double kLongest = 1.0;  // s; of a longer time, a stall or a clock that jumps, nobody knows what the robot did

}  // namespace

Odometry::Odometry(const PredictiveController& belief, const GeometryParameters& geometry, const PlantModel& model)
    : belief_(&belief), wheel_radius_(model.on_box ? 0.0 : geometry.wheel_radius) {}

Odometry::Odometry(const PredictiveParameters& parameters, const GeometryParameters& geometry, const PlantModel& model)
    : own_(std::make_unique<PredictiveController>(parameters, geometry, model)),
      belief_(own_.get()),
      wheel_radius_(model.on_box ? 0.0 : geometry.wheel_radius) {}

void Odometry::observe(const Observation& observation) {
  if (own_) own_->observe(observation);
}

void Odometry::advance(const WheelCommand& applied, double duration) {
  if (!(duration <= kLongest)) return forgetMotion();
  if (own_) {
    own_->overrule(applied);
    for (left_over_ += duration; left_over_ + kRounding >= own_->beliefStep(); left_over_ -= own_->beliefStep()) {
      own_->updateBelief();
    }
  }
  slip_.predict(wheel_radius_ * belief_->left().acceleration(), wheel_radius_ * belief_->right().acceleration(),
                duration);
  const PlanarMotion now = motion();
  reckoning_.advance({0.5 * (last_.forward + now.forward), 0.5 * (last_.yaw_rate + now.yaw_rate), now.covariance},
                     duration);
  last_ = now;
}

PlanarMotion Odometry::motion() const {
  const BodyVector velocity = belief_->believedVelocity();
  PlanarMotion motion{velocity(kForward), velocity(kYaw), belief_->velocityCovariance()};
  if (wheel_radius_ == 0.0) return motion;
  // + ½ (s_L² + s_R²) + c² θ̇²
  motion.covariance(0, 0) += slip_.variance() + square(kCentreDeviation * motion.yaw_rate);
  return motion;
}

void Odometry::forgetMotion() {
  if (own_) own_->forgetMotion();
  left_over_ = 0.0;
  slip_.reset();
  last_ = {};
}

}  // namespace jackal_aic
