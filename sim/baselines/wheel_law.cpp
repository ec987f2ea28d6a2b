#include "wheel_law.hpp"

#include <utility>

namespace jackal_aic::sim {

PathFollower::PathFollower(const PlantModel& model, double wheel_radius, double reference_time,
                           std::unique_ptr<Regulator> regulator)
    : gain_(model.gain),
      path_(model, wheel_radius, reference_time, kPeriod),
      expected_(model, wheel_radius),
      regulator_(std::move(regulator)) {}

void PathFollower::reset(double speed) {
  path_.reset(speed);
  expected_.reset(speed);
  regulator_->reset();
  forward_ = speed / gain_;
  feedback_ = 0.0;
}

void PathFollower::predict() {
  expected_.predict(forward_);
  regulator_->predict(feedback_);
}

double PathFollower::act(double wanted) {
  // u = w*/g + v
  forward_ = path_.advance(wanted) / gain_;
  feedback_ = regulator_->act();
  return command();
}

void PathFollower::hold(double applied) {
  path_.amend(gain_ * (applied - command()));
  forward_ = applied - feedback_;
}

void PathFollower::overrule(double applied) {
  path_.follow(gain_ * (applied - feedback_));
  forward_ = applied - feedback_;
}

}  // namespace jackal_aic::sim
