// Recordings of real robots through the drive loop. They are not part of the package: JACKAL_AIC_REAL_DATA says where
// they are, and without it these tests are skipped.

#include "real_drives.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <regex>
#include <utility>
#include <vector>

#include "commands.hpp"

namespace jackal_aic::sim {
namespace {

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

/// Where the recordings are; empty if they are not here.
std::string data() {
  const char* directory = std::getenv("JACKAL_AIC_REAL_DATA");
  return directory == nullptr ? "" : directory;
}

TEST(RealDrives, AbsentDataAreSkipped) {
  testing::internal::CaptureStdout();
  EXPECT_EQ(runCommand({"real", "--data", "/nonexistent/recordings"}), 0);
  EXPECT_EQ(testing::internal::GetCapturedStdout().rfind("skipped: ", 0), 0u);
}

TEST(RealDrives, RaiseNoAlarmAndTeachTheTurnWithEitherModel) {
  if (data().empty()) GTEST_SKIP() << "JACKAL_AIC_REAL_DATA is not set";
  testing::internal::CaptureStdout();
  const std::string summary = replayRealDrives(files(), data(), "", 1);
  const std::string table = testing::internal::GetCapturedStdout();
  const std::regex format("false alarms: [0-9]+; yaw error / best constant: worst ([0-9]+\\.[0-9]{3}|-)");
  EXPECT_TRUE(std::regex_match(summary, format)) << summary;
  EXPECT_EQ(summary.rfind("false alarms: 0;", 0), 0u) << table;
  for (const std::string& path : recordingsIn(data())) {
    const std::string name = readRecording(path).name;
    for (const char* model : {"assumed", "identified"}) {
      std::smatch row;
      ASSERT_TRUE(std::regex_search(table, row, std::regex(name + " +" + model + " +[0-9]+.* ([0-9.]+|-) *\n")))
          << name << " " << model;
      if (row[1] == "-") continue;
      // How the turn depends on the motion is learned where it matters, and costs nothing elsewhere.
      const bool depends = name.find("asphalt") != std::string::npos;
      EXPECT_LE(std::stod(row[1]), depends ? 0.65 : 1.05) << name << " " << model;
    }
  }
}

/// A recording whose steps are put into another order; each of them stays as it was.
RobotRecording shuffled(RobotRecording recording, unsigned seed) {
  std::vector<std::vector<RecordedSample>> stretches;
  for (const RecordedSample& sample : recording.samples) {
    if (sample.starts) stretches.emplace_back();
    stretches.back().push_back(sample);
  }
  std::mt19937 random(seed);
  for (std::size_t i = stretches.size() - 1; i > 0; --i) std::swap(stretches[i], stretches[random() % (i + 1)]);
  recording.samples.clear();
  double clock = 0.0;
  for (std::vector<RecordedSample>& stretch : stretches) {
    const double shift = clock - stretch.front().observation.stamp;
    for (RecordedSample& sample : stretch) {
      sample.observation.stamp += shift;
      recording.samples.push_back(sample);
    }
    clock = recording.samples.back().observation.stamp + 10.0;
  }
  return recording;
}

/// A recording whose wheels are measured anew only with every n-th sample of a stretch. @param samples n.
RobotRecording held(RobotRecording recording, std::size_t samples) {
  std::size_t since = 0;
  for (std::size_t i = 0; i < recording.samples.size(); ++i, ++since) {
    if (recording.samples[i].starts) since = 0;
    if (since % samples == 0) continue;
    const Observation& before = recording.samples[i - 1].observation;
    recording.samples[i].observation.wheel_left = before.wheel_left;
    recording.samples[i].observation.wheel_right = before.wheel_right;
  }
  return recording;
}

/// A recording of an encoder with another resolution [rad/s].
RobotRecording rounded(RobotRecording recording, double step) {
  for (RecordedSample& sample : recording.samples) {
    Observation& y = sample.observation;
    y.wheel_left = step * std::round(y.wheel_left / step);
    y.wheel_right = step * std::round(y.wheel_right / step);
  }
  return recording;
}

/// A part of a recording, from one share of its samples to another.
RobotRecording partOf(RobotRecording recording, double begin, double end) {
  const std::vector<RecordedSample> all = recording.samples;
  const auto at = [&](double share) {
    return all.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(all.size()));
  };
  recording.samples.assign(at(begin), at(end));
  recording.samples.front().starts = true;
  return recording;
}

/// A recording of the same wheels on ground on which they turn the body by a part of what they did.
RobotRecording slipperier(RobotRecording recording, double share) {
  for (RecordedSample& sample : recording.samples) sample.observation.yaw_rate *= share;
  return recording;
}

/// A recording of a gyro whose driver publishes zero below a rate [rad/s].
RobotRecording withDeadZone(RobotRecording recording, double rate) {
  for (RecordedSample& sample : recording.samples) {
    if (std::abs(sample.observation.yaw_rate) < rate) sample.observation.yaw_rate = 0.0;
  }
  return recording;
}

TEST(RealDrives, RaiseNoAlarmInAnotherOrderOrWithCoarserOrSlowerSensors) {
  if (data().empty()) GTEST_SKIP() << "JACKAL_AIC_REAL_DATA is not set";
  for (const std::string& path : recordingsIn(data())) {
    const RobotRecording whole = readRecording(path);
    std::vector<std::pair<const char*, RobotRecording>> variants{
        {"later half", partOf(whole, 0.5, 1.0)},        {"later quarter", partOf(whole, 0.75, 1.0)},
        {"encoders at 5 Hz", held(whole, 4)},           {"encoders at 4 Hz", held(whole, 5)},
        {"encoders of 0.1 rad/s", rounded(whole, 0.1)}, {"dead zone of the gyro", withDeadZone(whole, 0.02)}};
    // The steps of a log are one drive; those of windows are apart as they are.
    if (whole.name.find("windows") != std::string::npos) variants.emplace_back("shuffled", shuffled(whole, 1));
    for (const auto& [what, recording] : variants) {
      const CommandPath command_path = fitCommandPath(recording);
      for (const RealModel model : {RealModel::assumed, RealModel::identified}) {
        const RealFigures figures = replay(files(), recording, command_path, model);
        EXPECT_TRUE(figures.alarms.empty())
            << recording.name << ", " << what << ": " << figures.alarms.size() << ", " << figures.alarms.front().reason;
      }
    }
  }
}

/// A recording may begin anywhere, also while the robot is driven by somebody whose commands nobody knows.
TEST(RealDrives, RaiseNoAlarmWhereverTheyBegin) {
  if (data().empty()) GTEST_SKIP() << "JACKAL_AIC_REAL_DATA is not set";
  const std::vector<std::pair<const char*, std::vector<double>>> begins{
      {"warthog_grass", {0.13, 0.19, 0.23, 0.63}}, {"husky_indoor", {0.2, 0.4, 0.6}}, {"husky_windows", {0.448, 0.7}}};
  for (const std::string& path : recordingsIn(data())) {
    const RobotRecording whole = readRecording(path);
    for (const auto& [name, shares] : begins) {
      if (whole.name != name) continue;
      for (const double share : shares) {
        const RobotRecording part = partOf(whole, share, 1.0);
        const CommandPath command_path = fitCommandPath(part);
        for (const RealModel model : {RealModel::assumed, RealModel::identified}) {
          const RealFigures figures = replay(files(), part, command_path, model);
          EXPECT_TRUE(figures.alarms.empty()) << name << " from " << share << ": " << figures.alarms.front().reason;
        }
      }
    }
  }
}

/// The ground may turn the robot by far less than is assumed of it; a Husky's floor does so by more than half already.
TEST(RealDrives, TeachTheTurnOnSlipperierGroundToo) {
  if (data().empty()) GTEST_SKIP() << "JACKAL_AIC_REAL_DATA is not set";
  for (const std::string& path : recordingsIn(data())) {
    const RobotRecording whole = readRecording(path);
    for (const double share : {1.3, 0.7, 0.5}) {
      const RobotRecording recording = slipperier(whole, share);
      const RealFigures figures = replay(files(), recording, fitCommandPath(recording), RealModel::assumed);
      EXPECT_TRUE(figures.alarms.empty()) << whole.name << ", " << share << ": " << figures.alarms.front().reason;
      if (!figures.yaw_error) continue;
      const bool depends = whole.name.find("asphalt") != std::string::npos;
      EXPECT_LE(*figures.yaw_error, (depends ? 0.65 : 1.05) * *figures.constant_error) << whole.name << ", " << share;
    }
  }
}

/// Five minutes teach no more than they hold: what is learned of how the turn depends on the motion does not overreach.
TEST(RealDrives, APartOfARecordingTeachesTheTurnTenPercentAboveTheBestConstantAtMost) {
  if (data().empty()) GTEST_SKIP() << "JACKAL_AIC_REAL_DATA is not set";
  for (const std::string& path : recordingsIn(data())) {
    const RobotRecording whole = readRecording(path);
    if (whole.name.find("windows") == std::string::npos) continue;
    for (const int parts : {2, 3, 4}) {
      for (int i = 0; i < parts; ++i) {
        const RobotRecording part = partOf(whole, static_cast<double>(i) / parts, static_cast<double>(i + 1) / parts);
        const RealFigures figures = replay(files(), part, fitCommandPath(part), RealModel::assumed);
        EXPECT_TRUE(figures.alarms.empty()) << whole.name << ", part " << i << " of " << parts;
        ASSERT_TRUE(figures.yaw_error) << whole.name << ", part " << i << " of " << parts;
        EXPECT_LE(*figures.yaw_error, 1.1 * *figures.constant_error) << whole.name << ", part " << i << " of " << parts;
      }
    }
  }
}

TEST(RealDrives, AReversedGyroIsToldAndNotLearnedFrom) {
  if (data().empty()) GTEST_SKIP() << "JACKAL_AIC_REAL_DATA is not set";
  for (const std::string& path : recordingsIn(data())) {
    const RobotRecording recording = readRecording(path);
    if (!recording.has_imu) continue;
    const ReversedGyro reversed = replayReversed(files(), recording, fitCommandPath(recording), RealModel::assumed);
    EXPECT_TRUE(reversed.told) << recording.name;
    ASSERT_TRUE(reversed.slip.turn) << recording.name;
    const double configured = 1.0 / (1.5 * recording.robot.wheel_distance);
    EXPECT_NEAR(reversed.slip.turn->mean(0), configured, 0.02 * configured) << recording.name;
    EXPECT_LT(reversed.slip.turn->mean.tail<3>().cwiseAbs().maxCoeff(), 0.02 * configured) << recording.name;
  }
}

/// A part of a recording, from one wheel sample to another.
DriveRecording part(const DriveRecording& whole, double begin, double end) {
  const double first = whole.wheels.front().time, length = whole.wheels.back().time - first;
  DriveRecording result;
  const auto copy = [&](const auto& from, auto& to) {
    for (const auto& sample : from) {
      const double share = (sample.time - first) / length;
      if (share >= begin && share <= end) to.push_back(sample);
    }
  };
  copy(whole.commands, result.commands);
  copy(whole.wheels, result.wheels);
  copy(whole.yaw, result.yaw);
  return result;
}

/// Whether two estimates can be of one value.
bool agree(const Estimate& a, const Estimate& b) { return std::abs(a.value - b.value) <= a.half_width + b.half_width; }

TEST(RealDrives, BothHalvesOfARecordingAreExplained) {
  if (data().empty()) GTEST_SKIP() << "JACKAL_AIC_REAL_DATA is not set";
  for (const std::string& path : recordingsIn(data())) {
    const RobotRecording recording = readRecording(path);
    SCOPED_TRACE(recording.name);
    const DriveRecording whole = driveRecording(recording, fitCommandPath(recording), recording.samples.size());
    const double radius = recording.robot.wheel_radius;
    const Identification first = identifyDriveTrain(part(whole, 0.0, 0.5), radius);
    const Identification second = identifyDriveTrain(part(whole, 0.5, 1.0), radius);
    for (const Identification* half : {&first, &second}) {
      EXPECT_GT(half->r_squared, 0.97);
      EXPECT_TRUE(half->dead_time.known() && half->gain.known());
    }
    EXPECT_TRUE(agree(first.dead_time, second.dead_time)) << first.dead_time.value << " " << second.dead_time.value;
    EXPECT_NEAR(second.gain.value, first.gain.value, 0.07);
  }
}

}  // namespace
}  // namespace jackal_aic::sim
