// The controller's process is held up while the robot drives, and the motors stop by themselves for want of commands.
// What the node does about it (ControllerNode::seedBelief) keeps the robot from taking that for a disturbance.

#include <gtest/gtest.h>

#include <algorithm>

#include "jackal_aic/command_limiter.hpp"
#include "jackal_aic/gate_parameters.hpp"
#include "predictive_loop.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kStall = 2.0;         // s, beginning
constexpr double kStallEnd = 2.3;      // s
constexpr double kMotorTimeout = 0.1;  // s without a command
constexpr double kSeededUntil = 2.6;   // s
constexpr double kEnd = 4.0;           // s
constexpr double kSpeed = 1.0;         // m/s

/// Largest true speed from the stall on, of a robot that is to drive at kSpeed.
double fastest(bool seeded) {
  const PlantParameters robot = PredictiveLoop::ground();
  const GeometryParameters geometry;
  JackalPlant plant(textOf("sim/urdf/jackal.urdf"), robot);
  PredictiveController controller(PredictiveLoop::preset(), geometry, linearModel(robot));
  CommandLimiter limiter(LimitParameters{}, geometry, controller.actionStep());
  controller.setSetPoint({kSpeed, 0.0, 0.0});
  double largest = 0.0;
  for (long tick = 0; plant.time() < kEnd; ++tick) {
    const double now = plant.time();
    const bool stalled = now >= kStall && now < kStallEnd;
    if (plant.measurement() && !stalled) {
      controller.observe(plant.measurement()->observation());
      if (seeded && now >= kStallEnd && now < kSeededUntil) {
        controller.restart();
        controller.overrule(limiter.command());
      }
    }
    if (!stalled) controller.updateBelief();
    if (tick % 20 == 0 && !stalled) {
      controller.hold(limiter.drive(controller.updateAction()));
      plant.command(limiter.command());
    } else if (stalled && now >= kStall + kMotorTimeout) {
      plant.command({});
    }
    plant.step();
    if (now > kStall) largest = std::max(largest, plant.truth().linear_velocity.x());
  }
  EXPECT_NEAR(plant.truth().linear_velocity.x(), kSpeed, 0.02) << "did not get going again";
  return largest;
}

TEST(Stall, TheMotorsOwnStopIsNoDisturbance) {
  EXPECT_LT(fastest(true), kSpeed + 0.02);
  EXPECT_GT(fastest(false), kSpeed + 0.05) << "no stall that it takes a seed for: this test shows nothing";
}

}  // namespace
}  // namespace jackal_aic::sim
