// Recordings of real robots: the reader of both kinds of files, and what is made of them before a replay.

#include "robot_recording.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic::sim {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLog =
    "time_s,state,command_forward_mps,command_yaw_radps,wheel_left_radps,wheel_right_radps,gyro_z_radps,accel_x_mps2,"
    "accel_y_mps2,accel_z_mps2,lidar_x_m,lidar_y_m,lidar_yaw_rad\n";
constexpr const char* kWindows =
    "window,calib_step,steady,time_s,cmd_left_radps,cmd_right_radps,wheel_left_radps,wheel_right_radps,gyro_z_radps,"
    "accel_x_mps2,accel_y_mps2,accel_z_mps2,lidar_x_m,lidar_y_m,lidar_yaw_rad\n";

/// A directory of its own for every test, gone afterwards.
class RobotRecordingFile : public ::testing::Test {
 protected:
  RobotRecordingFile() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    directory_ = fs::temp_directory_path() / fmt::format("jackal_aic_{}_{}", test->name(), getpid());
    fs::create_directories(directory_);
  }
  ~RobotRecordingFile() override { fs::remove_all(directory_); }

  std::string write(const std::string& name, const std::string& text) {
    const fs::path path = directory_ / name;
    std::ofstream(path) << text;
    return path.string();
  }

  std::string complaint(const std::string& name, const std::string& text) {
    try {
      readRecording(write(name, text));
    } catch (const ParameterError& error) {
      return error.what();
    }
    return "accepted";
  }

  fs::path directory_;
};

/// Windows of 40 rows, each of one step, with wheels and gyro of these values.
std::string windowsText(int windows, const WheelCommand& command, const WheelCommand& wheels, double yaw_rate) {
  std::string text = kWindows;
  for (int window = 0; window < windows; ++window) {
    for (int row = 0; row < 40; ++row) {
      text += fmt::format("{},{},{},{:.2f},{},{},{},{},{},0,0,9.8,0,0,0\n", window, window / 3, window % 3 ? 1 : 0,
                          0.05 * row, command.left, command.right, wheels.left, wheels.right, yaw_rate);
    }
  }
  return text;
}

TEST_F(RobotRecordingFile, LogKnowsTheCommandWhileItCalibrates) {
  const auto recording =
      readRecording(write("husky_floor.csv", std::string(kLog) + "0.00,idle,0,0,1,2,0.1,0.2,0.3,9.8,0,0,0\n"
                                                                 "0.05,calib,0.5,1.0,1,2,0.1,0.2,0.3,9.8,0,0,0\n"
                                                                 "0.10,calib,0.5,1.0,1,2,0.1,0.2,0.3,9.8,0,0,0\n"
                                                                 "0.15,calib,0.5,0.0,1,2,0.1,0.2,0.3,9.8,0,0,0\n"));
  EXPECT_EQ(recording.name, "husky_floor");
  EXPECT_TRUE(recording.has_imu);
  EXPECT_FALSE(recording.gyro_reversed);
  const auto& samples = recording.samples;
  ASSERT_EQ(samples.size(), 4u);
  EXPECT_FALSE(samples[0].command);
  EXPECT_TRUE(samples[0].starts);
  EXPECT_TRUE(samples[1].starts) << "somebody else drove before";
  EXPECT_FALSE(samples[2].starts);
  EXPECT_EQ(samples[2].step, samples[1].step);
  EXPECT_EQ(samples[3].step, samples[2].step + 1);
  ASSERT_TRUE(samples[1].command);
  EXPECT_NEAR(samples[1].command->left, (0.5 - 0.5 * 0.5708) / 0.1651, 1e-12);
  EXPECT_NEAR(samples[1].command->right, (0.5 + 0.5 * 0.5708) / 0.1651, 1e-12);
  EXPECT_EQ(samples[1].observation.stamp, 0.05);
  EXPECT_EQ(samples[1].observation.wheel_right, 2.0);
  EXPECT_EQ(samples[1].observation.yaw_rate, 0.1);
  EXPECT_EQ(samples[1].observation.acceleration_x, 0.2);
  EXPECT_EQ(samples[1].observation.acceleration_z, 9.8);
}

