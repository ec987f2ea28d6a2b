#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

#include "bindings.hpp"
#include "jackal_aic/faults/fault.hpp"
#include "monitored_loop.hpp"
#include "response_metrics.hpp"

namespace jackal_aic::python {
namespace {

using sim::FaultChannel;
using sim::FaultKind;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Set points as (time [s], x_dot [m/s], theta_dot [rad/s]).
using TimedSetPoints = std::vector<std::tuple<double, double, double>>;

/// A fault as (kind, start [s], channel, value, duration [s]).
using FaultData = std::tuple<std::string, double, std::string, double, double>;

/// @throws ParameterError in the order of the list.
sim::SetPointProfile profileOf(const TimedSetPoints& set_points, double duration) {
  constexpr double kLongest = 3600.0, kFastest = 10.0, kFastestTurn = 50.0;
  if (!(duration > 0.0 && duration <= kLongest)) {
    throw ParameterError(fmt::format("duration = {:g}: must be above 0 and at most {:g} s", duration, kLongest));
  }
  sim::SetPointProfile profile;
  profile.duration = duration;
  double before = -std::numeric_limits<double>::infinity();
  for (const auto& [time, forward, yaw_rate] : set_points) {
    const std::string which = fmt::format("set_points[{}]", profile.changes.size());
    if (!(time >= 0.0 && time < duration)) {
      throw ParameterError(fmt::format("{}: time = {:g}: must be in [0, {:g}) s, the duration", which, time, duration));
    }
    if (time <= before) {
      throw ParameterError(
          fmt::format("{}: time = {:g}: must be later than that before it, {:g} s", which, time, before));
    }
    if (!(std::abs(forward) <= kFastest)) {
      throw ParameterError(fmt::format("{}: speed = {:g}: must be within +-{:g} m/s", which, forward, kFastest));
    }
    if (!(std::abs(yaw_rate) <= kFastestTurn)) {
      throw ParameterError(
          fmt::format("{}: yaw rate = {:g}: must be within +-{:g} rad/s", which, yaw_rate, kFastestTurn));
    }
    profile.changes.push_back({time, {forward, 0.0, yaw_rate}});
    before = time;
  }
  if (profile.changes.empty()) throw ParameterError("set_points = []: must hold at least one");
  return profile;
}

/// Kinds of sensor faults, by the words of the fault campaign, that the robot's sensors can have.
constexpr FaultKind kSensorKinds[] = {FaultKind::freeze, FaultKind::not_a_number, FaultKind::infinite,
                                      FaultKind::set,    FaultKind::huge,         FaultKind::bias,
                                      FaultKind::scale,  FaultKind::upside_down};

/// Adds a fault to those of a run. @throws ParameterError for an unknown kind or channel, or a time out of range.
void addFault(const FaultData& data, sim::Faults& faults) {
  const auto& [kind, start, channel, value, duration] = data;
  if (!(start >= 0.0)) throw ParameterError(fmt::format("fault '{}': start = {:g}: must be 0 s or more", kind, start));
  if (!(duration > 0.0))
    throw ParameterError(fmt::format("fault '{}': duration = {:g}: must be above 0 s", kind, duration));
  if (!std::isfinite(value)) throw ParameterError(fmt::format("fault '{}': value = {:g}: must be finite", kind, value));
  const double until = start + duration;
  const auto among = [&, kind = kind, channel = channel](const std::vector<const char*>& channels) {
    if (std::find(channels.begin(), channels.end(), channel) != channels.end()) return;
    throw ParameterError(
        fmt::format("fault '{}': channel = '{}': must be one of {}", kind, channel, fmt::join(channels, ", ")));
  };
  const bool all = channel == "all", left = all || channel == "left", right = all || channel == "right";
  if (kind == "blocked") {
    among({"left", "right", "all"});
    if (left) faults.motors.push_back({sim::Side::left, start, until});
    if (right) faults.motors.push_back({sim::Side::right, start, until});
    return;
  }
  if (kind == "lost") {
    among({"left", "right", "gyro", "acceleration", "all"});
    const ChannelValidity remaining{!(all || channel == "gyro"), !left, !right, !(all || channel == "acceleration")};
    faults.losses.push_back({remaining, start, until});
    return;
  }
  if (kind == "push") {
    among({"forward", "yaw_rate"});
    const bool along = channel == "forward";
    faults.pushes.push_back({along ? value : 0.0, along ? 0.0 : value, start, until});
    return;
  }
  if (kind == "lift") {
    faults.lifts.push_back({start, until});
    return;
  }
  std::string known;
  for (const FaultKind sensor_kind : kSensorKinds) {
    const char* word = sim::kFaultKindNames[static_cast<std::size_t>(sensor_kind)];
    known += std::string(word) + ", ";
    if (kind != word) continue;
    among({"left", "right", "gyro", "acceleration", "all"});
    const auto found = std::find(sim::kFaultChannelNames.begin(), sim::kFaultChannelNames.end(), channel);
    faults.sensors.push_back(
        {sensor_kind, static_cast<FaultChannel>(found - sim::kFaultChannelNames.begin()), value, 1.0, start, duration});
    return;
  }
  throw ParameterError("fault '" + kind + "': unknown; known: " + known + "lost, blocked, push, lift");
}

/// Columns of a drive, in the order of Row.
constexpr std::array<const char*, 21> kColumns{"time",
                                               "set_speed",
                                               "set_yaw_rate",
                                               "speed",
                                               "yaw_rate",
                                               "x",
                                               "y",
                                               "heading",
                                               "wheel_left",
                                               "wheel_right",
                                               "measured_speed",
                                               "measured_yaw_rate",
                                               "measured_left",
                                               "measured_right",
                                               "believed_speed",
                                               "believed_yaw_rate",
                                               "command_left",
                                               "command_right",
                                               "status",
                                               "cause",
                                               "fault"};
using Row = std::array<double, kColumns.size()>;

double headingOf(const Eigen::Quaterniond& q) {
  return std::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()), 1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()));
}

