#include "jackal_aic/aic/active_inference_controller.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "jackal_aic/aic/action_bound.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

const double kNaN = std::numeric_limits<double>::quiet_NaN();

ControllerParameters improved() {
  ControllerParameters controller;
  controller.belief_rate = 1000;
  controller.tau = 0.001;
  controller.kappa_mu = 0.1;
  return controller;
}

Observation observation(double stamp, const WheelCommand& wheels, double yaw_rate = 0.0) {
  return {stamp, yaw_rate, wheels.left, wheels.right, 0.0, 0.0};
}

void updateBeliefs(ActiveInferenceController& controller, const ControllerParameters& gains) {
  for (int i = 0; i < gains.beliefStepsPerAction(); ++i) controller.updateBelief();
}

/// Closes the loop over an ideal robot, whose wheels have the commanded speed, for a number of action periods.
WheelCommand drive(ActiveInferenceController& controller, const ControllerParameters& gains, const SetPoint& set_point,
                   int periods, double start = 1.0) {
  const SkidSteerKinematics kinematics{GeometryParameters{}};
  controller.setSetPoint(set_point);
  WheelCommand wheels = controller.action();
  for (int k = 0; k < periods; ++k) {
    controller.observe(observation(start + k * gains.actionStep(), wheels, kinematics.bodyVelocity(wheels)(kYaw)));
    updateBeliefs(controller, gains);
    wheels = controller.updateAction();
  }
  return wheels;
}

ControllerParameters eulerAt(int orders) {
  ControllerParameters controller;
  controller.integrator = Integrator::euler;
  controller.orders = orders;
  controller.state_variances.resize(orders + 1, 16.0);
  controller.sensory_variances.resize(orders + 1, 1e5);
  return controller;
}

TEST(ActiveInferenceController, DrivesAnIdealRobotToTheSetPoint) {
  const WheelCommand expected = SkidSteerKinematics{GeometryParameters{}}.wheelSpeeds(0.5, 0.4);
  for (const ControllerParameters& gains : {ControllerParameters{}, improved(), eulerAt(3), eulerAt(0), eulerAt(5)}) {
    SCOPED_TRACE(testing::Message() << gains.orders << " orders, tau " << gains.tau);
    ActiveInferenceController controller(gains, {});
    EXPECT_TRUE(drive(controller, gains, {0.5, 0.0, 0.4}, 400).vector().isApprox(expected.vector(), 1e-7));
    EXPECT_NEAR(controller.belief()(kForward, 0), 0.5, 1e-6);
    EXPECT_NEAR(controller.belief()(kYaw, 0), 0.4, 1e-6);
    EXPECT_NEAR(controller.freeEnergy(), 0.0, 1e-9);
  }
}

TEST(ActiveInferenceController, StartsWithTheFirstMeasurement) {
  ActiveInferenceController controller({}, {});
  controller.setSetPoint({1.0, 0.0, 0.0});
  for (int i = 0; i < 100; ++i) controller.updateBelief();
  EXPECT_EQ(controller.belief().norm(), 0.0);
  EXPECT_EQ(controller.updateAction(), WheelCommand{});
  const WheelCommand wheels = SkidSteerKinematics{GeometryParameters{}}.wheelSpeeds(0.8, -0.6);
  controller.observe(observation(3.0, wheels, -0.6));
  EXPECT_NEAR(controller.belief()(kForward, 0), 0.8, 1e-12);
  EXPECT_NEAR(controller.belief()(kYaw, 0), -0.6, 1e-12);
  EXPECT_EQ(controller.belief().rightCols(3).norm(), 0.0);
}

