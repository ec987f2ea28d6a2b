#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <tuple>

#include "bindings.hpp"
#include "injected_faults.hpp"
#include "jackal_aic/aic/belief_update.hpp"
#include "jackal_aic/config/yaml.hpp"
#include "jackal_aic/faults/fault.hpp"
#include "jackal_aic/safety/loop_odometry.hpp"

namespace jackal_aic::python {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Set points as (time [s], x_dot [m/s], theta_dot [rad/s]).
using TimedSetPoints = std::vector<std::tuple<double, double, double>>;

/// A fault as (kind, start [s], channel, value, duration [s]).
using FaultData = std::tuple<std::string, double, std::string, double, double>;

/// The enumerator of a word, which jackal_aic/_simulation.py has checked.
template <class Enum, std::size_t kCount>
Enum enumOf(const std::array<const char*, kCount>& words, const std::string& word) {
  return static_cast<Enum>(std::find(words.begin(), words.end(), word) - words.begin());
}

sim::InjectedFault faultOf(const FaultData& data) {
  const auto& [kind, start, channel, value, duration] = data;
  return {enumOf<sim::FaultKind>(sim::kFaultKindNames, kind),
          enumOf<sim::FaultChannel>(sim::kFaultChannelNames, channel), value, start, duration};
}

/// The columns of a drive, and those with odometry=True, whose names jackal_aic/_simulation.py has.
using Row = Eigen::Array<double, 22, 1>;
using OdometryRow = Eigen::Array<double, 13, 1>;

double headingOf(const Eigen::Quaterniond& q) {
  return std::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()), 1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()));
}

/// Results of a run.
struct Recording {
  std::vector<Row> rows;
  std::vector<OdometryRow> odometry;
  std::vector<std::pair<double, std::string>> events;           // time [s] and reason of each change
  std::vector<std::tuple<double, std::string, bool>> findings;  // time [s], reason, and whether it is a fault
};

