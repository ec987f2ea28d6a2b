#include "real_drives.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "campaign.hpp"
#include "csv.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "parallel.hpp"
#include "parameters/node_parameters.hpp"
#include "unidentified.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kTick = 0.01;        // s between calls of the loop's timer
constexpr double kSensorRate = 20.0;  // Hz, of the recordings
constexpr double kTrackRange = 4.0;   // a Husky on a smooth floor turns by less than half of its geometry

/// The limits of the drive gate are those of a Jackal; here others have driven, faster.
LimitParameters wideLimits() {
  LimitParameters limits;
  limits.linear_speed = limits.angular_speed = 20.0;
  limits.wheel_speed = 200.0;
  limits.linear_acceleration = limits.angular_acceleration = 0.0;
  return limits;
}

PlantModel identified(const RobotRecording& recording, const CommandPath& path, PlantModel model) {
  const auto drive = driveRecording(recording, path, recording.samples.size() / 2);
  const Identification found = identifyDriveTrain(drive, recording.robot.wheel_radius);
  if (!found.gain.known()) throw IdentificationError(recording.name + ": gain: " + found.gain.unknown);
  model.identified = true;
  model.dead_time = found.dead_time.value;
  model.lag = found.lag.value;
  model.gain = found.gain.value;
  model.offset = found.offset.significant() ? found.offset.value : 0.0;
  model.acceleration_limit = found.acceleration_limit.value;
  const auto& left = found.track_left;
  const auto& right = found.track_right;
  if (left.known() && right.known()) model.effective_track = 0.5 * (left.value + right.value);
  if (left.known() != right.known()) model.effective_track = left.known() ? left.value : right.value;
  return model;
}

/// What the loop knows of the recorded robot. @param refusal why it is not identified, if it should be.
PlantModel knownModel(const PackageFiles& files, const RobotRecording& recording, const CommandPath& path,
                      RealModel kind, std::string& refusal) {
  PlantModel model = assumedModel(files);
  model.sensor_rate = kSensorRate;
  if (kind == RealModel::assumed) return model;
  try {
    return identified(recording, path, model);
  } catch (const IdentificationError& error) {
    refusal = error.what();
    return model;
  }
}

/// A node's configuration on the recorded robot, as it is delivered.
DriveParameters driveParameters(const PackageFiles& files, const RobotRecording& recording, const PlantModel& model) {
  ParameterMap map = files.configuration("predictive");
  map.set("plant_model.dead_time", model.dead_time);
  map.set("plant_model.lag", model.lag);
  const NodeParameters node = readConfiguration(map);
  DriveParameters drive = node;
  drive.plant_model = model;
  drive.geometry.wheel_radius = recording.robot.wheel_radius;
  drive.geometry.effective_track = node.robot.track_multiplier * recording.robot.wheel_distance;
  drive.geometry.slip_factor = 1.0;
  drive.geometry.track_range = kTrackRange;
  drive.gate.limits = wideLimits();
  drive.motors_shared = true;
  return drive;
}

/// Counts the times in which the loop finds a fault, or would stop the robot.
class AlarmWatch {
 public:
  void look(const DriveLoopStatus& status, double now) {
    const DriveStatus drive = status.decision.status;
    const bool stops = drive != DriveStatus::driving && drive != DriveStatus::idle;
    const bool alarmed = isFault(status.fault) || status.fault == Fault::stuck || stops;
    if (alarmed && !alarmed_) alarms_.push_back({now, reason(status)});
    alarmed_ = alarmed;
    if (status.fault == Fault::gyro_reversed && !reversed_) reversed_ = now;
  }

  bool alarmed() const { return alarmed_; }
  const std::vector<RealAlarm>& alarms() const { return alarms_; }
  std::optional<double> reversedGyroTold() const { return reversed_; }  ///< when first [s]

 private:
  bool alarmed_ = false;
  std::optional<double> reversed_;
  std::vector<RealAlarm> alarms_;
};

/// A drive loop in the place of the one that would have run on the robot.
class Replay {
 public:
  explicit Replay(const DriveParameters& parameters)
      : kinematics_(parameters.geometry), loop_(parameters, makeController(parameters)) {}