TEST_F(RobotRecordingFile, WindowsOfAStepFollowEachOther) {
  const auto recording = readRecording(write("warthog_x.csv", windowsText(4, {1.0, 2.0}, {1.0, 2.0}, 0.1)));
  const auto& samples = recording.samples;
  ASSERT_EQ(samples.size(), 160u);
  EXPECT_NEAR(samples[40].observation.stamp - samples[39].observation.stamp, 0.05, 1e-9);
  EXPECT_FALSE(samples[40].starts);
  EXPECT_TRUE(samples[120].starts) << "another step: what was between is not recorded";
  EXPECT_GT(samples[120].observation.stamp - samples[119].observation.stamp, 1.0);
  EXPECT_EQ(samples[45].command->right, 2.0);
  EXPECT_FALSE(samples[10].steady);
  EXPECT_TRUE(samples[50].steady);
}

TEST_F(RobotRecordingFile, NumbersThatNoSensorGivesAreRefused) {
  const auto row = [](const std::string& left) {
    return std::string(kLog) + "0.00,idle,0,0," + left + ",2,0.1,0.2,0.3,9.8,0,0,0\n";
  };
  EXPECT_NE(complaint("husky_x.csv", row("1e300")).find("wheel_left_radps = '1e300': must be within +-1e+10"),
            std::string::npos);
  EXPECT_NE(complaint("husky_x.csv", row(std::string("1\0", 2))).find("must be a finite number"), std::string::npos);
  EXPECT_EQ(complaint("husky_x.csv", row("1.7e9")), "accepted");
}

TEST_F(RobotRecordingFile, WhatIsNoFileIsNoRecording) {
  fs::create_directories(directory_ / "husky_directory.csv");
  fs::create_symlink("/dev/zero", directory_ / "husky_endless.csv");
  EXPECT_THROW(recordingsIn(directory_.string()), ParameterError);
  EXPECT_THROW(readRecording("/dev/zero"), ParameterError);
  const std::string path = write("husky_x.csv", kLog);
  EXPECT_EQ(recordingsIn(directory_.string()), std::vector<std::string>{path});
}

TEST_F(RobotRecordingFile, ANameCannotCommandTheTerminal) {
  EXPECT_EQ(readRecording(write("husky_\033[31m.csv", windowsText(1, {}, {}, 0.0))).name, "husky_\\x1b[31m");
}

TEST_F(RobotRecordingFile, ARobotThatStandsOrNeverTurnsHasAPathToo) {
  for (const WheelCommand& wheels : {WheelCommand{}, WheelCommand{5.0, 5.0}, WheelCommand{5e-324, 0.0}}) {
    const auto recording = readRecording(write("husky_x.csv", windowsText(30, {6.0, 6.0}, wheels, 0.0)));
    EXPECT_NO_THROW(fitCommandPath(recording)) << wheels.left;
  }
}

TEST_F(RobotRecordingFile, GyroThatCountsTheOtherWayIsTurnedRoundAndTold) {
  const auto recording = readRecording(write("warthog_x.csv", windowsText(3, {1.0, 2.0}, {1.0, 2.0}, -0.1)));
  EXPECT_TRUE(recording.gyro_reversed);
  EXPECT_EQ(recording.samples.front().observation.yaw_rate, 0.1);
}

TEST_F(RobotRecordingFile, GyroIsAsItShouldBeWhereTheWheelsCountTheOtherWay) {
  const auto recording = readRecording(write("warthog_x.csv", windowsText(3, {1.0, 2.0}, {-1.0, -2.0}, 0.1)));
  EXPECT_FALSE(recording.gyro_reversed) << "it turns as it was commanded";
  EXPECT_EQ(recording.samples.front().observation.yaw_rate, 0.1);
}

TEST_F(RobotRecordingFile, ImuOfZerosIsNone) {
  const auto recording = readRecording(write("husky_x.csv", std::string(kLog) + "0,calib,0,0,1,2,0,0,0,0,0,0,0\n"
                                                                                "0.05,calib,0,0,1,2,0,0,0,0,0,0,0\n"));
  EXPECT_FALSE(recording.has_imu);
  EXPECT_FALSE(recording.samples[0].observation.valid.yaw_rate);
  EXPECT_FALSE(recording.samples[0].observation.valid.acceleration);
  EXPECT_TRUE(recording.samples[0].observation.valid.wheel_left);
}