/// Lets Ctrl-C end a drive.
void heedSignals() {
  py::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

/// The closed loop of a robot and a drive loop in steps of 1 ms, and its recording. Only the seed of the plant is
/// random, so equal setups give equal samples.
class ClosedLoop {
 public:
  ClosedLoop(sim::JackalPlant& plant, DriveLoop& drive, const sim::LoopSetup& setup, sim::Faults faults,
             bool samples_only, bool odometry)
      : plant_(plant),
        drive_(drive),
        faults_(std::move(faults), setup.plant),
        phase_(setup.loop.phase),
        support_(setup.plant.support),
        kinematics_(setup.drive.geometry),
        samples_only_(samples_only) {
    if (odometry) odometry_.emplace(makeOdometry(setup.drive, drive));
  }

  /// Drives along set points from rest, for a time [s].
  void run(const TimedSetPoints& set_points, double duration) {
    const double ahead = takeLead();
    auto next = set_points.begin();
    const auto steps = std::llround(duration / sim::JackalPlant::kStep);
    if (!samples_only_) recording_.rows.reserve(steps);
    for (long long k = 0; k < steps; ++k, plant_.step()) {
      const double now = plant_.time() - ahead;
      for (; next != set_points.end() && std::get<0>(*next) <= now + sim::kTimeTolerance; ++next) {
        set_point_ = {std::get<1>(*next), 0.0, std::get<2>(*next)};
      }
      drive_.setSetPoint(set_point_, now);
      faults_.disturb(plant_, now);
      const auto& sample = plant_.measurement();
      if (sample) {
        const Observation observation = faults_.observed(*sample, now);
        drive_.observe(observation, now);
        noteSample(observation, now);
      }
      if (const auto due = drive_.advance(now)) plant_.command(command_ = *due);
      if (odometry_) odometry_->advance(drive_.command(), sim::JackalPlant::kStep);
      noteEvent(now);
      if (sample || !samples_only_) record(now);
      if (k % 1000 == 999) heedSignals();
    }
  }

  const Recording& recording() const { return recording_; }

 private:
  /// Lets the plant rest for its lead over the controller, the phase; returns its time [s].
  double takeLead() {
    for (auto steps = std::llround(phase_ / sim::JackalPlant::kStep); steps > 0; --steps) {
      if (plant_.measurement()) drive_.observe(plant_.measurement()->observation(), plant_.time() - phase_);
      plant_.step();
    }
    return plant_.time();
  }

  void noteSample(const Observation& y, double now) {
    measured_ = {y.wheel_left, y.wheel_right};
    measured_yaw_rate_ = y.yaw_rate;
    counted_ = y.valid;
    if (odometry_) {
      odometry_->observe(asCounted(y, drive_));
      position_ = {plant_.measurement()->wheel_position[sim::kFrontLeft],
                   plant_.measurement()->wheel_position[sim::kFrontRight]};
    }
    const FaultReport* report = drive_.faultReport();
    if (report == nullptr) return;
    counted_ = counted_ & report->valid();
    const std::pair<std::string, bool> finding{report->reason(), report->faulty()};
    if (finding == finding_) return;
    finding_ = finding;
    recording_.findings.emplace_back(now, finding.first, finding.second);
  }

  /// Body velocity: the true one; on the box, where the chassis cannot move, that of the wheels without slip (eq. 3-1),
  /// as the thesis plots it.
  BodyVector velocity() const {
    const sim::PlantTruth& truth = plant_.truth();
    if (support_ == sim::Support::ground)
      return {truth.linear_velocity.x(), truth.linear_velocity.y(), truth.angular_velocity.z()};
    return kinematics_.bodyVelocity(wheels());
  }

  /// True mean speeds of the sides [rad/s].
  WheelCommand wheels() const {
    const auto& wheel = plant_.truth().wheel_velocity;
    return {0.5 * (wheel[sim::kFrontLeft] + wheel[sim::kRearLeft]),
            0.5 * (wheel[sim::kFrontRight] + wheel[sim::kRearRight])};
  }

  void record(double now) {
    const sim::PlantTruth& truth = plant_.truth();
    const BodyVector velocity = this->velocity();
    const WheelCommand wheels = this->wheels();
    const VelocityController& controller = drive_.controller();
    const BodyVector believed = controller.hasBelief() ? controller.believedVelocity() : BodyVector::Constant(kNaN);
    const DriveLoopStatus status = drive_.status();
    const auto whole = [](auto value) { return static_cast<double>(value); };
    Row row;
    row << now, set_point_.forward, set_point_.yaw_rate, velocity(kForward), velocity(kYaw), truth.position.x(),
        truth.position.y(), headingOf(truth.orientation), wheels.left, wheels.right,
        kinematics_.bodyVelocity(measured_)(kForward), measured_yaw_rate_, measured_.left, measured_.right,
        believed(kForward), believed(kYaw), command_.left, command_.right, whole(status.decision.status),
        whole(status.decision.cause), whole(status.fault), whole(counted_.all());
    recording_.rows.push_back(row);
    if (odometry_) recordOdometry();
  }

  void recordOdometry() {
    const PlanarPose& pose = odometry_->pose();
    const PlanarMotion motion = odometry_->motion();
    const PredictiveController* predictive = drive_.predictive();
    const Eigen::Matrix2d believed =
        predictive != nullptr ? predictive->motionCovariance() : Eigen::Matrix2d::Constant(kNaN).eval();
    OdometryRow row;
    row << pose.x, pose.y, pose.heading, motion.forward, motion.yaw_rate, motion.covariance(0, 0),
        motion.covariance(0, 1), motion.covariance(1, 1), believed(0, 0), believed(0, 1), believed(1, 1),
        position_.left, position_.right;
    recording_.odometry.push_back(row);
  }

  void noteEvent(double time) {
    const DriveLoopStatus status = drive_.status();
    const std::array<int, 4> now{static_cast<int>(status.decision.status), static_cast<int>(status.decision.cause),
                                 static_cast<int>(status.fault), static_cast<int>(status.loss)};
    if (now == last_) return;
    last_ = now;
    const std::string why = reason(status);
    recording_.events.emplace_back(time, text(status.decision.status) + (why.empty() ? "" : ": " + why));
  }

  sim::JackalPlant& plant_;
  DriveLoop& drive_;
  sim::FaultInjector faults_;
  double phase_;  // s
  sim::Support support_;
  SkidSteerKinematics kinematics_;
  bool samples_only_;  // records the steps with a sample
  std::optional<Odometry> odometry_;
  SetPoint set_point_;
  WheelCommand command_;            // last [rad/s]
  WheelCommand measured_;           // last wheel speeds [rad/s]
  WheelCommand position_;           // last angles of the front wheels [rad]
  double measured_yaw_rate_ = 0.0;  // last gyro sample [rad/s]
  ChannelValidity counted_;         // of the last sample
  std::array<int, 4> last_{-1, -1, -1, -1};
  std::pair<std::string, bool> finding_;
  Recording recording_;
};

/// Refuses overrides without effect on a controller from outside the setup. @throws ParameterError as loadSetup().
void requireHeeded(const sim::Overrides& overrides, std::initializer_list<const char*> sections) {
  for (const auto& [key, value] : overrides) {
    const std::string section = key.substr(0, key.find('.'));
    if (std::find(sections.begin(), sections.end(), section) != sections.end()) continue;
    throw ParameterError(key + " = " + value + ": unknown key for this controller");
  }
}

/// The loop of a run: named controllers, and those of Python, drive in the loop of the experiments, Parameters in that
/// of the node.
sim::LoopSetup setupOf(const std::string& robot, const py::object& controller, const sim::Overrides& overrides) {
  if (py::isinstance<py::str>(controller)) return sim::loadSetup(controller.cast<std::string>(), robot, overrides);
  if (!py::isinstance<Parameters>(controller)) {
    requireHeeded(overrides, {"plant", "loop", "robot", "limits"});
    return sim::loadSetup("standard", robot, overrides);
  }
  requireHeeded(overrides, {"plant", "loop"});
  sim::LoopSetup setup = sim::loadSetup(sim::kDifferentialDrive, robot, overrides);
  setup.drive = driveParameters(controller.cast<const Parameters&>());
  return setup;
}

/// Rows as an array, one column after the other.
template <class Row>
Eigen::Matrix<double, Row::SizeAtCompileTime, Eigen::Dynamic, Eigen::RowMajor> tableOf(const std::vector<Row>& rows) {
  return Eigen::Map<const Eigen::Matrix<double, Row::SizeAtCompileTime, Eigen::Dynamic>>(
      rows.empty() ? nullptr : rows.front().data(), Row::SizeAtCompileTime, static_cast<Eigen::Index>(rows.size()));
}

py::tuple simulate(const std::string& robot, const py::object& controller, const TimedSetPoints& set_points,
                   double duration, const std::vector<FaultData>& fault_list, const py::dict& changes,
                   std::optional<bool> monitor, const py::dict& monitor_model, bool samples_only, bool odometry) {
  sim::LoopSetup setup = setupOf(robot, controller, overridesOf(changes));
  const bool as_node = py::isinstance<Parameters>(controller), named = py::isinstance<py::str>(controller);
  if (monitor == false) setup.drive.faults.reset();
  if (!as_node && monitor.value_or(!fault_list.empty()))
    setup.monitor = changed(sim::monitorModel(robot), monitor_model);
  sim::Faults faults;
  for (const FaultData& fault : fault_list) faults.push_back(faultOf(fault));

  sim::JackalPlant plant(setup.urdf, setup.plant);
  DriveLoop drive = sim::makeLoop(setup, as_node || named ? nullptr : controllerOf(setup.drive, controller));
  drive.release();
  ClosedLoop loop(plant, drive, setup, std::move(faults), samples_only, odometry);
  {
    py::gil_scoped_release release;
    loop.run(set_points, duration);
  }
  const Recording& recording = loop.recording();
  const PredictiveController* predictive = drive.predictive();
  py::object track = py::none(), model = py::none();
  if (predictive != nullptr) {
    track = py::cast(predictive->effectiveTrack());
    model = dictOf(fieldsOf(predictive->model()));
  }
  return py::make_tuple(tableOf(recording.rows), tableOf(recording.odometry), recording.events, recording.findings,
                        track, model);
}

py::dict settings(const std::string& robot, const std::string& controller, const py::dict& changes) {
  const sim::LoopSetup setup = sim::loadSetup(controller, robot, overridesOf(changes));
  constexpr const char* kSections[] = {"controller", "predictive", "diff_drive"};
  py::dict all;
  all["structure"] = structureOf(setup.drive);
  all["plant"] = dictOf(fieldsOf(setup.plant));
  all["geometry"] = dictOf(fieldsOf(setup.drive.geometry));
  const std::vector<Field> gains =
      std::visit([](const auto& values) { return fieldsOf(values); }, setup.drive.controller);
  all["controller"] = dictOf(gains);
  all["preset"] = yamlBlock(kSections[setup.drive.controller.index()], gains);
  if (setup.drive.plant_model) all["plant_model"] = dictOf(fieldsOf(*setup.drive.plant_model));
  if (const auto* thesis = std::get_if<ControllerParameters>(&setup.drive.controller)) {
    const BeliefUpdate update(GenerativeModel(*thesis, setup.drive.geometry), thesis->kappa_mu, thesis->beliefStep(),
                              thesis->integrator);
    all["belief_radius"] = update.spectralRadius();
  }
  return all;
}

/// Texts of an enumeration in the order of its values.
template <class Enum>
py::tuple wordsOf(int count) {
  py::tuple words(static_cast<py::size_t>(count));
  for (int i = 0; i < count; ++i) words[static_cast<py::size_t>(i)] = py::str(text(static_cast<Enum>(i)));
  return words;
}

}  // namespace

