// The recorder behind the demo, and the differential drive baseline that it records here.

#include <std_msgs/Bool.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>

#include "../temporary_directory.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

using Row = std::map<std::string, std::string>;

/// Rows of a CSV file by the names of its columns.
std::vector<Row> readTable(const std::filesystem::path& path) {
  const auto split = [](const std::string& line) {
    std::vector<std::string> cells(1);
    for (char c : line) {
      if (c == ',') {
        cells.emplace_back();
      } else {
        cells.back().push_back(c);
      }
    }
    return cells;
  };
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  const auto names = split(line);
  std::vector<Row> rows;
  while (std::getline(file, line)) {
    const auto cells = split(line);
    Row row;
    for (std::size_t i = 0; i < names.size() && i < cells.size(); ++i) row[names[i]] = cells[i];
    rows.push_back(row);
  }
  return rows;
}

class StepRecorderTest : public testing::Test {
 protected:
  void SetUp() override {
    robot_.waitFor([this] { return !robot_.truth().time.empty() && !robot_.drives().empty(); }, "truth and commands");
  }

  /// Runs the recorder with a manoeuvre of two seconds forward and two of turning; returns its exit status.
  int record(const std::string& output_directory, const std::string& remapping = "") {
    robot_.leaveSetPoint();
    ros::param::set("/recorder_under_test/recorder/output_directory", output_directory);
    ros::param::set("/recorder_under_test/manoeuvre/durations", std::vector<double>{1.0, 2.0, 1.0, 2.0});
    ros::param::set("/recorder_under_test/manoeuvre/forward", std::vector<double>{0.0, 0.5, 0.0, 0.0});
    ros::param::set("/recorder_under_test/manoeuvre/yaw_rate", std::vector<double>{0.0, 0.0, 0.0, 0.5});
    const int status =
        std::system(("rosrun jackal_aic step_recorder __name:=recorder_under_test " + remapping).c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  /// A number of the recorded row at or before a time [s].
  static double at(const std::vector<Row>& rows, double time, const std::string& name) {
    const Row* found = nullptr;
    for (const auto& row : rows) {
      if (std::stod(row.at("time")) <= time) found = &row;
    }
    EXPECT_NE(found, nullptr) << "nothing recorded before " << time;
    return found == nullptr ? std::numeric_limits<double>::quiet_NaN() : std::stod(found->at(name));
  }

  TemporaryDirectory directory_;
  SimulatedRobot robot_;
};

TEST_F(StepRecorderTest, RecordsAForwardStepAndATurn) {
  ASSERT_EQ(record(directory_.path()), 0);

  const auto rows = readTable(directory_.path("response.csv"));
  ASSERT_GT(rows.size(), 400u) << "ground truth comes at 100 Hz for 6 s";
  EXPECT_EQ(at(rows, 2.9, "set_forward"), 0.5);
  EXPECT_NEAR(at(rows, 2.9, "true_forward"), 0.5, 0.02);
  EXPECT_NEAR(at(rows, 2.9, "measured_forward"), 0.5, 0.05);
  EXPECT_NEAR(at(rows, 2.9, "command_left"), 0.5 / 0.098, 0.01);
  EXPECT_NEAR(at(rows, 2.9, "command_right"), 0.5 / 0.098, 0.01);
  EXPECT_EQ(at(rows, 5.9, "set_yaw_rate"), 0.5);
  EXPECT_NEAR(at(rows, 5.9, "true_yaw_rate"), 0.5, 0.05);
  EXPECT_NEAR(at(rows, 5.9, "measured_yaw_rate"), 0.5, 0.08);
  EXPECT_NEAR(at(rows, 5.9, "command_right"), 0.5 * 0.5 * 0.563385 / 0.098, 0.01);
  EXPECT_NEAR(at(rows, 5.9, "command_left"), -at(rows, 5.9, "command_right"), 1e-6);
  EXPECT_EQ(rows.back().at("believed_forward"), "") << "an open-loop controller believes nothing";

  const auto metrics = readTable(directory_.path("metrics.csv"));
  ASSERT_EQ(metrics.size(), 2u);
  EXPECT_EQ(metrics[0].at("step"), "0.5 m/s");
  EXPECT_NEAR(std::stod(metrics[0].at("begin_s")), 1.0, 0.2);
  EXPECT_NEAR(std::stod(metrics[0].at("end_s")), 3.0, 0.2);
  EXPECT_LT(std::stod(metrics[0].at("settling_s")), 1.0);
  EXPECT_LT(std::abs(std::stod(metrics[0].at("steady_error_pct"))), 2.0);
  EXPECT_EQ(metrics[0].at("bounded"), "1");
  EXPECT_EQ(metrics[1].at("step"), "0.5 rad/s");
  EXPECT_LT(std::stod(metrics[1].at("settling_s")), 1.0);
}

TEST_F(StepRecorderTest, BeginsOnlyWhenTheControllerDrives) {
  ros::NodeHandle node;
  ros::Publisher emergency_stop = node.advertise<std_msgs::Bool>("e_stop", 1, true);
  std_msgs::Bool message;
  message.data = true;
  emergency_stop.publish(message);
  ros::param::set("/recorder_under_test/recorder/data_timeout", 4.0);
  EXPECT_EQ(record(directory_.path()), 1);
  message.data = false;
  emergency_stop.publish(message);
  EXPECT_EQ(record(directory_.path()), 0) << "its zero set points acknowledge the stop";
  ros::param::del("/recorder_under_test");
}

TEST_F(StepRecorderTest, BeginsOnlyWhenTheControllerHasSaidWhatItDoes) {
  ros::NodeHandle node;
  const ros::Publisher silent = node.advertise<ControllerState>("silent_state", 1);
  ros::param::set("/recorder_under_test/recorder/data_timeout", 4.0);
  EXPECT_EQ(record(directory_.path(), "jackal_AIC/state:=silent_state"), 1);
  ros::param::del("/recorder_under_test");
}

TEST_F(StepRecorderTest, RecordsToTheEndWhatComesLate) {
  ros::CallbackQueue queue;
  ros::NodeHandle node;
  node.setCallbackQueue(&queue);
  ros::Publisher late = node.advertise<nav_msgs::Odometry>("late_truth", 1000);
  std::deque<nav_msgs::Odometry> waiting;
  const ros::Subscriber truth =
      node.subscribe<nav_msgs::Odometry>("ground_truth/odom", 1000, [&](const nav_msgs::OdometryConstPtr& message) {
        waiting.push_back(*message);
        for (; message->header.stamp - waiting.front().header.stamp > ros::Duration(1.0); waiting.pop_front()) {
          late.publish(waiting.front());
        }
      });
  ros::AsyncSpinner spinner(1, &queue);
  spinner.start();
  ASSERT_EQ(record(directory_.path(), "ground_truth/odom:=late_truth"), 0);
  const auto rows = readTable(directory_.path("response.csv"));
  ASSERT_FALSE(rows.empty());
  EXPECT_GT(std::stod(rows.back().at("time")), 5.95);
}

TEST_F(StepRecorderTest, RefusesADirectoryThatDoesNotExist) { EXPECT_EQ(record(directory_.path("missing")), 1); }

TEST_F(StepRecorderTest, BaselineStopsWhenTheSetPointIsTooOld) {
  robot_.command(0.5, 0.0);
  robot_.run(2.0);
  EXPECT_NEAR(robot_.truth().forward.back(), 0.5, 0.02);
  robot_.stopCommanding();
  robot_.run(2.0);
  EXPECT_EQ(robot_.drives().back().drivers[0], 0.0);
  EXPECT_EQ(robot_.drives().back().drivers[1], 0.0);
  EXPECT_NEAR(robot_.truth().forward.back(), 0.0, 0.01);
}

TEST_F(StepRecorderTest, BaselineRejectsASetPointThatIsNotFinite) {
  robot_.command(0.3, 0.0);
  robot_.run(1.5);
  geometry_msgs::Twist twist;
  twist.linear.x = std::numeric_limits<double>::quiet_NaN();
  robot_.publishOnce(twist);
  robot_.run(0.2);
  EXPECT_NEAR(robot_.drives().back().drivers[0], 0.3 / 0.098, 0.01);
}

}  // namespace
}  // namespace jackal_aic::test