TEST_F(RobotRecordingFile, WrongFilesAreOneLineWithPlaceAndValue) {
  const std::string row = "0.00,idle,0,0,1,2,0.1,0.2,0.3,9.8,0,0,0\n";
  const auto ends = [](const std::string& text, const std::string& end) {
    return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
  };
  EXPECT_TRUE(ends(complaint("husky_x.csv", ""), "husky_x.csv': empty"));
  EXPECT_TRUE(ends(complaint("husky_x.csv", kLog), "husky_x.csv': has no rows"));
  EXPECT_NE(complaint("husky_x.csv", "a,b\n").find("line 1: columns of no known kind"), std::string::npos);
  EXPECT_NE(complaint("jackal.csv", kLog + row).find("known: husky, warthog"), std::string::npos);
  EXPECT_TRUE(ends(complaint("husky_x.csv", kLog + row + "0.05,idle,0\n"), "line 3: 3 fields: must be 13"));
  EXPECT_TRUE(ends(complaint("husky_x.csv", std::string(kLog) + "0,idle,0,0,x,2,0,0,0,0,0,0,0\n"),
                   "line 2: wheel_left_radps = 'x': must be a finite number"));
  EXPECT_TRUE(ends(complaint("husky_x.csv", std::string(kLog) + "0,idle,0,0,1,nan,0,0,0,0,0,0,0\n"),
                   "line 2: wheel_right_radps = 'nan': must be a finite number"));
  EXPECT_TRUE(ends(complaint("husky_x.csv", kLog + row + row),
                   "line 3: time_s = '0.00': must be above 0, that of the row before"));
  EXPECT_TRUE(ends(complaint("husky_x.csv", std::string(kWindows) + "0,0.5,0,0,1,1,1,2,0,0,0,0,0,0,0\n"),
                   "line 2: calib_step = '0.5': must be a whole number"));
  EXPECT_TRUE(ends(complaint("husky_x.csv", std::string(kWindows) + "0,0,0,2.5,1,1,1,2,0,0,0,0,0,0,0\n"),
                   "line 2: time_s = '2.5': must be in [0, 2) and increase in a window"));
}

TEST_F(RobotRecordingFile, DirectoryWithoutRecordingsIsRefused) {
  EXPECT_THROW(recordingsIn(directory_.string()), ParameterError);
  write("husky_b.csv", "");
  write("husky_a.csv", "");
  write("README.md", "");
  const auto found = recordingsIn(directory_.string());
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(fs::path(found[0]).filename(), "husky_a.csv");
}

TEST_F(RobotRecordingFile, SteadyPiecesAreMeansOfTwoSeconds) {
  const auto recording = readRecording(write("warthog_x.csv", windowsText(6, {1.0, 2.0}, {1.0, 3.0}, 0.25)));
  const auto blocks = steadyBlocks(recording);
  ASSERT_EQ(blocks.size(), 4u);  // two of three windows in each of two steps
  EXPECT_EQ(blocks[0].step, 0);
  EXPECT_EQ(blocks[2].step, 1);
  EXPECT_NEAR(blocks[0].yaw_rate, 0.25, 1e-12);
  EXPECT_NEAR(blocks[0].wheels.right, 3.0, 1e-12);
}

/// A robot that makes of every command what a path says, 0.1 s later, in steps of 5 s.
RobotRecording driven(const CommandPath& robot) {
  RobotRecording recording{"synthetic", {"synthetic", 0.1, 0.5}, true, false, {}};
  for (int i = 0; i < 200 * 100; ++i) {
    const int step = i / 100;
    const double forward = 4.0 * std::sin(1.0 * step), difference = 20.0 * std::sin(2.3 * step);
    RecordedSample sample;
    sample.observation.stamp = 0.05 * i;
    sample.starts = i == 0;
    sample.step = step;
    sample.steady = i % 100 >= 50;
    sample.command = WheelCommand{forward - 0.5 * difference, forward + 0.5 * difference};
    recording.samples.push_back(sample);
  }
  const auto applied = appliedCommands(recording, robot);
  for (std::size_t i = 2; i < applied.size(); ++i) {
    recording.samples[i].observation.wheel_left = applied[i - 2]->left;
    recording.samples[i].observation.wheel_right = applied[i - 2]->right;
  }
  return recording;
}

