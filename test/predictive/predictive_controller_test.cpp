#include "jackal_aic/predictive/predictive_controller.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098;  // m
constexpr double kTrack = 0.5621;  // m, of the controller
const double kNaN = std::numeric_limits<double>::quiet_NaN();

PlantModel driveTrain() {
  PlantModel model;
  model.dead_time = 0.08;
  model.lag = 0.04;
  model.acceleration_limit = 20.0;
  return model;
}

/// A controller, and a robot with a given effective track and drive train: exactly that of its model, unless given.
struct Loop {
  explicit Loop(double robot_track = kTrack, const PredictiveParameters& gains = {},
                const GeometryParameters& geometry = {}, const PlantModel& model = driveTrain(),
                const PlantModel& robot = driveTrain())
      : parameters(gains),
        controller(gains, geometry, model),
        track(robot_track),
        left(robot, kRadius, {}),
        right(robot, kRadius, {}) {}

  /// Drives to a set point.
  Loop& drive(const SetPoint& set_point, double seconds) {
    controller.setSetPoint(set_point);
    return drive(seconds);
  }

  Loop& drive(double seconds) {
    return run(seconds, [this] {
      const WheelCommand wanted = controller.updateAction();
      controller.hold({std::clamp(wanted.left, -limit, limit), std::clamp(wanted.right, -limit, limit)});
    });
  }

  /// Drives with another source's command.
  Loop& overrule(const WheelCommand& command, double seconds) {
    return run(seconds, [&] { controller.overrule(command); });
  }

  double forward() const { return kRadius * 0.5 * (left.speed() + right.speed()); }
  double yawRate() const { return kRadius * difference / track; }

  PredictiveParameters parameters;
  PredictiveController controller;
  double track;
  double gain = 1.0;
  double sideways = 0.0;  // lateral acceleration as measured [m/s^2]
  double push = 0.0;      // by which its wheels turn without a command [rad/s]
  double limit = 1e9;     // of a wheel command [rad/s]
  int phase = 0;          // of the sensors ahead of the actions [ms]
  int age = 0;            // of a measurement when it arrives [ms]
  double creep = 0.0;     // time constant by which the body follows its wheels in a turn [s]
  double fastest = 0.0;   // forward speed so far [m/s]

 private:
  /// @param act gives the controller's command.
  template <class Act>
  Loop& run(double seconds, Act act) {
    const int belief = static_cast<int>(std::lround(1000.0 / parameters.belief_rate));
    for (int k = 1; k <= 1000 * seconds; ++k) {
      left.predict(gain * controller.action().left + push);
      right.predict(gain * controller.action().right + push);
      time += 0.001;
      difference += 0.001 / std::max(creep, 0.001) * (right.speed() - left.speed() - difference);
      if ((k + phase) % 20 == 0) observe();
      if (k % belief == 0) controller.updateBelief();
      if (k % 20 == 0) act();
      past.push_back({left.speed(), right.speed()});
      fastest = std::max(fastest, forward());
    }
    return *this;
  }

  void observe() {
    WheelCommand then{left.speed(), right.speed()};
    if (age > 0) then = past.size() < static_cast<std::size_t>(age) ? WheelCommand{} : past[past.size() - age];
    controller.observe({time, kRadius * (age > 0 ? then.right - then.left : difference) / track, then.left, then.right,
                        0.0, sideways});
  }

  std::vector<WheelCommand> past;  // wheel speeds, one per ms
  WheelBelief left, right;
  double difference = 0.0;  // of the wheel speeds that the body has followed [rad/s]
  double time = 0.0;
};

PredictiveParameters atRate(double belief_rate) {
  PredictiveParameters parameters;
  parameters.belief_rate = belief_rate;
  return parameters;
}

class AtBeliefRate : public testing::TestWithParam<double> {};

TEST_P(AtBeliefRate, TwoSamplesWithinOneBeliefStepLoseNoChangeOfSpeed) {
  PredictiveController two(atRate(GetParam()), {}, driveTrain());
  const double step = 1.65 / kRadius * 0.02;  // rad/s, in a sample
  for (int k = 0; k < 150; ++k) {
    const int moved = std::clamp(k - 50, 0, 45);
    two.observe(
        {0.02 * k, 0.0, step * moved, step * moved, (moved > 0 && moved < 45 ? 1.65 : 0.0) + 0.01 * std::sin(k), 0.0});
    if (k % 2 == 0) continue;
    two.updateBelief();
    ASSERT_EQ(two.traction(), Traction::rolls) << k;
  }
  EXPECT_NEAR(two.believedVelocity()(kForward), kRadius * step * 45, 0.02);
}