/// What a run leaves behind.
struct Recording {
  std::vector<Row> rows;
  std::vector<std::pair<double, std::string>> events;  // time [s] and reason of each change
};

/// Records every step of a run.
class Recorder {
 public:
  Recorder(const sim::JackalPlant& plant, const DriveLoop& drive, sim::Support support,
           const GeometryParameters& geometry, std::size_t steps)
      : plant_(plant), drive_(drive), support_(support), kinematics_(geometry) {
    recording_.rows.reserve(steps);
  }

  void operator()(const sim::LoopStep& step) {
    if (step.observation) {
      measured_ = {step.observation->wheel_left, step.observation->wheel_right};
      measured_yaw_rate_ = step.observation->yaw_rate;
    }
    const sim::PlantTruth& truth = plant_.truth();
    const BodyVector velocity = sim::reportedVelocity(truth, support_, kinematics_);
    const VelocityController& controller = drive_.controller();
    const BodyVector believed = controller.hasBelief() ? controller.believedVelocity() : BodyVector::Constant(kNaN);
    const DriveLoopStatus status = drive_.status();
    const auto& wheels = truth.wheel_velocity;
    recording_.rows.push_back({step.time,
                               step.set_point.forward,
                               step.set_point.yaw_rate,
                               velocity(kForward),
                               velocity(kYaw),
                               truth.position.x(),
                               truth.position.y(),
                               headingOf(truth.orientation),
                               0.5 * (wheels[sim::kFrontLeft] + wheels[sim::kRearLeft]),
                               0.5 * (wheels[sim::kFrontRight] + wheels[sim::kRearRight]),
                               kinematics_.bodyVelocity(measured_)(kForward),
                               measured_yaw_rate_,
                               measured_.left,
                               measured_.right,
                               believed(kForward),
                               believed(kYaw),
                               step.command.left,
                               step.command.right,
                               static_cast<double>(status.decision.status),
                               static_cast<double>(status.decision.cause),
                               static_cast<double>(status.fault)});
    noteEvent(step.time, status);
  }

