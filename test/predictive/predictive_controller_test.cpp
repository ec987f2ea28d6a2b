#include "jackal_aic/predictive/predictive_controller.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace jackal_aic {
namespace {

PlantModel driveTrain() {
  PlantModel model;
  model.dead_time = 0.08;
  model.lag = 0.04;
  model.acceleration_limit = 20.0;
  return model;
}

/// A robot with exactly the drive train of a model and a given effective track, driven by a controller.
class Robot {
 public:
  Robot(const PlantModel& model, double track)
      : left_(model, 0.098, {}), right_(model, 0.098, {}), track_(track), step_time_(0.001) {}

  void drive(PredictiveController& controller, const PredictiveParameters& parameters, double seconds) {
    drive(controller, parameters, seconds, [&] { controller.hold(limited(controller.updateAction())); });
  }

  /// As drive(), with another command than the controller's.
  void overrule(PredictiveController& controller, const PredictiveParameters& parameters, const WheelCommand& command,
                double seconds) {
    drive(controller, parameters, seconds, [&] { controller.overrule(command); });
  }

  double forward() const { return 0.098 * 0.5 * (left_.speed() + right_.speed()); }
  double yawRate() const { return 0.098 * (right_.speed() - left_.speed()) / track_; }

  double gain = 1.0;
  double limit = 1e9;    // of a wheel command [rad/s]
  double noise = 0.0;    // of a measured wheel speed [rad/s]
  int phase = 0;         // of the sensors ahead of the actions [ms]
  int age = 0;           // of a measurement when it arrives [ms]
  double fastest = 0.0;  // forward speed so far [m/s]

 private:
  /// @param act gives the controller's command.
  template <class Act>
  void drive(PredictiveController& controller, const PredictiveParameters& parameters, double seconds, Act act) {
    const int belief = static_cast<int>(std::lround(1000.0 / parameters.belief_rate));
    for (int k = 1; k <= 1000 * seconds; ++k) {
      left_.predict(gain * controller.action().left);
      right_.predict(gain * controller.action().right);
      time_ += step_time_;
      if ((k + phase) % 20 == 0) observe(controller);
      if (k % belief == 0) controller.updateBelief();
      if (k % 20 == 0) act();
      past_.push_back({left_.speed(), right_.speed()});
      fastest = std::max(fastest, forward());
    }
  }

  WheelCommand limited(const WheelCommand& wanted) const {
    return {std::clamp(wanted.left, -limit, limit), std::clamp(wanted.right, -limit, limit)};
  }

  void observe(PredictiveController& controller) {
    std::normal_distribution<double> error;
    WheelCommand then{left_.speed(), right_.speed()};
    if (age > 0) then = past_.size() < static_cast<std::size_t>(age) ? WheelCommand{} : past_[past_.size() - age];
    const double left = then.left + noise * error(random_), right = then.right + noise * error(random_);
    controller.observe({time_, 0.098 * (then.right - then.left) / track_, left, right, 0.0, 0.0});
  }

