#include "jackal_aic/safety/drive_loop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "jackal_aic/safety/loop_odometry.hpp"

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;   // s
constexpr double kTick = 0.001;    // s
constexpr double kRadius = 0.098;  // m

DriveParameters thesis() {
  DriveParameters parameters;
  parameters.controller = ControllerParameters{};
  return parameters;
}

DriveParameters predictive() {
  DriveParameters parameters;
  parameters.controller = PredictiveParameters{};
  parameters.plant_model = PlantModel{};
  parameters.plant_model->identified = true;
  parameters.on_loss.one_wheel = LossAction::drive;
  return parameters;
}

DriveParameters openLoop(bool monitored) {
  DriveParameters parameters = predictive();
  parameters.controller = DifferentialDriveParameters{};
  parameters.open_loop_monitored = monitored;
  return parameters;
}

constexpr ChannelValidity kWheels{false, true, true, false}, kImu{true, false, false, true};

SensorReading reading(Observation observation, const ChannelValidity& valid, double sample) {
  observation.valid = valid;
  return {observation, InputSource::Sample::Constant(sample)};
}

/// A robot whose wheels follow their command with a lag of 0.1 s, and its drive loop.
struct Robot {
  explicit Robot(const DriveParameters& parameters)
      : kinematics(parameters.geometry), loop(parameters, makeController(parameters)) {
    loop.release();
  }

  /// Drives for a time [s]. @param sources that send: w wheels, i IMU, p pairs, l the IMU late and its pairs, 5 an IMU
  /// of 5 Hz and its pairs, 4 one of 4 Hz, s the set point. A pair of a slow IMU comes before the next wheels.
  void drive(double duration, const std::string& sources = "wips") {
    const auto sends = [&sources](char source) { return sources.find(source) != std::string::npos; };
    for (long end = tick + std::lround(duration / kTick); tick < end; ++tick) {
      now = start + kTick * static_cast<double>(tick);
      speed += (reached * command.vector() - speed) * kTick / 0.1;
      if (sends('4') && tick % 260 == 25) loop.observe(sample(), now);
      if (tick % 20 == 5) {
        const Observation y = sample();
        if (sends('w')) loop.receiveWheels(reading(y, kWheels, now), now);
        if (sends('i')) loop.receiveImu(reading(y, kImu, imu_repeats ? 0.0 : now), now);
        if (sends('p')) loop.observe(y, now);
        sent.push_back(y);
      }
      if (tick % 20 == 15 && sends('l') && sent.size() > kLate) {
        const Observation& late = sent[sent.size() - 1 - kLate];
        loop.observe(late, now);
        loop.receiveImu(reading(late, {}, now), now);
      }
      if (sends('5') && tick % 200 == 25) loop.observe(sent[sent.size() - 2], now);
      if ((sends('5') && tick % 200 == 11) || (sends('4') && tick % 260 == 21)) sendImu();
      if (tick % 100 == 0 && sends('s')) loop.setSetPoint(set_point, now);
      loop.report(robot, now);
      if (const auto due = loop.advance(now)) {
        EXPECT_TRUE(due->vector().allFinite());
        command = *due;
        ++commands;
      }
    }
  }

  void sendImu() { loop.receiveImu(reading(sample(), kImu, now), now); }

  Observation sample() const {
    const double noise = 0.001 * static_cast<double>(tick % 7);
    const double yaw_rate = kinematics.bodyVelocity({speed(0), speed(1)})(kYaw);
    return {now, yaw_rate + noise, speed(0) + noise, speed(1) - noise, 0.0, 0.0};
  }

  void driveAfterAZeroSetPoint(double duration) {
    const SetPoint wanted = std::exchange(set_point, SetPoint{});
    drive(0.2);
    set_point = wanted;
    drive(duration);
  }

  DriveStatus status() const { return loop.status().decision.status; }
  std::string why() const { return reason(loop.status()); }
  double forward() const { return kRadius * speed.mean(); }

  void expect(DriveStatus expected, const std::string& expected_reason) const {
    EXPECT_EQ(status(), expected) << why();
    EXPECT_EQ(why(), expected_reason);
  }

