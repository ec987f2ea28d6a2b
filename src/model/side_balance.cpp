#include "jackal_aic/model/side_balance.hpp"

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/robot_range.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

constexpr double kSideDifference = 0.07;  // largest `apart`: gains of the sides that differ by a factor of 1.15
constexpr double kSideSpeed = 0.1;        // rad/s, additional difference: offsets of the motors, steps of the encoders

/// Difference of the sides, relative to their mean; 0 if they have no common direction.
double apartOf(const WheelVector& share) { return share.sum() > 0.0 ? (share(1) - share(0)) / share.sum() : 0.0; }

}  // namespace

SideBalance::SideBalance(const GeometryParameters& geometry, bool gyro_measures)
    : slope_(SkidSteerKinematics(geometry).yawPerDifference()),
      range_(kTurnSlack * geometry.track_range),
      gyro_measures_(gyro_measures) {}

void SideBalance::reset() {
  stamp_ = yaw_rate_ = 0.0;
  speeds_.setZero();
  contradicted_ = false;
}

void SideBalance::observe(const Observation& y, const ChannelValidity& measured) {
  const double step = std::clamp(y.stamp - stamp_, 0.0, thresholds::kGap);
  stamp_ = y.stamp;
  average(speeds_(0), y.wheel_left, step, thresholds::kMotionMemory);
  average(speeds_(1), y.wheel_right, step, thresholds::kMotionMemory);
  average(yaw_rate_, y.yaw_rate, step, thresholds::kMotionMemory);
  const double n = speeds_(1) - speeds_(0), e = kVeer * std::abs(speeds_.mean()) + kSideSpeed;
  const auto turn = [this](double difference, double factor) {
    return slope_ * difference * (difference > 0.0 ? factor : 1.0 / factor);
  };
  const bool agrees = yaw_rate_ >= turn(n - e, 1.0 / range_) && yaw_rate_ <= turn(n + e, range_);
  contradicted_ = gyro_measures_ && measured.wheel_left && measured.wheel_right && measured.yaw_rate && !agrees;
}

WheelVector SideBalance::bound(const WheelVector& before, const WheelVector& commands, const WheelVector& goal) const {
  const double least = goal.cwiseAbs().minCoeff();
  if (least <= kSpeedRange) return commands;
  const WheelVector share = commands.cwiseQuotient(goal);
  if (share.sum() <= 0.0) return commands;
  const double apart = apartOf(share), apart_before = apartOf(before.cwiseQuotient(goal));
  const double most = contradicted_ ? 0.0 : kSideDifference + kSideSpeed / least;
  const double within = std::clamp(apart, std::min(-most, apart_before), std::max(most, apart_before));
  if (within == apart) return commands;
  return 0.5 * share.sum() * WheelVector(1.0 - within, 1.0 + within).cwiseProduct(goal);
}

}  // namespace jackal_aic