TEST_P(AtBeliefRate, ReachesTheSetPointAndBelievesTheTruth) {
  for (double gain : {0.8, 1.0, 1.2}) {
    Loop loop(kTrack, atRate(GetParam()));
    loop.gain = gain;
    loop.drive(0.1).drive({0.5, 0.0, 0.4}, 0.08);
    EXPECT_NEAR(loop.controller.believedVelocity()(kForward), 0.0, 0.02) << "nothing moves within the dead time";
    loop.drive(1.92);
    EXPECT_NEAR(loop.forward(), 0.5, gain == 1.0 ? 1e-3 : 0.005) << gain;
    EXPECT_NEAR(loop.yawRate(), 0.4, gain == 1.0 ? 1e-3 : 0.02) << gain;
    if (gain != 1.0) continue;
    EXPECT_NEAR(loop.controller.believedVelocity()(kForward), loop.forward(), 1e-3);
    EXPECT_NEAR(loop.controller.believedVelocity()(kYaw), loop.yawRate(), 1e-3);
  }
}

TEST_P(AtBeliefRate, DoesNotDependOnThePhaseNorOnTheAgeOfTheMeasurements) {
  for (int phase : {0, 1, 7, 13, 19}) {
    for (int age : {0, 5, 15}) {
      SCOPED_TRACE(testing::Message() << "phase " << phase << " ms, age " << age << " ms");
      Loop loop(kTrack, atRate(GetParam()));
      loop.phase = phase;
      loop.age = age;
      EXPECT_NEAR(loop.drive(0.1).drive({0.5, 0.0, 0.0}, 0.22).forward(), 0.5, 0.025);
      EXPECT_NEAR(loop.drive(2.0).forward(), 0.5, 0.0005);
      EXPECT_LT(loop.fastest, 1.05 * 0.5);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Rates, AtBeliefRate, testing::Values(50.0, 100.0, 1000.0));

// ---- learning

/// x_dot = r alpha (w_R + w_L)/2, theta_dot = r alpha (w_R - w_L)/b_hat (3-1), with the model's b_hat.
TEST(PredictiveController, SlipFactorAndTrackTurnTheRobotTogether) {
  for (const double slip_factor : {0.8, 1.0, 1.2}) {
    for (const bool learns : {false, true}) {
      PredictiveParameters gains;
      gains.learn_track = learns;
      GeometryParameters geometry;
      geometry.slip_factor = slip_factor;
      PlantModel model = driveTrain();
      model.effective_track = learns ? 0.75 : 0.6;
      Loop loop(0.6 / slip_factor, gains, geometry, model);
      loop.drive({0.4, 0.0, 0.5}, 4.0);
      EXPECT_NEAR(slip_factor * loop.forward(), 0.4, 0.004) << slip_factor << ", learns " << learns;
      EXPECT_NEAR(loop.yawRate(), 0.5, 0.005) << slip_factor << ", learns " << learns;
      EXPECT_NEAR(loop.controller.believedVelocity()(kForward), 0.4, 0.004);
      EXPECT_NEAR(loop.controller.effectiveTrack(), 0.6, 0.04 * 0.6) << "an arc shows little of the turn in place";
    }
  }
}

TEST(PredictiveController, SlipIsFrozenKeptAndTakenOver) {
  Loop loop(0.7);
  for (const bool shaken : {false, true}) {  // by request, or while a jolt shakes the gyro
    loop.controller.freezeLearning(!shaken);
    loop.controller.setShaken(shaken);
    loop.drive({0.0, 0.0, 0.5}, 2.0);
    EXPECT_EQ(loop.controller.learned().slip.effective_track, kTrack);
    EXPECT_NEAR(loop.controller.believedVelocity()(kYaw), 0.5 * kTrack / 0.7, 0.01);
  }
  loop.controller.setShaken(false);
  loop.drive(2.0);
  EXPECT_NEAR(loop.controller.effectiveTrack(), 0.7, 0.007);

  PredictiveController restarted({}, {}, driveTrain());
  restarted.setLearned(loop.controller.learned());
  EXPECT_DOUBLE_EQ(restarted.effectiveTrack(), loop.controller.learned().slip.effective_track) << "without the ground";
  EXPECT_NEAR(restarted.effectiveTrack(), 0.7, 0.035);
  const DriveTrainTiming before = *restarted.learned().timing;
  const double track = restarted.effectiveTrack();
  TurnCoefficients impossible, not_finite = *restarted.learned().slip.turn;
  impossible.mean.setZero();
  impossible.covariance.setConstant(-1.0);
  not_finite.mean(2) = kNaN;
  for (const LearnedModel& wrong :
       {LearnedModel{{-0.5, 1.0}}, LearnedModel{{0.5, kNaN}}, LearnedModel{{0.5, 1.0, not_finite}},
        LearnedModel{{0.5, 1.0, impossible}, DriveTrainTiming{0.3, 0.01}}}) {
    EXPECT_THROW(restarted.setLearned(wrong), ParameterError);
    EXPECT_EQ(restarted.learned().timing->dead_time, before.dead_time) << "a refused model changes nothing";
    EXPECT_EQ(restarted.effectiveTrack(), track);
  }
}

TEST(PredictiveController, MotionWhileLearningIsFrozenIsNoDeadTime) {
  for (const bool by_gains : {false, true}) {
    for (const double pause : {0.25, 2.0, 20.0}) {
      Loop loop;
      loop.drive(2.0);
      PredictiveParameters off;
      off.learn_drive_train = !by_gains;
      loop.controller.adoptGains(off);
      loop.controller.freezeLearning(!by_gains);
      loop.drive({1.0, 0.0, 0.0}, pause);
      loop.controller.adoptGains({});
      loop.controller.freezeLearning(false);
      loop.drive(3.0);
      EXPECT_NEAR(loop.controller.learned().timing->dead_time, driveTrain().dead_time, 0.003) << by_gains << pause;
    }
  }
}

TEST(PredictiveController, RefusesInputsThatAreNotFiniteOrNotLater) {
  PredictiveController controller({}, {}, driveTrain());
  EXPECT_FALSE(controller.setSetPoint({kNaN, 0.0, 0.0}));
  EXPECT_TRUE(taken(controller.observe({1.0, 0.0, 0.0, 0.0, 0.0, 0.0})));
  EXPECT_FALSE(taken(controller.observe({1.0, 0.0, 0.0, 0.0, 0.0, 0.0})));
  EXPECT_FALSE(taken(controller.observe({1.1, 0.0, kNaN, 0.0, 0.0, 0.0})));
}

TEST(PredictiveController, NumbersOfLostChannelsDoNotReachIt) {
  PredictiveController clean({}, {}, driveTrain());
  clean.setSetPoint({0.5, 0.0, 0.2});
  PredictiveController poisoned = clean;
  for (int k = 0; k < 100; ++k) {
    Observation y;
    y.stamp = 0.02 * k;
    (k % 3 == 0 ? y.valid.yaw_rate : y.valid.wheel_left) = false;
    y.valid.acceleration = y.valid.yaw_rate;
    clean.observe(y);
    if (!y.valid.wheel_left) y.wheel_left = kNaN;
    if (!y.valid.yaw_rate) y.yaw_rate = y.acceleration_x = y.acceleration_y = kNaN;
    EXPECT_TRUE(taken(poisoned.observe(y)));
    for (PredictiveController* controller : {&clean, &poisoned}) {
      for (int i = 0; i < 20; ++i) controller->updateBelief();
    }
    EXPECT_EQ(clean.updateAction(), poisoned.updateAction());
  }
  EXPECT_TRUE(poisoned.believedVelocity().allFinite());
}

/// A body that sticks, a gyro that is absent, has another unit or reads a third is no slip.
TEST(PredictiveController, LearnsNothingFromATurnBeyondTheRange) {
  for (const double part : {1e-9, 1.0 / 3.0, -1.0, 3.0, 57.3}) {
    Loop loop(kTrack / part);
    loop.drive({0.2, 0.0, 0.8}, 10.0);
    EXPECT_NEAR(loop.controller.effectiveTrack(), kTrack, 1e-3) << part;
    EXPECT_NEAR(loop.controller.turn().mean()(1), 0.0, 1e-3) << part;
  }
}

TEST(PredictiveController, SlowMotorsAndTyresAreNoSlip) {
  const struct {
    double lag, creep, most;  // of the motors, of the body [s]; error of the track
  } rows[] = {{0.15, 0.0, 0.06}, {0.03, 0.1, 0.3}};
  for (const auto& row : rows) {
    PlantModel model = driveTrain(), robot = driveTrain();
    model.lag = 0.03;
    robot.lag = row.lag;
    Loop loop(kTrack, {}, {}, model, robot);
    loop.creep = row.creep;
    loop.drive(0.5);
    for (int k = 0; k < 100; ++k) {
      loop.drive({0.0, 0.0, 0.35}, 0.02);
      EXPECT_NEAR(loop.controller.effectiveTrack(), kTrack, row.most * kTrack) << row.lag << ", " << 0.02 * k;
    }
  }
}

TEST(PredictiveController, SlopeWithoutAttitudeIsNoLateralAcceleration) {
  Loop loop(0.7);
  loop.sideways = 1.7;  // of 10 degrees
  loop.drive({0.5, 0.0, 0.6}, 10.0);
  EXPECT_NEAR(loop.controller.effectiveTrack(), 0.7, 0.05);
}

// ---- rest

TEST(PredictiveController, DisturbanceOfTheWheelsIsCompensatedAtRest) {
  for (const double push : {0.1, -0.3}) {
    Loop loop;
    loop.push = push;
    double tried = 0.0, travel = 0.0;  // rad
    int reversals = 0;
    bool stood = false;
    for (int k = 0; k < 3000; ++k) {
      loop.drive(0.02);
      if (k > 100) (k <= 1000 ? tried : travel) += 0.02 * loop.forward() / kRadius;
      const bool stands = loop.controller.action() == WheelCommand{};
      reversals += stands != stood;
      stood = stands;
    }
    EXPECT_NEAR(loop.controller.action().left, -push, 0.01);
    EXPECT_LT(std::abs(travel), 0.05) << "in 40 s";
    EXPECT_LT(std::abs(tried), 0.1) << "by which it rolls as the command is released";
    EXPECT_LE(reversals, 4) << "it holds or it stands";
  }
}

// ---- resets

TEST(PredictiveController, ResetMakesItAsNew) {
  Loop used(0.7), fresh;
  used.drive({0.5, 0.0, 0.5}, 2.0);
  used.controller.reset();
  Loop again;
  std::swap(again.controller, used.controller);
  for (Loop* loop : {&again, &fresh}) loop->drive({0.3, 0.0, -0.4}, 1.0);
  EXPECT_EQ(again.controller.action(), fresh.controller.action());
  EXPECT_EQ(again.controller.believedVelocity(), fresh.controller.believedVelocity());
  EXPECT_EQ(again.controller.motionCovariance(), fresh.controller.motionCovariance());
}

// ---- limits and other drivers

/// Another source drives a robot that had stood: handed back, it brakes as one that had been driving.
TEST(PredictiveController, RobotThatStoodIsHandedBackWithoutAJump) {
  const auto largestStepAfter = [](const SetPoint& before) {
    Loop loop;
    loop.drive(before, 5.0);
    loop.controller.setSetPoint({});
    loop.overrule({10.0, 10.0}, 2.0);
    double largest = 0.0, last = 10.0;
    for (int k = 0; k < 50; ++k) {
      const double action = loop.drive(0.02).controller.action().left;
      largest = std::max(largest, std::abs(action - last));
      last = action;
    }
    return largest;
  };
  EXPECT_NEAR(largestStepAfter({}), largestStepAfter({1.0, 0.0, 0.0}), 0.05);
}

TEST(PredictiveController, AdoptedGainsTakeOverWithoutAJump) {
  Loop changed(0.7), same(0.7);
  for (Loop* loop : {&changed, &same}) loop->drive(0.1).drive({0.5, 0.0, 0.5}, 2.0);
  PredictiveParameters slower, other;
  slower.reference_time = 0.3;
  slower.action_learning_rate = 0.5;
  other.belief_rate = 500.0;
  const WheelCommand before = changed.controller.action();
  changed.controller.adoptGains(slower);
  EXPECT_THROW(changed.controller.adoptGains(other), ParameterError) << "the caller's timers go on at the old rate";
  EXPECT_EQ(changed.controller.beliefStep(), 0.001);
  EXPECT_EQ(changed.controller.beliefStepsPerAction(), 20);
  EXPECT_EQ(changed.controller.effectiveTrack(), same.controller.effectiveTrack());
  EXPECT_NEAR(changed.controller.updateAction().left, before.left, 1e-3);
  for (Loop* loop : {&changed, &same}) loop->controller.setSetPoint({1.0, 0.0, 0.5});
  EXPECT_LT(changed.controller.updateAction().left, same.controller.updateAction().left - 0.5) << "it is slower";
}

}  // namespace
}  // namespace jackal_aic