  Recording take() { return std::move(recording_); }

 private:
  void noteEvent(double time, const DriveLoopStatus& status) {
    const std::array<int, 4> now{static_cast<int>(status.decision.status), static_cast<int>(status.decision.cause),
                                 static_cast<int>(status.fault), static_cast<int>(status.loss)};
    if (now == last_) return;
    last_ = now;
    const std::string why = reason(status);
    recording_.events.emplace_back(time, wordOf(status.decision.status) + (why.empty() ? "" : ": " + why));
  }

  const sim::JackalPlant& plant_;
  const DriveLoop& drive_;
  sim::Support support_;
  SkidSteerKinematics kinematics_;
  WheelCommand measured_;           // last wheel speeds [rad/s]
  double measured_yaw_rate_ = 0.0;  // last gyro sample [rad/s]
  std::array<int, 4> last_{-1, -1, -1, -1};
  Recording recording_;
};

/// The loop of a run: named controllers drive in the loop of the experiments, Parameters in that of the node.
struct Run {
  sim::LoopSetup setup;
  std::optional<PlantModel> monitor_model;  // of a fault detection beside the setup's own
};

/// Refuses overrides that a controller from outside the setup would not heed. @throws ParameterError as loadSetup().
void requireHeeded(const sim::Overrides& overrides, std::initializer_list<const char*> sections) {
  for (const auto& [key, value] : overrides) {
    const std::string section = key.substr(0, key.find('.'));
    if (std::find(sections.begin(), sections.end(), section) != sections.end()) continue;
    throw ParameterError(key + " = " + value + ": unknown key for this controller");
  }
}

Run runOf(const std::string& robot, const py::object& controller, const sim::Overrides& overrides, bool monitored,
          bool as_printed) {
  const bool named = py::isinstance<py::str>(controller);
  if (as_printed && !named) throw ParameterError("as_printed = True: needs the name or file of a controller");
  Run run;
  if (py::isinstance<Parameters>(controller)) {
    requireHeeded(overrides, {"plant", "loop"});
    run.setup = sim::loadSetup(packageFiles(), sim::kDifferentialDrive, robot, overrides);
    run.setup.drive = driveParameters(controller.cast<const Parameters&>());
    return run;
  }
  if (named) {
    const auto load = as_printed ? sim::loadPrintedSetup : sim::loadSetup;
    run.setup = load(packageFiles(), controller.cast<std::string>(), robot, overrides);
  } else {
    requireHeeded(overrides, {"plant", "loop", "robot", "limits"});
    run.setup = sim::loadSetup(packageFiles(), "standard", robot, overrides);
    run.setup.structure = [controller, drive = run.setup.drive] { return controllerOf(drive, controller); };
  }
  if (monitored) run.monitor_model = sim::monitorModel(packageFiles(), robot);
  return run;
}

