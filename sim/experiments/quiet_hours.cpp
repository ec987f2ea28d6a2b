#include "quiet_hours.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "parallel.hpp"
#include "perturbation.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kDriveTime = 1800.0;     // s
constexpr double kFastestInAnArc = 2.0;   // m/s^2 across: half of what the ground holds
constexpr double kJoystickPeriod = 0.05;  // s
constexpr const char* kQuietEncoderSteps[] = {"0", "0.0065", "0.0131", "0.06", "0.1"};  // rad/s
constexpr const char* kEncoderNoises[] = {"0", "0.003", "0.03"};                        // rad/s
constexpr const char* kJitters[] = {"0", "0.008"};                                      // s

/// Draws, in the order in which they are asked for.
class Draws {
 public:
  Draws(std::uint64_t seed, std::uint64_t number) : generator_(seed * 1000003 + number) {}

  std::uint64_t below(std::uint64_t count) { return generator_() % count; }
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(generator_() >> 11) * 0x1p-53;
  }
  double sign() { return below(2) == 0 ? 1.0 : -1.0; }
  template <std::size_t n>
  const char* oneOf(const char* const (&words)[n]) {
    return words[below(n)];
  }

 private:
  std::mt19937_64 generator_;
};

SetPoint arc(Draws& draw) {
  const double forward = draw.between(0.1, 1.5);
  const double fastest = std::min(2.0, kFastestInAnArc / forward);
  return {draw.sign() * forward, 0.0, draw.sign() * draw.between(0.1, fastest)};
}

/// A hand at a joystick: targets that change now and then, and a stick that follows them in its own time.
std::vector<SetPointProfile::Change> joystick(Draws& draw, double duration) {
  std::vector<SetPointProfile::Change> changes;
  SetPoint target, stick;
  double until = kRestTime, agility = 1.0;
  for (double time = kRestTime; time < duration; time += kJoystickPeriod) {
    if (time >= until) {
      const auto kind = draw.below(5);
      const SetPoint next = arc(draw);
      target = {kind == 0 || kind == 1 ? 0.0 : next.forward, 0.0, kind == 0 || kind == 2 ? 0.0 : next.yaw_rate};
      until = time + draw.between(0.2, 5.0);
      agility = draw.between(0.1, 1.0);
    }
    stick.forward += agility * (target.forward - stick.forward);
    stick.yaw_rate += agility * (target.yaw_rate - stick.yaw_rate);
    if ((target.vector() - stick.vector()).norm() < 0.02) stick = target;
    changes.push_back({time, stick});
  }
  return changes;
}

std::vector<SetPointProfile::Change> arcs(Draws& draw, double duration) {
  std::vector<SetPointProfile::Change> changes;
  for (double time = kRestTime; time < duration; time += draw.between(5.0, 60.0)) changes.push_back({time, arc(draw)});
  return changes;
}

void drawMotion(Draws& draw, QuietDrive& drive, double duration) {
  const auto steady = [&](const char* name, const SetPoint& set_point) {
    drive.motion = fmt::format("{} {:g} m/s {:g} rad/s", name, set_point.forward, set_point.yaw_rate);
    drive.profile.changes = {{kRestTime, set_point}};
  };
  drive.profile.duration = duration;
  switch (draw.below(6)) {
    case 0:
      return steady("turn", {0.0, 0.0, draw.sign() * 0.1 * std::pow(20.0, draw.between(0.0, 1.0))});
    case 1:
      return steady("circle", arc(draw));
    case 2:
      return steady("straight", {draw.sign() * 0.1 * std::pow(20.0, draw.between(0.0, 1.0)), 0.0, 0.0});
    case 3:
      drive.motion = "arcs";
      drive.profile.changes = arcs(draw, duration);
      return;
    case 4:
      drive.motion = "joystick";
      drive.profile.changes = joystick(draw, duration);
      return;
    default:
      return steady("stand", {});
  }
}

/// Even in the logarithm.
double ratio(Draws& draw, double low, double high) { return low * std::pow(high / low, draw.between(0.0, 1.0)); }

