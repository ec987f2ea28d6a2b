#include "jackal_aic/predictive/drive_train_reference.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kPathTolerance = 0.01;  // of the largest change of an input
constexpr int kHalvings = 12;            // of an interval of inputs
constexpr int kLongestReturn = 50;       // periods

}  // namespace

DriveTrainReference::DriveTrainReference(const PlantModel& model, double wheel_radius, double reference_time,
                                         double step)
    : drive_train_(model, wheel_radius),
      steps_(static_cast<int>(std::lround(step / DriveTrain::kStep))),
      step_(step),
      largest_change_(step * drive_train_.limit()),
      lead_(model.lag * drive_train_.limit()) {
  setReferenceTime(reference_time);
  const DriveTrainResponse response = driveTrainResponse(model, step);
  transition_ = response.transition;
  input_ = response.input;
}

double DriveTrainReference::input(double wanted) const {
  const double change = std::clamp(pull_ * (wanted - state_(0)), -largest_change_, largest_change_);
  const double r = (state_(0) + change - transition_.row(0).dot(state_)) / input_(0);
  return afterPeriod(r).limited ? inputAtLimit(change, r) : r;
}

double DriveTrainReference::inputAtLimit(double change, double r) const {
  // The motor accelerates as fast as it can all period long with r + z − w >= limit lag at its end.
  const double direction = std::copysign(1.0, change);
  double high = state_(0) + direction * (largest_change_ + lead_) - state_(1);
  if (direction * (high - r) <= 0.0) return r;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (r + high);
    (direction * (afterPeriod(middle).state(0) - state_(0) - change) < 0.0 ? r : high) = middle;
  }
  return high;
}

DriveTrainReference::Period DriveTrainReference::afterPeriod(double r) const {
  Eigen::Vector3d x(state_(0), state_(1), 0.0);
  bool limited = false;
  for (int i = 0; i < steps_; ++i) limited |= drive_train_.step(x, r / drive_train_.gain()).limited;
  if (limited) return {x.head<2>(), true};
  return {transition_ * state_ + input_ * r, false};
}

void DriveTrainReference::take(double r) {
  before_ = state_;
  r_ = r;
  state_ = afterPeriod(r).state;
}

double DriveTrainReference::advance(double wanted) {
  take(input(wanted));
  return r_;
}

DriveTrainReference DriveTrainReference::minus(const DriveTrainReference& other) const {
  DriveTrainReference difference = *this;
  difference.state_ -= other.state_;
  difference.before_ -= other.before_;
  difference.r_ -= other.r_;
  return difference;
}

double DriveTrainReference::inTime(double wanted, double r, double largest_change) const {
  double high = std::clamp(r, r_ - largest_change, r_ + largest_change);
  if (endsInTime(wanted, high, largest_change)) return r;
  double low = r_ - std::copysign(largest_change, wanted - state_(0));
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (endsInTime(wanted, middle, largest_change) ? low : high) = middle;
  }
  return low;
}

bool DriveTrainReference::endsInTime(double wanted, double r, double largest_change) const {
  const double direction = std::copysign(1.0, wanted - state_(0));
  Eigen::Vector2d state = transition_ * state_ + input_ * r;
  for (int k = 0; k < kLongestReturn; ++k) {
    const double lead = direction * (r + state(1) - wanted);
    if (lead <= 0.0) return true;
    if (direction * (state(0) - wanted) > kPathTolerance * largest_change) return false;
    r -= direction * std::min(lead, largest_change);
    state = transition_ * state + input_ * r;
  }
  return true;
}

void DriveTrainReference::amend(double more) {
  state_ = before_;
  take(r_ + more);
}

void DriveTrainReference::reset(double speed) {
  state_ << speed, 0.0;
  before_ = state_;
  r_ = speed;
}

}  // namespace jackal_aic
