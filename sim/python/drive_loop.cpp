#include "bindings.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"

namespace jackal_aic::python {
namespace {

/// A measurement whose wheels may repeat exactly, because no wheel positions are known.
bool receive(DriveLoop& loop, const Observation& y, double now) {
  SensorReading reading{y, InputSource::Sample::Zero(), true};
  loop.receiveWheels(reading, now);
  if (y.valid.yaw_rate) {
    reading.sample.head<4>() << y.yaw_rate, y.acceleration_x, y.acceleration_y, y.acceleration_z.value_or(0.0);
    loop.receiveImu(reading, now);
  }
  return loop.observe(y, now);
}

}  // namespace

void bindLoop(py::module& m) {
  py::class_<DriveLoop>(
      m, "DriveLoop",
      R"(Everything between a measurement and a command: limits, controller, fault detection, drive gate.

The caller keeps the time [s], of any clock: every call says when it is made. As on a robot, a set point of zero has to come
first, and the loop stands whenever an input is missing or late.)")
      .def(py::init([](const Parameters& parameters, const py::object& controller, bool motors_shared) {
             DriveParameters drive = driveParameters(parameters);
             drive.motors_shared = motors_shared;
             return std::make_unique<DriveLoop>(drive, controllerOf(drive, controller));
           }),
           py::arg("parameters"), py::arg("controller") = py::none(), py::arg("motors_shared") = false,
           R"(controller: a VelocityController in Python in place of that of the parameters.
motors_shared: another source may drive; say so by applied().)")
      .def(
          "start",
          [](DriveLoop& d, double left, double right, double now) {
            d.start({left, right}, now);
          },
          py::arg("left"), py::arg("right"), py::arg("now"),
          "Restarts on a robot whose wheels turn at these speeds [rad/s].")
      .def(
          "set_set_point",
          [](DriveLoop& d, double forward, double yaw_rate, double now) {
            constexpr const char* kWords[] = {"accepted", "not_finite", "absurd"};
            return kWords[static_cast<int>(d.setSetPoint({forward, 0.0, yaw_rate}, now))];
          },
          py::arg("forward"), py::arg("yaw_rate"), py::arg("now"),
          "Desired speed [m/s] and yaw rate [rad/s]; 'accepted', or why it was refused: 'not_finite', 'absurd'.")
      .def("observe", &DriveLoop::observe, py::arg("observation"), py::arg("now"),
           "A measurement came; True if the controller took it.")
      .def("receive", &receive, py::arg("observation"), py::arg("now"),
           "The messages came that a measurement is made of, of wheels and IMU, then the measurement; as observe().")
      .def(
          "applied",
          [](DriveLoop& d, double left, double right, double now) {
            d.applied({left, right}, AppliedSource::drive, now);
          },
          py::arg("left"), py::arg("right"), py::arg("now"), "With shared motors: this command reached them [rad/s].")
      .def("freeze_learning", &DriveLoop::freezeLearning, py::arg("frozen"), py::arg("now"),
           "Stops or resumes learning, if the controller learns.")
      .def(
          "usual_yaw_rate",
          [](const DriveLoop& d, double left, double right) {
            if (d.predictive() == nullptr) throw ParameterError("usual_yaw_rate: only `predictive` learns it");
            return d.predictive()->turn().usualYawRate({left, right});
          },
          py::arg("left"), py::arg("right"),
          "Yaw rate [rad/s] of these wheel speeds [rad/s], as `predictive` learned it.")
      .def(
          "advance",
          [](DriveLoop& d, double now) -> std::optional<WheelPair> {
            const std::optional<WheelCommand> command = d.advance(now);
            return command ? std::optional(pairOf(*command)) : std::nullopt;
          },
          py::arg("now"),
          "Runs every step that is due; the command (left, right) [rad/s] to drive from now on, or None if no action "
          "was due.")
      .def("release", &DriveLoop::release, "Lets set points move the robot without a zero before.")
      .def(
          "report",
          [](DriveLoop& d, double now, bool emergency_stop, bool robot_stopped, bool motors_off, bool driver_fault) {
            RobotStatus status;
            status.emergency_stop = emergency_stop;
            status.robot_stopped = robot_stopped;
            status.motors_off = motors_off;
            status.driver_fault = driver_fault;
            d.report(status, now);
          },
          py::arg("now"), py::arg("emergency_stop") = false, py::arg("robot_stopped") = false,
          py::arg("motors_off") = false, py::arg("driver_fault") = false, "Status of the robot from now on.")
      .def_property_readonly(
          "status", [](const DriveLoop& d) { return text(d.status().decision.status); },
          "'idle', 'driving', 'stopped', 'braking' or 'faulted'.")
      .def_property_readonly(
          "cause", [](const DriveLoop& d) { return text(d.status().decision.cause); },
          "Why it does not drive; empty if it does.")
      .def_property_readonly(
          "fault", [](const DriveLoop& d) { return text(d.status().fault); },
          "What the fault detection finds; empty for nothing.")
      .def_property_readonly(
          "faulty", [](const DriveLoop& d) { return isFault(d.status().fault); },
          "The finding is a fault of a sensor or a drive, and no remark.")
      .def_property_readonly(
          "reason", [](const DriveLoop& d) { return reason(d.status()); },
          "Cause and fault in one sentence, as in the node's log; empty for neither.")
      .def_property_readonly(
          "command", [](const DriveLoop& d) { return pairOf(d.command()); },
          "Command of the last action step (left, right) [rad/s].")
      .def_property_readonly(
          "believed_velocity", [](const DriveLoop& d) -> BodyVector { return d.controller().believedVelocity(); },
          "Of the controller; see CoreController.believed_velocity.");
}

}  // namespace jackal_aic::python