  /// Sends set points for a time, and expects that none of them moves the robot.
  void expectLatched(DriveStatus latched, double duration) {
    for (long i = std::lround(duration / kPeriod); i > 0; --i) {
      drive(kPeriod);
      ASSERT_EQ(command, WheelCommand{}) << now << " s: " << why();
    }
    EXPECT_EQ(status(), latched) << why();
    EXPECT_NE(why().find("zero set point"), std::string::npos) << why();
  }

  SkidSteerKinematics kinematics;
  DriveLoop loop;
  SetPoint set_point{0.5, 0.0, 0.0};
  RobotStatus robot;
  double reached = 1.0;  // share of the commands that reaches the motors
  double start = 10.0, now = 10.0;
  long tick = 0;
  WheelVector speed = WheelVector::Zero();
  WheelCommand command;
  int commands = 0;
  bool imu_repeats = false;
  static constexpr std::size_t kLate = 13;  // samples
  std::vector<Observation> sent;
};

class ThesisLoop : public testing::Test, protected Robot {
 protected:
  ThesisLoop() : Robot(thesis()) {}
};

/// A loop that was started and not released.
class LatchedLoop : public ThesisLoop {
 protected:
  LatchedLoop() { loop.start({}, now); }
};

TEST(DriveLoop, DrivesToTheSetPointWithOneCommandAPeriod) {
  for (const DriveParameters& parameters : {thesis(), predictive()}) {
    Robot robot(parameters);
    robot.drive(3.0);
    robot.expect(DriveStatus::driving, "");
    EXPECT_NEAR(robot.commands, 3.0 / kPeriod, 1.0);
    EXPECT_NEAR(robot.forward(), 0.5, 0.02);
    EXPECT_EQ(robot.loop.status().faults_detected, 0u);
  }
}

TEST(DriveLoop, WaitsForWheelsAndSetPointAndStopsWithoutThem) {
  using Status = DriveStatus;
  const std::tuple<const char*, Status, const char*, Status, const char*> rows[] = {
      // first, and after having driven
      {"", Status::idle, "no set point received yet", Status::stopped, "set point too old"},
      {"s", Status::stopped, "no wheel speeds received yet", Status::stopped, "wheel speeds too old"},
      {"is", Status::stopped, "no wheel speeds received yet", Status::stopped, "wheel speeds too old"},
      {"wip", Status::idle, "no set point received yet", Status::stopped, "set point too old"},
      {"ps", Status::driving, "", Status::driving, ""}};
  for (const auto& [sources, first, first_reason, later, later_reason] : rows) {
    SCOPED_TRACE(sources);
    Robot robot(thesis());
    robot.drive(0.4, sources);
    robot.expect(first, first_reason);
    robot.drive(2.0);
    EXPECT_EQ(robot.status(), Status::driving) << robot.why();
    robot.drive(2.0, sources);
    robot.expect(later, later_reason);
    EXPECT_EQ(robot.command == WheelCommand{}, later == Status::stopped);
  }
}

TEST_F(ThesisLoop, AdoptsGainsOfItsStructureWhileItDrives) {
  drive(1.0);
  EXPECT_THROW(loop.adoptGains(PredictiveParameters{}, now), ParameterError);
  ControllerParameters slow;
  slow.kappa_a *= 0.01;
  loop.adoptGains(slow, now);
  set_point.forward = 1.0;
  drive(0.3);
  EXPECT_LT(forward(), 0.55) << "follows as fast as with the gains of before";
}

TEST_F(ThesisLoop, SetPointsAreRefusedOrScaledIntoTheLimits) {
  EXPECT_EQ(loop.setSetPoint({std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0}, now), SetPointVerdict::not_finite);
  EXPECT_EQ(loop.setSetPoint({1e9, 0.0, 0.0}, now), SetPointVerdict::absurd);
  EXPECT_EQ(loop.status().rejected_set_points, 2u);
  for (const SetPoint& within : {SetPoint{2.0, 0.0, 0.0}, SetPoint{-0.5, 0.0, 0.7}}) loop.setSetPoint(within, now);
  EXPECT_EQ(loop.status().scaled_set_points, 0u);
  EXPECT_EQ(loop.setSetPoint({50.0, 0.0, 0.0}, now), SetPointVerdict::accepted);
  EXPECT_EQ(loop.setPoint().forward, 2.0);
  for (const SetPoint& next : {SetPoint{0.0, 0.0, 9.0}, SetPoint{1.0, 0.0, 0.0}}) loop.setSetPoint(next, now);
  EXPECT_EQ(loop.status().scaled_set_points, 2u);
  EXPECT_EQ(loop.status().scaled_from.yaw_rate, 9.0);
  EXPECT_EQ(loop.status().scaled_to.yaw_rate, 4.0);
}

