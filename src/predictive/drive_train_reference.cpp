#include "jackal_aic/predictive/drive_train_reference.hpp"

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/drive_train.hpp"

namespace jackal_aic {
namespace {

constexpr double kPathTolerance = 0.01;  // of the largest change of an input
constexpr int kLongestReturn = 50;       // periods

}  // namespace

DriveTrainReference::DriveTrainReference(const PlantModel& model, double wheel_radius, double reference_time,
                                         double step)
    : step_(step), wheel_radius_(wheel_radius) {
  setReferenceTime(reference_time);
  setDriveTrain(model);
}

void DriveTrainReference::setDriveTrain(const PlantModel& model) {
  largest_change_ = step_ * model.acceleration_limit / wheel_radius_;
  const DriveTrainResponse response = driveTrainResponse(model, step_);
  transition_ = response.transition;
  input_ = response.input;
}

double DriveTrainReference::input(double wanted) const {
  const double change = std::clamp(pull_ * (wanted - state_(0)), -largest_change_, largest_change_);
  return (state_(0) + change - transition_.row(0).dot(state_)) / input_(0);
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
  for (int halving = 0; halving < 12; ++halving) {
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

void DriveTrainReference::follow(double r) {
  before_ = state_;
  r_ = r;
  // Beyond the acceleration limit only the part of the input within the limit acts. It is continuous there, so that two
  // nearly equal wheels on either side of the limit stay together.
  const double without = transition_.row(0).dot(before_) - before_(0);
  const double lowest = (-largest_change_ - without) / input_(0), highest = (largest_change_ - without) / input_(0);
  state_ = transition_ * before_ + input_ * std::clamp(r_, lowest, highest);
}

void DriveTrainReference::amend(double more) {
  state_ = before_;
  follow(r_ + more);
}

void DriveTrainReference::reset(double speed) {
  state_ << speed, 0.0;
  before_ = state_;
  r_ = speed;
}

}  // namespace jackal_aic
