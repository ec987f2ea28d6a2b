#include "robot_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlopt.hpp>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/config/text.hpp"

namespace jackal_aic::sim {
namespace {

constexpr RecordedRobot kRobots[] = {{"husky", 0.1651, 0.5708}, {"warthog", 0.30, 1.1652}};

constexpr double kSamplePeriod = 0.05;       // s, of the samples
constexpr double kLongestGap = 0.175;        // s within a stretch; what is silent for longer is by its deadline
constexpr double kPause = 10.0;              // s that the clock shows between stretches of windows, which have none
constexpr double kSteady = 2.0;              // s after a command of a log until the robot moves steadily
constexpr double kWindow = 2.0;              // s
constexpr std::size_t kMostRows = 10000000;  // six days
constexpr std::size_t kLongestLine = 10000;  // characters
constexpr double kLargest = 1e10;            // of any number, larger than every date

const std::vector<std::string> kSensors{"wheel_left_radps", "wheel_right_radps", "gyro_z_radps",
                                        "accel_x_mps2",     "accel_y_mps2",      "accel_z_mps2",
                                        "lidar_x_m",        "lidar_y_m",         "lidar_yaw_rad"};

std::vector<std::string> columns(std::vector<std::string> first) {
  first.insert(first.end(), kSensors.begin(), kSensors.end());
  return first;
}

const std::vector<std::string>& logColumns() {
  static const auto names = columns({"time_s", "state", "command_forward_mps", "command_yaw_radps"});
  return names;
}

const std::vector<std::string>& windowColumns() {
  static const auto names = columns({"window", "calib_step", "steady", "time_s", "cmd_left_radps", "cmd_right_radps"});
  return names;
}

/// Rows of a file with the columns of one of the kinds.
class Table {
 public:
  explicit Table(const std::string& path) : path_(path), file_(path) {
    if (!file_) throw ParameterError(quoted(path) + ": cannot be read");
    std::vector<std::string> header;
    if (!nextFields(header)) throw ParameterError(quoted(path) + ": empty");
    log_ = header == logColumns();
    if (!log_ && header != windowColumns()) {
      throw ParameterError(
          fmt::format("{} line 1: columns of no known kind of recording; a log begins with {}, {}, "
                      "windows with {}, {}, and each has {} or {}",
                      quoted(path), logColumns()[0], logColumns()[1], windowColumns()[0], windowColumns()[1],
                      logColumns().size(), windowColumns().size()));
    }
  }

  bool isLog() const { return log_; }

  bool next() {
    if (!nextFields(fields_)) return false;
    if (line_ > kMostRows) fail(fmt::format("more than {} rows", kMostRows));
    if (fields_.size() == names().size()) return true;
    fail(fmt::format("{} fields: must be {}", fields_.size(), names().size()));
  }

  const std::string& text(std::size_t column) const { return fields_[column]; }

  double number(std::size_t column) const {
    const std::string& text = fields_[column];
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (text.empty() || end != text.c_str() + text.size() || !std::isfinite(value)) {
      fail(fmt::format("{} = {}: must be a finite number", names()[column], quoted(text)));
    }
    if (std::abs(value) <= kLargest) return value;
    fail(fmt::format("{} = {}: must be within +-{:g}", names()[column], quoted(text), kLargest));
  }

  int count(std::size_t column) const {
    const double value = number(column);
    if (value == std::floor(value) && std::abs(value) < 1e9) return static_cast<int>(value);
    fail(fmt::format("{} = {}: must be a whole number", names()[column], quoted(fields_[column])));
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw ParameterError(fmt::format("{} line {}: {}", quoted(path_), line_, what));
  }

 private:
  const std::vector<std::string>& names() const { return log_ ? logColumns() : windowColumns(); }

  bool nextFields(std::vector<std::string>& fields) {
    std::string line;
    if (!nextLine(line)) return false;
    ++line_;
    if (line.size() > kLongestLine) fail(fmt::format("longer than {} characters", kLongestLine));
    if (!line.empty() && line.back() == '\r') line.pop_back();
    fields.assign(1, "");
    for (const char c : line) {
      if (c == ',') {
        fields.emplace_back();
      } else {
        fields.back() += c;
      }
    }
    return true;
  }

