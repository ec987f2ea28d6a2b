#include "jackal_aic/predictive/wheel_controller.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/robot_range.hpp"
#include "jackal_aic/model/wheel_belief.hpp"
#include "jackal_aic/predictive/drive_train_reference.hpp"

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098, kGain = 0.9;

PlantModel driveTrain(double offset = 0.0) { return {0.08, 0.04, kGain, offset, 0.0, 20.0}; }

/// A wheel that its model describes but for a disturbance of the input [rad/s], under its controller.
struct Loop {
  explicit Loop(double input_disturbance, const PlantModel& model = driveTrain())
      : disturbance(input_disturbance / model.gain),
        wheel(PredictiveParameters{}, model, kRadius),
        robot(model, kRadius, {}) {}

  void drive(double wanted, int periods) {
    for (int k = 0; k < periods; ++k) {
      for (int i = 0; i < 20; ++i) {
        robot.predict(wheel.action() + disturbance);
        wheel.predict();
      }
      wheel.correct(robot.speed());
      wheel.act(wheel.input(wanted));
    }
  }

  double disturbance;  // of its command
  WheelController wheel;
  WheelBelief robot;
};

TEST(WheelController, CancelsTheDisturbanceThatItBelieves) {
  for (const double disturbance : {0.0, 0.7, -0.4}) {
    Loop loop(disturbance);
    loop.drive(5.0, 100);
    EXPECT_NEAR(loop.robot.speed(), 5.0, 0.005) << disturbance;
    EXPECT_NEAR(loop.wheel.belief().disturbance(), disturbance, 0.02) << disturbance;
    EXPECT_NEAR(loop.wheel.action(), (5.0 - disturbance) / 0.9, 0.02) << disturbance;
  }
}

TEST(WheelController, CompensatesNoMoreThanTheRange) {
  // A wheel that does not follow is not thrown forward when it does again.
  WheelController wheel(PredictiveParameters{}, driveTrain(), kRadius);
  for (int k = 0; k < 500; ++k) {
    for (int i = 0; i < 20; ++i) wheel.predict();
    wheel.correct(0.0);
    const double input = wheel.input(5.0), before = wheel.action();
    wheel.act(input);
    EXPECT_LE(wheel.action(), std::max(before, (kGainRange * input + kSpeedRange) / kGain) + 1e-6);
  }
  EXPECT_LT(wheel.belief().disturbance(), -7.0);
}

TEST(WheelController, CompensatesTheOffsetOfItsModel) {
  Loop with(0.0, driveTrain(0.5)), without(0.0);
  for (const double wanted : {0.2, 5.0, -3.0}) {
    for (int k = 0; k < 100; ++k) {
      for (Loop* loop : {&with, &without}) loop->drive(wanted, 1);
      ASSERT_NEAR(with.wheel.effectiveAction(), without.wheel.action(), 1e-9) << "to " << wanted << ", period " << k;
      ASSERT_NEAR(with.robot.speed(), without.robot.speed(), 1e-9) << "to " << wanted << ", period " << k;
    }
    EXPECT_NEAR(with.wheel.action(), (wanted + std::copysign(0.5, wanted)) / 0.9, 0.01) << wanted;
  }
}

TEST(WheelController, ThePathEndsWhereTheHeldCommandTakesIt) {
  WheelController free(PredictiveParameters{}, driveTrain(), kRadius), held(free), stopped(free);
  for (WheelController* wheel : {&free, &held, &stopped}) wheel->act(wheel->input(3.0));
  held.hold(0.5 * held.action());
  EXPECT_NEAR(held.path().speed(), 0.5 * free.path().speed(), 1e-9) << "from rest the drive train is linear";
  stopped.hold(0.0);
  EXPECT_NEAR(stopped.path().speed(), 0.0, 1e-12);
  EXPECT_EQ(stopped.action(), 0.0);
}

TEST(WheelController, RestReleasesTheActionAndKeepsTheBelief) {
  Loop loop(0.3);
  loop.drive(5.0, 50);
  const double before = loop.wheel.action();
  loop.wheel.rest(2.0 * std::abs(before));
  EXPECT_EQ(loop.wheel.action(), before);
  loop.wheel.rest(0.5);
  EXPECT_EQ(loop.wheel.action(), 0.5) << "it is released slowly";
  loop.wheel.rest(0.0);
  EXPECT_EQ(loop.wheel.action(), 0.0);
  EXPECT_EQ(loop.wheel.path().speed(), 0.0);
  EXPECT_NE(loop.wheel.belief().disturbance(), 0.0) << "the belief stays";
}

/// Without a dead time. @param integral of the velocity loop [1/s].
PlantModel driveTrain(double lag, double integral, double acceleration_limit) {
  return {0.0, lag, 1.0, 0.0, integral, acceleration_limit};
}

/// Takes the input towards a wheel speed.
double advance(DriveTrainReference& path, double wanted) {
  const double input = path.input(wanted);
  path.follow(input);
  return input;
}

TEST(DriveTrainReference, InputMakesTheModelFollowThePath) {
  const PlantModel model = driveTrain(0.04, 6.0, 20.0);
  DriveTrainReference reference(model, kRadius, 0.05, 0.02);
  WheelBelief wheel(model, kRadius, {});
  double path = 0.0;
  for (int k = 0; k < 100; ++k) {
    const double r = advance(reference, 5.0);
    path += -std::expm1(-0.02 / 0.05) * (5.0 - path);
    for (int i = 0; i < 20; ++i) wheel.predict(r);
    EXPECT_NEAR(wheel.speed(), path, 0.01) << "period " << k;
  }
}

TEST(DriveTrainReference, InputOfLimitedChangeEndsInTime) {
  const PlantModel model = driveTrain(0.0455, 8.0, 100.0);
  for (const double largest_change : {1.4, 3.0}) {
    for (const bool in_time : {false, true}) {
      DriveTrainReference path(model, kRadius, 0.01, 0.02);
      double before = 0.0, fastest = 0.0;
      int settled = 0;
      for (int k = 0; k < 60; ++k) {
        const double wanted = path.input(6.0);
        const double r = in_time ? path.inTime(6.0, wanted, largest_change) : wanted;
        before += std::clamp(r - before, -largest_change, largest_change);
        path.follow(before);
        fastest = std::max(fastest, path.speed());
        if (std::abs(path.speed() - 6.0) > 0.3) settled = k + 1;
      }
      EXPECT_EQ(fastest > 6.1, !in_time) << largest_change << ", " << fastest;
      if (in_time) {
        EXPECT_LT(0.02 * settled, 0.02 * 6.0 / largest_change + 0.15) << largest_change;
      }
    }
  }
}

TEST(DriveTrainReference, NearlyEqualWheelsStayTogetherAtTheLimit) {
  DriveTrainReference left(driveTrain(0.04, 8.0, 20.0), kRadius, 0.01, 0.02), right(left);
  right.reset(1e-3);
  for (int k = 0; k < 5; ++k) {
    // A gate lets through all but a hair of what one wheel asks for at the limit.
    advance(left, 20.0);
    advance(right, 20.0);
    left.amend(1e-6);
    right.amend(-1e-6);
  }
  EXPECT_NEAR(advance(left, 20.0), advance(right, 20.0), 0.05);
}

}  // namespace
}  // namespace jackal_aic
