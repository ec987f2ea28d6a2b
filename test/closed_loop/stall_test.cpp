// A process that is held up, a clock that runs back and commands that reach no motor, in the closed loop.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>

#include "jackal_aic/safety/drive_loop.hpp"
#include "jackal_plant.hpp"
#include "loop_setup.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kStall = 2.0;  // s, beginning
constexpr double kEnd = 4.0;    // s
constexpr double kSpeed = 1.0;  // m/s

const LoopSetup& setup() {
  static const LoopSetup setup = loadSetup("predictive", "ground", {});
  return setup;
}

JackalPlant newPlant() { return {setup().urdf, setup().plant}; }

/// With the deadlines and limits of the node, which the setup of experiments has not.
DriveParameters parameters() {
  DriveParameters parameters;
  parameters.controller = setup().drive.controller;
  parameters.plant_model = setup().drive.plant_model;
  parameters.plant_model->identified = true;
  return parameters;
}

/// A millisecond of the process: a set point from 0.3 s on, the measurement if there is one, and the command.
void serve(
    DriveLoop& loop, JackalPlant& plant, const SetPoint& set_point,
    const std::function<void(Observation&)>& sensed = [](Observation&) {}) {
  const double now = plant.time();
  loop.setSetPoint(now < 0.3 ? SetPoint{} : set_point, now);
  if (plant.measurement()) {
    Observation y = plant.measurement()->observation();
    sensed(y);
    loop.observe(y, now);
  }
  if (const auto command = loop.advance(now)) plant.command(*command);
}

/// Largest true speed from the stall on, of a robot that is to drive at kSpeed. @param process a millisecond of it.
double fastest(const std::function<void(JackalPlant& plant, long tick)>& process) {
  constexpr double kStallEnd = 2.3, kMotorTimeout = 0.1;  // s
  JackalPlant plant = newPlant();
  double largest = 0.0;
  for (long tick = 0; plant.time() < kEnd; ++tick) {
    const double now = plant.time();
    if (now < kStall || now >= kStallEnd) {
      process(plant, tick);
    } else if (now >= kStall + kMotorTimeout) {
      plant.command({});
    }
    plant.step();
    if (now > kStall) largest = std::max(largest, plant.truth().linear_velocity.x());
  }
  EXPECT_NEAR(plant.truth().linear_velocity.x(), kSpeed, 0.02) << "did not get going again";
  return largest;
}

TEST(Stall, StopOfTheMotorsByThemselvesIsNoDisturbance) {
  DriveLoop loop(parameters(), makeController(parameters()));
  EXPECT_LT(fastest([&loop](JackalPlant& plant, long) { serve(loop, plant, {kSpeed, 0.0, 0.0}); }), kSpeed + 0.02);
  EXPECT_GT(loop.status().dropped_periods, 0u);
  EXPECT_EQ(loop.status().faults_detected, 0u);
  PredictiveController controller(std::get<PredictiveParameters>(setup().drive.controller), {},
                                  *setup().drive.plant_model);
  controller.setSetPoint({kSpeed, 0.0, 0.0});
  EXPECT_GT(fastest([&controller](JackalPlant& plant, long tick) {
              if (plant.measurement()) controller.observe(plant.measurement()->observation());
              controller.updateBelief();
              if (tick % 20 == 0) plant.command(controller.updateAction());
            }),
            kSpeed + 0.05)
      << "without the drive loop it would be one";
}

/// Time until a bias of the gyro is found in a turn of a new robot, whose clock begins at zero [s].
double timeToFindABias(DriveLoop& loop) {
  constexpr double kOnset = 2.0;  // s
  JackalPlant plant = newPlant();
  for (; plant.time() < kEnd; plant.step()) {
    const double now = plant.time();
    serve(loop, plant, {0.5, 0.0, 0.8}, [now](Observation& y) { y.yaw_rate += now >= kOnset ? 0.3 : 0.0; });
    if (loop.status().fault == Fault::gyro_disagrees) return now - kOnset;
  }
  return std::numeric_limits<double>::infinity();
}

/// The motion of the motors while the clock jumps is unknown: their last command counts no more.
TEST(ClockThatRanBack, LeavesNothingThatHidesAFault) {
  DriveLoop loop(parameters(), makeController(parameters()));
  EXPECT_LT(timeToFindABias(loop), 0.3);
  EXPECT_LT(timeToFindABias(loop), 0.3) << "while the robot still drove when the clock jumped";
  EXPECT_EQ(loop.status().clock_resets, 1u);
}

/// A Gazebo robot has no jackal_left_wheel/command, and its wheels are not to blame for that.
TEST(CommandsWithoutSubscriber, WheelsThatStandAreNoFault) {
  for (const bool no_subscriber : {false, true}) {
    DriveLoop loop(parameters(), makeController(parameters()));
    JackalPlant plant = newPlant();
    RobotStatus status;
    status.no_subscriber = no_subscriber;
    for (; plant.time() < kEnd; plant.step()) {
      loop.report(status, plant.time());
      serve(loop, plant, {0.5, 0.0, 0.0});
      plant.command({});
    }
    EXPECT_EQ(reason(loop.status()), no_subscriber ? "" : "wheels do not follow their command");
  }
}

}  // namespace
}  // namespace jackal_aic::sim
