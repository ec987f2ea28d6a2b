// A drive that is recorded by the launch file comes out of the replay to the bit, with all its events.

#include <dynamic_reconfigure/Reconfigure.h>
#include <jackal_msgs/Feedback.h>
#include <std_msgs/Bool.h>
#include <std_srvs/SetBool.h>

#include <array>
#include <cstdio>
#include <filesystem>

#include "service_call.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

namespace fs = std::filesystem;

/// The bags whose path begins with a prefix, without those that are still written.
std::vector<fs::path> bagsOf(const fs::path& prefix) {
  std::vector<fs::path> bags;
  for (const auto& entry : fs::directory_iterator(prefix.parent_path())) {
    const std::string name = entry.path().filename().string();
    if (name.find(prefix.filename().string()) == 0 && entry.path().extension() == ".bag") bags.push_back(entry.path());
  }
  return bags;
}

/// A path as a word of the shell.
std::string quoted(const std::string& path) { return "'" + path + "'"; }

/// What a command prints; its exit status is checked.
std::string output(const std::string& command, int expected) {
  std::string text;
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  std::array<char, 256> part{};
  while (fgets(part.data(), part.size(), pipe) != nullptr) text += part.data();
  const int status = pclose(pipe);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == expected) << command << ": " << text;
  return text;
}

class RecordTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(ros::param::get("~to", to_));
    ASSERT_TRUE(robot_.waitUntilReady());
  }
  void TearDown() override {
    for (const fs::path& bag : bagsOf(to_)) fs::remove(bag);
  }

  /// Ends the recorder in order and waits for its bag.
  std::string recording() {
    output("rosnode kill /jackal_aic_recorder", 0);
    robot_.waitFor([this] { return !bagsOf(to_).empty(); }, "the bag", 20.0);
    return bagsOf(to_).empty() ? "" : bagsOf(to_).front().string();
  }

  SimulatedRobot robot_;
  std::string to_;
};

TEST_F(RecordTest, DriveComesOutToTheBit) {
  robot_.command(0.5, 0.0);
  robot_.run(1.5);
  robot_.command(0.3, 0.6);
  robot_.run(1.0);
  std_srvs::SetBool freeze;
  freeze.request.data = true;
  ASSERT_TRUE(sim::callService("/jackal_aic/freeze_learning", freeze, ros::Duration(30.0)));
  dynamic_reconfigure::Reconfigure gains;
  gains.request.config.doubles.resize(1);
  gains.request.config.doubles[0].name = "reference_time";
  gains.request.config.doubles[0].value = 0.05;
  ASSERT_TRUE(sim::callService("/jackal_aic/predictive/set_parameters", gains, ros::Duration(30.0)));
  robot_.run(1.0);
  ros::NodeHandle node;
  // Latched: the controller and the recorder hear it, whichever is connected first.
  ros::Publisher stop = node.advertise<std_msgs::Bool>("e_stop", 1, true);
  robot_.waitFor([&] { return stop.getNumSubscribers() > 1; }, "the controller and the recorder to hear the stop");
  std_msgs::Bool engaged;
  engaged.data = true;
  stop.publish(engaged);
  robot_.run(1.0);
  ASSERT_TRUE(!robot_.states().empty() && robot_.states().back().status == ControllerState::STOPPED);
  robot_.stopCommanding();
  robot_.run(0.5);

  const std::string bag = recording();
  ASSERT_NE(bag, "");
  const std::string text = output("rosrun jackal_aic replay --check " + quoted(bag), 0);
  EXPECT_NE(text.find("all identical"), std::string::npos) << text;
  EXPECT_EQ(text.find("missing"), std::string::npos) << text;
  EXPECT_EQ(text.find("begins"), std::string::npos) << text;
  EXPECT_NE(text.find("emergency stop"), std::string::npos) << text;

  // The sensors' messages alone give the same drive, with the timers a moment apart.
  const std::string messages = output("rosrun jackal_aic replay --messages " + quoted(bag), 0);
  EXPECT_NE(messages.find("Messages of the sensors"), std::string::npos) << messages;
  EXPECT_EQ(messages.find("refused"), std::string::npos) << messages;
  EXPECT_NE(messages.find("emergency stop"), std::string::npos) << messages;

  const std::string picture = to_ + ".png";
  output("rosrun jackal_aic plot " + quoted(bag) + " --output " + quoted(picture), 0);
  EXPECT_GT(fs::file_size(picture), 10000u);
  fs::remove(picture);
  EXPECT_NE(output("rosrun jackal_aic plot " + quoted(bag) + " --namespace robot1", 1).find("no messages on /robot1/"),
            std::string::npos);
}

TEST_F(RecordTest, StateHasWhatWasMeasuredBesideWhatIsBelieved) {
  robot_.command(0.0, 0.0);
  robot_.run(0.5);
  ros::NodeHandle node;
  ros::Publisher stop = node.advertise<std_msgs::Bool>("e_stop", 1, true);
  robot_.waitFor([&] { return stop.getNumSubscribers() > 0; }, "the controller to hear the release");
  stop.publish(std_msgs::Bool());
  robot_.run(0.5);
  robot_.command(0.0, 0.0);
  robot_.run(0.5);
  robot_.command(0.4, 0.5);
  robot_.run(2.0);
  const ControllerState& state = robot_.states().back();
  ASSERT_EQ(state.status, ControllerState::DRIVING) << state.reason;
  EXPECT_EQ(state.summary, "predictive, driving, driven by this controller");
  EXPECT_NEAR(state.measured_forward, 0.4, 0.05);
  EXPECT_NEAR(state.measured_yaw_rate, 0.5, 0.1);
  EXPECT_NEAR(state.measured_forward, state.belief_forward.at(0), 0.05);

  const std::string picture = to_ + ".png";
  output("timeout 60 rosrun jackal_aic plot_live --duration 3 --output " + quoted(picture), 0);
  EXPECT_GT(fs::file_size(picture), 10000u);
  fs::remove(picture);
}

}  // namespace
}  // namespace jackal_aic::test
