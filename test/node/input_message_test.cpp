#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "jackal_aic/config/yaml_parameters.hpp"
#include "outputs/input_log.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic {
namespace {

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

/// What comes back of one input.
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
  addInput({kNow, GainsInput{gains}}, message);
  addInput({kNow, BeliefInput{}}, message);
  addInput({kNow, GainsInput{thesis}}, message);
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
  ParameterMap map;
  for (const std::string name : {"advanced", "jackal", preset.c_str(), "plant_model"}) {
    addYamlFile(std::string(JACKAL_AIC_SOURCE_DIR) + "/config/" + name + ".yaml", map);
  }
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
    EXPECT_TRUE(again.motors_shared);
    EXPECT_EQ(again.robot_name, parameters.robot_name);
  }
}

}  // namespace
}  // namespace jackal_aic
