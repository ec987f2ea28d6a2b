// A body that does not follow its wheels: on ice the belief knows its speed, and against a wall it is reported stuck.
// A body that does, behind an attitude filter that takes its accelerations for tilt.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "drives.hpp"
#include "jackal_aic/model/gravity.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"
#include "jackal_aic/safety/loop_odometry.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kStart = 1.0;       // s, of the first step
constexpr double kHalfPeriod = 3.0;  // s, between steps
constexpr double kAfterAStep = 1.0;  // s, from which the belief has to be right
// s, in which it is learned whether the attitude takes accelerations for tilt: spinning wheels look the same before.
constexpr double kFirst = 4.0 * kHalfPeriod;
constexpr double kBeliefBar = 0.03;  // m/s
constexpr double kFastBar = 0.04;    // m/s, at 1.5 m/s, where it slides for 1.5 s
constexpr double kStuckBar = 1.0;    // s from the contact until it is reported
constexpr double kContact = -3.0;    // m/s^2, of the body that hits something
constexpr double kNear = 0.5;        // m, of the centre of a robot that touches a wall

/// A simulated robot under a drive loop, and the odometry.
struct Robot {
  DriveLoop loop;
  Odometry odometry;
  JackalPlant plant;

  Robot(const LoopSetup& setup, const DriveParameters& parameters, std::unique_ptr<VelocityController> controller)
      : loop(parameters, std::move(controller)),
        odometry(makeOdometry(parameters, loop)),
        plant(setup.urdf, setup.plant) {}

  /// Receives a set point and the sensors. @param sensed may change a measurement; true if there was one.
  template <class Sensed>
  bool observe(double forward, const Sensed& sensed) {
    loop.setSetPoint({forward, 0.0, 0.0}, plant.time());
    if (!plant.measurement()) return false;
    Observation y = plant.measurement()->observation();
    sensed(y);
    loop.observe(y, plant.time());
    odometry.observe(asCounted(y, loop));
    return true;
  }

  /// Drives for a millisecond.
  void act() {
    if (const auto command = loop.advance(plant.time())) plant.command(*command);
    odometry.advance(loop.command(), 0.001);
    plant.step();
  }
};

struct Figures {
  double worst_belief = 0.0;      // error of the believed forward speed, later than kAfterAStep [m/s]
  double worst_odometry = 0.0;    // the same of the odometry [m/s]
  std::optional<double> contact;  // time at which the body was stopped [s]
  std::optional<double> stuck;    // ... and at which that was reported
  std::string faults;             // of a sensor or a motor, that were reported
};

/// Drives to and fro between rest and a speed, or keeps it. @param cycles 0: keeps it for five seconds.
Figures drive(const std::string& controller, const std::string& plant_name, double speed, int cycles,
              const Overrides& overrides) {
  const LoopSetup setup = loadSetup(files(), controller, plant_name, overrides);
  DriveParameters parameters = setup.drive;
  parameters.faults = FaultParameters{};
  parameters.plant_model = monitorModel(files(), plant_name);
  parameters.open_loop_monitored = true;
  Robot robot(setup, parameters, makeController(setup.drive));
  const JackalPlant& plant = robot.plant;
  const auto* predictive = dynamic_cast<const PredictiveController*>(&robot.loop.controller());
  Figures figures;
  const double end = cycles > 0 ? kStart + 2.0 * kHalfPeriod * cycles : kStart + 5.0;
  double before = 0.0;
  for (; plant.time() < end; robot.act()) {
    const double now = plant.time();
    const double into = cycles > 0 ? std::fmod(now - kStart + 1e-9, 2.0 * kHalfPeriod) : now - kStart;
    const bool drives = now >= kStart && (cycles == 0 || into < kHalfPeriod);
    const double truth = plant.truth().linear_velocity.x();
    const bool near = plant.truth().position.x() > setup.plant.kerb_distance - kNear;  // uneven ground jolts, too
    if (near && !figures.contact && (truth - before) / 0.001 * (speed < 0.0 ? -1.0 : 1.0) < kContact) {
      figures.contact = now;
    }
    before = truth;
    if (!robot.observe(drives ? speed : 0.0, [](Observation&) {})) continue;
    const Fault fault = robot.loop.status().fault;
    if (fault == Fault::stuck && !figures.stuck) figures.stuck = now;
    const bool remark = fault == Fault::stuck || fault == Fault::wheels_off_model || fault == Fault::turn_off_model;
    if (fault != Fault::none && !remark && figures.faults.empty()) figures.faults = text(fault);
    if (now < kStart + kFirst || std::fmod(into, kHalfPeriod) < kAfterAStep) continue;
    const double believed = predictive ? predictive->believedVelocity()(kForward) : truth;
    figures.worst_belief = std::max(figures.worst_belief, std::abs(believed - truth));
    figures.worst_odometry = std::max(figures.worst_odometry, std::abs(robot.odometry.motion().forward - truth));
  }
  return figures;
}

