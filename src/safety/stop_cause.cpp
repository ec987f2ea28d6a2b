#include "jackal_aic/safety/stop_cause.hpp"

#include <array>

#include "jackal_aic/faults/fault.hpp"
#include "jackal_aic/model/enum_table.hpp"

namespace jackal_aic {
namespace {

constexpr const char* kWheelDriver = "Check the robot's driver and the encoders (joint_states)";

struct Entry {
  StopCause cause;
  Severity severity;
  const char* text;
  const char* remedy;
};

constexpr std::array<Entry, kStopCauses> kEntries{{
    {StopCause::none, Severity::stop, "", ""},
    {StopCause::start, Severity::stop, "set points not zero since the start",
     "Send a zero set point, or pause, to set off"},
    {StopCause::unpaired, Severity::stop, "stamps of wheel speeds and IMU data do not pair",
     "Synchronise the clocks of the machines (chrony), or check the network"},
    {StopCause::moved, Severity::stop, "moved from outside", "It drives on when it stands still"},
    {StopCause::imu_frozen, Severity::stop, "IMU data frozen", kCheckImu},
    {StopCause::imu_late, Severity::stop, "IMU data too old", kCheckImu},
    {StopCause::imu_missing, Severity::stop, "no IMU data received yet", kCheckImu},
    {StopCause::wheels_frozen, Severity::stop, "wheel speeds frozen", kWheelDriver},
    {StopCause::feedback_late, Severity::stop, "feedback of the motors too old",
     "Check the power and the cable of the motor controller"},
    {StopCause::wheels_late, Severity::stop, "wheel speeds too old", kWheelDriver},
    {StopCause::wheels_missing, Severity::stop, "no wheel speeds received yet", kWheelDriver},
    {StopCause::set_point_late, Severity::stop, "set point too old", ""},
    {StopCause::set_point_missing, Severity::stop, "no set point received yet", ""},
    {StopCause::set_points_rival, Severity::stop, "more than one node publishes set points", ""},
    {StopCause::clock_jump, Severity::emergency, "clock jumped back", "It drives on by itself"},
    {StopCause::graph_unchecked, Severity::stop, "publishers of commands and emergency stop not checked yet",
     "Check that the ROS master runs"},
    {StopCause::motors_off, Severity::halt, "motors do not take velocity commands",
     "Switch the motors to velocity control"},
    {StopCause::robot_stopped, Severity::halt, "robot reports that it is stopped",
     "Release the stop button of the robot"},
    {StopCause::emergency_stop, Severity::halt, "emergency stop", "Release it to drive on"},
    {StopCause::disabled, Severity::halt, "disabled", "Call the service enable with true to drive on"},
    {StopCause::shutdown, Severity::emergency, "controller is to end", ""},
    {StopCause::contention, Severity::fault, "another node publishes commands", ""},
    {StopCause::sensor_fault, Severity::fault, "sensors or motors faulty",
     "Check the sensors and the motors, then send a zero set point"},
    {StopCause::belief_diverged, Severity::fault, "belief diverged",
     "Send a zero set point to drive on; if it comes again, check the gains and the plant model (analyze)"},
    {StopCause::driver_fault, Severity::fault, "motor driver reports a fault",
     "Look at /feedback and restart the motor driver"},
}};

static_assert(inOrder(kEntries, &Entry::cause), "one entry for each cause, in the order of the enumerators");

const Entry& entry(StopCause cause) { return kEntries[static_cast<std::size_t>(cause)]; }

}  // namespace

Severity severity(StopCause cause) { return entry(cause).severity; }

const char* text(StopCause cause) { return entry(cause).text; }

const char* remedy(StopCause cause) { return entry(cause).remedy; }

StopCause StopCauses::worst() const {
  for (std::size_t i = set_.size(); i-- > 1;) {
    if (set_.test(i)) return static_cast<StopCause>(i);
  }
  return StopCause::none;
}

}  // namespace jackal_aic
