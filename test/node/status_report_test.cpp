// What people read of the drive loop: log lines and diagnostics.

#include <gtest/gtest.h>
#include <ros/console.h>

#include <string>
#include <vector>

#include "../complaint.hpp"
#include "outputs/diagnostics.hpp"

namespace jackal_aic {
namespace {

using diagnostic_msgs::DiagnosticStatus;

using Lines = std::vector<std::string>;

/// Keeps what is logged while it is there.
class StatusReportTest : public testing::Test, private ros::console::LogAppender {
 protected:
  StatusReportTest() { ros::console::register_appender(this); }
  ~StatusReportTest() override { ros::console::deregister_appender(this); }

  void log(ros::console::Level level, const char* text, const char*, const char*, int) override {
    const char* const names[] = {"DEBUG ", "", "WARN ", "ERROR ", "FATAL "};
    lines.push_back(names[level] + std::string(text));
  }
  bool update() { return report.update(status, ""); }

  diagnostic_updater::DiagnosticStatusWrapper diagnosis() const {
    diagnostic_updater::DiagnosticStatusWrapper told;
    report.diagnose(told, missing, no_subscriber);
    return told;
  }

  void expectDiagnosis(std::uint8_t level, const std::string& message) const {
    EXPECT_EQ(diagnosis().level, level);
    EXPECT_EQ(diagnosis().message, message);
  }

  void decide(DriveStatus wanted, StopCause cause) {
    status.decision.status = wanted;
    status.decision.cause = cause;
    update();
  }

  /// Drives, and forgets what was logged.
  void drive() {
    decide(DriveStatus::driving, StopCause::none);
    lines.clear();
  }

  Lines lines;
  DriveLoopStatus status;
  std::string missing, no_subscriber;
  StatusReport report{0.5};
};

TEST_F(StatusReportTest, TheMostLikelyHypothesisIsShownWithItsProbability) {
  const auto shown = [this] {
    for (const auto& pair : diagnosis().values) {
      if (pair.key == "Hypothesis") return pair.value;
    }
    return std::string();
  };
  drive();
  EXPECT_EQ(shown(), "") << "without fault detection";
  status.suspicion = {faults::kGyroOffset, 0.6};
  update();
  EXPECT_EQ(shown(), "perhaps: gyro offset, 0.60");
  EXPECT_EQ(diagnosis().message, "driving") << "doubt is no fault";
}

TEST_F(StatusReportTest, ARemarkOnTheWheelsIsToldWithItsNumber) {
  drive();
  ros::Time::init();  // the line is throttled
  status.fault = Fault::wheels_off_model;
  status.share = 0.5;
  EXPECT_TRUE(update());
  EXPECT_EQ(lines, Lines{"WARN Noticed: wheels reach 50 % of their commands. "
                         "Check the scale of the encoders, the motors and the plant model"});
  expectDiagnosis(DiagnosticStatus::WARN, "driving with a fault: wheels reach 50 % of their commands");
  status.share = 0.6;  // it ended, and came again between two looks
  EXPECT_TRUE(update());
  expectDiagnosis(DiagnosticStatus::WARN, "driving with a fault: wheels reach 60 % of their commands");
}

TEST_F(StatusReportTest, AStartIsToldWithTheNextActionStep) {
  expectDiagnosis(DiagnosticStatus::WARN, "no action step yet");
  status.decision.status = DriveStatus::driving;
  EXPECT_TRUE(update());
  status.decision = {};
  EXPECT_FALSE(update());
  expectDiagnosis(DiagnosticStatus::WARN, "no action step yet");
  status.decision.cause = StopCause::set_point_missing;
  EXPECT_TRUE(update());
  expectDiagnosis(DiagnosticStatus::OK, "no set point received yet");
}

TEST_F(StatusReportTest, WhatHasNotComeOrIsFaultyIsAWarningWhileIdle) {
  status.decision.cause = StopCause::set_point_missing;
  update();
  missing = "no wheel speeds received yet";
  expectDiagnosis(DiagnosticStatus::WARN, "no set point received yet; no wheel speeds received yet");
  missing.clear();
  status.loss = Loss::both_encoders;
  update();
  expectDiagnosis(DiagnosticStatus::WARN, "no set point received yet; both encoders lost");
  status.loss = Loss::none;
  status.fault = Fault::gyro_frozen;
  update();
  EXPECT_EQ(diagnosis().level, DiagnosticStatus::WARN);
}

TEST_F(StatusReportTest, CommandsThatNobodyHearsAreAWarning) {
  no_subscriber = "nobody listens to /cmd_vel";
  for (const bool handed_over : {true, false}) {
    status.handed_over = handed_over;
    decide(DriveStatus::driving, StopCause::none);
    expectDiagnosis(DiagnosticStatus::WARN, no_subscriber);
  }
  decide(DriveStatus::idle, StopCause::set_point_missing);
  expectDiagnosis(DiagnosticStatus::WARN, "no set point received yet; nobody listens to /cmd_vel");
  decide(DriveStatus::faulted, StopCause::driver_fault);
  expectDiagnosis(DiagnosticStatus::ERROR, "motor driver reports a fault; nobody listens to /cmd_vel");
}

TEST_F(StatusReportTest, ALossIsLoggedAndItsEnd) {
  drive();
  status.loss = Loss::yaw_rate;
  update();
  update();
  status.loss = Loss::encoder_and_yaw_rate;
  update();
  status.loss = Loss::none;
  update();
  ASSERT_EQ(lines.size(), 3u);
  expectSays(lines[0], {"WARN Sensors: yaw rate lost. Check the IMU"});
  expectSays(lines[1], {"WARN Sensors: encoder and yaw rate lost. "});
  EXPECT_EQ(lines[2], "Cleared: encoder and yaw rate lost");
}

TEST_F(StatusReportTest, AFaultThatStopsTheRobotIsOneLineWithWhatToDo) {
  drive();
  status.fault = Fault::left_wheels_blocked;
  decide(DriveStatus::braking, StopCause::sensor_fault);
  decide(DriveStatus::faulted, StopCause::sensor_fault);
  EXPECT_EQ(lines, Lines{"ERROR Stopping: left wheels do not follow their command. Free the wheels, and check the "
                         "power of the motors; then send a zero set point"});
}

TEST_F(StatusReportTest, StopsAreToldOnceWithHowToGoOn) {
  const struct {
    StopCause cause;
    Lines lines;
  } rows[] = {{StopCause::set_point_late, {"Stopped: no set point for 0.5 s"}},
              {StopCause::emergency_stop, {"WARN Stopping: emergency stop. Release it to drive on"}},
              {StopCause::shutdown, {}}};
  for (const auto& row : rows) {
    drive();
    decide(DriveStatus::braking, row.cause);
    decide(DriveStatus::stopped, row.cause);
    EXPECT_EQ(lines, row.lines);
  }
  drive();
  decide(DriveStatus::braking, StopCause::imu_late);
  decide(DriveStatus::braking, StopCause::emergency_stop);
  decide(DriveStatus::stopped, StopCause::emergency_stop);
  status.decision.unacknowledged = true;
  update();
  update();
  ASSERT_EQ(lines.size(), 3u) << "the first, another cause of the same stop, and its end";
  EXPECT_EQ(lines[1], "WARN Stopping: emergency stop. Release it to drive on");
  EXPECT_EQ(lines[2], "Cleared: emergency stop. Send a zero set point, or pause for 0.5 s, to drive on");
}

}  // namespace
}  // namespace jackal_aic