  std::mt19937 random_{7};
  std::vector<WheelCommand> past_;  // wheel speeds, one per ms
  WheelBelief left_, right_;
  double track_, step_time_, time_ = 0.0;
};

class AtBeliefRate : public testing::TestWithParam<double> {
 protected:
  PredictiveParameters parameters() const {
    PredictiveParameters p;
    p.belief_rate = GetParam();
    return p;
  }
};

TEST_P(AtBeliefRate, OfTwoSamplesWithinOneBeliefStepNoChangeOfSpeedIsLost) {
  PredictiveController two(parameters(), {}, driveTrain());
  const double step = 1.65 / 0.098 * 0.02;  // rad/s, in a sample
  const auto sample = [step](int k) {
    const int moved = std::clamp(k - 50, 0, 45);
    return Observation{
        0.02 * k, 0.0, step * moved, step * moved, (moved > 0 && moved < 45 ? 1.65 : 0.0) + 0.01 * std::sin(k), 0.0};
  };
  for (int k = 0; k < 150; k += 2) {
    two.observe(sample(k));
    two.observe(sample(k + 1));
    two.updateBelief();
    ASSERT_EQ(two.traction(), Traction::rolls) << k;
  }
  EXPECT_NEAR(two.believedVelocity()(kForward), 0.098 * step * 45, 0.02);
}

TEST_P(AtBeliefRate, ReachesTheSetPointExactlyAndBelievesTheTruth) {
  PredictiveController controller(parameters(), {}, driveTrain());
  Robot robot(driveTrain(), 0.5621);
  robot.drive(controller, parameters(), 0.1);
  controller.setSetPoint({0.5, 0.0, 0.4});
  robot.drive(controller, parameters(), 1.0);
  EXPECT_NEAR(robot.forward(), 0.5, 1e-3);
  EXPECT_NEAR(robot.yawRate(), 0.4, 1e-3);
  EXPECT_NEAR(controller.believedVelocity()(kForward), robot.forward(), 1e-3);
  EXPECT_NEAR(controller.believedVelocity()(kYaw), robot.yawRate(), 1e-3);
}

TEST_P(AtBeliefRate, CancelsAGainError) {
  for (double gain : {0.8, 1.2}) {
    PredictiveController controller(parameters(), {}, driveTrain());
    Robot robot(driveTrain(), 0.5621);
    robot.gain = gain;
    robot.drive(controller, parameters(), 0.1);
    controller.setSetPoint({0.5, 0.0, 0.0});
    robot.drive(controller, parameters(), 2.0);
    EXPECT_NEAR(robot.forward(), 0.5, 0.005) << "gain " << gain;
  }
}

TEST_P(AtBeliefRate, BeliefFollowsTheRobotAndNotTheWish) {
  PredictiveController controller(parameters(), {}, driveTrain());
  Robot robot(driveTrain(), 0.5621);
  robot.drive(controller, parameters(), 0.1);
  controller.setSetPoint({1.0, 0.0, 0.0});
  robot.drive(controller, parameters(), 0.08);  // the dead time: nothing moves yet
  EXPECT_NEAR(controller.believedVelocity()(kForward), 0.0, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Rates, AtBeliefRate, testing::Values(50.0, 100.0, 1000.0));

TEST(PredictiveController, DoesNotDependOnThePhaseNorOnTheAgeOfTheMeasurements) {
  for (double rate : {50.0, 1000.0}) {
    for (int phase : {0, 1, 7, 13, 19}) {
      for (int age : {0, 5, 15}) {
        PredictiveParameters parameters;
        parameters.belief_rate = rate;
        PredictiveController controller(parameters, {}, driveTrain());
        Robot robot(driveTrain(), 0.5621);
        robot.phase = phase;
        robot.age = age;
        robot.drive(controller, parameters, 0.1);
        controller.setSetPoint({0.5, 0.0, 0.0});
        robot.drive(controller, parameters, 0.22);
        EXPECT_NEAR(robot.forward(), 0.5, 0.025) << rate << " Hz, phase " << phase << " ms, age " << age << " ms";
        robot.drive(controller, parameters, 2.0);
        EXPECT_NEAR(robot.forward(), 0.5, 0.0005) << rate << " Hz, phase " << phase << " ms, age " << age << " ms";
        EXPECT_LT(robot.fastest, 1.05 * 0.5) << rate << " Hz, phase " << phase << " ms, age " << age << " ms";
      }
    }
  }
}

TEST(PredictiveController, LearnsTheEffectiveTrackOfBothSigns) {
  for (double factor : {0.75, 1.25}) {
    for (double turn : {0.5, -0.5}) {
      PredictiveController controller({}, {}, driveTrain());
      Robot robot(driveTrain(), factor * 0.5621);
      robot.drive(controller, {}, 0.1);
      controller.setSetPoint({0.0, 0.0, turn});
      robot.drive(controller, {}, 3.0);
      EXPECT_NEAR(controller.effectiveTrack(), factor * 0.5621, 0.01 * 0.5621);
      EXPECT_NEAR(robot.yawRate(), turn, 0.02 * std::abs(turn));
    }
  }
}

TEST(PredictiveController, DoesNotLearnSlipDrivingStraightNorWhenFrozen) {
  PredictiveParameters frozen;
  frozen.learn_track = false;
  PredictiveController straight({}, {}, driveTrain()), still(frozen, {}, driveTrain());
  Robot a(driveTrain(), 0.7), b(driveTrain(), 0.7);
  a.drive(straight, {}, 0.1);
  straight.setSetPoint({1.0, 0.0, 0.0});
  a.drive(straight, {}, 2.0);
  EXPECT_EQ(straight.effectiveTrack(), 0.5621);
  b.drive(still, frozen, 0.1);
  still.setSetPoint({0.0, 0.0, 0.5});
  b.drive(still, frozen, 2.0);
  EXPECT_EQ(still.effectiveTrack(), 0.5621);
}

TEST(PredictiveController, SlipIsFrozenKeptAndTakenOver) {
  PredictiveController controller({}, {}, driveTrain());
  Robot robot(driveTrain(), 0.7);
  controller.freezeLearning(true);
  controller.setSetPoint({0.0, 0.0, 0.5});
  robot.drive(controller, {}, 2.0);
  EXPECT_EQ(controller.learned().slip.effective_track, 0.5621);
  controller.freezeLearning(false);
  robot.drive(controller, {}, 2.0);
  EXPECT_NEAR(controller.effectiveTrack(), 0.7, 0.007);

  PredictiveController restarted({}, {}, driveTrain());
  restarted.setLearned(controller.learned());
  EXPECT_DOUBLE_EQ(restarted.effectiveTrack(), controller.learned().slip.effective_track) << "without the ground";
  EXPECT_NEAR(restarted.effectiveTrack(), 0.7, 0.035);
  EXPECT_THROW(restarted.setLearned({{-0.5, 1.0}}), ParameterError);
  EXPECT_THROW(restarted.setLearned({{0.5, std::numeric_limits<double>::quiet_NaN()}}), ParameterError);

  const DriveTrainTiming before = *restarted.learned().timing;
  const double track = restarted.effectiveTrack();
  TurnCoefficients impossible;
  impossible.mean.setZero();
  impossible.covariance.setConstant(-1.0);
  EXPECT_THROW(restarted.setLearned({{0.5, 1.0, impossible}, DriveTrainTiming{0.3, 0.01}}), ParameterError);
  EXPECT_EQ(restarted.learned().timing->dead_time, before.dead_time) << "what is refused changes nothing";
  EXPECT_EQ(restarted.effectiveTrack(), track);
}

TEST(PredictiveController, WhatWasDrivenWhileNothingWasLearnedIsNoDeadTime) {
  for (const bool by_gains : {false, true}) {
    for (const double pause : {0.25, 2.0, 20.0}) {
      PredictiveController controller({}, {}, driveTrain());
      Robot robot(driveTrain(), 0.5621);
      robot.drive(controller, {}, 2.0);
      PredictiveParameters off;
      off.learn_drive_train = !by_gains;
      controller.adoptGains(off);
      controller.freezeLearning(!by_gains);
      controller.setSetPoint({1.0, 0.0, 0.0});
      robot.drive(controller, off, pause);
      controller.adoptGains({});
      controller.freezeLearning(false);
      robot.drive(controller, {}, 3.0);
      EXPECT_NEAR(controller.learned().timing->dead_time, driveTrain().dead_time, 0.003) << by_gains << ", " << pause;
    }
  }
}

TEST(PredictiveController, AGyroThatAJoltShakesIsBelievedAndTeachesNoSlip) {
  PredictiveController controller({}, {}, driveTrain());
  Robot robot(driveTrain(), 0.7);
  controller.setShaken(true);
  controller.setSetPoint({0.0, 0.0, 0.5});
  robot.drive(controller, {}, 2.0);
  EXPECT_EQ(controller.effectiveTrack(), 0.5621);
  EXPECT_NEAR(controller.believedVelocity()(kYaw), 0.5 * 0.5621 / 0.7, 0.01);
  controller.setShaken(false);
  robot.drive(controller, {}, 2.0);
  EXPECT_NEAR(controller.effectiveTrack(), 0.7, 0.007);
}

/// Its wheels were under way when the motion was forgotten: the gain that is known is no disturbance of theirs.
TEST(PredictiveController, AForgottenMotionLeavesNoDisturbanceOfALearnedGain) {
  PredictiveController controller({}, {}, driveTrain());
  Robot robot(driveTrain(), 0.5621);
  robot.gain = 0.8;
  for (int i = 0; i < 8; ++i) {
    controller.setSetPoint({i % 3 == 0 ? 0.5 : i % 3 == 1 ? 0.2 : -0.4, 0.0, 0.0});
    robot.drive(controller, {}, 2.0);
  }
  ASSERT_NEAR(controller.model().gain, 0.8, 0.03);
  controller.forgetMotion();
  EXPECT_NEAR(controller.model().gain, 0.8, 0.03);
  EXPECT_EQ(controller.left().disturbance(), 0.0);
}

TEST(PredictiveController, RefusesWhatIsNotFiniteOrNotLater) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  PredictiveController controller({}, {}, driveTrain());
  EXPECT_FALSE(controller.setSetPoint({nan, 0.0, 0.0}));
  EXPECT_TRUE(taken(controller.observe({1.0, 0.0, 0.0, 0.0, 0.0, 0.0})));
  EXPECT_FALSE(taken(controller.observe({1.0, 0.0, 0.0, 0.0, 0.0, 0.0})));
  EXPECT_FALSE(taken(controller.observe({1.1, 0.0, nan, 0.0, 0.0, 0.0})));
}

TEST(PredictiveController, ResetMakesItAsNew) {
  PredictiveController used({}, {}, driveTrain()), fresh({}, {}, driveTrain());
  Robot first(driveTrain(), 0.7), second(driveTrain(), 0.5621), third(driveTrain(), 0.5621);
  used.setSetPoint({0.5, 0.0, 0.5});
  first.drive(used, {}, 2.0);
  used.reset();
  used.setSetPoint({0.3, 0.0, -0.4});
  fresh.setSetPoint({0.3, 0.0, -0.4});
  second.drive(used, {}, 1.0);
  third.drive(fresh, {}, 1.0);
  EXPECT_EQ(used.action(), fresh.action());
  EXPECT_EQ(used.believedVelocity(), fresh.believedVelocity());
  EXPECT_EQ(used.motionCovariance(), fresh.motionCovariance());
}

TEST(PredictiveController, ResetForgetsTheVibrationOfTheAccelerometer) {
  const auto feed = [](PredictiveController& controller, int samples, double begin, double vibration) {
    for (int k = 1; k <= samples; ++k) {
      const double speed =
          std::clamp(0.6 * (k - 20), 0.0, 15.0);  // wheels that spin up while the body does not feel it
      const double felt = 0.05 * std::sin(2.0 * k) + (k % 2 == 0 ? vibration : -vibration);
      controller.observe({begin + 0.02 * k, 0.0, speed, speed, felt, 0.0});
      for (int i = 0; i < 20; ++i) controller.updateBelief();
    }
    return controller.believedVelocity();
  };
  PredictiveController used({}, {}, driveTrain()), fresh({}, {}, driveTrain());
  feed(used, 500, 0.0, 6.0);
  used.reset();
  const BodyVector believed = feed(fresh, 60, 10.0, 0.0);
  EXPECT_LT(believed(kForward), 0.3) << "that the body stands";
  EXPECT_EQ(feed(used, 60, 10.0, 0.0), believed);
}

TEST(PredictiveController, ATurnLimitThatIsNoneBoundsNothingAndHidesNoOther) {
  // 0 stands for no bound. Commands follow the same path whether the other limit is told alone or twice.
  const auto actions = [](double acceleration, double deceleration) {
    PredictiveController controller({}, {}, driveTrain());
    controller.setTurnLimits(acceleration, deceleration);
    Robot robot(driveTrain(), 0.5621);
    robot.drive(controller, {}, 0.1);
    controller.setSetPoint({0.0, 0.0, 1.5});
    std::vector<double> turn;
    for (int i = 0; i < 40; ++i) {
      robot.drive(controller, {}, 0.02);
      turn.push_back(controller.action().right);
    }
    return turn;
  };
  EXPECT_EQ(actions(0.0, 2.0), actions(2.0, 2.0));
  EXPECT_EQ(actions(2.0, 0.0), actions(2.0, 2.0));
  EXPECT_NE(actions(0.0, 0.0), actions(2.0, 2.0));
}

TEST(PredictiveController, BelievesItsOwnBrakeWhileItIsOverruledAndDrivesOnWithoutAJump) {
  PredictiveController controller({}, {}, driveTrain());
  Robot robot(driveTrain(), 0.5621);
  robot.drive(controller, {}, 0.1);
  controller.setSetPoint({0.5, 0.0, 0.0});
  robot.drive(controller, {}, 1.0);
  robot.overrule(controller, {}, {}, 0.2);  // dead time and lag: the robot is braking
  EXPECT_LT(robot.forward(), 0.4);
  EXPECT_NEAR(controller.believedVelocity()(kForward), robot.forward(), 0.005);
  robot.overrule(controller, {}, {}, 1.0);
  EXPECT_NEAR(controller.believedVelocity()(kForward), 0.0, 0.005)
      << "the belief is what the robot does, not the set point";
  EXPECT_EQ(controller.action(), WheelCommand{});
  controller.setSetPoint({});
  EXPECT_NEAR(controller.updateAction().left, 0.0, 0.05) << "the path starts from rest";
}

TEST(PredictiveController, PathDoesNotRunAwayBeyondALimit) {
  const double limit = 5.0;  // rad/s
  PredictiveController controller({}, {}, driveTrain());
  Robot robot(driveTrain(), 0.5621);
  robot.limit = limit;
  robot.drive(controller, {}, 0.1);
  controller.setSetPoint({50.0, 0.0, 0.0});
  robot.drive(controller, {}, 3.0);
  EXPECT_NEAR(robot.forward(), 0.098 * limit, 0.01);
  controller.setSetPoint({0.2, 0.0, 0.0});
  robot.drive(controller, {}, 0.02);
  EXPECT_LT(controller.action().left, limit) << "the command falls at once when less is asked";
  robot.drive(controller, {}, 1.0);
  EXPECT_NEAR(robot.forward(), 0.2, 0.002);
}

TEST(PredictiveController, OtherGainsTakeOverWithoutAJump) {
  PredictiveController changed({}, {}, driveTrain()), same({}, {}, driveTrain());
  Robot a(driveTrain(), 0.7), b(driveTrain(), 0.7);
  for (auto [controller, robot] : {std::pair(&changed, &a), std::pair(&same, &b)}) {
    robot->drive(*controller, {}, 0.1);
    controller->setSetPoint({0.5, 0.0, 0.5});
    robot->drive(*controller, {}, 2.0);
  }
  PredictiveParameters slower;
  slower.reference_time = 0.3;
  slower.action_learning_rate = 0.5;
  const WheelCommand before = changed.action();
  changed.adoptGains(slower);
  EXPECT_EQ(changed.effectiveTrack(), same.effectiveTrack());
  EXPECT_NEAR(changed.updateAction().left, before.left, 1e-3);
  changed.setSetPoint({1.0, 0.0, 0.5});
  same.setSetPoint({1.0, 0.0, 0.5});
  EXPECT_LT(changed.updateAction().left, same.updateAction().left - 0.5) << "the slower reference is in force";
}

TEST(PredictiveController, RefusedGainsChangeNothing) {
  PredictiveController controller({}, {}, driveTrain());
  PredictiveParameters other;
  other.belief_rate = 500.0;
  EXPECT_THROW(controller.adoptGains(other), ParameterError) << "the caller's timers go on at the old rate";
  EXPECT_EQ(controller.beliefStep(), 0.001);
  EXPECT_EQ(controller.beliefStepsPerAction(), 20);
}

TEST(PredictiveController, CovarianceCoversTheErrorOfTheBelief) {
  PredictiveParameters parameters;
  PredictiveController controller(parameters, {}, driveTrain());
  Robot robot(driveTrain(), 0.5621);
  robot.noise = std::sqrt(parameters.wheel_variance);
  robot.drive(controller, parameters, 0.1);
  controller.setSetPoint({0.5, 0.0, 0.5});
  robot.drive(controller, parameters, 3.0);
  double squares = 0.0;  // of the error in units of the believed deviation
  constexpr int kSamples = 200;
  for (int i = 0; i < kSamples; ++i) {
    robot.drive(controller, parameters, 0.1);
    const double error = controller.believedVelocity()(kForward) - robot.forward();
    squares += error * error / controller.motionCovariance()(0, 0);
  }
  EXPECT_LT(squares / kSamples, 1.5) << "not overconfident";
  EXPECT_GT(controller.motionCovariance()(1, 1), 0.0);
}

TEST(PredictiveController, RefusesRatesThatDoNotFit) {
  PredictiveParameters parameters;
  parameters.belief_rate = 75.0;
  EXPECT_THROW(PredictiveController(parameters, {}, driveTrain()), ParameterError);
  parameters.belief_rate = 150.0;
  EXPECT_THROW(PredictiveController(parameters, {}, driveTrain()), ParameterError) << "150 Hz does not divide 1 kHz";
}

/// Somebody else drives a robot that had stood: handed back, it brakes as one that had been driving.
TEST(PredictiveController, ARobotThatStoodIsHandedBackWithoutAJump) {
  const auto largestStepAfter = [](const SetPoint& before) {
    PredictiveController controller({}, {}, driveTrain());
    Robot robot(driveTrain(), 0.5621);
    controller.setSetPoint(before);
    robot.drive(controller, {}, 5.0);
    controller.setSetPoint({});
    robot.overrule(controller, {}, {10.0, 10.0}, 2.0);
    double largest = 0.0, last = 10.0;
    for (int k = 0; k < 50; ++k) {
      robot.drive(controller, {}, 0.02);
      largest = std::max(largest, std::abs(controller.action().left - last));
      last = controller.action().left;
    }
    return largest;
  };
  EXPECT_NEAR(largestStepAfter({}), largestStepAfter({1.0, 0.0, 0.0}), 0.05);
}

TEST(PredictiveController, WithoutEncodersNothingIsLearnedOfTheirErrors) {
  PredictiveController controller({}, {}, driveTrain());
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.03);
  double measured = 0.0;  // variance while there are encoders
  for (int k = 0; k < 350; ++k) {
    Observation y{0.02 * k, 0.0, 5.0 + noise(random), 5.0 + noise(random), 0.1 * noise(random), 0.0};
    y.valid.wheel_left = y.valid.wheel_right = k < 300;
    controller.observe(y);
    controller.overrule({5.0, 5.0});
    for (int i = 0; i < 20; ++i) controller.updateBelief();
    if (k == 299) measured = controller.motionCovariance()(0, 0);
  }
  EXPECT_GT(controller.motionCovariance()(0, 0), measured);
}

}  // namespace
}  // namespace jackal_aic
