// Bags as a controller and its recorder write them, from the drive loop on the simulated robot without ROS.

#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <jackal_aic/LoopInputs.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>

#include <boost/program_options/errors.hpp>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <tuple>
#include <utility>

#include "../command.hpp"
#include "../complaint.hpp"
#include "../repository.hpp"
#include "../temporary_directory.hpp"
#include "inputs/set_points.hpp"
#include "jackal_plant.hpp"
#include "outputs/commands.hpp"
#include "outputs/input_log.hpp"
#include "outputs/state_output.hpp"
#include "parameters/node_parameters.hpp"
#include "plant_messages.hpp"
#include "programs.hpp"

namespace jackal_aic {
namespace {

constexpr double kDuration = 4.0;  // s, of the drive
constexpr double kSetBack = 2.0;   // s, into the drive

struct What {
  std::string preset = "predictive";
  bool log = true;                      ///< of the controller
  std::uint64_t first = 0;              ///< number of its first input
  std::string imu_frame = "base_link";  ///< another has a static transform after a second
  double set_back = 0.0;                ///< of the clock, after kSetBack [s]
  double recorder_late = 0.0;           ///< by which the recorder's clock is [s]
  bool extreme_stamp = false;           ///< one message of the wheels has the latest stamp there is
  bool middle = false;                  ///< it begins in the middle of a drive, with set points that are not zero
};

/// A bag that goes with the test.
class RecordedBag {
 public:
  explicit RecordedBag(const What& what) {
    const ParameterMap configured = shipped({"advanced", "jackal", what.preset, "plant_model"});
    const NodeParameters parameters = readNodeParameters(configured, jackalUrdf);
    DriveLoop loop(parameters, makeController(parameters));
    if (what.middle) loop.release();
    const sim::PlantParameters plant_parameters;
    sim::JackalPlant plant(jackalUrdf(), plant_parameters);
    rosbag::Bag bag(path(), rosbag::bagmode::Write);
    LoopInputs log;
    log.first = what.first;
    log.configuration = configurationText(parameters);
    loop.listen([&](const DriveInput& input) { addInput(input, log); });
    Observation wheels, imu;
    bool extreme_stamp = what.extreme_stamp;
    for (; plant.time() < kDuration; plant.step()) {
      const ros::Duration ahead(plant.time() < kSetBack ? what.set_back : 0.0);
      const ros::Time stamp = sim::stampOf(plant.time()) + ahead;
      const double now = stamp.toSec();
      const long k = std::lround(plant.time() / sim::JackalPlant::kStep);
      if (k % 50 == 0) {
        geometry_msgs::Twist twist;
        twist.linear.x = plant.time() < 1.0 && !what.middle ? 0.0 : 0.5;
        twist.angular.z = plant.time() < 2.5 ? 0.0 : 0.5;
        bag.write("/jackal_AIC/set_point", stamp, twist);
        loop.setSetPoint(setPoint(twist), now);
      }
      if (k == 1000 && what.imu_frame != "base_link") {
        geometry_msgs::TransformStamped mounted;
        mounted.header.frame_id = "base_link";
        mounted.child_frame_id = what.imu_frame;
        mounted.transform.rotation.w = 1.0;
        tf2_msgs::TFMessage transforms;
        transforms.transforms = {mounted};
        bag.write("/tf_static", stamp, transforms);
      }
      if (plant.measurement()) {
        auto joints = sim::toJointState(*plant.measurement());
        auto inertial = sim::toImu(*plant.measurement(), plant_parameters);
        inertial.header.frame_id = what.imu_frame;
        auto feedback = sim::toFeedback(*plant.measurement(), jackal_msgs::Drive::MODE_VELOCITY);
        for (auto* header : {&joints.header, &inertial.header, &feedback.header}) header->stamp += ahead;
        const ros::Time recorded = sim::stampOf(std::max(plant.time() - what.recorder_late, 0.0)) + ahead;
        if (std::exchange(extreme_stamp, false)) {
          auto extreme = joints;
          extreme.header.stamp = ros::TIME_MAX;
          bag.write("/joint_states", recorded, extreme);
        }
        bag.write("/joint_states", recorded, joints);
        bag.write("/imu/data", recorded, inertial);
        bag.write("/feedback", stamp, feedback);
        Observation y = plant.measurement()->observation();
        y.stamp = joints.header.stamp.toSec();
        wheels = imu = y;
        wheels.valid = {false, true, true, false};
        imu.valid = {true, false, false, true};
        loop.receiveWheels({wheels, InputSource::Sample::Constant(now)}, now);
        loop.receiveImu({imu, InputSource::Sample::Constant(now)}, now);
        loop.observe(y, now);
        loop.receiveFeedback(feedback.header.stamp.toSec(), now);
      }
      if (k % 20 != 7) {
        loop.updateBelief(now);
        continue;
      }
      loop.report({}, now);
      const auto command = loop.advance(now, now);
      if (!command) continue;
      plant.command(*command);
      ControllerState state;
      fillState(loop, stamp, state);
      addRemarks(loop.status(), {}, "base_link", state);
      log.header.stamp = stamp;
      if (what.log) bag.write("/jackal_AIC/inputs", stamp, log);
      log.first += log.inputs.size();
      log.inputs.clear();
      log.gains.clear();
      log.configuration.clear();
      bag.write("/jackal_AIC/state", stamp, state);
      bag.write("/cmd_drive", stamp, driveMessage(*command));
    }
  }