TEST(Ice, BelievedSpeedIsThatOfTheBodyASecondAfterEveryStep) {
  for (const double speed : {0.3, 0.5, 0.8, 1.0, 1.5, -1.0}) {
    for (const char* seed : {"1", "2"}) {
      const Figures f = drive("predictive", "ground", speed, 4, {{"plant.friction", "0.1"}, {"plant.seed", seed}});
      EXPECT_LE(f.worst_belief, speed < 1.5 ? kBeliefBar : kFastBar) << speed << " m/s, seed " << seed;
      EXPECT_FALSE(f.stuck) << speed << " m/s, seed " << seed;
      EXPECT_EQ(f.faults, "") << speed << " m/s, seed " << seed;
    }
  }
  for (const double speed : {0.5, 1.0, 1.5}) {
    const Figures f = drive("improved", "ground", speed, 3, {{"plant.friction", "0.1"}});
    EXPECT_LE(f.worst_odometry, speed < 1.5 ? kBeliefBar : kFastBar) << speed << " m/s, thesis controller";
  }
}

TEST(Grip, RobotIsNotReportedStuckAndTheWheelsAreBelieved) {
  for (const char* friction : {"0.25", "0.5", "1"}) {
    for (const double speed : {0.1, 0.5, 1.5}) {
      const Figures f = drive("predictive", "ground", speed, 3, {{"plant.friction", friction}});
      EXPECT_LE(f.worst_belief, 0.01) << "friction " << friction << ", " << speed << " m/s";
      EXPECT_FALSE(f.stuck) << "friction " << friction << ", " << speed << " m/s";
    }
  }
}

/// A wall almost touched, and hit at speed; from 1 m/s on the wheels stop with the body, which bounces. On the real
/// robot through vibration, an IMU of its own rate and a network that delays: at 0.3 m/s it is reported in 77 or 78 of
/// 80 drives (seeds 1 to 40, two speeds); which seeds are missed is a draw.
TEST(Wall, IsReportedWithinASecondOfTheContact) {
  const struct {
    const char *plant, *distance;  // m
    std::vector<double> speeds;    // m/s, that are reached before it
    std::vector<const char*> seeds;
  } rows[] = {{"ground", "0.3", {0.3, 0.5, 1.0}, {"1"}}, {"ground", "1.0", {0.3, 0.5, 1.0}, {"1"}},
              {"ground", "2.5", {1.0, 1.5}, {"1"}},      {"real", "1.0", {0.3, 0.5}, {"2", "3"}},
              {"real", "0.3", {0.5}, {"2", "3"}},        {"real", "2.5", {1.0}, {"2", "3"}}};
  for (const char* controller : {"diff_drive", "standard", "improved", "tuned", "predictive"}) {
    for (const auto& row : rows) {
      for (const double speed : row.speeds) {
        for (const char* seed : row.seeds) {
          SCOPED_TRACE(testing::Message() << controller << " on " << row.plant << ", wall after " << row.distance
                                          << " m, " << speed << " m/s, seed " << seed);
          const Figures f =
              drive(controller, row.plant, speed, 0,
                    {{"plant.kerb_distance", row.distance}, {"plant.kerb_height", "0.2"}, {"plant.seed", seed}});
          ASSERT_TRUE(f.contact);
          ASSERT_TRUE(f.stuck);
          EXPECT_GE(*f.stuck, *f.contact);
          EXPECT_LE(*f.stuck - *f.contact, kStuckBar);
          EXPECT_EQ(f.faults, "") << "a healthy sensor is called faulty";
        }
      }
    }
  }
}

}  // namespace
}  // namespace jackal_aic::sim
