#include "state_comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

double firstOf(const std::vector<double>& orders) { return orders.empty() ? 0.0 : orders.front(); }

}  // namespace

const ControllerState* StateComparison::find(double time) {
  const auto stamp = [this](std::size_t i) { return recorded_[i].header.stamp.toSec(); };
  // Recorded states that the replay has none of are passed over; not those after a clock that jumped back.
  while (next_ < recorded_.size() && stamp(next_) < time - tolerance_) ++next_;
  if (next_ == recorded_.size()) return nullptr;
  if (stamp(next_) > time + tolerance_) {
    std::size_t back = next_ + 1;
    while (back < recorded_.size() && stamp(back) >= stamp(back - 1)) ++back;
    const bool here = back < recorded_.size() && std::abs(stamp(back) - time) <= tolerance_;
    if (!here) return nullptr;
    next_ = back;
  }
  return &recorded_[next_++];
}

const ControllerState* StateComparison::compare(const ReplayedState& replayed) {
  const ControllerState* recorded = find(replayed.time);
  if (recorded == nullptr) return nullptr;
  ++compared_;
  const WheelCommand command{recorded->command_left, recorded->command_right};
  const WheelCommand action{recorded->action_left, recorded->action_right};
  const double forward = firstOf(recorded->belief_forward), yaw_rate = firstOf(recorded->belief_yaw_rate);
  const bool status = recorded->status == static_cast<std::uint8_t>(replayed.status.decision.status);
  const bool same = status && command == replayed.command && action == replayed.action &&
                    recorded->set_point_forward == replayed.set_point.forward &&
                    recorded->set_point_yaw_rate == replayed.set_point.yaw_rate &&
                    forward == replayed.belief(kForward) && yaw_rate == replayed.belief(kYaw) &&
                    recorded->free_energy == replayed.free_energy;
  if (!same && different_++ == 0) first_difference_ = replayed.time;
  if (!status) ++different_status_;
  const WheelVector difference = (command.vector() - replayed.command.vector()).cwiseAbs();
  largest_command_ = std::max(largest_command_, difference.maxCoeff());
  command_squares_ += 0.5 * difference.squaredNorm();
  largest_forward_ = std::max(largest_forward_, std::abs(forward - replayed.belief(kForward)));
  largest_yaw_rate_ = std::max(largest_yaw_rate_, std::abs(yaw_rate - replayed.belief(kYaw)));
  return recorded;
}

std::string StateComparison::text() const {
  if (recorded_.empty()) return "No recorded states to compare with";
  if (compared_ == 0) return "No recorded state is of a time of the replay";
  if (different_ == 0) return fmt::format("Recorded states: {} compared, all identical", compared_);
  return fmt::format(
      "Recorded states: {} compared, {} differ, the first at {:.3f} s; {} in what is done (driving, braking, ...)\n"
      "Differences: commands {:.3g} rad/s rms, {:.3g} rad/s at most; belief {:.3g} m/s and {:.3g} rad/s at most",
      compared_, different_, first_difference_, different_status_, std::sqrt(command_squares_ / compared_),
      largest_command_, largest_forward_, largest_yaw_rate_);
}

}  // namespace jackal_aic