TEST_F(ThesisLoop, SetPointWithAnOldStampIsLate) {
  drive(1.0);
  ASSERT_EQ(status(), DriveStatus::driving) << why();
  for (int i = 0; i < 5; ++i) {
    loop.setSetPoint(set_point, now, now - 10.0);
    drive(0.02, "wip");
  }
  expect(DriveStatus::braking, "set point too old");
  loop.setSetPoint(set_point, now, now);
  drive(0.3, "wip");
  EXPECT_EQ(status(), DriveStatus::driving) << why();
}

TEST_F(LatchedLoop, ClockThatStepsBackAtRestKeepsTheLatch) {
  unsigned resets = 0;
  for (const auto& [stop, latched] : {std::pair(&RobotStatus::emergency_stop, DriveStatus::stopped),
                                      std::pair(&RobotStatus::driver_fault, DriveStatus::faulted)}) {
    driveAfterAZeroSetPoint(1.8);
    ASSERT_EQ(status(), DriveStatus::driving) << why();
    robot.*stop = true;
    drive(1.0);
    robot.*stop = false;
    drive(3.0);
    ASSERT_EQ(status(), latched) << why();
    start -= 0.05;
    expectLatched(latched, 3.0);
    EXPECT_EQ(loop.status().clock_resets, ++resets);
  }
  driveAfterAZeroSetPoint(1.0);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
}

TEST(DriveLoop, SilenceBeforeSetPointsAreConnectedIsNoPause) {
  for (const bool connected : {true, false}) {
    Robot robot(thesis());
    robot.loop.start({}, robot.now);
    robot.robot.set_points_connected = connected;
    robot.drive(2.0, "wip");
    robot.robot.set_points_connected = true;
    robot.drive(1.0);
    EXPECT_EQ(robot.status(), connected ? DriveStatus::driving : DriveStatus::stopped) << robot.why();
  }
}

TEST_F(LatchedLoop, SetPointsThatLastSinceTheStartDoNotMoveTheRobot) {
  drive(0.3, "wip");  // a subscriber needs a moment to find the publisher
  EXPECT_EQ(status(), DriveStatus::idle) << why();
  expectLatched(DriveStatus::stopped, 3.0);
  driveAfterAZeroSetPoint(1.8);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  loop.start({}, now);
  EXPECT_EQ(loop.command(), WheelCommand{});
  command = {};
  expectLatched(DriveStatus::stopped, 2.0);
  driveAfterAZeroSetPoint(1.8);
  const WheelCommand before = command;
  loop.start(before, now);
  drive(kPeriod);
  EXPECT_GT(command.left, 0.8 * before.left) << "no jerk";
  drive(1.0);
  expectLatched(DriveStatus::stopped, 1.0);
  // A pause is as good as a zero set point.
  loop.start({}, now);
  drive(0.6, "wip");
  EXPECT_EQ(status(), DriveStatus::idle) << "the set point of before the start is forgotten: " << why();
  drive(1.0);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
}

