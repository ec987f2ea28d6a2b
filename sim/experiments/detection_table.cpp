#include "detection_table.hpp"

#include <fmt/format.h>

#include <limits>
#include <random>

#include "campaign.hpp"
#include "csv.hpp"
#include "parallel.hpp"

namespace jackal_aic::sim {
namespace {

constexpr std::uint64_t kSeed = 7;
constexpr double kTenMinutes = 600.0;  // s
constexpr double kWatched = 1.0;       // s after the onset of a fault

struct Motion {
  const char* name;
  SetPoint set_point;
};

const Motion kMotions[] = {{"0.5 m/s", {0.5, 0.0, 0.0}},
                           {"1 m/s", {1.0, 0.0, 0.0}},
                           {"-0.5 m/s", {-0.5, 0.0, 0.0}},
                           {"0.5 rad/s", {0.0, 0.0, 0.5}},
                           {"0.5 m/s, 0.5 rad/s", {0.5, 0.0, 0.5}}};

struct NamedFault {
  const char* name;
  Faults faults;
  const char* on_ground;  // reason
  const char* on_box;     // reason; there the gyro cannot tell a dead encoder from a blocked wheel
};

Faults motor(Side side) {
  Faults faults;
  faults.motors = {{side, kFaultTime, std::numeric_limits<double>::infinity()}};
  return faults;
}

std::vector<NamedFault> namedFaults() {
  constexpr const char* kLeftBlocked = "left wheels do not follow their command";
  constexpr const char* kRightBlocked = "right wheels do not follow their command";
  constexpr const char* kGyro = "gyro disagrees with the wheels";
  return {
      {"left encoder frozen", sensorFault(FaultKind::freeze, FaultChannel::left), "left encoder frozen",
       "left encoder frozen"},
      {"right encoder frozen", sensorFault(FaultKind::freeze, FaultChannel::right), "right encoder frozen",
       "right encoder frozen"},
      {"left encoder dead", sensorFault(FaultKind::set, FaultChannel::left), "left encoder wrong", kLeftBlocked},
      {"gyro bias 0.2 rad/s", sensorFault(FaultKind::bias, FaultChannel::gyro, 0.2), kGyro, kGyro},
      {"gyro bias -0.2 rad/s", sensorFault(FaultKind::bias, FaultChannel::gyro, -0.2), kGyro, kGyro},
      {"gyro frozen", sensorFault(FaultKind::freeze, FaultChannel::gyro), "gyro frozen", "gyro frozen"},
      {"IMU upside down", sensorFault(FaultKind::upside_down, FaultChannel::all), "IMU upside down", "IMU upside down"},
      {"left motor blocked", motor(Side::left), kLeftBlocked, kLeftBlocked},
      {"right motor blocked", motor(Side::right), kRightBlocked, kRightBlocked}};
}

std::string lineOf(const DetectionCase& c, const std::optional<Detection>& found) {
  return fmt::format("{},{},{},{},{},{},{}\n", c.controller, c.plant, csvField(c.motion), csvField(c.fault),
                     csvField(c.expected), csvField(found ? found->reason : ""),
                     found ? fmt::format("{:.2f}", found->delay) : "");
}

std::string lineOf(const OrdinaryCase& c, const Alarms& alarms) {
  return fmt::format("{},{},{},{:g},{},{},{}\n", c.controller, c.plant, csvField(c.condition), c.duration,
                     alarms.samples, alarms.outliers, csvField(alarms.fault));
}

}  // namespace

Faults sensorFault(FaultKind kind, FaultChannel channel, double amount) {
  Faults faults;
  faults.sensors = {{kind, channel, amount, 1.0, kFaultTime, std::numeric_limits<double>::infinity()}};
  return faults;
}

std::vector<DetectionCase> detectionCases(World world) {
  using Loops = std::vector<std::pair<const char*, const char*>>;
  const Loops loops = world == World::real
                          ? Loops{{"predictive", "real"}, {"improved", "real"}}
                          : Loops{{"predictive", "ground"}, {"predictive", "box"}, {"improved", "ground"}};
  std::vector<DetectionCase> cases;
  for (const auto& [controller, plant] : loops) {
    for (const Motion& motion : kMotions) {
      for (const NamedFault& fault : namedFaults()) {
        const bool on_box = std::string(plant) == "box";
        cases.push_back({controller, plant, motion.name, motion.set_point, fault.name, fault.faults,
                         on_box ? fault.on_box : fault.on_ground});
      }
    }
  }
  return cases;
}

std::optional<Detection> runCase(const PackageFiles& files, const DetectionCase& c) {
  SetPointProfile profile;
  profile.changes = {{kRestTime, c.set_point}};
  profile.duration = kFaultTime + kWatched;
  const LoopSetup setup = loadSetup(files, c.controller, c.plant, {});
  return detection(runMonitored(setup, monitorModel(files, c.plant), profile, c.faults), kFaultTime);
}

std::vector<OrdinaryCase> ordinaryCases(World world) {
  if (world == World::real) {
    return {{"predictive", "real", "as configured", {}, kTenMinutes},
            {"improved", "real", "as configured", {}, kTenMinutes}};
  }
  const std::pair<const char*, Overrides> conditions[] = {
      {"as calibrated", {}},
      {"noise x 5", {{"plant.noise_scale", "5"}}},
      {"no noise", {{"plant.noise_scale", "0"}}},
      {"10 % of the samples lost", {{"plant.measurement_loss", "0.1"}}},
      {"friction 0.25", {{"plant.friction", "0.25"}}},
      {"friction 1", {{"plant.friction", "1.0"}}},
      {"5 deg uphill", {{"plant.slope", "5"}}},
      {"10 deg downhill", {{"plant.slope", "-10"}}},
      {"payload 8 kg", {{"plant.payload", "8"}}}};
  constexpr std::size_t kOnBoxToo = 4;  // of the conditions; the others are of the ground
  std::vector<OrdinaryCase> cases;
  for (const auto& [name, overrides] : conditions) {
    cases.push_back({"predictive", "ground", name, overrides, kTenMinutes});
  }
  for (std::size_t i = 0; i < kOnBoxToo; ++i) {
    cases.push_back({"predictive", "box", conditions[i].first, conditions[i].second, kTenMinutes});
  }
  for (const char* plant : {"ground", "box"}) cases.push_back({"improved", plant, "as calibrated", {}, kTenMinutes});
  return cases;
}

SetPointProfile ordinaryDriving(std::uint64_t seed, double duration) {
  const double speeds[] = {0.0, 0.1, 0.3, 0.5, 1.0, -0.5};
  const double turns[] = {0.0, 0.2, 0.5, 1.0, -0.5, -1.0};
  std::mt19937_64 random(seed);
  const auto pick = [&](const double(&values)[6]) { return values[random() % 6]; };
  SetPointProfile profile;
  double time = kRestTime;
  const auto add = [&](const SetPoint& set_point, double seconds) {
    profile.changes.push_back({time, set_point});
    time += seconds;
  };
  while (time < duration) {
    const double length = 1.0 + 0.001 * static_cast<double>(random() % 3000);
    const auto kind = random() % 4;
    const double forward = pick(speeds), yaw_rate = pick(turns);
    if (kind == 0) add({forward, 0.0, 0.0}, length);
    if (kind == 1) add({0.0, 0.0, yaw_rate}, length);
    if (kind == 2) add({forward, 0.0, yaw_rate}, length);
    for (int half = 0; kind == 3 && half < 6; ++half) add({half % 2 == 0 ? 0.1 : 0.5, 0.0, 0.0}, 2.0);
  }
  profile.duration = duration;
  return profile;
}

void AlarmCounter::add(const MonitoredSample& sample) {
  ++alarms_.samples;
  if (!sample.counted.all()) ++alarms_.outliers;
  const std::string reason = sample.report.reason();
  if (reason != reason_ && !reason.empty()) {
    if (alarms_.faults++ == 0) alarms_.fault = fmt::format("{} at {:.6f} s", reason, sample.time);
  }
  reason_ = reason;
}

Alarms runOrdinary(const PackageFiles& files, const OrdinaryCase& c, double duration) {
  const LoopSetup setup = loadSetup(files, c.controller, c.plant, c.overrides);
  AlarmCounter alarms;
  runMonitored(setup, monitorModel(files, c.plant), ordinaryDriving(kSeed, duration), {},
               [&alarms](const MonitoredSample& sample) { alarms.add(sample); });
  return alarms.alarms();
}

void writeDetectionTables(const PackageFiles& files, const std::string& directory, unsigned jobs, World world) {
  const auto detections = detectionCases(world);
  const auto ordinary = ordinaryCases(world);
  // The long runs first, so that no thread ends alone with one of them.
  const auto lines = parallelResults("detection", ordinary.size() + detections.size(), jobs, [&](std::size_t i) {
    if (i < ordinary.size()) return lineOf(ordinary[i], runOrdinary(files, ordinary[i], ordinary[i].duration));
    const DetectionCase& c = detections[i - ordinary.size()];
    return lineOf(c, runCase(files, c));
  });
  const auto begin_of_detections = lines.begin() + static_cast<std::ptrdiff_t>(ordinary.size());
  writeTable(directory, "detection.csv",
             fmt::format("controller,plant,motion,fault,expected,found,delay_s\n{}",
                         fmt::join(begin_of_detections, lines.end(), "")));
  writeTable(directory, "alarms.csv",
             fmt::format("controller,plant,condition,duration_s,samples,outliers,fault\n{}",
                         fmt::join(lines.begin(), begin_of_detections, "")));
}

}  // namespace jackal_aic::sim
