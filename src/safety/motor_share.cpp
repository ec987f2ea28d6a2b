#include "jackal_aic/safety/motor_share.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

/// Tolerance of an applied command of ours [rad/s]: rounding, and the kinematics of the other controller.
constexpr double kLeastTolerance = 0.3;

}  // namespace

void MotorShare::send(double time, const WheelCommand& command) {
  head_ = (head_ + 1) % sent_.size();
  sent_[head_] = {time, command.vector()};
  count_ = std::min(count_ + 1, sent_.size());
}

double MotorShare::distance(double time, const WheelVector& tolerance) const {
  const WheelVector applied = applied_.vector();
  if (count_ == 0) return applied.lpNorm<Eigen::Infinity>();
  WheelVector low = sent_[head_].command, high = low;
  for (std::size_t i = 1; i < count_; ++i) {
    const Sent& sent = sent_[(head_ + sent_.size() - i) % sent_.size()];
    low = low.cwiseMin(sent.command);
    high = high.cwiseMax(sent.command);
    if (time - sent.time > thresholds::kPatience) break;  // it was in force at the start of that time
  }
  const WheelVector outside = (low - applied).cwiseMax(applied - high) - tolerance;
  return std::max(0.0, outside.maxCoeff());
}

bool MotorShare::follows(const WheelVector& before, const WheelVector& tolerance) const {
  // The commands of another source may lie among our offers, which surround them. Ours move with our offers, or equal
  // the last one.
  const WheelVector now = applied_.vector(), last = sent_[head_].command;
  const bool moved = ((now - before).cwiseAbs() - tolerance).maxCoeff() > 0.0;
  const bool same = ((now - last).cwiseAbs() - tolerance).maxCoeff() <= 0.0;
  return moved || same;
}

void MotorShare::apply(double time, const WheelCommand& command, AppliedSource source) {
  const bool reported = any_drive_ || any_twist_;
  any_drive_ = any_drive_ || source == AppliedSource::drive;
  any_twist_ = any_twist_ || (source == AppliedSource::twist && !any_drive_);
  if (source == AppliedSource::twist && any_drive_) return;
  if (source == AppliedSource::wheels && reported) return;
  apply(time, command, source == AppliedSource::wheels ? kWheelTolerance : kTolerance);
}

std::optional<WheelCommand> MotorShare::applied(double time) {
  if (any_twist_ && !any_drive_ && !known(time)) apply(time, {}, kTolerance);
  return known(time) ? std::optional(applied_) : std::nullopt;
}

std::optional<WheelCommand> MotorShare::another(double time) {
  const std::optional<WheelCommand> command = applied(time);
  return ours_ ? std::nullopt : command;
}

void MotorShare::apply(double time, const WheelCommand& command, double tolerance) {
  const WheelVector before = applied_.vector();
  const WheelVector allowance = (kLeastTolerance + tolerance * command.vector().array().abs()).matrix();
  applied_ = command;
  applied_time_ = time;
  any_ = true;
  const double far = distance(time, allowance);
  if (far == 0.0 && (ours_ || follows(before, allowance))) {
    ours_ = true;
    mark_ = HUGE_VAL;
    mark_time_ = time;
  } else if (ours_) {
    if (far <= mark_ - thresholds::kRest) {
      mark_ = far;
      mark_time_ = time;
    }
    ours_ = time - mark_time_ <= thresholds::kPatience;
  }
}

WheelCommand MotorShare::offer(const WheelCommand& goal) const {
  const WheelVector step = (goal.vector() - applied_.vector()).cwiseMax(-kOffer).cwiseMin(kOffer);
  return WheelCommand::from(applied_.vector() + step);
}

}  // namespace jackal_aic