  /// @param applied what the motors got; empty if that is not known.
  void take(const RecordedSample& sample, const std::optional<WheelCommand>& applied) {
    const double now = sample.observation.stamp;
    const Observation& y = sample.observation;
    if (sample.starts) {
      loop_.start({y.wheel_left, y.wheel_right}, now);
      loop_.release();
      clock_ = now;
    }
    for (; clock_ + kTick < now; clock_ += kTick) tick(clock_ + kTick);
    loop_.freezeLearning(sample.step >= 0 && isHeldOut(sample.step), now);
    command(applied, now);
    SensorReading reading;
    reading.observation = y;
    reading.may_repeat = true;  // the recordings hold no positions, which would tell
    loop_.receiveWheels(reading, now);
    if (y.valid.yaw_rate) {
      reading.sample << y.yaw_rate, y.acceleration_x, y.acceleration_y, *y.acceleration_z, 0.0, 0.0, 0.0, 0.0;
      loop_.receiveImu(reading, now);
    }
    loop_.observe(y, now);
    tick(now);
    alarmed_ += watch_.alarmed() ? 1 : 0;
  }

  static bool isHeldOut(int step) { return step % 2 == 1; }
  const std::vector<RealAlarm>& alarms() const { return watch_.alarms(); }
  std::size_t alarmed() const { return alarmed_; }                                      ///< samples
  std::optional<double> reversedGyroTold() const { return watch_.reversedGyroTold(); }  ///< when first [s]
  const SlipBelief& slip() const { return loop_.predictive()->slipBelief(); }

 private:
  void command(const std::optional<WheelCommand>& applied, double now) {
    if (applied) loop_.applied(*applied, AppliedSource::drive, now);
    const BodyVector body = kinematics_.bodyVelocity(applied.value_or(WheelCommand{}));
    loop_.setSetPoint({body(kForward), 0.0, body(kYaw)}, now);
  }

  void tick(double now) {
    loop_.advance(now);
    watch_.look(loop_.status(), now);
  }

  SkidSteerKinematics kinematics_;
  DriveLoop loop_;
  AlarmWatch watch_;
  double clock_ = 0.0;  // s
  std::size_t alarmed_ = 0;
};

/// Error of a yaw rate per steady piece.
struct YawErrors {
  double squares = 0.0;
  std::size_t pieces = 0;
  void add(double error) {
    squares += error * error;
    ++pieces;
  }
  double rms() const { return std::sqrt(squares / static_cast<double>(pieces)); }
};

void judgeSlip(const RobotRecording& recording, const TurnModel& turn, RealFigures& figures) {
  const double radius = recording.robot.wheel_radius;
  const auto difference = [radius](const SteadyBlock& b) { return radius * (b.wheels.right - b.wheels.left); };
  double xx = 0.0, xy = 0.0;
  const auto blocks = steadyBlocks(recording);
  for (const SteadyBlock& block : blocks) {
    if (Replay::isHeldOut(block.step)) continue;
    xx += difference(block) * difference(block);
    xy += difference(block) * block.yaw_rate;
  }
  YawErrors ours, constant;
  for (const SteadyBlock& block : blocks) {
    if (!Replay::isHeldOut(block.step)) continue;
    const double v = 0.5 * radius * (block.wheels.left + block.wheels.right);
    ours.add(block.yaw_rate - turn.usualYawRate(difference(block), v));
    constant.add(block.yaw_rate - xy / xx * difference(block));
  }
  if (!recording.has_imu || ours.pieces == 0 || xx == 0.0 || constant.squares == 0.0) return;
  figures.yaw_error = ours.rms();
  figures.constant_error = constant.rms();
}

const char* name(RealModel model) { return model == RealModel::assumed ? "assumed" : "identified"; }

/// A row of the table, and of the CSV file.
struct Row {
  const RobotRecording* recording;
  const CommandPath* path;
  RealModel model;
  RealFigures figures;

  std::optional<double> ratio() const {
    if (!figures.yaw_error) return std::nullopt;
    return *figures.yaw_error / *figures.constant_error;
  }
};

std::string decimals(const std::optional<double>& value, const char* otherwise = "") {
  return value ? fmt::format("{:.3f}", *value) : otherwise;
}

/// The columns, once: what the table shows and the file holds.
std::vector<std::pair<const char*, std::string>> cells(const Row& row) {
  const RealFigures& f = row.figures;
  std::string gyro = row.recording->has_imu ? "as the wheels" : "none";
  if (f.reversed) {
    gyro = f.reversed->told ? fmt::format("reversed, told after {:.0f} s", *f.reversed->told) : "reversed, not told";
  }
  return {{"recording", row.recording->name},
          {"model", f.refusal.empty() ? name(row.model) : "refused"},
          {"duration_s", fmt::format("{:.0f}", f.duration)},
          {"samples", fmt::format("{}", f.samples)},
          {"gyro", gyro},
          {"false_alarms", fmt::format("{}", f.alarms.size())},
          {"time_in_fault_pct", fmt::format("{:.2f}", 100.0 * f.alarmed)},
          {"yaw_error_radps", decimals(f.yaw_error, "-")},
          {"best_constant_radps", decimals(f.constant_error, "-")},
          {"ratio", decimals(row.ratio(), "-")}};
}

