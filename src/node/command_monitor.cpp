#include "command_monitor.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kRounding = 1e-3;  // relative: cmd_drive carries float32

}  // namespace

CommandMonitor::CommandMonitor(const CommandMonitorParameters& parameters, const GateParameters& gate,
                               const GeometryParameters& geometry, double longest_blind)
    : parameters_(parameters), gate_(gate), geometry_(geometry), longest_blind_(longest_blind) {}

void CommandMonitor::takeSetPoint(double forward, double yaw_rate, double now) {
  if (!std::isfinite(forward) || !std::isfinite(yaw_rate)) return;
  set_point_ = now;
  if (forward != 0.0 || yaw_rate != 0.0) {
    zero_since_.reset();
  } else if (!zero_since_) {
    zero_since_ = now;
  }
}

void CommandMonitor::takeEmergencyStop(bool engaged, double now) {
  if (!engaged) {
    stop_since_.reset();
  } else if (!stop_since_) {
    stop_since_ = now;
  }
}

std::optional<Breach> CommandMonitor::takeCommand(const WheelCommand& command, double now) {
  ++commands_;
  const std::optional<Breach> breach = judge(command, now);
  if (breach) ++counts_[static_cast<std::size_t>(*breach)];
  last_ = command;
  last_time_ = now;
  return breach;
}

std::optional<Breach> CommandMonitor::judge(const WheelCommand& command, double now) const {
  if (!std::isfinite(command.left) || !std::isfinite(command.right)) return Breach::not_finite;
  if (tooFast(command)) return Breach::speed;
  if (tooSudden(command, now)) return Breach::acceleration;
  if (command.left == 0.0 && command.right == 0.0) return std::nullopt;
  if (!set_point_) return Breach::no_set_point;
  if (overdue(*set_point_, gate_.deadlines.set_point, now)) return Breach::old_set_point;
  if (zero_since_ && now > *zero_since_ + parameters_.standstill) return Breach::no_standstill;
  if (blind(now)) return Breach::no_wheels;
  if (stop_since_ && now > *stop_since_ + gate_.brake.time + 2.0 * parameters_.action_period) {
    return Breach::stop_ignored;
  }
  return std::nullopt;
}

bool CommandMonitor::overdue(double since, double deadline, double now) const {
  return deadline > 0.0 && now > since + deadline + gate_.brake.time + 2.0 * parameters_.action_period;
}

bool CommandMonitor::blind(double now) const {
  if (std::isinf(longest_blind_)) return false;
  return !wheels_ || overdue(*wheels_ + longest_blind_, gate_.deadlines.wheels, now);
}

BodyVector CommandMonitor::motion(const WheelCommand& command) const {
  // x_dot = r alpha (omega_L + omega_R) / 2, theta_dot = r alpha (omega_R - omega_L) / b_hat (3-1)
  const double rolling = geometry_.wheel_radius * geometry_.slip_factor;
  return {0.5 * rolling * (command.left + command.right), 0.0,
          rolling * (command.right - command.left) / geometry_.effective_track};
}

bool CommandMonitor::tooFast(const WheelCommand& command) const {
  const LimitParameters& limits = gate_.limits;
  const BodyVector v = motion(command);
  const auto beyond = [](double value, double limit) { return std::abs(value) > limit * (1.0 + kRounding); };
  return beyond(v(kForward), limits.linear_speed) || beyond(v(kYaw), limits.angular_speed) ||
         beyond(command.left, limits.wheel_speed) || beyond(command.right, limits.wheel_speed);
}

// By arrival two commands may be closer together than they were sent, so that a period is the least that counts. A
// brake may be harder than what is driven, and ends within its time from any speed.
bool CommandMonitor::tooSudden(const WheelCommand& command, double now) const {
  if (!last_) return false;
  const LimitParameters& limits = gate_.limits;
  const double time = std::max(now - last_time_, parameters_.action_period) + parameters_.action_period;
  const BodyVector before = motion(*last_), after = motion(command);
  const auto beyond = [&](int axis, double acceleration, double deceleration, double speed, double brake) {
    if (acceleration <= 0.0) return false;  // no bound
    const double largest = std::max({acceleration, deceleration, brake, speed / gate_.brake.time});
    return std::abs(after(axis) - before(axis)) > largest * time * (1.0 + kRounding);
  };
  return beyond(kForward, limits.linear_acceleration, limits.linear_deceleration, limits.linear_speed,
                gate_.brake.linear_deceleration) ||
         beyond(kYaw, limits.angular_acceleration, limits.angular_deceleration, limits.angular_speed,
                gate_.brake.angular_deceleration);
}

}  // namespace jackal_aic
