// What people read of the drive loop: log lines and diagnostics.

#include <gtest/gtest.h>
#include <ros/console.h>

#include <string>
#include <vector>

#include "outputs/diagnostics.hpp"

namespace jackal_aic {
namespace {

using diagnostic_msgs::DiagnosticStatus;

/// Keeps what is logged while it is there.
class KeptLog : public ros::console::LogAppender {
 public:
  KeptLog() { ros::console::register_appender(this); }
  ~KeptLog() override { ros::console::deregister_appender(this); }
  KeptLog(const KeptLog&) = delete;
  KeptLog& operator=(const KeptLog&) = delete;

  void log(ros::console::Level level, const char* text, const char*, const char*, int) override {
    const char* name = level == ros::console::levels::Warn    ? "WARN "
                       : level == ros::console::levels::Error ? "ERROR "
                                                              : "";
    lines.push_back(name + std::string(text));
  }

  std::vector<std::string> lines;
};

class StatusReportTest : public testing::Test {
 protected:
  bool update() { return report.update(status, ""); }

  diagnostic_updater::DiagnosticStatusWrapper diagnosis() const {
    diagnostic_updater::DiagnosticStatusWrapper told;
    report.diagnose(told, missing, unheard);
    return told;
  }

  using Lines = std::vector<std::string>;

  void decide(DriveStatus wanted, StopCause cause) {
    status.decision.status = wanted;
    status.decision.cause = cause;
    update();
  }

  /// Drives, and forgets what was logged.
  void drive() {
    decide(DriveStatus::driving, StopCause::none);
    log.lines.clear();
  }