TEST(CommandPathTest, FindsGainsCutsAndRatesOfTheRobot) {
  const CommandPath robot{1.85, 0.8, 6.0, 6.2, 20.0, 8.0};
  const CommandPath found = fitCommandPath(driven(robot));
  EXPECT_NEAR(found.forward_gain, robot.forward_gain, 0.02);
  EXPECT_NEAR(found.yaw_gain, robot.yaw_gain, 0.02);
  EXPECT_NEAR(found.largest_difference, robot.largest_difference, 0.1);
  EXPECT_NEAR(found.largest_wheel_speed, robot.largest_wheel_speed, 0.1);
  EXPECT_NEAR(found.largest_forward_rate, robot.largest_forward_rate, 4.0);
  EXPECT_NEAR(found.largest_difference_rate, robot.largest_difference_rate, 1.6);
}

/// What identification refuses a robot for whose wheels are not what it makes of its commands.
std::string refusalOf(void (*change)(Observation&)) {
  RobotRecording recording = driven({1.85, 0.8, 6.0, 6.2, 20.0, 8.0});
  for (RecordedSample& sample : recording.samples) change(sample.observation);
  const CommandPath path = fitCommandPath(recording);
  EXPECT_EQ(path.forward_gain, CommandPath().forward_gain) << "straight through";
  EXPECT_EQ(path.largest_wheel_speed, CommandPath().largest_wheel_speed);
  try {
    identifyDriveTrain(driveRecording(recording, path, recording.samples.size()), recording.robot.wheel_radius);
  } catch (const IdentificationError& error) {
    return error.what();
  }
  return "";
}

TEST(CommandPathTest, IsNoneOfWheelsThatDoNotFollowTheirCommands) {
  EXPECT_NE(refusalOf([](Observation& y) { y.wheel_left = y.wheel_right = 0.0; }).find("the wheels never turn"),
            std::string::npos);
  EXPECT_NE(refusalOf([](Observation& y) {
              y.wheel_left = -y.wheel_left;
              y.wheel_right = -y.wheel_right;
            }).find("the wheels turn against their commands"),
            std::string::npos);
  EXPECT_NE(refusalOf([](Observation& y) { std::swap(y.wheel_left, y.wheel_right); }).find("exchanged"),
            std::string::npos);
}

TEST(CommandPathTest, SlowsBothSidesAlike) {
  const WheelCommand slower = CommandPath{1.0, 1.0, 100.0, 5.0, 1e6, 1e6}.applied({4.0, 10.0});
  EXPECT_NEAR(slower.left, 2.0, 1e-12);
  EXPECT_NEAR(slower.right, 5.0, 1e-12);
}

TEST_F(RobotRecordingFile, AWindowThatIsMissingPartsTwoStretches) {
  std::string text = windowsText(6, {1.0, 2.0}, {1.0, 2.0}, 0.1);
  std::string without;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("1,", 0) != 0) without += line + "\n";
  }
  const auto stretches = [](const RobotRecording& recording) {
    int starts = 0;
    for (const RecordedSample& sample : recording.samples) starts += sample.starts ? 1 : 0;
    return starts;
  };
  const int whole = stretches(readRecording(write("warthog_x.csv", text)));
  EXPECT_EQ(stretches(readRecording(write("warthog_y.csv", without))), whole + 1);
}

TEST_F(RobotRecordingFile, IdentificationGetsTheStretchesApart) {
  const auto recording = readRecording(write("warthog_x.csv", windowsText(6, {1.0, 2.0}, {1.0, 2.0}, 0.1)));
  const DriveRecording drive = driveRecording(recording, {}, 200);
  ASSERT_EQ(drive.wheels.size(), 200u);
  int gaps = 0;
  for (std::size_t i = 1; i < drive.wheels.size(); ++i) {
    const double step = drive.wheels[i].time - drive.wheels[i - 1].time;
    EXPECT_EQ(drive.wheels[i].time, drive.commands[i].time);
    if (recording.samples[i].starts) {
      EXPECT_GT(step, 5.0) << i;
      ++gaps;
    } else {
      EXPECT_NEAR(step, 0.05, 1e-9) << i;
    }
  }
  EXPECT_EQ(gaps, 1);
  EXPECT_EQ(drive.yaw.size(), 200u);
  EXPECT_EQ(drive.commands.back().command.right, 2.0);
}

}  // namespace
}  // namespace jackal_aic::sim
