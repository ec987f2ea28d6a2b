#include <fmt/format.h>

#include <cmath>

#include "bindings.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"

namespace jackal_aic::python {
namespace {

using Table = py::array_t<double, py::array::c_style | py::array::forcecast>;

constexpr double kTick = 0.01;       // s between calls of the loop's timer
constexpr double kTrackRange = 4.0;  // a Husky on a smooth floor turns by less than half of its geometry

/// A recorded robot and the loop's model of it.
struct RecordedRobot {
  double wheel_radius, wheel_distance;  // m
  PlantModel model;
};

/// The default configuration of a node on a recorded robot, which another controller drove, faster than a Jackal.
DriveParameters recordedParameters(const RecordedRobot& robot) {
  ParameterMap map = packageFiles().configuration("predictive");
  map.set("plant_model.dead_time", robot.model.dead_time);
  map.set("plant_model.lag", robot.model.lag);
  const NodeParameters node = readConfiguration(map);
  DriveParameters drive = node;
  drive.plant_model = robot.model;
  drive.geometry.wheel_radius = robot.wheel_radius;
  drive.geometry.effective_track = node.robot.track_multiplier * robot.wheel_distance;
  drive.geometry.slip_factor = 1.0;
  drive.geometry.track_range = kTrackRange;
  LimitParameters& limits = drive.gate.limits;
  limits = {};
  limits.linear_speed = limits.angular_speed = 20.0;
  limits.wheel_speed = 200.0;
  limits.linear_acceleration = limits.angular_acceleration = 0.0;
  drive.motors_shared = true;
  return drive;
}

/// A drive loop on a recorded robot.
class Replay {
 public:
  explicit Replay(const DriveParameters& parameters)
      : kinematics_(parameters.geometry), loop_(parameters, makeController(parameters)) {}

  /// @param applied command of the motors; empty if unknown.
  void take(const Observation& y, bool starts, bool held_out, const std::optional<WheelCommand>& applied) {
    const double now = y.stamp;
    if (starts) {
      loop_.start({y.wheel_left, y.wheel_right}, now);
      loop_.release();
      clock_ = now;
    }
    for (; clock_ + kTick < now; clock_ += kTick) tick(clock_ + kTick);
    loop_.freezeLearning(held_out, now);
    if (applied) loop_.applied(*applied, AppliedSource::drive, now);
    const BodyVector body = kinematics_.bodyVelocity(applied.value_or(WheelCommand{}));
    loop_.setSetPoint({body(kForward), 0.0, body(kYaw)}, now);
    SensorReading reading;
    reading.observation = y;
    reading.may_repeat = true;  // the recordings have no wheel positions
    loop_.receiveWheels(reading, now);
    if (y.valid.yaw_rate) {
      reading.sample << y.yaw_rate, y.acceleration_x, y.acceleration_y, *y.acceleration_z, 0.0, 0.0, 0.0, 0.0;
      loop_.receiveImu(reading, now);
    }
    loop_.observe(y, now);
    tick(now);
    if (alarmed_) ++alarmed_samples_;
  }

  py::dict result() const {
    const SlipBelief& slip = loop_.predictive()->slipBelief();
    py::dict result;
    result["alarms"] = alarms_;
    result["alarmed"] = alarmed_samples_;
    result["reversed_told"] = reversed_;
    result["turn"] = slip.state().turn ? py::cast(Eigen::VectorXd(slip.state().turn->mean)) : py::object(py::none());
    return result;
  }

  /// Yaw rates that the loop predicts for (difference of the sides, forward speed) [m/s].
  std::vector<double> usualYawRates(const Table& motions) const {
    const auto rows = motions.unchecked<2>();
    std::vector<double> rates;
    for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
      rates.push_back(loop_.predictive()->slipBelief().turn().usualYawRate(rows(i, 0), rows(i, 1)));
    }
    return rates;
  }

 private:
  void tick(double now) {
    loop_.advance(now);
    const DriveLoopStatus status = loop_.status();
    const DriveStatus drive = status.decision.status;
    const bool stops = drive != DriveStatus::driving && drive != DriveStatus::idle;
    const bool alarmed = isFault(status.fault) || status.fault == Fault::stuck || stops;
    if (alarmed && !alarmed_) alarms_.emplace_back(now, reason(status));
    alarmed_ = alarmed;
    if (status.fault == Fault::gyro_reversed && !reversed_) reversed_ = now;
  }

  SkidSteerKinematics kinematics_;
  DriveLoop loop_;
  double clock_ = 0.0;  // s
  bool alarmed_ = false;
  std::size_t alarmed_samples_ = 0;
  std::optional<double> reversed_;                      // first report of a reversed gyro [s]
  std::vector<std::pair<double, std::string>> alarms_;  // time [s] and reason
};

py::dict replayRecording(const Table& samples, double wheel_radius, double wheel_distance, const py::dict& model,
                         bool has_imu, const Table& motions) {
  constexpr py::ssize_t kColumns = 10;
  if (samples.ndim() != 2 || samples.shape(1) != kColumns || motions.ndim() != 2 || motions.shape(1) != 2) {
    throw ParameterError("samples, motions: must have the shapes (n, 10) and (m, 2)");
  }
  Replay replay(recordedParameters({wheel_radius, wheel_distance, changed(PlantModel{}, model)}));
  const auto rows = samples.unchecked<2>();
  for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
    Observation y{rows(i, 0), rows(i, 3), rows(i, 1), rows(i, 2), rows(i, 4), rows(i, 5), rows(i, 6)};
    y.valid.yaw_rate = y.valid.acceleration = has_imu;
    const double left = rows(i, 7), right = rows(i, 8);
    const int kind = static_cast<int>(rows(i, 9));
    replay.take(y, (kind & 1) != 0, (kind & 2) != 0,
                std::isnan(left) ? std::nullopt : std::optional(WheelCommand{left, right}));
  }
  py::dict result = replay.result();
  result["usual_yaw_rates"] = replay.usualYawRates(motions);
  return result;
}

}  // namespace

void bindStudies(py::module& m) {
  m.def(
      "replay_recording", &replayRecording, py::arg("samples"), py::arg("wheel_radius"), py::arg("wheel_distance"),
      py::arg("plant_model"), py::arg("has_imu"), py::arg("motions"),
      R"(Replays a recording of a skid-steer robot through the drive loop with `predictive`, as a node would have seen it.

samples: rows (time, left, right, yaw rate, acceleration x, y, z, applied left, applied right, kind) [s, rad/s, m/s^2],
shape (n, 10); applied commands are NaN where they are not known; kind is 1 where a stretch begins, plus 2 where the loop
shall not learn. plant_model: keys of plant_model.*. motions: rows (difference of the sides, speed) [m/s], shape (m, 2).
Returns a dict: alarms (time, reason), alarmed samples, reversed_told [s] or None, turn (mean of what was learned of the
turn, or None), usual_yaw_rates of the motions [rad/s].)");
}

}  // namespace jackal_aic::python