  KeptLog log;
  DriveLoopStatus status;
  StopCauses missing;
  std::string unheard;
  StatusReport report{0.5};
};

TEST_F(StatusReportTest, ARemarkOnTheWheelsIsToldWithItsNumber) {
  drive();
  ros::Time::init();  // the line is throttled
  status.fault = Fault::wheels_off_model;
  status.share = 0.5;
  EXPECT_TRUE(update());
  EXPECT_EQ(log.lines, Lines{"WARN Noticed: wheels reach 50 % of their commands. "
                             "Check the scale of the encoders, the motors and the plant model"});
  EXPECT_EQ(report.reason(), "wheels reach 50 % of their commands");
  status.share = 0.6;  // it ended, and came again between two looks
  EXPECT_TRUE(update());
  EXPECT_EQ(report.reason(), "wheels reach 60 % of their commands");
}

TEST_F(StatusReportTest, BeforeTheFirstActionStepItSaysSo) {
  EXPECT_EQ(diagnosis().message, "no action step yet");
  EXPECT_EQ(diagnosis().level, DiagnosticStatus::WARN);
}

TEST_F(StatusReportTest, AStartIsToldWithTheNextActionStep) {
  status.decision.status = DriveStatus::driving;
  EXPECT_TRUE(update());
  status.decision = {};
  EXPECT_FALSE(update());
  EXPECT_EQ(diagnosis().message, "no action step yet");
  status.decision.cause = StopCause::set_point_missing;
  EXPECT_TRUE(update());
  EXPECT_EQ(diagnosis().message, "no set point received yet");
  EXPECT_EQ(diagnosis().level, DiagnosticStatus::OK);
}

TEST_F(StatusReportTest, WhatHasNotComeIsAWarningWhileIdle) {
  status.decision.cause = StopCause::set_point_missing;
  update();
  EXPECT_EQ(diagnosis().level, DiagnosticStatus::OK);
  missing.add(StopCause::wheels_missing, true);
  EXPECT_EQ(diagnosis().message, "no set point received yet; no wheel speeds received yet");
  EXPECT_EQ(diagnosis().level, DiagnosticStatus::WARN);
  missing.add(StopCause::imu_missing, true);
  EXPECT_EQ(diagnosis().message, "no set point received yet; no wheel speeds received yet; no IMU data received yet");
  missing = {};
  missing.add(StopCause::imu_missing, true);
  EXPECT_EQ(diagnosis().message, "no set point received yet; no IMU data received yet");
}

TEST_F(StatusReportTest, WhatIsLostOrFaultyIsAWarningWhileIdle) {
  status.decision.cause = StopCause::set_point_missing;
  status.loss = Loss::both_encoders;
  update();
  EXPECT_EQ(diagnosis().message, "no set point received yet; both encoders lost");
  EXPECT_EQ(diagnosis().level, DiagnosticStatus::WARN);
  status.loss = Loss::none;
  status.fault = Fault::gyro_frozen;
  update();
  EXPECT_EQ(diagnosis().level, DiagnosticStatus::WARN);
}

TEST_F(StatusReportTest, CommandsThatNobodyHearsAreAWarning) {
  unheard = "nobody listens to /cmd_vel";
  status.decision.status = DriveStatus::driving;
  for (const bool handed_over : {true, false}) {
    status.handed_over = handed_over;
    update();
    EXPECT_EQ(diagnosis().message, unheard);
    EXPECT_EQ(diagnosis().level, DiagnosticStatus::WARN);
  }
  status.decision.status = DriveStatus::idle;
  status.decision.cause = StopCause::set_point_missing;
  update();
  EXPECT_EQ(diagnosis().message, "no set point received yet; nobody listens to /cmd_vel");
  EXPECT_EQ(diagnosis().level, DiagnosticStatus::WARN);
  status.decision.status = DriveStatus::faulted;
  status.decision.cause = StopCause::driver_fault;
  update();
  EXPECT_EQ(diagnosis().message, "motor driver reports a fault; nobody listens to /cmd_vel");
  EXPECT_EQ(diagnosis().level, DiagnosticStatus::ERROR);
}

TEST_F(StatusReportTest, ALossIsLoggedAndItsEnd) {
  drive();
  status.loss = Loss::yaw_rate;
  update();
  update();
  EXPECT_TRUE(log.lines.empty()) << "it may stop the robot";
  report.settle(ros::WallDuration(0.0));
  ASSERT_EQ(log.lines.size(), 1u);
  EXPECT_EQ(log.lines[0].find("WARN Sensors: yaw rate lost. Check the IMU"), 0u) << log.lines[0];
  status.loss = Loss::encoder_and_yaw_rate;
  update();
  report.settle(ros::WallDuration(0.0));
  EXPECT_EQ(log.lines.back().find("WARN Sensors: encoder and yaw rate lost. "), 0u) << log.lines.back();
  status.loss = Loss::none;
  update();
  EXPECT_EQ(log.lines.back(), "Cleared: encoder and yaw rate lost");
  EXPECT_EQ(log.lines.size(), 3u);
}

TEST_F(StatusReportTest, ALossByAFaultIsLoggedOnce) {
  drive();
  status.fault = Fault::gyro_disagrees;
  status.loss = Loss::yaw_rate;
  update();
  report.settle(ros::WallDuration(0.0));
  report.settle(ros::WallDuration(0.0));
  ASSERT_EQ(log.lines.size(), 1u);
  EXPECT_EQ(log.lines[0].find("WARN Fault: gyro disagrees with the wheels. Check "), 0u) << log.lines[0];
  status.fault = Fault::none;
  status.loss = Loss::none;
  update();
  ASSERT_EQ(log.lines.size(), 2u);
  EXPECT_EQ(log.lines[1], "Fault cleared: gyro disagrees with the wheels");
}

TEST_F(StatusReportTest, AFaultThatStopsTheRobotIsOneLineWithWhatToDo) {
  drive();
  status.fault = Fault::left_wheels_blocked;
  update();
  decide(DriveStatus::braking, StopCause::sensor_fault);
  decide(DriveStatus::faulted, StopCause::sensor_fault);
  report.settle(ros::WallDuration(0.0));
  EXPECT_EQ(log.lines, Lines{"ERROR Stopping: left wheels do not follow their command. Free the wheels, and check the "
                             "power of the motors; then send a zero set point"});
}

TEST_F(StatusReportTest, ASetPointThatEndsIsOneLine) {
  drive();
  decide(DriveStatus::braking, StopCause::set_point_late);
  decide(DriveStatus::stopped, StopCause::set_point_late);
  EXPECT_EQ(log.lines, Lines{"Stopped: no set point for 0.5 s"});
}

TEST_F(StatusReportTest, AnEmergencyStopIsTwoLinesTheSecondSaysHowToGoOn) {
  drive();
  decide(DriveStatus::braking, StopCause::emergency_stop);
  decide(DriveStatus::stopped, StopCause::emergency_stop);
  status.decision.unacknowledged = true;
  update();
  update();
  EXPECT_EQ(log.lines, (Lines{"WARN Stopping: emergency stop. Release it to drive on",
                              "Cleared: emergency stop. Send a zero set point, or pause for 0.5 s, to drive on"}));
}

TEST_F(StatusReportTest, AnotherCauseOfTheSameStopIsTold) {
  drive();
  decide(DriveStatus::braking, StopCause::imu_late);
  decide(DriveStatus::braking, StopCause::emergency_stop);
  ASSERT_EQ(log.lines.size(), 2u);
  EXPECT_EQ(log.lines[1], "WARN Stopping: emergency stop. Release it to drive on");
}

TEST_F(StatusReportTest, TheEndOfTheNodeIsToldByTheNode) {
  drive();
  decide(DriveStatus::braking, StopCause::shutdown);
  decide(DriveStatus::stopped, StopCause::shutdown);
  EXPECT_TRUE(log.lines.empty()) << log.lines[0];
}

}  // namespace
}  // namespace jackal_aic