  /// Like std::getline(), but no further than a character beyond the longest line.
  bool nextLine(std::string& line) {
    char c = 0;
    while (line.size() <= kLongestLine && file_.get(c) && c != '\n') line += c;
    return !line.empty() || !file_.fail();
  }

  std::string path_;
  std::ifstream file_;
  std::vector<std::string> fields_;
  std::size_t line_ = 0;
  bool log_ = true;
};

void readSensors(const Table& table, std::size_t first, RecordedSample& sample) {
  Observation& y = sample.observation;
  y.wheel_left = table.number(first);
  y.wheel_right = table.number(first + 1);
  y.yaw_rate = table.number(first + 2);
  y.acceleration_x = table.number(first + 3);
  y.acceleration_y = table.number(first + 4);
  y.acceleration_z = table.number(first + 5);
  table.number(first + 6);  // where the robot is, nobody asks; but it has to be a number
  table.number(first + 7);
  sample.heading = table.number(first + 8);
}

void readLog(Table& table, const RecordedRobot& robot, std::vector<RecordedSample>& samples) {
  double since = 0.0;  // time of the last change of command
  double forward = 0.0, yaw_rate = 0.0;
  int step = -1;
  while (table.next()) {
    RecordedSample sample;
    const double time = table.number(0);
    if (!samples.empty() && time <= samples.back().observation.stamp) {
      table.fail(fmt::format("time_s = {}: must be above {}, that of the row before", quoted(table.text(0)),
                             samples.back().observation.stamp));
    }
    const double v = table.number(2), w = table.number(3);
    const bool known = table.text(1) == "calib";
    // Whoever drives changes with the state, and what he sent last is not in the log.
    sample.starts = samples.empty() || known != samples.back().command.has_value() ||
                    time - samples.back().observation.stamp > kLongestGap;
    if (known && (sample.starts || v != forward || w != yaw_rate)) {
      ++step;
      since = time;
    }
    forward = v;
    yaw_rate = w;
    sample.observation.stamp = time;
    if (known) {
      const double half = 0.5 * robot.wheel_distance * w;
      sample.command = WheelCommand{(v - half) / robot.wheel_radius, (v + half) / robot.wheel_radius};
      sample.step = step;
      sample.steady = time - since >= kSteady;
    }
    readSensors(table, 4, sample);
    samples.push_back(sample);
  }
}

void readWindows(Table& table, std::vector<RecordedSample>& samples) {
  int window = 0;
  double begin = 0.0, last = 0.0;  // s, of the window on the recording's clock, and of the last row in its window
  while (table.next()) {
    RecordedSample sample;
    const bool first = samples.empty(), next = first || table.count(0) != window;
    const bool missing = next && !first && table.count(0) != window + 1;
    window = table.count(0);
    sample.step = table.count(1);
    sample.steady = table.count(2) != 0;
    const double time = table.number(3);
    if (time < 0.0 || time >= kWindow || (!next && time <= last)) {
      table.fail(
          fmt::format("time_s = {}: must be in [0, {:g}) and increase in a window", quoted(table.text(3)), kWindow));
    }
    last = time;
    sample.starts = first || missing || sample.step != samples.back().step;
    if (next && !first) begin += kWindow + (sample.starts ? kPause : 0.0);
    sample.observation.stamp = begin + time;
    sample.command = WheelCommand{table.number(4), table.number(5)};
    readSensors(table, 6, sample);
    samples.push_back(sample);
  }
}

/// Whether the gyro counts the other way than the wheels turn the robot, and it is not the wheels that do, against
/// their commands.
bool gyroReversed(const std::vector<RecordedSample>& samples) {
  double together = 0.0, followed = 0.0;
  for (const auto& s : samples) {
    const double turn = s.observation.wheel_right - s.observation.wheel_left;
    together += s.observation.yaw_rate * turn;
    if (s.command) followed += (s.command->right - s.command->left) * turn;
  }
  return together < 0.0 && followed >= 0.0;
}

const RecordedRobot& robotOf(const std::filesystem::path& path) {
  const std::string name = path.stem().string();
  std::string known;
  for (const RecordedRobot& robot : kRobots) {
    if (name.rfind(robot.prefix, 0) == 0) return robot;
    known += (known.empty() ? "" : ", ") + std::string(robot.prefix);
  }
  throw ParameterError(
      fmt::format("{}: begins with the name of no known robot; known: {}", quoted(path.string()), known));
}

double magnitude(const WheelCommand& c) { return std::max(std::abs(c.left), std::abs(c.right)); }

double median(std::vector<double> values, double otherwise) {
  if (values.empty()) return otherwise;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double mean(const WheelCommand& c) { return 0.5 * (c.left + c.right); }
double difference(const WheelCommand& c) { return c.right - c.left; }

/// Median of measured / recorded over the pieces in which a part of the command is moderate: neither noise nor cut.
double ratio(const std::vector<SteadyBlock>& blocks, double (*part)(const WheelCommand&)) {
  std::vector<double> asked;
  for (const auto& block : blocks) asked.push_back(std::abs(part(block.command)));
  const double moderate = median(asked, 0.0);
  std::vector<double> ratios;
  for (const auto& block : blocks) {
    const double recorded = part(block.command);
    if (std::abs(recorded) > 0.2 * moderate && std::abs(recorded) < moderate) {
      ratios.push_back(part(block.wheels) / recorded);
    }
  }
  return std::clamp(median(ratios, 1.0), 0.2, 5.0);
}

/// Whether a part of the wheels' speeds follows that of the commands at all, as far as it is commanded.
bool follows(const std::vector<SteadyBlock>& blocks, double (*part)(const WheelCommand&)) {
  constexpr double kLeast = 0.05;  // wheels / command
  double squares = 0.0, together = 0.0;
  for (const auto& block : blocks) {
    squares += part(block.command) * part(block.command);
    together += part(block.command) * part(block.wheels);
  }
  return together >= kLeast * squares;
}

/// A command by what it does to the body.
struct Parts {
  double forward = 0.0;     // mean of the sides [rad/s]
  double difference = 0.0;  // of the sides [rad/s]
};

Parts partsOf(const WheelCommand& wheels) { return {mean(wheels), difference(wheels)}; }

/// The parts of a command after gains and cut.
Parts partsOf(const CommandPath& path, const WheelCommand& recorded) {
  return {path.forward_gain * mean(recorded),
          std::clamp(path.yaw_gain * difference(recorded), -path.largest_difference, path.largest_difference)};
}

WheelCommand slowed(const CommandPath& path, const Parts& parts) {
  WheelCommand command{parts.forward - 0.5 * parts.difference, parts.forward + 0.5 * parts.difference};
  const double slower = std::min(1.0, path.largest_wheel_speed / std::max(magnitude(command), 1e-9));
  command.left *= slower;
  command.right *= slower;
  return command;
}

/// A value a sample later on its way to a goal. @param rate largest [1/s].
double towards(double value, double goal, double rate) {
  return value + std::clamp(goal - value, -rate * kSamplePeriod, rate * kSamplePeriod);
}

CommandPath pathOf(const std::vector<double>& p) {
  CommandPath path;
  path.forward_gain = p[0];
  path.yaw_gain = p[1];
  path.largest_difference = p[2];
  path.largest_wheel_speed = p[3];
  return path;
}

/// Sum of the absolute errors of a path over the pieces at `data` [rad/s].
double pathError(const std::vector<double>& p, std::vector<double>&, void* data) {
  const CommandPath path = pathOf(p);
  double sum = 0.0;
  for (const SteadyBlock& block : *static_cast<const std::vector<SteadyBlock>*>(data)) {
    sum += (path.applied(block.command).vector() - block.wheels.vector()).lpNorm<1>();
  }
  return sum;
}

/// Gains and cuts.
CommandPath steadyPath(const std::vector<SteadyBlock>& blocks) {
  double fastest = 0.0, widest = 0.0;
  for (const auto& block : blocks) {
    fastest = std::max(fastest, magnitude(block.wheels));
    widest = std::max(widest, std::abs(difference(block.wheels)));
  }
  constexpr double kLeast = 0.1;  // of gains and cuts
  std::vector<double> p{ratio(blocks, mean), ratio(blocks, difference), 0.95 * widest, 0.95 * fastest};
  for (double& value : p) value = std::max(value, kLeast);  // also where the robot stood, or never turned
  nlopt::opt search(nlopt::LN_SBPLX, 4);
  search.set_min_objective(pathError, const_cast<std::vector<SteadyBlock>*>(&blocks));
  search.set_lower_bounds(std::vector<double>(4, kLeast));
  search.set_upper_bounds({10.0, 10.0, 2.0 * widest + 0.2, 2.0 * fastest + 0.2});
  search.set_initial_step({0.1, 0.1, 0.1 * widest + 0.01, 0.1 * fastest + 0.01});
  search.set_xtol_rel(1e-4);
  search.set_maxeval(2000);
  double least = 0.0;
  search.optimize(p, least);
  return pathOf(p);
}

/// Sum of the absolute errors of one part of the command against that of the wheels some samples later [rad/s].
double rateError(const RobotRecording& recording, const CommandPath& path, double Parts::*part, double rate,
                 std::size_t delay) {
  const auto& samples = recording.samples;
  double sum = 0.0, now = 0.0;
  std::size_t begin = 0;  // of the stretch
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto measured = [&](std::size_t k) {
      return partsOf(WheelCommand{samples[k].observation.wheel_left, samples[k].observation.wheel_right}).*part;
    };
    if (samples[i].starts) {
      begin = i;
      now = measured(i);
    }
    if (!samples[i].command || i < begin + delay) continue;
    now = towards(now, partsOf(path, *samples[i - delay].command).*part, rate);
    sum += std::abs(now - measured(i));
  }
  return sum;
}

/// The rate that explains a part of the wheels' speeds best, whatever the delay up to 0.4 s [rad/s^2].
double bestRate(const RobotRecording& recording, const CommandPath& path, double Parts::*part) {
  constexpr double kSlowest = 0.5, kFastest = 100.0, kFiner = 1.15;  // rad/s^2, rad/s^2, ratio
  constexpr std::size_t kLongestDelay = 8;                           // samples
  double best = kFastest, least = HUGE_VAL;
  for (double rate = kSlowest; rate <= kFastest; rate *= kFiner) {
    for (std::size_t delay = 0; delay <= kLongestDelay; ++delay) {
      const double error = rateError(recording, path, part, rate, delay);
      if (error >= least) continue;
      least = error;
      best = rate;
    }
  }
  return best;
}

}  // namespace

double RobotRecording::duration() const { return kSamplePeriod * static_cast<double>(samples.size()); }

std::vector<std::string> recordingsIn(const std::string& directory) {
  std::vector<std::string> paths;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(directory, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().extension() == ".csv" && entry->is_regular_file(error)) paths.push_back(entry->path().string());
  }
  if (error) throw ParameterError(fmt::format("data = {}: {}", quoted(directory), error.message()));
  if (paths.empty()) throw ParameterError(fmt::format("data = {}: holds no file *.csv", quoted(directory)));
  std::sort(paths.begin(), paths.end());
  return paths;
}