TEST(ActiveInferenceController, RefusesNumbersThatAreNotFinite) {
  ActiveInferenceController controller({}, {});
  drive(controller, {}, {0.5, 0.0, 0.0}, 5);
  const GeneralizedBody belief = controller.belief();
  EXPECT_FALSE(controller.setSetPoint({kNaN, 0.0, 0.0}));
  EXPECT_FALSE(controller.setSetPoint({0.0, 0.0, std::numeric_limits<double>::infinity()}));
  EXPECT_EQ(controller.observe({1.1, kNaN, 0, 0, 0, 0}), SampleVerdict::not_finite);
  EXPECT_EQ(controller.belief(), belief);
  EXPECT_NEAR(drive(controller, {}, {0.5, 0.0, 0.0}, 400, 1.2).left, 0.5 / 0.098, 1e-6);
}

TEST(ActiveInferenceController, GapKeepsTheActionAndRestartDropsIt) {
  ActiveInferenceController controller({}, {});
  controller.observe(observation(1.0, {5.0, 5.0}));
  controller.hold({5.0, 6.0});
  ASSERT_EQ(controller.observe(observation(1.5, {4.0, 4.0})), SampleVerdict::restarted);
  EXPECT_EQ(controller.action(), (WheelCommand{5.0, 6.0}));
  EXPECT_NEAR(controller.belief()(kForward, 0), 4.0 * 0.098, 1e-9);
  ActiveInferenceController straight({}, {});
  drive(straight, {}, {0.5, 0.0, 0.0}, 100);
  straight.restart();
  EXPECT_EQ(straight.action(), WheelCommand{});
  EXPECT_NEAR(straight.belief()(kForward, 0), straight.measurement()(kWheelLeft, 0) * 0.098, 1e-9);
  EXPECT_EQ(straight.belief().rightCols(3).norm(), 0.0);
}

TEST(ActiveInferenceController, ResetMakesItAsNew) {
  ActiveInferenceController used({}, {}), fresh({}, {});
  drive(used, {}, {0.5, 0.0, 0.3}, 50);
  used.reset();
  EXPECT_EQ(drive(used, {}, {0.2, 0.0, -0.1}, 30), drive(fresh, {}, {0.2, 0.0, -0.1}, 30));
  EXPECT_EQ(used.belief(), fresh.belief());
}

TEST(ActiveInferenceController, AdoptedGainsKeepBeliefActionAndMeasurements) {
  ActiveInferenceController changed(improved(), {}, PlantModel{}), unbound(improved(), {});
  drive(changed, improved(), {0.5, 0.0, 0.3}, 7);
  drive(unbound, improved(), {0.5, 0.0, 0.3}, 7);
  const WheelCommand action = changed.action();
  const GeneralizedBody belief = changed.belief();
  const GeneralizedSensor measurement = changed.measurement();
  ControllerParameters slower = improved();
  slower.kappa_a *= 0.5;
  slower.tau = 0.01;
  changed.adoptGains(slower, {});
  unbound.adoptGains(slower, {});
  EXPECT_EQ(changed.action(), action);
  EXPECT_EQ(changed.belief(), belief);
  EXPECT_EQ(changed.measurement(), measurement);
  const double before = unbound.action().left;
  const double error = unbound.errors().sensory(kWheelLeft, 0), gyro_error = unbound.errors().sensory(kYawRate, 0);
  const double gradient = (error - 0.098 / 0.5621 * gyro_error) / slower.sensory_variances[0];
  EXPECT_NEAR(unbound.updateAction().left - before, -0.02 * slower.kappa_a * gradient, 1e-12);
  // The bound by the plant's dead time stays: the action does not wind up while the wheels stand.
  for (int k = 0; k < 100; ++k) {
    changed.updateAction();
    unbound.updateAction();
  }
  EXPECT_LT(std::abs(changed.action().left), 0.5 * std::abs(unbound.action().left));
}