TEST(DriveLoop, ReportedStopsAreNamedAndLatchedByTheirKind) {
  const struct {
    bool RobotStatus::*reported;
    bool latches;
    const char* reason;
    DriveStatus status = DriveStatus::stopped;
  } rows[] = {
      {&RobotStatus::motors_off, true, "motors do not take velocity commands"},
      {&RobotStatus::robot_stopped, true, "robot reports that it is stopped"},
      {&RobotStatus::emergency_stop, true, "emergency stop"},
      {&RobotStatus::disabled, true, "disabled"},
      {&RobotStatus::ending, false, "controller is to end"},
      {&RobotStatus::driver_fault, true, "motor driver reports a fault", DriveStatus::faulted},
      {&RobotStatus::contended, true, "another node publishes commands: /a on /b", DriveStatus::faulted},
      {&RobotStatus::rivals, false, "more than one node publishes set points: /a on /b"},
      {&RobotStatus::graph_checked, false, "publishers of commands and emergency stop not checked yet: /a on /b"}};
  for (const auto& row : rows) {
    SCOPED_TRACE(row.reason);
    Robot robot(thesis());
    robot.drive(2.0);
    ASSERT_EQ(robot.status(), DriveStatus::driving);
    EXPECT_EQ(reason(robot.loop.status(), "/a on /b"), "");
    robot.robot.*row.reported = !(robot.robot.*row.reported);
    robot.drive(0.03);
    EXPECT_EQ(robot.status(), DriveStatus::braking);
    robot.drive(2.0);
    EXPECT_EQ(robot.status(), row.status);
    EXPECT_EQ(reason(robot.loop.status(), "/a on /b"), row.reason);
    EXPECT_EQ(robot.why(), std::string(row.reason).substr(0, std::string(row.reason).find(':'))) << "without a name";
    EXPECT_EQ(robot.loop.command(), WheelCommand{});
    EXPECT_EQ(robot.loop.status().brakes, 1u);
    EXPECT_EQ(robot.loop.status().faults, row.status == DriveStatus::faulted ? 1u : 0u);
    robot.robot = {};
    if (row.latches) robot.expectLatched(row.status, 2.0);
    if (row.latches) robot.driveAfterAZeroSetPoint(0.0);
    robot.drive(1.0);
    robot.expect(DriveStatus::driving, "");
    EXPECT_EQ(robot.loop.status().brakes, 1u);
  }
}

TEST(DriveLoop, LossOfTheImuIsToldOnceAndTheWheelsAreObservedAlone) {
  const std::tuple<std::string, int, bool> rows[] = {{"wls", 50, true},  // its messages are too old
                                                     {"ws", 100, true},
                                                     {"w4s", 500, true},
                                                     {"w5s", 500, false}};  // its period is its deadline
  for (const auto& [sources, periods, lost] : rows) {
    SCOPED_TRACE(sources);
    Robot robot(thesis());
    robot.drive(2.0);
    if (sources == "ws") robot.sendImu();  // of an IMU that is faster than the wheels
    std::string before;
    int changes = 0;
    const auto count = [&](const std::string& heard, int steps) {
      for (int k = 0; k < steps; ++k) {
        robot.drive(kPeriod, heard);
        ASSERT_EQ(robot.status(), DriveStatus::driving) << robot.why();
        changes += robot.why() != before;
        before = robot.why();
      }
    };
    count(sources, periods);
    EXPECT_NEAR(robot.forward(), 0.5, 0.05) << "follows the wheels";
    if (!lost) continue;
    EXPECT_EQ(before, "yaw rate lost");
    EXPECT_EQ(changes, 1);
    count("wips", 500);
    EXPECT_EQ(before, "") << "it is back";
    EXPECT_EQ(changes, 2);
    if (sources == "wls") continue;
    EXPECT_EQ(robot.loop.status().rejected_measurements, 0u) << "a pair whose wheels were observed alone is no error";
  }
}

TEST(DriveLoop, OdometryIgnoresImpossibleSamples) {
  for (const double impossible : {1e300, 1e4, std::numeric_limits<double>::quiet_NaN()}) {
    DriveLoop loop(thesis(), makeController(thesis()));
    Odometry odometry = makeOdometry(thesis(), loop);
    for (int k = 1; k <= 100; ++k) {
      Observation y;
      y.stamp = kPeriod * k;
      y.wheel_left = k == 50 ? impossible : 0.0;
      y.yaw_rate = k == 60 ? impossible : 0.0;
      loop.observe(y, y.stamp);
      odometry.observe(asCounted(y, loop));
      loop.advance(y.stamp);
      odometry.advance(loop.command(), kPeriod);
      ASSERT_LT(std::abs(odometry.motion().forward), 0.01) << impossible << ", sample " << k;
      ASSERT_LT(std::abs(odometry.motion().yaw_rate), 0.01) << impossible << ", sample " << k;
    }
    EXPECT_LT(odometry.poseCovariance()(0, 0), 0.01);
  }
}

