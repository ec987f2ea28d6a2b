#pragma once

/// @file
/// What can go wrong with a sensor or with the messages of a topic: in the fault campaign (faulty_channel.hpp) as in
/// experiments without ROS (sensor_faults.hpp).

#include <algorithm>
#include <array>
#include <limits>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic::sim {

/// Kind of a fault. The meaning of InjectedFault::amount is in brackets, its unit that of the channel.
enum class FaultKind {
  drop,            ///< the message is lost
  delay,           ///< it comes later [s]
  duplicate,       ///< it comes more than once [additional copies]
  reorder,         ///< every second one comes later than its successor [delay in s, longer than a period]
  burst,           ///< messages are held back and come together [period of the bursts in s]
  freeze,          ///< the values stay those of the last good message; the stamp is fresh
  stale,           ///< the last good message comes again and again, old stamp and all
  stamp_zero,      ///< the stamp is zero
  stamp_shift,     ///< the stamp is shifted [s; positive is the future]
  stamp_repeated,  ///< every stamp is that of the first message
  stamp_reversed,  ///< the stamps run backwards from the first message
  not_a_number,    ///< the value is NaN
  infinite,        ///< the value is infinite
  set,             ///< the value is a constant [value]
  huge,            ///< the value is 1e300
  bias,            ///< something is added [value]
  scale,           ///< the value is multiplied [factor; -1 flips the sign]
  upside_down,     ///< IMU: the sensor is turned over about its x axis
  wrong_names,     ///< joint states: the joints have other names
  one_side,        ///< joint states: the joints of the right side are missing
  no_values,       ///< joint states: names without velocities
  driver_fault,    ///< feedback: the motor drivers report a fault
  mode_none,       ///< feedback: the drivers are in MODE_NONE
  external_stop    ///< status: the stop button is pressed
};

/// Words of FaultKind, in the order of the enumerators.
inline constexpr std::array<const char*, 24> kFaultKindNames{
    "drop",        "delay",      "duplicate",   "reorder",        "burst",          "freeze",
    "stale",       "stamp_zero", "stamp_shift", "stamp_repeated", "stamp_reversed", "not_a_number",
    "infinite",    "set",        "huge",        "bias",           "scale",          "upside_down",
    "wrong_names", "one_side",   "no_values",   "driver_fault",   "mode_none",      "external_stop"};

/// Which values of a message a fault touches.
enum class FaultChannel {
  all,           ///< every value
  left,          ///< of the left wheels
  right,         ///< of the right wheels
  gyro,          ///< yaw rate of the IMU
  acceleration,  ///< of the IMU
  forward,       ///< of a set point
  yaw_rate       ///< of a set point
};

/// Words of FaultChannel, in the order of the enumerators.
inline constexpr std::array<const char*, 7> kFaultChannelNames{"all",          "left",    "right",   "gyro",
                                                               "acceleration", "forward", "yaw_rate"};

/// A fault of one sensor or of the messages of one topic, for a time.
struct InjectedFault {
  FaultKind kind = FaultKind::drop;          ///< what happens
  FaultChannel channel = FaultChannel::all;  ///< to which values, where the kind concerns values
  double amount = 0.0;                       ///< how much; meaning and unit depend on the kind
  double share = 1.0;                        ///< probability with which a message is hit
  double start = 0.0;                        ///< after the onset of the faults, which is 0 without a scenario [s]
  double duration = 1.6;                     ///< [s]

  /// True at a time since the onset [s].
  bool activeAt(double time) const { return time >= start && time < start + duration; }
};

/// What a fault of a value makes of it; 1e300 is limited to `largest`. Kinds that concern no single value leave it as
/// it is.
inline double faultyValue(FaultKind kind, double amount, double value,
                          double largest = std::numeric_limits<double>::max()) {
  switch (kind) {
    case FaultKind::not_a_number:
      return std::numeric_limits<double>::quiet_NaN();
    case FaultKind::infinite:
      return std::numeric_limits<double>::infinity();
    case FaultKind::set:
      return amount;
    case FaultKind::huge:
      return std::min(1e300, largest);
    case FaultKind::bias:
      return value + amount;
    case FaultKind::scale:
      return value * amount;
    default:
      return value;
  }
}

/// Lists the fields of InjectedFault with unit and range.
template <class Visitor>
void describeFields(Visitor& v, InjectedFault& p) {
  v.field("kind", p.kind, kFaultKindNames, Presence::required);
  v.field("channel", p.channel, kFaultChannelNames, Presence::optional);
  v.field("amount", p.amount, {-1000.0, 1000.0}, "", Presence::optional);
  v.field("share", p.share, {0.0, 1.0}, "", Presence::optional);
  v.field("start", p.start, {0.0, 3600.0}, "s", Presence::optional);
  v.field("duration", p.duration, {0.0, 3600.0}, "s", Presence::optional);
}

}  // namespace jackal_aic::sim