DriveTrainRatios drawRobot(Draws& draw, QuietRobots robots) {
  DriveTrainRatios robot;
  robot.acceleration_limit = ratio(draw, 0.5, 3.0);
  if (robots == QuietRobots::identified) return robot;
  robot.dead_time = ratio(draw, 0.5, 2.0);
  robot.lag = ratio(draw, 0.5, 2.0);
  robot.gain = draw.between(0.8, 1.2);
  return robot;
}

}  // namespace

PlantParameters scaled(PlantParameters plant, const DriveTrainRatios& ratios) {
  plant.dead_time *= ratios.dead_time;
  plant.motor_lag *= ratios.lag;
  plant.wheel_gain *= ratios.gain;
  plant.acceleration_limit *= ratios.acceleration_limit;
  return plant;
}

SetPointProfile joystickDriving(std::uint64_t seed, double duration) {
  Draws draw(seed, 0);
  SetPointProfile profile;
  profile.changes = joystick(draw, duration);
  profile.duration = duration;
  return profile;
}

QuietDrive drawQuietDrive(std::uint64_t seed, std::uint64_t number, double duration, QuietRobots robots, World world) {
  Draws draw(seed, number);
  QuietDrive drive;
  drive.controller = controllerNames()[draw.below(controllerNames().size())];
  drive.plant = draw.oneOf(kCalibratedPlants);
  drive.identified = robots == QuietRobots::identified;
  drive.robot = drawRobot(draw, robots);
  drive.overrides = {{"plant.encoder_step", draw.oneOf(kQuietEncoderSteps)},
                     {"plant.encoder_noise", draw.oneOf(kEncoderNoises)},
                     {"plant.stamp_jitter", draw.oneOf(kJitters)},
                     {"plant.seed", fmt::format("{}", 1 + draw.below(1000))}};
  drawMotion(draw, drive, duration);
  if (world == World::real) {
    drive.plant = "real";
    drive.overrides = drawReality(seed * 1000003 + number);
  }
  return drive;
}

std::string describe(const QuietDrive& drive) {
  std::string line = drive.controller + " on " + drive.plant + ", " + drive.motion;
  for (const auto& [key, value] : drive.overrides) line += ", " + key + "=" + value;
  const DriveTrainRatios& robot = drive.robot;
  return line + fmt::format(", dead time x {:g}, lag x {:g}, gain x {:g}, limit x {:g}", robot.dead_time, robot.lag,
                            robot.gain, robot.acceleration_limit);
}

Alarms runQuiet(const PackageFiles& files, const QuietDrive& drive) {
  LoopSetup setup = loadSetup(files, drive.controller, drive.plant, drive.overrides);
  setup.plant = scaled(setup.plant, drive.robot);
  PlantModel model = monitorModel(files, drive.plant);
  model.identified = drive.identified;
  AlarmCounter alarms;
  runMonitored(setup, model, drive.profile, {}, [&](const MonitoredSample& sample) { alarms.add(sample); });
  return alarms.alarms();
}

std::size_t runQuietHours(const PackageFiles& files, double hours, std::uint64_t seed, QuietRobots robots,
                          unsigned jobs, World world) {
  const double drives = hours * 3600.0 / kDriveTime;
  if (!(drives >= 1.0) || drives > 1e6 || drives != std::floor(drives)) {
    throw ParameterError(fmt::format("quiet-hours = {:g}: must be a multiple of 0.5 and at most 500000 h", hours));
  }
  const auto draw = [&](std::size_t i) { return drawQuietDrive(seed, i, kDriveTime, robots, world); };
  const auto found = parallelResults("quiet hours", static_cast<std::size_t>(drives), jobs,
                                     [&](std::size_t i) { return runQuiet(files, draw(i)); });
  std::size_t faults = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    faults += found[i].faults;
    if (found[i].faults == 0) continue;
    fmt::print("{}: {}: {} alarms, first {}\n", i, describe(draw(i)), found[i].faults, found[i].fault);
  }
  fmt::print("false alarms: {} in {:g} hours\n", faults, hours);
  return faults;
}

}  // namespace jackal_aic::sim