RobotRecording readRecording(const std::string& path) {
  const std::filesystem::path file(path);
  RobotRecording recording{shortened(file.stem().string()), robotOf(file), true, false, {}};
  Table table(path);
  if (table.isLog()) {
    readLog(table, recording.robot, recording.samples);
  } else {
    readWindows(table, recording.samples);
  }
  auto& samples = recording.samples;
  if (samples.empty()) throw ParameterError(quoted(path) + ": has no rows");
  recording.has_imu = std::any_of(samples.begin(), samples.end(), [](const RecordedSample& s) {
    return s.observation.yaw_rate != 0.0 || *s.observation.acceleration_z != 0.0;
  });
  recording.gyro_reversed = gyroReversed(samples);
  for (RecordedSample& sample : samples) {
    Observation& y = sample.observation;
    if (recording.gyro_reversed) y.yaw_rate = -y.yaw_rate;
    y.valid.yaw_rate = y.valid.acceleration = recording.has_imu;
  }
  return recording;
}

std::vector<SteadyBlock> steadyBlocks(const RobotRecording& recording) {
  std::vector<SteadyBlock> blocks;
  WheelVector sum = WheelVector::Zero();
  double turn = 0.0;  // of the gyro, or of the heading [rad]
  std::size_t count = 0;
  for (std::size_t i = 0; i < recording.samples.size(); ++i) {
    const RecordedSample& s = recording.samples[i];
    const bool goes_on = count > 0 && !s.starts && s.step == recording.samples[i - 1].step;
    if (!goes_on) {
      sum.setZero();
      turn = 0.0;
      count = 0;
    }
    if (!s.steady || !s.command) {
      count = 0;
      sum.setZero();
      turn = 0.0;
      continue;
    }
    sum += WheelVector(s.observation.wheel_left, s.observation.wheel_right);
    if (recording.has_imu) turn += s.observation.yaw_rate;
    if (!recording.has_imu && count > 0) {
      turn += std::remainder(s.heading - recording.samples[i - 1].heading, 2.0 * M_PI) / kSamplePeriod;
    }
    if (++count < SteadyBlock::kLength) continue;
    const auto n = static_cast<double>(SteadyBlock::kLength);
    blocks.push_back({s.step, *s.command, WheelCommand::from(sum / n), turn / (recording.has_imu ? n : n - 1.0)});
    count = 0;
    sum.setZero();
    turn = 0.0;
  }
  return blocks;
}

