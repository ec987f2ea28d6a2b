#pragma once

/// @file
/// Checks the requirements of the controller (doc/reference/requirements.yaml) by the topics alone. It shares no code
/// with the drive loop, and stops nothing: it accuses.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "jackal_aic/model/geometry.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/safety/gate_parameters.hpp"

namespace jackal_aic {

/// Requirements that a command can break, in the order of kMonitored.
enum class Breach {
  speed,
  acceleration,
  not_finite,
  no_set_point,
  old_set_point,
  no_standstill,
  no_wheels,
  stop_ignored
};

/// What the monitor says of a breach.
struct MonitoredRequirement {
  const char* id;    ///< in requirements.yaml
  const char* text;  ///< what was wrong with a command
};

/// By Breach.
inline constexpr std::array<MonitoredRequirement, 8> kMonitored{
    {{"LIM-1", "beyond the limits of speed"},
     {"LIM-3", "changes faster than the limits of acceleration"},
     {"LIM-5", "not a finite number"},
     {"DEM-1", "not zero, and there was never a set point"},
     {"DEM-2", "not zero, although the last set point is older than its deadline and the brake's time"},
     {"DEM-6", "not zero, although the robot has been told to stand for long"},
     {"SEN-1", "not zero, although the wheel speeds have been away for their deadline and the brake's time"},
     {"STO-1", "not zero, although the emergency stop has been engaged for the brake's time"}}};

/// Parameters of the monitor in addition to those of the drive gate. YAML keys without a prefix.
struct CommandMonitorParameters {
  double action_period = 0.02;  ///< of the commands, the longest of all: what is not told of their times [s]
  double standstill = 5.0;      ///< time with a zero set point after which the command has to be zero [s]
};

/// Lists the fields of CommandMonitorParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, CommandMonitorParameters& p) {
  v.field("action_period", p.action_period, {0.001, 1.0}, "s", Presence::optional);
  v.field("standstill", p.standstill, {0.1, 60.0}, "s", Presence::optional);
}

/// Judges each command by what has come before. Times [s] are those of arrival, on one clock.
class CommandMonitor {
 public:
  /// @param gate limits, deadlines and brake that the controller has; @param geometry r, alpha and b_hat that it starts
  /// from; @param longest_blind time that it may drive without wheel speeds beyond their deadline [s].
  CommandMonitor(const CommandMonitorParameters& parameters, const GateParameters& gate,
                 const GeometryParameters& geometry, double longest_blind = 0.0);

  /// A set point was sent. One that is not finite is no set point.
  void takeSetPoint(double forward, double yaw_rate, double now);

  /// Wheel speeds were sent.
  void takeWheels(double now) { wheels_ = now; }

  /// The emergency stop was engaged or released.
  void takeEmergencyStop(bool engaged, double now);

  /// A command came. @return what is wrong with it, the first of kMonitored; std::nullopt if nothing is.
  std::optional<Breach> takeCommand(const WheelCommand& command, double now);

  /// Commands that broke a requirement so far.
  std::uint32_t count(Breach breach) const { return counts_[static_cast<std::size_t>(breach)]; }

  /// Commands so far.
  std::uint64_t commands() const { return commands_; }

 private:
  std::optional<Breach> judge(const WheelCommand& command, double now) const;
  bool tooFast(const WheelCommand& command) const;
  bool tooSudden(const WheelCommand& command, double now) const;
  bool overdue(double since, double deadline, double now) const;
  bool blind(double now) const;
  BodyVector motion(const WheelCommand& command) const;

  CommandMonitorParameters parameters_;
  GateParameters gate_;
  GeometryParameters geometry_;
  double longest_blind_;              // s
  std::optional<double> set_point_;   // time of the last [s]
  std::optional<double> zero_since_;  // set points have been zero since [s]
  std::optional<double> wheels_;      // time of the last [s]
  std::optional<double> stop_since_;  // engaged since [s]
  std::optional<WheelCommand> last_;  // command
  double last_time_ = 0.0;            // of it [s]
  std::uint64_t commands_ = 0;
  std::array<std::uint32_t, kMonitored.size()> counts_{};
};

}  // namespace jackal_aic
