// What the node says of its drive loop: states, inputs for the replay, log lines and diagnostics; no master.

#include <gtest/gtest.h>
#include <jackal_msgs/Drive.h>
#include <jackal_msgs/DriveFeedback.h>
#include <jackal_msgs/Feedback.h>
#include <jackal_msgs/Status.h>
#include <ros/console.h>
#include <ros/message_traits.h>

#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "../complaint.hpp"
#include "../repository.hpp"
#include "outputs/diagnostics.hpp"
#include "outputs/input_log.hpp"
#include "outputs/state_output.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic {
namespace {

template <class Gains>
DriveLoop turning(const Gains& gains) {
  DriveParameters parameters;
  parameters.controller = gains;
  parameters.plant_model = PlantModel{};
  DriveLoop loop(parameters, makeController(parameters));
  loop.setSetPoint({0.5, 0.0, 0.2}, 1.0);
  loop.observe({1.0, 0.3, 2.0, 4.0, 0.0, 0.0}, 1.0);
  loop.advance(1.0);
  loop.observe({1.02, 0.2, 2.2, 4.1, 0.0, 0.0}, 1.02);
  loop.updateBelief(1.02);
  return loop;
}

ControllerState messageOf(const DriveLoop& loop, const DriveLoopStatus& status, const Surroundings& around = {}) {
  ControllerState message;
  fillState(loop, ros::Time(1.02), message);
  addRemarks(status, around, "base_link", message);
  return message;
}
ControllerState messageOf(const DriveLoop& loop) { return messageOf(loop, loop.status()); }

TEST(StateMessage, CarriesBeliefAndErrorsOfAllOrders) {
  const DriveLoop loop = turning(ControllerParameters{});
  const auto& controller = dynamic_cast<const ActiveInferenceController&>(loop.controller());
  const ControllerState message = messageOf(loop);
  EXPECT_EQ(message.structure, ControllerState::THESIS);
  const auto orders = [](const auto& rows, int row) {
    return std::vector<double>{rows(row, 0), rows(row, 1), rows(row, 2), rows(row, 3)};
  };
  EXPECT_EQ(message.belief_forward, orders(controller.belief(), kForward));
  EXPECT_EQ(message.belief_yaw_rate, orders(controller.belief(), kYaw));
  EXPECT_EQ(message.sensory_error_wheel_left, orders(controller.errors().sensory, kWheelLeft));
  EXPECT_EQ(message.sensory_error_wheel_right, orders(controller.errors().sensory, kWheelRight));
  EXPECT_EQ(message.state_error_yaw_rate, orders(controller.errors().state, kYaw));
  EXPECT_EQ(message.free_energy, controller.freeEnergy());
  EXPECT_EQ(message.effective_track, GeometryParameters{}.effective_track);
}

TEST(StateMessage, CarriesWhatThePredictiveControllerBelieves) {
  const DriveLoop loop = turning(PredictiveParameters{});
  const PredictiveController& controller = *loop.predictive();
  const ControllerState message = messageOf(loop);
  EXPECT_EQ(message.structure, ControllerState::PREDICTIVE);
  EXPECT_EQ(message.belief_forward, std::vector<double>{controller.believedVelocity()(kForward)});
  EXPECT_EQ(message.belief_yaw_rate, std::vector<double>{controller.believedVelocity()(kYaw)});
  EXPECT_TRUE(message.state_error_forward.empty());
  EXPECT_EQ(message.sensory_error_wheel_left, std::vector<double>{controller.sensoryErrors()(kWheelLeft)});
  EXPECT_EQ(message.sensory_error_wheel_right, std::vector<double>{controller.sensoryErrors()(kWheelRight)});
  EXPECT_EQ(message.wheel_belief_left, controller.left().speed());
  EXPECT_EQ(message.wheel_belief_right, controller.right().speed());
  EXPECT_EQ(message.disturbance_right, controller.right().disturbance());
  EXPECT_EQ(message.effective_track, controller.effectiveTrack());
  EXPECT_GT(message.wheel_belief_right, message.wheel_belief_left);
}

TEST(StateMessage, SaysWhoDrivesAndWhyNot) {
  DriveParameters parameters;
  parameters.controller = DifferentialDriveParameters{};
  DriveLoop loop(parameters, makeController(parameters));
  loop.release();
  loop.setSetPoint({0.5, 0.0, 0.0}, 1.0);
  for (int k = 0; k <= 5; ++k) loop.advance(1.0 + 0.02 * k);
  ASSERT_GT(loop.command().left, 0.0);
  EXPECT_TRUE(messageOf(loop).belief_forward.empty()) << "the baseline has none";
  const std::string absent = "no subscriber on /cmd_vel";
  using State = ControllerState;
  DriveLoopStatus status = loop.status();
  const std::tuple<Surroundings, std::uint8_t, std::string, std::string> rows[] = {
      {{}, State::BY_US, "", "driven by this controller"},
      {{"", absent}, State::BY_NOBODY, absent, "not driven"},
      {{"", "", true}, State::BY_ANOTHER, "", "driven by another node"}};
  for (const auto& [around, driven_by, reason, summary] : rows) {
    const ControllerState message = messageOf(loop, status, around);
    EXPECT_EQ(message.driven_by, driven_by) << summary;
    EXPECT_EQ(message.reason, reason);
    EXPECT_EQ(message.summary, "thesis, driving, " + summary);
  }
  EXPECT_EQ(messageOf(loop).hypothesis, "") << "without fault detection";
  status.suspicion = {faults::kGyroOffset, 0.6};
  status.loss = Loss::yaw_rate;
  const ControllerState message = messageOf(loop, status, {"", absent, false, 3});
  EXPECT_EQ(message.rejected_measurements, 3u);
  EXPECT_EQ(message.reason, "yaw rate lost; " + absent);
  EXPECT_EQ(message.hypothesis, "gyro offset");
  EXPECT_EQ(message.hypothesis_probability, 0.6);
  status.handed_over = true;
  EXPECT_EQ(messageOf(loop, status).driven_by, State::BY_ANOTHER);
}

// The sums of Clearpath's own package: with them a robot's nodes and ours accept each other's messages.
TEST(JackalMsgs, AreWireCompatibleWithTheRobots) {
  using namespace ros::message_traits;
  EXPECT_STREQ(MD5Sum<jackal_msgs::Drive>::value(), "601cf097cd47c174590c366c6ddd5fb3");
  EXPECT_STREQ(MD5Sum<jackal_msgs::DriveFeedback>::value(), "8dd0b7a3cfa20cfc5c054ddd9763609b");
  EXPECT_STREQ(MD5Sum<jackal_msgs::Feedback>::value(), "3bdabb0ef46338ee5672d1b82220ab49");
  EXPECT_STREQ(MD5Sum<jackal_msgs::Status>::value(), "c851ebcf9a6e20b196bc7894e285b4f6");
}

// Numbers that no decimal text of a few digits keeps.
constexpr double kThird = 1.0 / 3.0;
constexpr double kNow = 1700000000.123456789;

SensorReading reading() {
  SensorReading reading{};
  reading.observation = {kNow, kThird, -2.0 * kThird, 3.1, -0.0, 5e-324, 9.81 + kThird, {true, false, true, false},
                         true};
  for (int i = 0; i < reading.sample.size(); ++i) reading.sample(i) = kThird * i;
  reading.may_repeat = true;
  return reading;
}

template <class Input>
Input roundTrip(const Input& input) {
  LoopInputs message;
  addInput({kNow, input}, message);
  const auto inputs = inputsOf(message);
  EXPECT_EQ(inputs.size(), 1u);
  EXPECT_EQ(inputs.at(0).now, kNow);
  return std::get<Input>(inputs.at(0).what);
}

void expectSame(const Observation& a, const Observation& b) {
  EXPECT_EQ(a.stamp, b.stamp);
  EXPECT_EQ(a.vector(), b.vector());
  EXPECT_EQ(a.acceleration_z, b.acceleration_z);
  EXPECT_EQ(a.valid, b.valid);
  EXPECT_EQ(a.level, b.level);
}

TEST(InputMessage, KeepsEveryKindToTheBit) {
  roundTrip(BeliefInput{});
  EXPECT_EQ(roundTrip(ActionInput{kNow}).due, kNow);
  EXPECT_EQ(roundTrip(ActionInput{}).due, std::nullopt);
  EXPECT_EQ(roundTrip(SetPointInput{{kThird, 0.1, -kThird}, {}}).wanted.vector(), BodyVector(kThird, 0.1, -kThird));
  EXPECT_TRUE(std::isnan(roundTrip(SetPointInput{{std::nan(""), 0.0, 1.0}, {}}).wanted.forward));
  EXPECT_EQ(roundTrip(SetPointInput{{}, kNow}).stamp, kNow);
  EXPECT_EQ(roundTrip(SetPointInput{}).stamp, std::nullopt);
  const SensorReading wheels = roundTrip(WheelsInput{reading()}).reading;
  expectSame(wheels.observation, reading().observation);
  EXPECT_EQ(wheels.sample, reading().sample);
  EXPECT_TRUE(wheels.may_repeat);
  EXPECT_EQ(roundTrip(ImuInput{reading()}).reading.sample, reading().sample);
  Observation without_z = reading().observation;
  without_z.acceleration_z = std::nullopt;
  expectSame(roundTrip(ObservationInput{without_z}).observation, without_z);
  EXPECT_EQ(roundTrip(FeedbackInput{kNow}).stamp, kNow);
  const RobotStatus status =
      roundTrip(StatusInput{{false, true, false, true, false, false, true, true, true, true, false}}).status;
  EXPECT_TRUE(status.robot_stopped && status.driver_fault && status.ending && status.rivals && status.disabled);
  EXPECT_TRUE(status.no_subscriber);
  EXPECT_FALSE(status.emergency_stop || status.motors_off || status.contended || status.graph_checked ||
               status.set_points_connected);
  const AppliedInput applied = roundTrip(AppliedInput{{kThird, -kThird}, AppliedSource::wheels});
  EXPECT_EQ(applied.command, (WheelCommand{kThird, -kThird}));
  EXPECT_EQ(applied.source, AppliedSource::wheels);
  EXPECT_EQ(roundTrip(LearnedInput{{{kThird, 0.9}}}).learned.slip.effective_track, kThird);
  EXPECT_FALSE(roundTrip(LearnedInput{{{kThird, 0.9}}}).learned.timing);
  const auto timing =
      roundTrip(LearnedInput{{{kThird, 0.9}, DriveTrainTiming{kThird, 0.25, 3.0}}}).learned.timing.value();
  EXPECT_EQ(timing.dead_time, kThird);
  EXPECT_EQ(timing.lag, 0.25);
  EXPECT_EQ(timing.acceleration_limit, 3.0);
  EXPECT_TRUE(roundTrip(LearningInput{true}).frozen);
  EXPECT_EQ(roundTrip(StartInput{{1.0, kThird}}).driven.right, kThird);
}

TEST(InputMessage, KeepsGainsInTheirOrder) {
  PredictiveParameters gains;
  gains.reference_time = kThird;
  gains.wheel_variance = 1e-4 * kThird;
  ControllerParameters thesis;
  thesis.tau = kThird;
  LoopInputs message;
  for (const DriveInput& input :
       {DriveInput{kNow, GainsInput{gains}}, {kNow, BeliefInput{}}, {kNow, GainsInput{thesis}}}) {
    addInput(input, message);
  }
  const auto inputs = inputsOf(message);
  const auto& first = std::get<PredictiveParameters>(std::get<GainsInput>(inputs.at(0).what).gains);
  EXPECT_EQ(first.reference_time, kThird);
  EXPECT_EQ(first.wheel_variance, 1e-4 * kThird);
  EXPECT_EQ(std::get<ControllerParameters>(std::get<GainsInput>(inputs.at(2).what).gains).tau, kThird);
  message.gains.pop_back();
  EXPECT_THROW(inputsOf(message), ParameterError);
}

TEST(InputMessage, RefusesWhatNoControllerWrote) {
  void (*const damages[])(LoopInput&) = {[](LoopInput& input) { input.kind = 200; },
                                         [](LoopInput& input) { input.values.clear(); },
                                         [](LoopInput& input) { input.values.push_back(1.0); },
                                         [](LoopInput& input) { input.values[2] = -1.0; },
                                         [](LoopInput& input) { input.values[2] = 3.0; },
                                         [](LoopInput& input) { input.values[2] = std::nan(""); }};
  for (const auto& damage : damages) {
    LoopInputs message;
    addInput({kNow, AppliedInput{}}, message);
    EXPECT_NO_THROW(inputsOf(message));
    damage(message.inputs[0]);
    EXPECT_THROW(inputsOf(message), ParameterError);
  }
}

NodeParameters configured(const std::string& preset) {
  ParameterMap map = shipped({"advanced", "jackal", preset, "plant_model"});
  map.set("robot.wheel_radius", 0.1 * kThird + 0.07);
  map.set("robot.effective_track", 0.4 + 0.1 * kThird);
  map.set("limits.linear_speed", 2.0 * kThird);
  map.set("sensors.gyro_variance", 1e-5 * kThird);
  map.set("deadlines.imu", 0.1 + 0.01 * kThird);
  map.set("restart_after_stop", std::string("at_once"));
  map.set("output", std::string("twist"));
  return readNodeParameters(map, [] { return ""; });
}

TEST(ConfigurationText, GivesTheSameParametersAgainForEveryPreset) {
  for (const std::string preset : {"predictive", "standard", "improved", "tuned", "diff_drive"}) {
    const NodeParameters parameters = configured(preset);
    const std::string text = configurationText(parameters);
    ParameterMap map;
    addYamlText(text, "text", map);
    const NodeParameters again = readNodeParameters(map, [] {
      ADD_FAILURE() << "asks for the URDF";
      return "";
    });
    SCOPED_TRACE(preset);
    EXPECT_EQ(configurationText(again), text);
    EXPECT_EQ(again.controller.index(), parameters.controller.index());
    EXPECT_EQ(again.gate.limits.linear_speed, 2.0 * kThird);
    EXPECT_EQ(again.gate.restart_after_stop, RestartPolicy::at_once);
    EXPECT_EQ(again.faults.value().gyro_variance, 1e-5 * kThird);
    const auto* predictive = std::get_if<PredictiveParameters>(&again.controller);
    EXPECT_EQ(predictive ? predictive->gyro_variance : 1e-5 * kThird, 1e-5 * kThird) << "one variance for all";
    EXPECT_TRUE(again.motors_shared);
    EXPECT_EQ(again.robot_name, parameters.robot_name);
  }
}

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

TEST_F(StatusReportTest, WhatIsMissingOrFaultyOrHeardByNobodyIsAWarning) {
  const std::string idle = "no set point received yet";
  status.decision.cause = StopCause::set_point_missing;
  update();
  missing = "no wheel speeds received yet";
  expectDiagnosis(DiagnosticStatus::WARN, idle + "; no wheel speeds received yet");
  missing.clear();
  status.loss = Loss::both_encoders;
  update();
  expectDiagnosis(DiagnosticStatus::WARN, idle + "; both encoders lost");
  status.loss = Loss::none;
  status.fault = Fault::gyro_frozen;
  update();
  EXPECT_EQ(diagnosis().level, DiagnosticStatus::WARN);
  status.fault = Fault::none;
  no_subscriber = "nobody listens to /cmd_vel";
  for (const bool handed_over : {true, false}) {
    status.handed_over = handed_over;
    decide(DriveStatus::driving, StopCause::none);
    expectDiagnosis(DiagnosticStatus::WARN, no_subscriber);
  }
  decide(DriveStatus::idle, StopCause::set_point_missing);
  expectDiagnosis(DiagnosticStatus::WARN, idle + "; nobody listens to /cmd_vel");
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

TEST_F(StatusReportTest, StopsAreToldOnceWithHowToGoOn) {
  const std::pair<StopCause, Lines> rows[] = {
      {StopCause::set_point_late, {"Stopped: no set point for 0.5 s"}},
      {StopCause::emergency_stop, {"WARN Stopping: emergency stop. Release it to drive on"}},
      {StopCause::shutdown, {}},
      {StopCause::sensor_fault,
       {"ERROR Stopping: left wheels do not follow their command. Free the wheels, and check the power of the motors; "
        "then send a zero set point"}}};
  for (const auto& [cause, said] : rows) {
    drive();
    if (cause == StopCause::sensor_fault) status.fault = Fault::left_wheels_blocked;
    decide(DriveStatus::braking, cause);
    decide(DriveStatus::stopped, cause);
    EXPECT_EQ(lines, said);
  }
  status.fault = Fault::none;
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