TEST_F(ThesisLoop, StartForgetsThatTheImuRepeated) {
  drive(1.0);
  imu_repeats = true;
  for (int start = 0; start < 2; ++start) {
    drive(0.2);
    EXPECT_EQ(why(), "");
    drive(0.4);
    EXPECT_EQ(why(), "yaw rate lost");
    loop.start({}, now);
    loop.release();
  }
}

TEST(DriveLoop, DeadEncoderIsNamedAndTheRobotDrivesOn) {
  for (const DriveParameters& parameters : {predictive(), openLoop(true)}) {
    Robot robot(parameters);
    robot.drive(3.0);
    ASSERT_NE(robot.loop.faultReport(), nullptr);
    EXPECT_FALSE(robot.loop.faultReport()->faulty());
    EXPECT_EQ(robot.loop.status().suspicion.hypothesis, faults::kHealthy);
    EXPECT_GT(robot.loop.status().suspicion.probability, 0.9);
    for (int i = 0; i < 100; ++i) {
      robot.drive(kPeriod, "s");
      Observation y = robot.sample();
      y.wheel_left = 0.0;
      robot.loop.observe(y, robot.now);
    }
    EXPECT_STREQ(robot.loop.faultReport()->reason(), "left encoder wrong");
    EXPECT_EQ(robot.loop.status().fault, Fault::left_encoder_wrong);
    robot.expect(DriveStatus::driving, "left encoder wrong");
    EXPECT_EQ(robot.loop.status().faults_detected, 1u);
    EXPECT_GT(robot.command.left, 4.0);
  }
}

TEST(DriveLoop, WithdrawsAGainThatCommandsOfAnotherNodeTaught) {
  for (const auto noticed : {&RobotStatus::contended, &RobotStatus::no_subscriber}) {
    Robot robot(predictive());
    const auto& controller = dynamic_cast<const PredictiveController&>(robot.loop.controller());
    robot.reached = 0.8;
    for (const double forward : {0.5, 0.0, 0.5, 0.0, 0.5, 0.0, 0.5, 0.0}) {
      robot.set_point.forward = forward;
      robot.drive(2.0);
    }
    EXPECT_LT(controller.learned().timing->gain_share, 0.9);
    robot.robot.*noticed = true;
    robot.drive(0.1);
    EXPECT_EQ(controller.learned().timing->gain_share, 1.0);
  }
}

TEST(DriveLoop, OpenLoopIsMonitoredOnRequestAndPredictiveNeedsAModel) {
  EXPECT_EQ(DriveLoop(openLoop(false), makeController(openLoop(false))).faultReport(), nullptr);
  DriveParameters parameters = predictive();
  parameters.plant_model.reset();
  EXPECT_THROW(makeController(parameters), ParameterError);
}

TEST(DriveLoop, EveryInputButFeedbackDetectsAClockThatRanBack) {
  const Observation y;
  const DriveInput calls[] = {{1.0, BeliefInput{}},      {1.0, ActionInput{}},        {1.0, ActionInput{1.0}},
                              {1.0, SetPointInput{}},    {1.0, WheelsInput{{y, {}}}}, {1.0, ImuInput{{y, {}}}},
                              {1.0, ObservationInput{}}, {1.0, StatusInput{}},        {1.0, AppliedInput{}},
                              {1.0, LearnedInput{}},     {1.0, LearningInput{true}},  {1.0, GainsInput{}},
                              {1.0, FeedbackInput{}}};
  for (const DriveInput& call : calls) {
    DriveLoop loop(thesis(), makeController(thesis()));
    loop.advance(10.0);
    loop.take(call);
    const bool feedback = std::holds_alternative<FeedbackInput>(call.what);
    EXPECT_EQ(loop.status().clock_resets, feedback ? 0u : 1u) << "input " << call.what.index();
  }
}

TEST(DriveLoop, LearnedModelOutlastsAClockThatRanBack) {
  DriveLoop loop(predictive(), makeController(predictive()));
  loop.setLearned({{0.6, 1.0}}, 10.0);
  const auto& controller = dynamic_cast<const PredictiveController&>(loop.controller());
  EXPECT_EQ(controller.learned().slip.effective_track, 0.6);
  loop.advance(5.0);
  EXPECT_EQ(loop.status().clock_resets, 1u);
  EXPECT_EQ(controller.learned().slip.effective_track, 0.6);
}

