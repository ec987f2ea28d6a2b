#include "jackal_aic/aic/active_inference_controller.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <limits>

#include "jackal_aic/model/skid_steer_kinematics.hpp"

// Counts every allocation of the process: operator new and Eigen both end in malloc. The sanitizers bring their own
// malloc.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define JACKAL_AIC_COUNTS_ALLOCATIONS 0
#else
#define JACKAL_AIC_COUNTS_ALLOCATIONS 1
#endif

namespace {
std::atomic<std::size_t> allocations{0};
}

#if JACKAL_AIC_COUNTS_ALLOCATIONS
extern "C" void* __libc_malloc(std::size_t size);  // NOLINT(bugprone-reserved-identifier): glibc's name
extern "C" void* malloc(std::size_t size) noexcept {
  ++allocations;
  return __libc_malloc(size);
}
#endif

namespace jackal_aic {
namespace {

ControllerParameters improved() {
  ControllerParameters controller;
  controller.belief_rate = 1000;
  controller.tau = 0.001;
  controller.kappa_mu = 0.1;
  return controller;
}

Observation observation(double stamp, const WheelCommand& wheels, double yaw_rate) {
  return {stamp, yaw_rate, wheels.left, wheels.right, 0.0, 0.0};
}

/// Closes the loop over a robot that does at once what it is told, for a number of action periods.
WheelCommand drive(ActiveInferenceController& controller, const ControllerParameters& gains, const SetPoint& set_point,
                   int periods, double start = 1.0) {
  const SkidSteerKinematics kinematics{GeometryParameters{}};
  controller.setSetPoint(set_point);
  WheelCommand wheels = controller.action();
  for (int k = 0; k < periods; ++k) {
    controller.observe(observation(start + k * gains.actionStep(), wheels, kinematics.bodyVelocity(wheels)(kYaw)));
    for (int i = 0; i < gains.beliefStepsPerAction(); ++i) controller.updateBelief();
    wheels = controller.updateAction();
  }
  return wheels;
}

class Preset : public testing::TestWithParam<ControllerParameters> {};

TEST_P(Preset, DrivesAnIdealRobotToTheSetPoint) {
  ActiveInferenceController controller(GetParam(), {});
  const WheelCommand expected = SkidSteerKinematics{GeometryParameters{}}.wheelSpeeds(0.5, 0.4);
  const WheelCommand wheels = drive(controller, GetParam(), {0.5, 0.0, 0.4}, 400);
  EXPECT_NEAR(wheels.left, expected.left, 1e-6);
  EXPECT_NEAR(wheels.right, expected.right, 1e-6);
  EXPECT_NEAR(controller.belief()(kForward, 0), 0.5, 1e-6);
  EXPECT_NEAR(controller.belief()(kYaw, 0), 0.4, 1e-6);
  EXPECT_NEAR(controller.freeEnergy(), 0.0, 1e-9);
}

TEST_P(Preset, MirroredTurnsSwapTheWheels) {
  ActiveInferenceController left(GetParam(), {}), right(GetParam(), {});
  const WheelCommand a = drive(left, GetParam(), {0.3, 0.0, 0.7}, 20);
  const WheelCommand b = drive(right, GetParam(), {0.3, 0.0, -0.7}, 20);
  EXPECT_NEAR(a.left, b.right, 1e-12);
  EXPECT_NEAR(a.right, b.left, 1e-12);
  EXPECT_GT(a.right, a.left) << "a positive yaw rate needs the right wheel to be the faster one";
}

TEST_P(Preset, BackwardIsForwardMirrored) {
  ActiveInferenceController forward(GetParam(), {}), backward(GetParam(), {});
  const WheelCommand a = drive(forward, GetParam(), {0.5, 0.0, 0.2}, 20);
  const WheelCommand b = drive(backward, GetParam(), {-0.5, 0.0, -0.2}, 20);
  EXPECT_NEAR(a.left, -b.left, 1e-12);
  EXPECT_NEAR(a.right, -b.right, 1e-12);
}

TEST_P(Preset, RunsWithoutAllocating) {
  ActiveInferenceController controller(GetParam(), {});
  const std::size_t before = allocations;
  drive(controller, GetParam(), {0.5, 0.0, 0.4}, 10);
  const double energy = controller.freeEnergy();
  controller.hold({1.0, 1.0});
  controller.restart();
  controller.reset();
  const std::size_t after = allocations;
  EXPECT_EQ(after, before);
  EXPECT_GT(energy, 0.0);
#if JACKAL_AIC_COUNTS_ALLOCATIONS
  EXPECT_GT(before, 0u) << "the counter itself does not work";
#endif
}

ControllerParameters eulerAt(int orders) {
  ControllerParameters controller;
  controller.integrator = Integrator::euler;
  controller.orders = orders;
  controller.state_variances.resize(orders + 1, 16.0);
  controller.sensory_variances.resize(orders + 1, 1e5);
  return controller;
}

INSTANTIATE_TEST_SUITE_P(Gains, Preset,
                         testing::Values(ControllerParameters{}, improved(), eulerAt(3), eulerAt(0), eulerAt(5)));

TEST(ActiveInferenceController, DoesNothingBeforeTheFirstMeasurement) {
  ActiveInferenceController controller({}, {});
  controller.setSetPoint({1.0, 0.0, 0.0});
  for (int i = 0; i < 100; ++i) controller.updateBelief();
  EXPECT_EQ(controller.belief().norm(), 0.0);
  EXPECT_EQ(controller.updateAction(), WheelCommand{});
}

TEST(ActiveInferenceController, SeedsTheBeliefWithTheFirstMeasurement) {
  ActiveInferenceController controller({}, {});
  const WheelCommand wheels = SkidSteerKinematics{GeometryParameters{}}.wheelSpeeds(0.8, -0.6);
  controller.observe(observation(3.0, wheels, -0.6));
  EXPECT_NEAR(controller.belief()(kForward, 0), 0.8, 1e-12);
  EXPECT_NEAR(controller.belief()(kYaw, 0), -0.6, 1e-12);
  EXPECT_EQ(controller.belief().rightCols(3).norm(), 0.0);
}

TEST(ActiveInferenceController, RefusesWhatIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ActiveInferenceController controller({}, {});
  drive(controller, {}, {0.5, 0.0, 0.0}, 5);
  const GeneralizedBody belief = controller.belief();
  EXPECT_FALSE(controller.setSetPoint({nan, 0.0, 0.0}));
  EXPECT_FALSE(controller.setSetPoint({0.0, 0.0, std::numeric_limits<double>::infinity()}));
  EXPECT_EQ(controller.observe({1.1, nan, 0, 0, 0, 0}), SampleVerdict::not_finite);
  EXPECT_EQ(controller.belief(), belief);
  const WheelCommand wheels = drive(controller, {}, {0.5, 0.0, 0.0}, 400, 1.2);
  EXPECT_NEAR(wheels.left, 0.5 / 0.098, 1e-6);
}

TEST(ActiveInferenceController, HeldActionDoesNotWindUp) {
  // A robot stuck at a limit of 2 rad/s: the action may exceed it by one step only, and comes back within one step.
  ActiveInferenceController controller({}, {});
  controller.setSetPoint({1.0, 0.0, 0.0});
  const WheelCommand limit{2.0, 2.0};
  double largest = 0.0;
  for (int k = 0; k < 500; ++k) {
    controller.observe(observation(1.0 + 0.02 * k, limit, 0.0));
    controller.updateBelief();
    largest = std::max(largest, controller.updateAction().left);
    if (controller.action().left > limit.left) controller.hold(limit);
  }
  EXPECT_LE(largest, 2.0 + 0.02 * 8 * 0.5 * (1.0 / 0.098));
  EXPECT_EQ(controller.action(), limit);
}

TEST(ActiveInferenceController, AGapInTheMeasurementsLeavesTheActionAsItWas) {
  ActiveInferenceController controller({}, {});
  controller.observe(observation(1.0, {5.0, 5.0}, 0.0));
  controller.hold({5.0, 6.0});
  ASSERT_EQ(controller.observe(observation(1.5, {4.0, 4.0}, 0.0)), SampleVerdict::restarted);
  EXPECT_EQ(controller.action(), (WheelCommand{5.0, 6.0}));
  EXPECT_NEAR(controller.belief()(kForward, 0), 4.0 * 0.098, 1e-9);
}

TEST(ActiveInferenceController, RestartKeepsTheMotionAndDropsTheAction) {
  ActiveInferenceController controller({}, {});
  drive(controller, {}, {0.5, 0.0, 0.0}, 100);
  controller.restart();
  EXPECT_EQ(controller.action(), WheelCommand{});
  EXPECT_NEAR(controller.belief()(kForward, 0), controller.measurement()(kWheelLeft, 0) * 0.098, 1e-9);
  EXPECT_EQ(controller.belief().rightCols(3).norm(), 0.0);
}

TEST(ActiveInferenceController, ResetMakesItAsNew) {
  ActiveInferenceController used({}, {}), fresh({}, {});
  drive(used, {}, {0.5, 0.0, 0.3}, 50);
  used.reset();
  const WheelCommand a = drive(used, {}, {0.2, 0.0, -0.1}, 30);
  const WheelCommand b = drive(fresh, {}, {0.2, 0.0, -0.1}, 30);
  EXPECT_EQ(a, b);
  EXPECT_EQ(used.belief(), fresh.belief());
}

TEST(ActiveInferenceController, OtherGainsGoOnWithBeliefActionAndMeasurements) {
  ActiveInferenceController changed(improved(), {}), fresh(improved(), {});
  drive(changed, improved(), {0.5, 0.0, 0.3}, 7);
  const WheelCommand action = changed.action();
  const GeneralizedBody belief = changed.belief();
  const GeneralizedSensor measurement = changed.measurement();
  ControllerParameters slower = improved();
  slower.kappa_a *= 0.5;
  slower.tau = 0.01;
  changed.adoptGains(slower, {});
  EXPECT_EQ(changed.action(), action);
  EXPECT_EQ(changed.belief(), belief);
  EXPECT_EQ(changed.measurement(), measurement);

  const double error = changed.errors().sensory(kWheelLeft, 0), gyro_error = changed.errors().sensory(kYawRate, 0);
  const double gradient = (error - 0.098 / 0.5621 * gyro_error) / slower.sensory_variances[0];
  EXPECT_NEAR(changed.updateAction().left - action.left, -0.02 * slower.kappa_a * gradient, 1e-12);
}

TEST(ActiveInferenceController, EveryBeliefUpdateHasTheLatestInputs) {
  // What measurement and set point add to the belief is kept between its updates.
  ActiveInferenceController controller(improved(), {});
  ControllerParameters gains = improved();
  SetPoint set_point;
  double stamp = 1.0;
  const auto expectUpdate = [&](const char* after) {
    const BeliefUpdate update(GenerativeModel(gains, {}), gains.kappa_mu, gains.beliefStep(), gains.integrator);
    GeneralizedBody expected = controller.belief(), mu_d = GeneralizedBody::Zero(kBodySize, gains.orders + 1);
    mu_d.col(0) = set_point.vector();
    update.step(expected, controller.measurement(), mu_d);
    controller.updateBelief();
    EXPECT_EQ(controller.belief(), expected) << after;
  };
  const auto observe = [&](double speed) { controller.observe(observation(stamp += 0.02, {speed, speed + 0.3}, 0.1)); };
  controller.setSetPoint(set_point = {0.5, 0.1, 0.2});
  observe(1.0);
  expectUpdate("the first measurement");
  observe(2.0);
  expectUpdate("another measurement");
  controller.setSetPoint(set_point = {-0.5, 0.0, 0.7});
  expectUpdate("another set point");
  gains.tau = 0.01;
  controller.adoptGains(gains, {});
  expectUpdate("other gains");
  controller.overrule({1.0, 1.0});
  expectUpdate("another command");
  controller.restart();
  expectUpdate("a restart");
  stamp += 1.0;
  observe(3.0);
  expectUpdate("a gap");
  controller.reset();
  set_point = {};
  observe(1.0);
  expectUpdate("a reset");
}

TEST(ActiveInferenceController, OtherGainsKeepThePlantModel) {
  PlantModel plant;
  plant.dead_time = 0.07;
  ActiveInferenceController controller(improved(), {}, plant);
  controller.adoptGains(improved(), {});
  ASSERT_TRUE(controller.plantModel());
  EXPECT_EQ(controller.plantModel()->dead_time, 0.07);
}

TEST(ActiveInferenceController, PrintedIsWithoutActionBoundAndStandstill) {
  // A robot that does not move: bounded, the action waits for the motors; printed, it winds up.
  ControllerParameters printed = improved();
  printed.printed = true;
  const auto actionOf = [](const ControllerParameters& gains, const std::optional<PlantModel>& plant) {
    ActiveInferenceController controller(gains, {}, plant);
    controller.setSetPoint({1.0, 0.0, 0.0});
    for (int k = 0; k < 100; ++k) {
      controller.observe(observation(1.0 + 0.02 * k, {}, 0.0));
      for (int i = 0; i < gains.beliefStepsPerAction(); ++i) controller.updateBelief();
      controller.updateAction();
    }
    return controller.action();
  };
  EXPECT_EQ(actionOf(printed, PlantModel{}), actionOf(improved(), {}));
  EXPECT_GT(actionOf(printed, PlantModel{}).left, 2.0 * actionOf(improved(), PlantModel{}).left);
}

TEST(ActiveInferenceController, RefusedGainsChangeNothing) {
  ActiveInferenceController controller(improved(), {});
  ControllerParameters diverging = improved(), fewer = improved(), slower = improved(), printed = improved();
  printed.printed = true;
  diverging.integrator = Integrator::euler;
  fewer.orders = 2;
  slower.belief_rate = 500;
  drive(controller, improved(), {0.5, 0.0, 0.0}, 7);
  const GeneralizedBody belief = controller.belief();
  EXPECT_THROW(controller.adoptGains(diverging, {}), ParameterError);
  EXPECT_THROW(controller.adoptGains(fewer, {}), ParameterError);
  EXPECT_THROW(controller.adoptGains(slower, {}), ParameterError) << "whoever calls it keeps the time";
  EXPECT_THROW(controller.adoptGains(printed, {}), ParameterError) << "the bound does not know what was driven";
  EXPECT_EQ(controller.belief(), belief);
}

TEST(ActiveInferenceController, RefusesInvalidGains) {
  ControllerParameters diverging = improved();
  diverging.integrator = Integrator::euler;
  EXPECT_THROW(ActiveInferenceController(diverging, {}), ParameterError);
}

/// Somebody else drives a robot that had stood: handed back, it brakes as one that had been driving.
TEST(ActiveInferenceController, ARobotThatStoodIsHandedBackWithoutAJump) {
  const auto commandAfter = [](const SetPoint& before) {
    ControllerParameters gains = improved();
    ActiveInferenceController controller(gains, {}, PlantModel{});
    drive(controller, gains, before, 300);
    controller.setSetPoint({});
    for (int k = 0; k < 100; ++k) {
      controller.observe(observation(20.0 + 0.02 * k, {10.0, 10.0}, 0.0));
      for (int i = 0; i < gains.beliefStepsPerAction(); ++i) controller.updateBelief();
      controller.overrule({10.0, 10.0});
    }
    controller.observe(observation(22.0, {10.0, 10.0}, 0.0));
    return controller.updateAction().left;
  };
  EXPECT_GT(commandAfter({}), 5.0);
  EXPECT_NEAR(commandAfter({}), commandAfter({0.5, 0.0, 0.0}), 0.05);
}

}  // namespace
}  // namespace jackal_aic