  std::string path(const std::string& name = "drive.bag") const { return directory_.path(name); }

 private:
  TemporaryDirectory directory_;
};

CommandResult run(const std::vector<std::string>& arguments) {
  std::ostringstream out;
  const int status = replay(arguments, out);
  return {out.str(), status};
}

std::string refusal(const std::vector<std::string>& arguments) {
  return complaint([&] { run(arguments); });
}

/// Rows of a table of numbers and words.
std::vector<std::vector<std::string>> rowsOf(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(file, line);) {
    rows.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

TEST(Replay, LogOfEveryStructureComesOutToTheBit) {
  for (const std::string preset : {"predictive", "improved", "standard", "diff_drive"}) {
    const RecordedBag bag({preset});
    const CommandResult outcome = run({bag.path(), "--check"});
    EXPECT_EQ(outcome.status, 0) << preset << ": " << outcome.text;
    expectSays(outcome.text, {"all identical"});
  }
}

TEST(Replay, TableHasWhatWasDoneAndWhatWasRecorded) {
  const RecordedBag bag({});
  run({bag.path(), "--output", bag.path("drive.csv")});
  const auto rows = rowsOf(bag.path("drive.csv"));
  ASSERT_EQ(rows.size(), 1u + 199u);
  ASSERT_EQ(rows[0].size(), 18u);
  EXPECT_EQ(rows[0][11], "action_right");
  for (std::size_t i = 1; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), rows[0].size()) << i;
    EXPECT_EQ(rows[i][12], rows[i][14]) << i;  // command of the left wheels, replayed and recorded
    EXPECT_EQ(rows[i][7], rows[i][16]) << i;   // belief of the forward speed
  }
  // The values of this drive, pinned: 0.5 m/s straight ahead at 2.4 s, in an arc of 0.5 rad/s at the end.
  const auto& straight = rows[1 + 119];
  EXPECT_EQ(straight[1], "driving");
  EXPECT_NEAR(std::stod(straight[7]), 0.5, 0.01);
  EXPECT_NEAR(std::stod(straight[12]), 5.11, 0.1);
  EXPECT_NEAR(std::stod(rows.back()[8]), 0.5, 0.05);
  EXPECT_LT(std::stod(rows.back()[12]), std::stod(rows.back()[13]));
}

TEST(Replay, AnotherConfigurationIsReported) {
  const RecordedBag bag({});
  const CommandResult slow = run({bag.path(), "--check", "--set", "limits.linear_acceleration=0.3"});
  EXPECT_EQ(slow.status, 1);
  // The wheels answer to the recorded commands, not to those.
  expectSays(slow.text, {"changed as asked for", "differ, the first at 1.", "driving: another source has the motors"});
  expectSaysNot(slow.text, {"faulted:", "braking:", "follow"});
  const CommandResult improved = run({bag.path(), "--preset", "improved"});
  EXPECT_EQ(improved.status, 0) << improved.text;
  expectSays(improved.text, {" differ"});
}

TEST(Replay, ADriveThatBeginsInItsMiddleIsDriven) {
  What middle;
  middle.first = 5000;
  middle.middle = true;
  const RecordedBag bag(middle);
  expectSays(run({bag.path()}).text, {"all identical"});
  for (const char* how : {"--messages", "--check"}) {
    const std::string text = run({bag.path(), how}).text;
    expectSays(text, {"driving"});
    expectSaysNot(text, {"since the start"});
  }
}

/// A clock that is set back into the drive, and to before its begin.
TEST(Replay, AClockThatWasSetBackIsReplayedAsItRan) {
  for (const double set_back : {0.5, 3.0}) {
    What what;
    what.set_back = set_back;
    const RecordedBag bag(what);
    const CommandResult log = run({bag.path(), "--check", "--output", bag.path("drive.csv")});
    EXPECT_EQ(log.status, 0) << log.text;
    expectSays(log.text, {"Recorded states: 198 compared, all identical", "clock jumped back"});
    expectSaysNot(log.text, {"missing", "anew in this bag"});

    const auto rows = rowsOf(bag.path("drive.csv"));
    EXPECT_NEAR(static_cast<double>(rows.size()), 200.0, 3.0);
    int jumps = 0;
    for (std::size_t i = 2; i < rows.size(); ++i) jumps += std::stod(rows[i][0]) < std::stod(rows[i - 1][0]);
    EXPECT_EQ(jumps, 1);
    EXPECT_EQ(rows.back()[1], "driving") << rows.back()[2];
    EXPECT_NEAR(std::stod(rows.back()[7]), 0.5, 0.02);
  }
}

TEST(Replay, StaticTransformThatCameLateHoldsFromTheStart) {
  What late;
  late.imu_frame = "imu_link";
  expectSaysNot(run({RecordedBag(late).path(), "--messages"}).text, {"refused"});
}

TEST(Replay, NoMessageComesBeforeItWasMeasured) {
  What late;
  late.recorder_late = 0.3;
  const std::string said = run({RecordedBag(late).path(), "--messages"}).text;
  expectSaysNot(said, {"refused"});
  expectSays(said, {"recorded more than 0.1 s before their stamps: played at their stamps"});
}

TEST(Replay, MessageWithAnyStampIsRefusedAlone) {
  What extreme;
  extreme.extreme_stamp = true;
  const CommandResult result = run({RecordedBag(extreme).path(), "--messages"});
  EXPECT_EQ(result.status, 0) << result.text;
  expectSays(result.text, {"1 refused: joint states from the future"});
}

TEST(Replay, BagOfAnotherControllerIsPlayedFromItsMessages) {
  What stock;
  stock.log = false;
  const RecordedBag bag(stock);
  expectSays(run({bag.path(), "--plant-model", kRoot / "config/plant_model.yaml"}).text,
             {"that of config/", "Messages of the sensors", "driving"});
  expectSays(refusal({bag.path(), "--set-point-topic", "cmd_vel"}), {"it has /jackal_AIC/set_point"});
  expectSays(refusal({bag.path(), "--namespace", "robot1"}), {"no messages on /robot1/"});
}

TEST(Replay, WhatCannotBeReplayedIsOneLine) {
  const RecordedBag bag({});
  for (const auto& [option, value, said] :
       {std::tuple("--set-point-topic", "cmd_vel", "the log in this bag has the set points"),
        {"--preset", "nope",
         "--preset = 'nope': unknown; known: predictive, improved, standard, tuned, diff_drive, or a file NAME.yaml"},
        {"--set", "limits.linear_speed", "key=value"},
        {"--set", "limits.linear_sped=1", "limits.linear_sped"},
        {"--output", "/nowhere/x.csv", "/nowhere/x.csv"}}) {
    expectSays(refusal({bag.path(), option, value}), {said});
  }
  EXPECT_THROW(run({}), boost::program_options::error);
  EXPECT_ANY_THROW(run({bag.path("none.bag")}));
}

TEST(Replay, DamagedBagsEndTheProgramInOrder) {
  const RecordedBag bag({});
  const auto size = std::filesystem::file_size(bag.path());
  for (const double part : {0.1, 0.5, 0.9, 0.999}) {
    std::filesystem::copy_file(bag.path(), bag.path("cut.bag"), std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(bag.path("cut.bag"), static_cast<std::uintmax_t>(part * static_cast<double>(size)));
    const CommandResult said = runCommand("timeout 20 " JACKAL_AIC_REPLAY " " + bag.path("cut.bag"));
    EXPECT_EQ(said.status, 2) << part;
    expectSays(said.text, {"cannot be read as a bag"});
  }
}

}  // namespace
}  // namespace jackal_aic
