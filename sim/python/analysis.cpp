#include <fmt/format.h>

#include "bindings.hpp"
#include "jackal_aic/certificate/certificate.hpp"
#include "jackal_aic/config/yaml.hpp"
#include "jackal_aic/faults/fault_monitor.hpp"
#include "jackal_aic/odometry/odometry.hpp"

namespace jackal_aic::python {
namespace {

/// A certificate with a sentence on its meaning.
struct CertificateWithAdvice : Certificate {
  std::string advice;
};

CertificateWithAdvice withAdvice(const LinearLoop& loop) {
  const Certificate certificate = certify(loop);
  return {certificate, advice(certificate, loop)};
}

const PlantModel& plantModelOf(const Parameters& parameters) {
  if (!parameters.plant_model) throw ParameterError("plant_model.*: missing; it describes the robot");
  return *parameters.plant_model;
}

/// A controller with its model, on a robot that may differ from it. @throws ParameterError for the open loop.
LinearLoop loopOf(const DriveParameters& drive, const PlantModel& model, const PlantModel& actual) {
  if (const auto* gains = std::get_if<ControllerParameters>(&drive.controller)) {
    return LinearLoop(*gains, drive.geometry, actual);
  }
  if (const auto* gains = std::get_if<PredictiveParameters>(&drive.controller))
    return LinearLoop(*gains, model, actual);
  throw ParameterError("preset = diff_drive: not a closed loop");
}

CertificateWithAdvice certificateOf(const Parameters& parameters, const py::dict& robot) {
  const PlantModel model = drivenModel(plantModelOf(parameters));
  const LinearLoop loop = loopOf(parameters, model, changed(model, robot));
  py::gil_scoped_release release;
  return withAdvice(loop);
}

/// The loop of a controller on its model and on each corner of the model's confidence box, the model first.
std::vector<LinearLoop> linearLoops(const std::string& robot, const std::string& controller, const py::dict& changes) {
  const DriveParameters drive = sim::loadSetup(controller, robot, overridesOf(changes)).drive;
  const PlantModel model = drivenModel(drive.plant_model.value_or(PlantModel{}));
  std::vector<LinearLoop> loops{loopOf(drive, model, model)};
  for (const PlantModel& actual : confidenceBox(model)) loops.push_back(loopOf(drive, model, actual));
  return loops;
}

double largestRadius(const LinearLoop& loop, const LoopChange& change) {
  double radius = loop.beliefSpectralRadius();
  for (const LoopMode mode : loop.modes()) radius = std::max(radius, loop.spectralRadius(mode, change));
  return radius;
}

void bindLinearLoop(py::module& m) {
  py::class_<LinearLoop>(m, "LinearLoop", "A controller and a linear robot as one linear periodic system.")
      .def_property_readonly("period", &LinearLoop::period, "Common period of sensor, belief and action [s].")
      .def_property_readonly("longest_phase", &LinearLoop::longestPhase,
                             "Largest age of the newest measurement when the action is computed [s].")
      .def_property_readonly(
          "robot", [](const LinearLoop& loop) { return dictOf(fieldsOf(loop.robot())); },
          "The robot, as the keys of plant_model.* describe it.")
      .def(
          "spectral_radius",
          [](const LinearLoop& loop, double gain, double extra_dead_time, double phase) {
            return largestRadius(loop, {gain, extra_dead_time, phase});
          },
          py::arg("gain") = 1.0, py::arg("extra_dead_time") = 0.0, py::arg("phase") = 0.0,
          "Largest spectral radius of belief and loops with a factor on the gain, a longer dead time [s], and a phase "
          "[s].")
      .def(
          "step_response",
          [](const LinearLoop& loop, int periods, double phase) {
            return loop.stepResponse(periods, {1.0, 0.0, phase});
          },
          py::arg("periods"), py::arg("phase") = 0.0,
          "Speed after each period of a step, as a part of its final value; of the thesis' structure only.")
      .def("certify", &withAdvice, py::call_guard<py::gil_scoped_release>(), "The Certificate of this loop.");
  m.def(
      "linear_loops", &linearLoops, py::arg("robot"), py::arg("controller"), py::arg("overrides") = py::dict(),
      R"(The LinearLoops of a controller: on its model of the robot first, then on each corner of the model's confidence box.

Arguments and errors are those of simulate().)");
}

void bindCertificate(py::module& m) {
  py::class_<CertificateWithAdvice>(m, "Certificate", "Stability certificate of driving straight and of turning.")
      .def_property_readonly(
          "stable", [](const CertificateWithAdvice& c) { return c.stable(); },
          "The verdict: belief and loop are stable.")
      .def_readonly("belief_spectral_radius", &CertificateWithAdvice::belief_spectral_radius, "Of the belief alone.")
      .def_readonly("loop_spectral_radius", &CertificateWithAdvice::spectral_radius,
                    "Of the closed loop over one common period.")
      .def_readonly("period", &CertificateWithAdvice::period, "Common period of sensor, belief and action [s].")
      .def_readonly("gain_margin", &CertificateWithAdvice::gain_margin,
                    "Factor on the gain at which the loop becomes unstable; below 1 for an unstable loop.")
      .def_readonly("delay_margin", &CertificateWithAdvice::delay_margin,
                    "Extra dead time at which the loop becomes unstable [s]; negative for an unstable loop.")
      .def_readonly("advice", &CertificateWithAdvice::advice, "What it means, and what to change.")
      .def("__repr__", [](const CertificateWithAdvice& c) {
        return fmt::format("<Certificate {}, spectral radius {:.4f}, gain margin {:.3g}, delay margin {:.3g} s>",
                           c.stable() ? "stable" : "unstable", c.spectral_radius, c.gain_margin, c.delay_margin);
      });
  m.def("certify", &certificateOf, py::arg("parameters"), py::arg("robot") = py::dict(),
        R"(Certifies a controller on its robot: spectral radii, margins, verdict.

robot: keys of plant_model.* in which the robot differs from the controller's model, such as {"dead_time": 0.12}.
Takes tens of milliseconds. Raises ValueError without a plant model, for the open-loop baseline, and for rates without a
common period.)");
}

void bindOdometry(py::module& m) {
  py::class_<Odometry>(m, "Odometry", "Motion and pose by wheels, gyro and commands, with their covariances.")
      .def(py::init([](const Parameters& parameters) {
             PredictiveParameters own;
             own.learn_drive_train = false;  // as of a loop whose controller has another belief
             const auto* predictive = std::get_if<PredictiveParameters>(&parameters.controller);
             return std::make_unique<Odometry>(predictive != nullptr ? *predictive : own, parameters.geometry,
                                               drivenModel(plantModelOf(parameters)));
           }),
           py::arg("parameters"), "Needs a plant model. Raises ValueError without one.")
      .def("observe", &Odometry::observe, py::arg("observation"), "A measurement came.")
      .def(
          "advance",
          [](Odometry& o, double left, double right, double duration) {
            o.advance({left, right}, duration);
          },
          py::arg("left"), py::arg("right"), py::arg("duration"),
          "Goes on by a time [s] in which the motors had a command [rad/s].")
      .def_property_readonly(
          "pose", [](const Odometry& o) { return py::make_tuple(o.pose().x, o.pose().y, o.pose().heading); },
          "(x, y, heading) [m, m, rad] in the frame of the start.")
      .def_property_readonly(
          "pose_covariance", [](const Odometry& o) { return o.poseCovariance(); },
          "Of the pose, shape (3, 3) [m^2, rad^2]; it grows without bound.")
      .def_property_readonly(
          "motion",
          [](const Odometry& o) {
            const PlanarMotion motion = o.motion();
            return py::make_tuple(motion.forward, motion.yaw_rate);
          },
          "(x_dot, theta_dot) [m/s, rad/s] in base_link.")
      .def_property_readonly(
          "motion_covariance", [](const Odometry& o) { return o.motion().covariance; }, "Of the motion, shape (2, 2).");
}

void bindFaults(py::module& m) {
  py::class_<FaultReport>(m, "FaultReport", "What the fault monitor thinks of the robot after a sample.")
      .def_property_readonly(
          "fault", [](const FaultReport& r) { return r.reason(); }, "The gravest finding in words; empty for none.")
      .def_property_readonly("faulty", &FaultReport::faulty,
                             "A channel or a drive is faulty; a remark or an outlier does not count.")
      .def_property_readonly(
          "valid", [](const FaultReport& r) { return channelsOf(r.valid()); },
          "Channels that count; see Observation.valid.")
      .def_property_readonly(
          "distances",
          [](const FaultReport& r) {
            return py::dict(py::arg("left") = r.wheel_left.distance, py::arg("right") = r.wheel_right.distance);
          },
          "Mahalanobis distance of each wheel's last prediction error, in multiples of the bound of an outlier.")
      .def_property_readonly(
          "probabilities",
          [](const FaultReport& r) {
            return py::dict(py::arg("gyro") = r.gyro.probability,
                            py::arg("acceleration") = r.accelerometer.probability);
          },
          "Probability of each of gyro and acceleration, while it counts, that it is faulty.");
  py::class_<FaultMonitor>(m, "FaultMonitor", "Fault detection per channel from prediction errors.")
      .def(py::init([](const Parameters& parameters) {
             return FaultMonitor(parameters.faults.value_or(FaultParameters{}), parameters.geometry,
                                 plantModelOf(parameters));
           }),
           py::arg("parameters"), "Needs a plant model. Raises ValueError without one.")
      .def(
          "advance",
          [](FaultMonitor& f, const std::optional<WheelPair>& applied, double duration) {
            f.advance(applied ? std::optional(WheelCommand{applied->first, applied->second}) : std::nullopt, duration);
          },
          py::arg("applied"), py::arg("duration"),
          "Lets a time [s] pass under a command (left, right) [rad/s] that is really driven, or None if it is not "
          "known.")
      .def(
          "check", [](FaultMonitor& f, const Observation& y) { return f.check(y); }, py::arg("observation"),
          "Judges a sample.")
      .def("reset", &FaultMonitor::reset, "Forgets everything but the parameters.");
}

}  // namespace

PlantModel changed(const PlantModel& model, const py::dict& changes) {
  ParameterMap map;
  for (const Field& field : fieldsOf(model)) {
    if (field.name != "robot") map.set("plant_model." + field.name, field.value);
  }
  for (const auto& [key, value] : overridesOf(changes)) setFromText("plant_model." + key, value, map);
  const PlantModel robot = readPlantModel(map);
  map.refuseUnknown();
  return robot;
}

void bindAnalysis(py::module& m) {
  bindCertificate(m);
  bindLinearLoop(m);
  bindOdometry(m);
  bindFaults(m);
}

}  // namespace jackal_aic::python
