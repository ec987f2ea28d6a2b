// What people read of the drive loop: log lines and diagnostics.

#include "status_report.hpp"

#include <gtest/gtest.h>
#include <ros/console.h>

#include <string>
#include <vector>

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
    lines.push_back((level == ros::console::levels::Warn ? "WARN " : "") + std::string(text));
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

  KeptLog log;
  DriveLoopStatus status;
  StopCauses missing;
  std::string unheard;
  StatusReport report;
};

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
  using Lines = std::vector<std::string>;
  status.decision.status = DriveStatus::driving;
  update();
  log.lines.clear();
  status.loss = Loss::yaw_rate;
  update();
  update();
  ASSERT_EQ(log.lines, Lines{"WARN Sensors: yaw rate lost"});
  status.loss = Loss::encoder_and_yaw_rate;
  update();
  EXPECT_EQ(log.lines.back(), "WARN Sensors: encoder and yaw rate lost");
  status.loss = Loss::none;
  update();
  EXPECT_EQ(log.lines.back(), "Over: encoder and yaw rate lost");
  EXPECT_EQ(log.lines.size(), 3u);
}

TEST_F(StatusReportTest, ALossByAFaultIsLoggedOnce) {
  status.decision.status = DriveStatus::driving;
  update();
  log.lines.clear();
  status.fault = Fault::gyro_disagrees;
  status.loss = Loss::yaw_rate;
  update();
  ASSERT_EQ(log.lines.size(), 1u);
  EXPECT_NE(log.lines[0].find("Fault detected: "), std::string::npos) << log.lines[0];
  status.fault = Fault::none;
  status.loss = Loss::none;
  update();
  ASSERT_EQ(log.lines.size(), 2u);
  EXPECT_NE(log.lines[1].find("Over: "), std::string::npos) << log.lines[1];
}

}  // namespace
}  // namespace jackal_aic