/// The part of measurement and set point in the belief is kept between its updates.
TEST(ActiveInferenceController, EveryBeliefUpdateHasTheLatestInputs) {
  ActiveInferenceController controller(improved(), {});
  ControllerParameters gains = improved();
  SetPoint set_point;
  double stamp = 1.0;
  const auto observe = [&](double speed) { controller.observe(observation(stamp += 0.02, {speed, speed + 0.3}, 0.1)); };
  const auto expectLatestAfter = [&](const char* change) {
    const BeliefUpdate update(GenerativeModel(gains, {}), gains.kappa_mu, gains.beliefStep(), gains.integrator);
    GeneralizedBody expected = controller.belief(), mu_d = GeneralizedBody::Zero(kBodySize, gains.orders + 1);
    mu_d.col(0) = set_point.vector();
    update.step(expected, controller.measurement(), mu_d);
    controller.updateBelief();
    EXPECT_EQ(controller.belief(), expected) << change;
  };
  controller.setSetPoint(set_point = {0.5, 0.1, 0.2});
  observe(1.0);
  expectLatestAfter("the first measurement");
  observe(2.0);
  expectLatestAfter("another measurement");
  controller.setSetPoint(set_point = {-0.5, 0.0, 0.7});
  expectLatestAfter("another set point");
  gains.tau = 0.01;
  controller.adoptGains(gains, {});
  expectLatestAfter("other gains");
  controller.reset();
  set_point = {};
  observe(1.0);
  expectLatestAfter("a reset");
}

TEST(ActiveInferenceController, PrintedIsWithoutActionBoundAndStandstill) {
  // A robot that does not move: bounded, the action waits for the motors; printed, it winds up.
  ControllerParameters printed = improved();
  printed.printed = true;
  const auto actionOf = [](const ControllerParameters& gains, const std::optional<PlantModel>& plant) {
    ActiveInferenceController controller(gains, {}, plant);
    controller.setSetPoint({1.0, 0.0, 0.0});
    for (int k = 0; k < 100; ++k) {
      controller.observe(observation(1.0 + 0.02 * k, {}));
      updateBeliefs(controller, gains);
      controller.updateAction();
    }
    return controller.action();
  };
  EXPECT_EQ(actionOf(printed, PlantModel{}), actionOf(improved(), {}));
  EXPECT_GT(actionOf(printed, PlantModel{}).left, 2.0 * actionOf(improved(), PlantModel{}).left);
}

TEST(ActiveInferenceController, RefusedGainsChangeNothing) {
  ActiveInferenceController controller(improved(), {});
  drive(controller, improved(), {0.5, 0.0, 0.0}, 7);
  const GeneralizedBody belief = controller.belief();
  ControllerParameters diverging = improved(), fewer = improved(), slower = improved(), printed = improved();
  diverging.integrator = Integrator::euler;
  fewer.orders = 2;
  slower.belief_rate = 500;  // the caller keeps the time
  printed.printed = true;    // the bound does not know the commands so far
  for (const ControllerParameters& gains : {diverging, fewer, slower, printed}) {
    EXPECT_THROW(controller.adoptGains(gains, {}), ParameterError);
    EXPECT_EQ(controller.belief(), belief);
  }
  EXPECT_THROW(ActiveInferenceController(diverging, {}), ParameterError);
}

/// Another source drives a robot that had stood: handed back, it brakes as one that had been driving.
TEST(ActiveInferenceController, RobotThatStoodIsHandedBackWithoutAJump) {
  const auto commandAfter = [](const SetPoint& before) {
    const ControllerParameters gains = improved();
    ActiveInferenceController controller(gains, {}, PlantModel{});
    drive(controller, gains, before, 300);
    controller.setSetPoint({});
    for (int k = 0; k < 100; ++k) {
      controller.observe(observation(20.0 + 0.02 * k, {10.0, 10.0}));
      updateBeliefs(controller, gains);
      controller.overrule({10.0, 10.0});
    }
    controller.observe(observation(22.0, {10.0, 10.0}));
    return controller.updateAction().left;
  };
  EXPECT_GT(commandAfter({}), 5.0);
  EXPECT_NEAR(commandAfter({}), commandAfter({0.5, 0.0, 0.0}), 0.05);
}