TEST_F(ThesisLoop, TimerIsSetToRightAfterTheMeasurements) {
  drive(0.1, "");
  double due = now + kPeriod;
  std::vector<double> ages;
  double measured = 0.0;
  for (long end = tick + 4000; tick < end; ++tick) {
    now = start + kTick * static_cast<double>(tick);
    if (tick % 20 == 5) loop.observe(sample(), measured = now);
    if (now < due) continue;
    if (loop.advance(now, due)) ages.push_back(now - measured);
    due = loop.nextDue(due, now);
    ASSERT_GE(due, now + 0.95 * kPeriod - kTick);
  }
  ASSERT_GE(ages.size(), 195u);
  EXPECT_LE(*std::max_element(ages.begin() + 5, ages.end()), 1.5 * kTick);
  loop.start({}, now);
  EXPECT_NEAR(loop.nextDue(now, now), now + kPeriod, 1e-6) << "a start forgets the measurements";
}

/// Inputs of every kind, with stops and a clock that runs back, are replayed by another loop.
void expectReplay(const DriveParameters& parameters) {
  Robot robot(parameters);
  DriveLoop& loop = robot.loop;
  std::vector<std::pair<DriveInput, WheelCommand>> heard;  // with the command before it
  loop.listen([&](const DriveInput& input) { heard.emplace_back(input, loop.command()); });
  loop.setLearned({{0.5, 0.95}}, robot.start);
  robot.drive(1.0);
  robot.set_point = {0.3, 0.0, 0.4};
  robot.drive(1.0, "ws");  // the IMU falls silent: the wheels are observed by the loop itself
  loop.freezeLearning(true, robot.now);
  ControllerParameters slow_action;
  slow_action.kappa_a *= 0.9;
  PredictiveParameters slow_reference;
  slow_reference.reference_time *= 2.0;
  const bool thesis_gains = std::holds_alternative<ControllerParameters>(parameters.controller);
  if (thesis_gains) loop.adoptGains(slow_action, robot.now);
  if (!thesis_gains) loop.adoptGains(slow_reference, robot.now);
  loop.receiveFeedback(robot.now, robot.now);
  for (int k = 0; k < 60; ++k) {  // another source drives a shared robot
    loop.applied({-2.0, -2.0}, AppliedSource::drive, robot.now);
    loop.updateBelief(robot.now);
    robot.drive(kPeriod);
  }
  robot.robot.emergency_stop = true;
  robot.drive(0.5);
  robot.robot.emergency_stop = false;
  robot.start -= 1.0;  // the clock runs back
  robot.drive(0.5);
  loop.start({1.0, 1.0}, robot.now);
  robot.drive(0.5);
  robot.set_point = {-0.3, 0.0, 0.0};
  robot.drive(0.021);
  loop.advance(robot.now + 0.02, robot.now + 0.02);  // an action that was due at a time of its own
  DriveLoop again(parameters, makeController(parameters));
  again.release();
  std::set<std::size_t> kinds;
  for (const auto& [input, command] : heard) {
    ASSERT_EQ(again.command(), command) << "input " << input.what.index() << " at " << input.now;
    again.take(input);
    kinds.insert(input.what.index());
  }
  EXPECT_EQ(kinds.size(), std::variant_size_v<decltype(DriveInput::what)>);
  EXPECT_EQ(again.command(), loop.command());
  EXPECT_EQ(again.controller().freeEnergy(), loop.controller().freeEnergy());
  EXPECT_EQ(again.status().clock_resets, 1u);
  EXPECT_EQ(again.status().brakes, loop.status().brakes);
  EXPECT_EQ(again.status().faults_detected, loop.status().faults_detected);
  const auto* controller = dynamic_cast<const PredictiveController*>(&again.controller());
  EXPECT_TRUE(controller == nullptr || controller->learningFrozen());
}

TEST(DriveLoop, RecordedInputsReplayExactly) {
  for (DriveParameters parameters : {thesis(), predictive()}) {
    parameters.plant_model = predictive().plant_model;
    for (const bool shared : {false, true}) {
      parameters.motors_shared = shared;
      expectReplay(parameters);
    }
  }
}

}  // namespace
}  // namespace jackal_aic