void print(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths;
  for (const auto& cell : cells(rows.front())) widths.push_back(std::string(cell.first).size());
  for (const Row& row : rows) {
    std::size_t column = 0;
    for (const auto& cell : cells(row)) {
      widths[column] = std::max(widths[column], cell.second.size());
      ++column;
    }
  }
  const auto line = [&widths](const Row& row, bool header) {
    std::string text;
    std::size_t column = 0;
    for (const auto& cell : cells(row)) {
      text += fmt::format("{:<{}}  ", header ? cell.first : cell.second, widths[column++]);
    }
    fmt::print("{}\n", text.substr(0, text.find_last_not_of(' ') + 1));
  };
  line(rows.front(), true);
  for (const Row& row : rows) line(row, false);
  for (const Row& row : rows) {
    if (!row.figures.refusal.empty()) fmt::print("{}: not identified: {}\n", row.recording->name, row.figures.refusal);
    for (const RealAlarm& alarm : row.figures.alarms) {
      fmt::print("{}, {}: {:.2f} s: {}\n", row.recording->name, name(row.model), alarm.time, alarm.reason);
    }
  }
}

std::string csvText(const std::vector<Row>& rows) {
  std::string header, lines;
  for (const auto& cell : cells(rows.front())) header += (header.empty() ? "" : ",") + std::string(cell.first);
  for (const Row& row : rows) {
    std::string line;
    for (const auto& cell : cells(row)) line += (line.empty() ? "" : ",") + csvField(cell.second);
    lines += line + "\n";
  }
  return header + "\n" + lines;
}

}  // namespace

RealFigures replay(const PackageFiles& files, const RobotRecording& recording, const CommandPath& path,
                   RealModel model) {
  RealFigures figures;
  const DriveParameters parameters =
      driveParameters(files, recording, knownModel(files, recording, path, model, figures.refusal));
  const auto commands = appliedCommands(recording, path);
  Replay replay(parameters);
  for (std::size_t i = 0; i < commands.size(); ++i) replay.take(recording.samples[i], commands[i]);
  figures.model = *parameters.plant_model;
  figures.samples = recording.samples.size();
  figures.duration = recording.duration();
  figures.alarms = replay.alarms();
  figures.alarmed = static_cast<double>(replay.alarmed()) / static_cast<double>(figures.samples);
  judgeSlip(recording, replay.slip().turn(), figures);
  if (recording.gyro_reversed) figures.reversed = replayReversed(files, recording, path, model);
  return figures;
}

ReversedGyro replayReversed(const PackageFiles& files, const RobotRecording& recording, const CommandPath& path,
                            RealModel model) {
  const auto commands = appliedCommands(recording, path);
  std::string refusal;
  Replay replay(driveParameters(files, recording, knownModel(files, recording, path, model, refusal)));
  for (std::size_t i = 0; i < commands.size(); ++i) {
    RecordedSample sample = recording.samples[i];
    sample.observation.yaw_rate = -sample.observation.yaw_rate;
    replay.take(sample, commands[i]);
  }
  return {replay.reversedGyroTold(), replay.slip().state()};
}

std::string replayRealDrives(const PackageFiles& files, const std::string& directory, const std::string& csv,
                             unsigned jobs) {
  std::vector<RobotRecording> recordings;
  for (const std::string& path : recordingsIn(directory)) recordings.push_back(readRecording(path));
  const auto paths = parallelResults("command paths", recordings.size(), jobs,
                                     [&](std::size_t i) { return fitCommandPath(recordings[i]); });
  std::vector<Row> rows;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    for (const RealModel model : {RealModel::assumed, RealModel::identified}) {
      rows.push_back({&recordings[i], &paths[i], model, {}});
    }
  }
  const auto figures = parallelResults("recordings", rows.size(), jobs, [&](std::size_t i) {
    return replay(files, *rows[i].recording, *rows[i].path, rows[i].model);
  });
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].figures = figures[i];
  print(rows);
  if (!csv.empty()) writeText(csv, csvText(rows));
  std::size_t alarms = 0;
  std::optional<double> worst;
  for (const Row& row : rows) {
    alarms += row.figures.alarms.size();
    if (row.ratio()) worst = std::max(worst.value_or(0.0), *row.ratio());
  }
  return fmt::format("false alarms: {}; yaw error / best constant: worst {}", alarms, decimals(worst, "-"));
}

}  // namespace jackal_aic::sim