constexpr double kPeriod = 0.02;  // s
constexpr double kRadius = 0.098;
constexpr double kLimit = 1.65 / kRadius;  // rad/s^2
constexpr double kRamp = kLimit * kPeriod;

PlantModel ground() {
  PlantModel model;
  model.dead_time = 0.08;
  model.lag = 0.00636;
  model.acceleration_limit = 1.65;
  return model;
}

ActionBound bound() { return {ground(), {}, kPeriod}; }

Observation measured(double stamp, double left, double right) { return {stamp, 0.0, left, right, 0.0, 0.0}; }

TEST(ActionBound, RampsWithTheMotorsOnTheCurvature) {
  ActionBound bound = ::jackal_aic::bound();
  WheelVector action = WheelVector::Zero();
  for (int k = 1; k <= 50; ++k) {
    action = bound.bound(action, action + WheelVector(2.0, 4.0), {10.0, 20.0});
    bound.apply(action);
    EXPECT_NEAR(action(0), 0.5 * action(1), 1e-9);
    EXPECT_NEAR(action(1), (k + 1) * kRamp, 1e-9) << "a period ahead of the motor";
  }
}

TEST(ActionBound, ActionStaysAtTheGoalWhileAWheelRamps) {
  ActionBound bound = ::jackal_aic::bound();
  WheelVector action = WheelVector::Zero();
  double speed = 0.0;
  for (int k = 0; k < 60; ++k) {
    action = bound.bound(action, action + WheelVector(2.0, 2.0), {5.0, 5.0});
    bound.apply(action);
    if (k >= 4) speed = std::min(5.0, speed + 0.9 * kRamp);
    bound.observe(measured(k * kPeriod, speed, speed), {});
    if (speed < 4.5) {
      EXPECT_LE(action(0), 5.0) << k;
    }
  }
  EXPECT_GT(action(0), 5.0) << "a wheel that rests is no ramp";
}

/// An arc: the left wheel follows, the right one has half the model's acceleration.
TEST(ActionBound, WheelsRampTogether) {
  ActionBound bound = ::jackal_aic::bound();
  const WheelVector goal(5.0, 10.0);
  WheelVector action = WheelVector::Zero();
  for (int k = 0; k < 40; ++k) {
    // Behind by more, the right wheel is pressed more.
    action = bound.bound(action, action + WheelVector(0.1, 1.0), goal);
    bound.apply(action);
    const double right = 0.5 * kRamp * k;
    bound.observe(measured(k * kPeriod, std::min(action(0), right), right), {});
    if (k > 10 && right < goal(1)) {
      EXPECT_LE(action(1) / goal(1), action(0) / goal(0) + 0.2) << k;
    }
  }
}

TEST(ActionBound, StopEndsAtZeroWhileTheWheelMoves) {
  PlantModel quick = ground();
  quick.acceleration_limit = 100.0;
  ActionBound bound(quick, {}, kPeriod);
  WheelVector action(10.0, 10.0);
  bound.observe(measured(0.0, 10.0, 10.0), {});
  bound.apply(action);
  bound.bound(action, action, {10.0, 10.0});
  int periods = 0;
  for (; action(0) > 0.0 && periods < 100; ++periods) {
    const WheelVector next = bound.bound(action, action - WheelVector(3.0, 3.0), WheelVector::Zero());
    EXPECT_GE(next(0), 0.0) << "reverses while the wheel moves";
    action = next;
    bound.apply(action);
  }
  EXPECT_NEAR(periods * kPeriod, thresholds::kPatience, 1e-9);
  bound.observe(measured(1.0, 0.1, 0.1), {});
  EXPECT_LT(bound.bound(action, {-0.1, -0.1}, WheelVector::Zero())(0), 0.0) << "at rest it holds the robot";
}

}  // namespace
}  // namespace jackal_aic