WheelCommand CommandPath::applied(const WheelCommand& recorded) const {
  return slowed(*this, partsOf(*this, recorded));
}

CommandPath fitCommandPath(const RobotRecording& recording) {
  constexpr std::size_t kFew = 8;
  const std::vector<SteadyBlock> blocks = steadyBlocks(recording);
  if (blocks.size() < kFew || !follows(blocks, mean) || !follows(blocks, difference)) return {};
  CommandPath path = steadyPath(blocks);
  path.largest_forward_rate = bestRate(recording, path, &Parts::forward);
  path.largest_difference_rate = bestRate(recording, path, &Parts::difference);
  return path;
}

std::vector<std::optional<WheelCommand>> appliedCommands(const RobotRecording& recording, const CommandPath& path) {
  std::vector<std::optional<WheelCommand>> commands;
  Parts now;
  for (const RecordedSample& s : recording.samples) {
    if (s.starts) now = partsOf({s.observation.wheel_left, s.observation.wheel_right});
    commands.emplace_back();
    if (!s.command) continue;
    const Parts goal = partsOf(path, *s.command);
    now.forward = towards(now.forward, goal.forward, path.largest_forward_rate);
    now.difference = towards(now.difference, goal.difference, path.largest_difference_rate);
    commands.back() = slowed(path, now);
  }
  return commands;
}

DriveRecording driveRecording(const RobotRecording& recording, const CommandPath& path, std::size_t end) {
  DriveRecording drive;
  const auto commands = appliedCommands(recording, path);
  for (std::size_t i = 0; i < std::min(end, recording.samples.size()); ++i) {
    if (!commands[i]) continue;
    const Observation& y = recording.samples[i].observation;
    drive.commands.push_back({y.stamp, *commands[i]});
    drive.wheels.push_back({y.stamp, {y.wheel_left, y.wheel_right}});
    if (recording.has_imu) drive.yaw.push_back({y.stamp, y.yaw_rate});
  }
  return drive;
}

}  // namespace jackal_aic::sim
