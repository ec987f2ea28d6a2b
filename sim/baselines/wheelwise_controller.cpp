#include "wheelwise_controller.hpp"

#include <cmath>

namespace jackal_aic::sim {

WheelwiseController::WheelwiseController(const GeometryParameters& geometry, const WheelLawMaker& make,
                                         const DeadZone& dead_zone)
    : kinematics_(geometry), dead_zone_(dead_zone), left_(make()), right_(make()) {}

WheelCommand WheelwiseController::action() const {
  return {dead_zone_.command(left_->command()), dead_zone_.command(right_->command())};
}

bool WheelwiseController::setSetPoint(const SetPoint& set_point) {
  if (!set_point.vector().allFinite()) return false;
  set_point_ = set_point;
  return true;
}

SampleVerdict WheelwiseController::observe(const Observation& observation) {
  if (!observation.finite()) return SampleVerdict::not_finite;
  if (started_ && observation.stamp <= observation_.stamp) return SampleVerdict::stale;
  if (!observation.valid.wheel_left || !observation.valid.wheel_right) return SampleVerdict::incomplete;
  const bool first = !started_;
  observation_ = observation;
  observed_ = started_ = true;
  if (!first) return SampleVerdict::accepted;
  restart();
  return SampleVerdict::restarted;
}

void WheelwiseController::updateBelief() {
  if (!started_) return;
  left_->predict();
  right_->predict();
  if (observed_) {
    left_->correct(observation_.wheel_left);
    right_->correct(observation_.wheel_right);
  }
  observed_ = false;
}

WheelCommand WheelwiseController::updateAction() {
  if (!started_) return action();
  const WheelCommand wanted = kinematics_.wheelSpeeds(set_point_.forward, set_point_.yaw_rate);
  left_->act(wanted.left);
  right_->act(wanted.right);
  return action();
}

void WheelwiseController::hold(const WheelCommand& applied) {
  if (applied == action()) return;
  left_->hold(dead_zone_.effective(applied.left));
  right_->hold(dead_zone_.effective(applied.right));
}

void WheelwiseController::overrule(const WheelCommand& applied) {
  left_->overrule(dead_zone_.effective(applied.left));
  right_->overrule(dead_zone_.effective(applied.right));
}

void WheelwiseController::restart() {
  left_->reset(observation_.wheel_left);
  right_->reset(observation_.wheel_right);
  overrule({});
}

void WheelwiseController::reset() {
  observation_ = {};
  observed_ = started_ = false;
  set_point_ = {};
  restart();
}

BodyVector WheelwiseController::believedVelocity() const {
  return kinematics_.bodyVelocity({observation_.wheel_left, observation_.wheel_right});
}

int WheelwiseController::beliefStepsPerAction() const {
  return static_cast<int>(std::lround(WheelLaw::kPeriod / WheelLaw::kStep));
}

}  // namespace jackal_aic::sim
