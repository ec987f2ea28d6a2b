#include "jackal_aic/faults/turn_witness.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/square.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

/// The speed of a wheel by its commands, on its way as far as the other one is; as measured, if it is no other.
double commanded(const CommandedWheel& wheel, const CommandedWheel& other) {
  const bool tells = std::abs(other.nominal) > TurnWitness::kMoving;
  const double speed = wheel.reachable.nearest(tells ? wheel.nominal * other.measured / other.nominal : wheel.measured);
  const double alike = TurnWitness::kAlike * std::abs(speed) + TurnWitness::kAlikeSpeed;
  return std::abs(speed - wheel.measured) > alike ? speed : wheel.measured;
}

}  // namespace

double TurnWitness::error(double yaw_rate, double left, double right) const {
  const double turn = slope_ * (right - left);
  const double beside = kVeer * slope_ * std::abs(0.5 * (left + right)) + late_;
  const Range possible{std::min(turn * range_, turn / range_) - beside,
                       std::max(turn * range_, turn / range_) + beside};
  return possible.outside(yaw_rate);
}

void TurnWitness::watchTurn(double asked, double hold, double step) {
  late_ = keptAfter(step, thresholds::kFollowing + hold) * late_ + std::abs(asked - std::exchange(asked_, asked));
}

bool TurnWitness::slides(const WheelVector& measured, double hold, double step) {
  const WheelVector change = measured - std::exchange(measured_, measured);
  const double both = change(0) * change(1) > 0.0 ? change.cwiseAbs().minCoeff() : 0.0;
  const bool beyond = radius_ * both > thresholds::kGrip * std::max(step, hold);
  sliding_ = beyond ? thresholds::kFollowing + hold : std::max(0.0, sliding_ - step);
  return sliding_ > 0.0;
}

void TurnWitness::update(double yaw_rate, const CommandedWheel& left, const CommandedWheel& right, double hold,
                         double step) {
  watchTurn(slope_ * (right.nominal - left.nominal), hold, step);
  if (slides({left.measured, right.measured}, hold, step)) return;
  const double l = commanded(left, right), r = commanded(right, left);
  const std::array<double, kHypotheses> errors{error(yaw_rate, left.measured, right.measured),
                                               error(yaw_rate, l, right.measured), error(yaw_rate, left.measured, r)};
  for (std::size_t i = 0; i < errors.size(); ++i)
    average(evidence_[i], square(limited(errors[i], 2.0 * kLeastError)), step, thresholds::kFollowing);
  const double samples = step / std::max(step, hold);
  const bool off = contradiction() && errors[kAsMeasured] != 0.0;
  left_ = off && explains(kLeft) && !explains(kRight) ? left_ + samples : 0.0;
  right_ = off && explains(kRight) && !explains(kLeft) ? right_ + samples : 0.0;
}

}  // namespace jackal_aic
