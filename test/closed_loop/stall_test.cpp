// The controller's process is held up while the robot drives, and the motors stop by themselves for want of commands:
// the drive loop does not take that for a disturbance.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <string>

#include "jackal_aic/safety/drive_loop.hpp"
#include "predictive_loop.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kStall = 2.0;         // s, beginning
constexpr double kStallEnd = 2.3;      // s
constexpr double kMotorTimeout = 0.1;  // s without a command
constexpr double kEnd = 4.0;           // s
constexpr double kSpeed = 1.0;         // m/s

/// Called with the robot at every millisecond in which the process runs.
using Process = std::function<void(JackalPlant& plant, long tick)>;

/// Largest true speed from the stall on, of a robot that is to drive at kSpeed.
double fastest(const Process& process) {
  JackalPlant plant(textOf("sim/urdf/jackal.urdf"), PredictiveLoop::ground());
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

TEST(Stall, TheMotorsOwnStopIsNoDisturbance) {
  DriveParameters parameters;
  parameters.controller = PredictiveLoop::preset();
  parameters.plant_model = linearModel(PredictiveLoop::ground());
  parameters.plant_model->identified = true;
  DriveLoop loop(parameters, makeController(parameters));
  EXPECT_LT(fastest([&loop](JackalPlant& plant, long) {
              const double now = plant.time();
              loop.setSetPoint({now < 0.1 ? 0.0 : kSpeed, 0.0, 0.0}, now);
              if (plant.measurement()) loop.observe(plant.measurement()->observation(), now);
              if (const auto command = loop.advance(now)) plant.command(*command);
            }),
            kSpeed + 0.02);
  EXPECT_GT(loop.status().dropped_periods, 0u);
  EXPECT_EQ(loop.status().faults_detected, 0u);
}

/// A robot whose quiet wheels are a little slower than its model: the value that its coarse encoder repeats after the
/// stall is where it was before, and not where its model leads.
TEST(Stall, QuietWheelsThatAreOffTheirModelAreNotFrozenAfterIt) {
  constexpr double kLongStall = 0.5;  // s
  DriveParameters parameters;
  parameters.controller = DifferentialDriveParameters{};
  parameters.open_loop_monitored = true;
  parameters.plant_model = linearModel(PredictiveLoop::ground());
  parameters.plant_model->identified = true;
  parameters.plant_model->sensor_rate = 20.0;
  PlantParameters robot = PredictiveLoop::ground();
  robot.sensor_rate = 20.0;
  robot.encoder_step = 0.02;
  robot.encoder_noise = 0.005;
  for (const double gain : {0.95, 1.05}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      robot.wheel_gain = gain;
      robot.seed = seed;
      DriveLoop loop(parameters, makeController(parameters));
      JackalPlant plant(textOf("sim/urdf/jackal.urdf"), robot);
      for (; plant.time() < kEnd; plant.step()) {
        const double now = plant.time();
        const bool stalled = now >= kStall && now < kStall + kLongStall;
        if (stalled) continue;
        loop.setSetPoint(now < 0.3 ? SetPoint{} : SetPoint{0.3, 0.0, 0.0}, now);
        if (plant.measurement()) loop.observe(plant.measurement()->observation(), now);
        if (const auto command = loop.advance(now)) plant.command(*command);
      }
      EXPECT_GT(loop.status().dropped_periods, 0u);
      EXPECT_EQ(loop.status().faults_detected, 0u) << gain << ", seed " << seed << ": " << reason(loop.status());
    }
  }
}

/// Drives a turn on a new robot, whose clock begins at zero; time until a bias of the gyro is found [s].
double timeToFindABias(DriveLoop& loop) {
  constexpr double kOnset = 2.0;  // s
  JackalPlant plant(textOf("sim/urdf/jackal.urdf"), PredictiveLoop::ground());
  for (; plant.time() < kEnd; plant.step()) {
    const double now = plant.time();
    loop.setSetPoint(now < 0.3 ? SetPoint{} : SetPoint{0.5, 0.0, 0.8}, now);
    if (plant.measurement()) {
      Observation y = plant.measurement()->observation();
      if (now >= kOnset) y.yaw_rate += 0.3;
      loop.observe(y, now);
      if (loop.status().fault == Fault::gyro_disagrees) return now - kOnset;
    }
    if (const auto command = loop.advance(now)) plant.command(*command);
  }
  return std::numeric_limits<double>::infinity();
}

