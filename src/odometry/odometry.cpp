#include "jackal_aic/odometry/odometry.hpp"

#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

constexpr double kLongest = 1.0;  // s; the motion in a stall or clock jump is unknown

}  // namespace

Odometry::Odometry(const PredictiveParameters& parameters, const GeometryParameters& geometry, const PlantModel& model)
    : own_(std::make_unique<PredictiveController>(parameters, geometry, model)), belief_(own_.get()) {}

void Odometry::observe(const Observation& observation) {
  if (own_) own_->observe(observation);
}

void Odometry::advance(const WheelCommand& applied, double duration) {
  if (!(duration >= 0.0 && duration <= kLongest)) return resetMotion();
  if (own_) {
    own_->overrule(applied);
    for (left_over_ += duration; left_over_ + thresholds::kRounding >= own_->beliefStep();
         left_over_ -= own_->beliefStep()) {
      own_->updateBelief();
    }
  }
  const PlanarMotion now = motion();
  pose_.advance({0.5 * (last_.forward + now.forward), 0.5 * (last_.yaw_rate + now.yaw_rate), now.covariance}, duration);
  last_ = now;
}

PlanarMotion Odometry::motion() const {
  const BodyVector velocity = belief_->believedVelocity();
  return {velocity(kForward), velocity(kYaw), belief_->motionCovariance()};
}

void Odometry::resetMotion() {
  if (own_) own_->resetMotion();
  left_over_ = 0.0;
  last_ = {};
}

}  // namespace jackal_aic
