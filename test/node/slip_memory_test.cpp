// What the predictive controller learns about the slip: kept across restarts in a file, frozen on request.

#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "../temporary_directory.hpp"
#include "controller_process.hpp"
#include "service_call.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

constexpr double kTurn = 0.5;        // rad/s
constexpr double kConfigured = 0.7;  // m, configured effective track of the controller
constexpr double kTrue = 0.547;      // m, of the simulated robot turning in place
constexpr double kTolerance = 0.02;  // m

class SlipMemory : public testing::Test {
 protected:
  std::string file() const { return directory_.path("slip.yaml"); }

  /// Loads robot, preset and a plant model with a wrong effective track into the namespace of a node to come.
  void configure(const std::string& name) {
    const std::string config = ros::param::param<std::string>("~config", "");
    for (const char* part : {"jackal", "predictive", "plant_model"}) {
      ASSERT_EQ(std::system(("rosparam load " + config + "/" + part + ".yaml /" + name).c_str()), 0);
    }
    ros::param::set("/" + name + "/plant_model/effective_track", kConfigured);
    ros::param::set("/" + name + "/slip/file", file());
  }

  static void turn(SimulatedRobot& robot, double rate) {
    robot.command(0.0, rate);
    robot.run(3.0);
  }

  static void end(SimulatedRobot& robot, ControllerProcess& process, int signal) {
    process.signal(signal);
    ASSERT_TRUE(robot.waitFor([&] { return process.ended(); }, "the node to end", 60.0));
    robot.run(1.0);
    robot.clear();
  }

  TemporaryDirectory directory_;
};

TEST_F(SlipMemory, OutlivesARestart) {
  configure("learning");
  SimulatedRobot robot;
  {
    ControllerProcess process("learning");
    ASSERT_TRUE(robot.waitUntilReady());
    EXPECT_NEAR(robot.states().back().effective_track, kConfigured, 1e-9);
    turn(robot, kTurn);
    EXPECT_NEAR(robot.states().back().effective_track, kTrue, kTolerance);
    end(robot, process, SIGTERM);
    EXPECT_EQ(process.exitStatus(), 0) << process.errors();
  }
  ControllerProcess process("learning");
  robot.command(0.0, 0.0);
  ASSERT_TRUE(robot.waitUntilReady());
  EXPECT_NEAR(robot.states().front().effective_track, kTrue, kTolerance) << "known before the first turn";
  end(robot, process, SIGINT);
}

TEST_F(SlipMemory, IsWrittenWhileTheControllerRuns) {
  configure("killed");
  SimulatedRobot robot;
  ControllerProcess process("killed");
  ASSERT_TRUE(robot.waitUntilReady());
  turn(robot, kTurn);
  robot.command(0.0, 0.0);
  robot.run(10.5);
  const double learned = robot.states().back().effective_track;
  process.signal(SIGKILL);
  ASSERT_TRUE(robot.waitFor([&] { return process.ended(); }, "the node to end", 60.0));
  robot.clear();
  ControllerProcess again("killed");
  ASSERT_TRUE(robot.waitUntilReady());
  EXPECT_NEAR(robot.states().front().effective_track, learned, 1e-6);
  EXPECT_NEAR(learned, kTrue, kTolerance);
}

TEST_F(SlipMemory, IsSavedOnRequest) {
  configure("saved");
  SimulatedRobot robot;
  ControllerProcess process("saved");
  ASSERT_TRUE(robot.waitUntilReady());
  turn(robot, kTurn);
  std_srvs::Trigger save;
  ASSERT_TRUE(sim::callService("/saved/save_learned_model", save) && save.response.success) << save.response.message;
  EXPECT_NE(save.response.message.find(file() + ": effective track 0.5"), std::string::npos) << save.response.message;
  std::ifstream stream(file());
  const std::string kept((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  EXPECT_NE(kept.find("effective_track: 0.5"), std::string::npos) << kept;
  end(robot, process, SIGTERM);
}

TEST_F(SlipMemory, StaysAsItIsWhileFrozen) {
  configure("frozen");
  SimulatedRobot robot;
  robot.run(1.0);  // it rests: nothing is learned before it is frozen
  ControllerProcess process("frozen");
  ASSERT_TRUE(robot.waitUntilReady());
  std_srvs::SetBool freeze;
  freeze.request.data = true;
  ASSERT_TRUE(sim::callService("/frozen/freeze_learning", freeze) && freeze.response.success);
  turn(robot, kTurn);
  EXPECT_EQ(robot.states().back().effective_track, kConfigured);
  EXPECT_TRUE(robot.states().back().learning_frozen);
  EXPECT_LT(robot.truth().yaw_rate.back(), 1.4 * kTurn);
  EXPECT_GT(robot.truth().yaw_rate.back(), 1.15 * kTurn) << "turns faster than it should, by the wrong track";
  freeze.request.data = false;
  ASSERT_TRUE(sim::callService("/frozen/freeze_learning", freeze));
  robot.run(3.0);
  EXPECT_NEAR(robot.states().back().effective_track, kTrue, kTolerance);
  EXPECT_FALSE(robot.states().back().learning_frozen);
}

TEST_F(SlipMemory, AFolderThatIsMissingKeepsNothingAndTheRobotDrives) {
  configure("homeless");
  ros::param::set("/homeless/slip/file", directory_.path("none/slip.yaml"));
  SimulatedRobot robot;
  ControllerProcess process("homeless");
  ASSERT_TRUE(robot.waitUntilReady());
  turn(robot, kTurn);
  EXPECT_EQ(robot.states().back().status, ControllerState::DRIVING) << robot.states().back().reason;
  EXPECT_NE(process.errors().find("none/slip.yaml': cannot be written: No such file or directory"), std::string::npos)
      << process.errors();
  end(robot, process, SIGTERM);
}

/// As a build before the release wrote it, for one.
TEST_F(SlipMemory, AFileThatCannotBeUsedIsPutAsideAndTheRobotDrives) {
  configure("outdated");
  const std::string outdated = "slip: {effective_track: 0.6, slip_factor: 1.0, told_track: 0.7}";
  std::ofstream(file()) << outdated;
  SimulatedRobot robot;
  ControllerProcess process("outdated");
  ASSERT_TRUE(robot.waitUntilReady());
  EXPECT_NEAR(robot.states().back().effective_track, kConfigured, 1e-9);
  turn(robot, kTurn);
  EXPECT_EQ(robot.states().back().status, ControllerState::DRIVING) << robot.states().back().reason;
  const std::string said = process.errors();
  EXPECT_NE(said.find("slip.told_track"), std::string::npos) << said;
  EXPECT_NE(said.find("Learning starts from the configuration, and the file is now " + file() + ".old"),
            std::string::npos)
      << said;
  std::ifstream stream(file() + ".old");
  EXPECT_EQ(std::string((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>()), outdated);
  EXPECT_TRUE(std::filesystem::exists(file()));
  end(robot, process, SIGTERM);
}

}  // namespace
}  // namespace jackal_aic::test