/// What the motors do while the clock jumps is not known: their last command counts no more.
TEST(ClockThatRanBack, LeavesNothingThatHidesAFault) {
  DriveParameters parameters;
  parameters.controller = PredictiveLoop::preset();
  parameters.plant_model = linearModel(PredictiveLoop::ground());
  parameters.plant_model->identified = true;
  DriveLoop loop(parameters, makeController(parameters));
  EXPECT_LT(timeToFindABias(loop), 0.3);
  EXPECT_LT(timeToFindABias(loop), 0.3) << "while the robot still drove when the clock jumped";
  EXPECT_EQ(loop.status().clock_resets, 1u);
}

/// First fault that is found in a turn of a new robot, whose clock begins at zero.
Fault faultInATurn(DriveLoop& loop, const PlantParameters& robot) {
  constexpr double kLong = 8.0;  // s
  JackalPlant plant(textOf("sim/urdf/jackal.urdf"), robot);
  for (; plant.time() < kLong; plant.step()) {
    const double now = plant.time();
    loop.setSetPoint(now < 0.3 ? SetPoint{} : SetPoint{0.5, 0.0, 0.8}, now);
    if (plant.measurement()) loop.observe(plant.measurement()->observation(), now);
    if (const auto command = loop.advance(now)) plant.command(*command);
    if (isFault(loop.status().fault)) return loop.status().fault;
  }
  return Fault::none;
}

/// A simulation that starts anew may have another robot; what resolution its encoders have is to be learned.
TEST(ClockThatRanBack, EncodersAreNotJudgedByThoseOfBefore) {
  DriveParameters parameters;
  parameters.controller = PredictiveLoop::preset();
  parameters.plant_model = linearModel(PredictiveLoop::ground());
  parameters.plant_model->identified = true;
  for (const std::uint64_t seed : {1, 2, 3}) {
    DriveLoop loop(parameters, makeController(parameters));
    PlantParameters noisy = PredictiveLoop::ground(), coarse = noisy;
    noisy.seed = coarse.seed = seed;
    coarse.encoder_step = 0.1;
    coarse.encoder_noise = 0.0;
    EXPECT_EQ(faultInATurn(loop, noisy), Fault::none) << seed;
    EXPECT_STREQ(text(faultInATurn(loop, coarse)), "") << seed;
  }
}

/// What is found of a robot that stands although it is commanded.
std::string foundAtRest(const RobotStatus& status) {
  DriveParameters parameters;
  parameters.controller = PredictiveLoop::preset();
  parameters.plant_model = linearModel(PredictiveLoop::ground());
  parameters.plant_model->identified = true;
  DriveLoop loop(parameters, makeController(parameters));
  JackalPlant plant(textOf("sim/urdf/jackal.urdf"), PredictiveLoop::ground());
  for (; plant.time() < kEnd; plant.step()) {
    const double now = plant.time();
    loop.report(status, now);
    loop.setSetPoint({now < 0.3 ? 0.0 : 0.5, 0.0, 0.0}, now);
    if (plant.measurement()) loop.observe(plant.measurement()->observation(), now);
    loop.advance(now);
  }
  return reason(loop.status());
}

/// A Gazebo robot has no jackal_left_wheel/command, and its wheels are not to blame for that.
TEST(CommandsWithoutSubscriber, WheelsThatStandAreNoFault) {
  EXPECT_EQ(foundAtRest({}), "wheels do not follow their command");
  RobotStatus unheard;
  unheard.unheard = true;
  EXPECT_EQ(foundAtRest(unheard), "");
}

TEST(Stall, WithoutTheDriveLoopItWouldBeOne) {
  PredictiveController controller(PredictiveLoop::preset(), GeometryParameters{},
                                  linearModel(PredictiveLoop::ground()));
  controller.setSetPoint({kSpeed, 0.0, 0.0});
  EXPECT_GT(fastest([&controller](JackalPlant& plant, long tick) {
              if (plant.measurement()) controller.observe(plant.measurement()->observation());
              controller.updateBelief();
              if (tick % 20 == 0) plant.command(controller.updateAction());
            }),
            kSpeed + 0.05)
      << "no stall that needs an answer: the test above shows nothing";
}

}  // namespace
}  // namespace jackal_aic::sim