/// Lets Ctrl-C end a drive.
void heedSignals() {
  py::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

py::dict columnsOf(const std::vector<Row>& rows) {
  py::dict columns;
  for (std::size_t c = 0; c < kColumns.size(); ++c) {
    const auto fill = [&](auto column) {
      auto values = column.template mutable_unchecked<1>();
      for (std::size_t i = 0; i < rows.size(); ++i) {
        values(static_cast<py::ssize_t>(i)) = static_cast<std::decay_t<decltype(values(0))>>(rows[i][c]);
      }
      columns[kColumns[c]] = column;
    };
    const auto size = static_cast<py::ssize_t>(rows.size());
    if (c + 3 >= kColumns.size()) {
      fill(py::array_t<int>(size));
    } else {
      fill(py::array_t<double>(size));
    }
  }
  return columns;
}

py::tuple simulate(const std::string& robot, const py::object& controller, const TimedSetPoints& set_points,
                   double duration, const std::vector<FaultData>& fault_list, const py::dict& changes,
                   std::optional<bool> monitor, bool as_printed) {
  const sim::SetPointProfile profile = profileOf(set_points, duration);
  sim::Faults faults;
  for (const FaultData& fault : fault_list) addFault(fault, faults);
  Run run = runOf(robot, controller, overridesOf(changes), monitor.value_or(!fault_list.empty()), as_printed);
  sim::LoopSetup& setup = run.setup;
  if (monitor == false) setup.drive.faults.reset();

  sim::JackalPlant plant(setup.urdf, setup.plant);
  DriveLoop drive = run.monitor_model ? sim::monitoredLoop(setup, *run.monitor_model) : sim::makeLoop(setup);
  drive.release();
  Recorder recorder(plant, drive, setup.plant.support, setup.drive.geometry,
                    static_cast<std::size_t>(profile.plantSteps()));
  sim::LoopHooks hooks = sim::faultHooks(plant, faults);
  hooks.done = [&recorder, steps = 0](const sim::LoopStep& step) mutable {
    recorder(step);
    if (++steps % 1000 == 0) heedSignals();
  };
  {
    py::gil_scoped_release release;
    sim::driveClosedLoop(plant, drive, profile, hooks, setup.loop);
  }
  const Recording recording = recorder.take();
  return py::make_tuple(columnsOf(recording.rows), recording.events);
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
  m.def("simulate", &simulate, py::arg("robot"), py::arg("controller"), py::arg("set_points"), py::arg("duration"),
        py::arg("faults"), py::arg("overrides"), py::arg("monitor"), py::arg("as_printed"),
        "Columns by name and events of a drive; see jackal_aic.simulate().");
  py::class_<sim::ResponseMetrics>(m, "StepResponse",
                                   "Figures of a step response, as the thesis defines them (chapter 5).")
      .def_readonly(
          "settling_time", &sim::ResponseMetrics::settling,
          "Time after the step until the signal stays within 5 % of its final value [s]; None if it never does.")
      .def_readonly("rise_time", &sim::ResponseMetrics::rise,
                    "Time from 10 % to 90 % of the set point [s]; None if 90 % is never reached.")
      .def_readonly("overshoot", &sim::ResponseMetrics::overshoot_pct, "Beyond the set point, in percent of the step.")
      .def_readonly("steady_error", &sim::ResponseMetrics::steady_error_pct,
                    "Mean error of the last 0.5 s, in percent of the step; positive if too fast.")
      .def_readonly("bounded", &sim::ResponseMetrics::bounded, "False if the response runs away.")
      .def("__repr__", [](const sim::ResponseMetrics& r) {
        const auto seconds = [](const std::optional<double>& time) {
          return time ? fmt::format("{:.3f} s", *time) : "never";
        };
        return fmt::format("<StepResponse settling {}, rise {}, overshoot {:.2f} %, steady error {:.2f} %>",
                           seconds(r.settling), seconds(r.rise), r.overshoot_pct, r.steady_error_pct);
      });
  m.def("step_response", &sim::stepResponseMetrics, py::arg("time"), py::arg("value"), py::arg("step_time"),
        py::arg("initial"), py::arg("set_point"), py::arg("settling_band") = sim::kSettlingBand,
        R"(Figures of a step from initial to set_point at step_time [s].

time: stamps [s], increasing, shape (n,). value: the signal at these times, shape (n,), in the unit of the set points.
settling_band: share of the final value. Raises ValueError if the series differ in length, span less than 0.5 s after the
step, or the step is zero.)");
  py::tuple statuses(5);
  for (int i = 0; i < 5; ++i) statuses[static_cast<py::size_t>(i)] = py::str(wordOf(static_cast<DriveStatus>(i)));
  m.attr("STATUSES") = statuses;
  m.attr("CAUSES") = wordsOf<StopCause>(kStopCauses);
  m.attr("FAULTS") = wordsOf<Fault>(kFaults);
}

}  // namespace jackal_aic::python
