#include "jackal_aic/safety/stop_cause.hpp"

#include <array>

namespace jackal_aic {
namespace {

struct Entry {
  StopCause cause;
  Severity severity;
  const char* text;
};

constexpr std::array<Entry, kStopCauses> kEntries{{
    {StopCause::none, Severity::stop, ""},
    {StopCause::start, Severity::stop, "set points not zero since the start"},
    {StopCause::unpaired, Severity::stop, "stamps of wheel speeds and IMU data do not pair"},
    {StopCause::moved, Severity::stop, "moved from outside"},
    {StopCause::imu_frozen, Severity::stop, "IMU data frozen"},
    {StopCause::imu_late, Severity::stop, "IMU data too old"},
    {StopCause::imu_missing, Severity::stop, "no IMU data received yet"},
    {StopCause::wheels_frozen, Severity::stop, "wheel speeds frozen"},
    {StopCause::feedback_late, Severity::stop, "feedback of the motors too old"},
    {StopCause::wheels_late, Severity::stop, "wheel speeds too old"},
    {StopCause::wheels_missing, Severity::stop, "no wheel speeds received yet"},
    {StopCause::set_point_late, Severity::stop, "set point too old"},
    {StopCause::set_point_missing, Severity::stop, "no set point received yet"},
    {StopCause::set_points_rival, Severity::stop, "more than one node publishes set points"},
    {StopCause::clock_jump, Severity::emergency, "clock jumped back"},
    {StopCause::graph_unchecked, Severity::stop, "publishers of commands and emergency stop not checked yet"},
    {StopCause::motors_off, Severity::halt, "motors do not take velocity commands"},
    {StopCause::robot_stopped, Severity::halt, "robot reports that it is stopped"},
    {StopCause::emergency_stop, Severity::halt, "emergency stop"},
    {StopCause::disabled, Severity::halt, "disabled"},
    {StopCause::shutdown, Severity::emergency, "controller is to end"},
    {StopCause::contention, Severity::fault, "another node publishes commands"},
    {StopCause::sensor_fault, Severity::fault, "sensors or motors faulty"},
    {StopCause::belief_diverged, Severity::fault, "belief diverged"},
    {StopCause::driver_fault, Severity::fault, "motor driver reports a fault"},
}};

constexpr bool inOrder() {
  for (std::size_t i = 0; i < kEntries.size(); ++i) {
    if (static_cast<std::size_t>(kEntries[i].cause) != i) return false;
  }
  return true;
}
static_assert(inOrder(), "one entry for each cause, in the order of the enumerators");

const Entry& entry(StopCause cause) { return kEntries[static_cast<std::size_t>(cause)]; }

}  // namespace

Severity severity(StopCause cause) { return entry(cause).severity; }

const char* text(StopCause cause) { return entry(cause).text; }

StopCause StopCauses::worst() const {
  for (std::size_t i = set_.size(); i-- > 1;) {
    if (set_.test(i)) return static_cast<StopCause>(i);
  }
  return StopCause::none;
}

}  // namespace jackal_aic