void bindSimulation(py::module& m) {
  m.def(
      "simulate", &simulate, py::arg("robot"), py::arg("controller"), py::arg("set_points"), py::arg("duration"),
      py::arg("faults"), py::arg("overrides"), py::arg("monitor"), py::arg("monitor_model"), py::arg("samples_only"),
      py::arg("odometry"),
      "Columns, those of the odometry, events, findings, effective track and plant model of a drive; see simulate().");
  m.def("settings", &settings, py::arg("robot"), py::arg("controller"), py::arg("overrides") = py::dict(),
        R"(The values with which simulate() drives, as dicts of names and values: "plant", "geometry", "controller", and
"plant_model", which the controller has of the robot (unless it is the open loop). "preset" is the text of a YAML file with
the controller's values. "structure" is "thesis", "predictive" or
"diff_drive", "belief_radius" the spectral radius of a thesis controller's belief update. Arguments and errors are those of
simulate().)");
  py::class_<std::mt19937_64>(m, "Generator", "std::mt19937_64: a seed means the same draws everywhere.")
      .def(py::init<std::uint64_t>(), py::arg("seed"))
      .def(
          "__call__", [](std::mt19937_64& generator) { return generator(); }, "64 random bits.");
  m.attr("STATUSES") = wordsOf<DriveStatus>(5);
  m.attr("CAUSES") = wordsOf<StopCause>(kStopCauses);
  m.attr("FAULTS") = wordsOf<Fault>(kFaults);
}

}  // namespace jackal_aic::python
