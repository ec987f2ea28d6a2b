// A body that does not follow its wheels: on ice the belief knows its speed, and against a wall the robot says that it
// does not move. A body that does, behind an attitude filter that takes its accelerations for tilt.

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
#include "monitored_loop.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kStart = 1.0;       // s, of the first step
constexpr double kHalfPeriod = 3.0;  // s, between steps
constexpr double kAfterAStep = 1.0;  // s, from which the belief has to be right
// s, in which it is learned whether the attitude takes accelerations for tilt: wheels that spin look the same before.
constexpr double kFirst = 4.0 * kHalfPeriod;
constexpr double kBeliefBar = 0.03;  // m/s
constexpr double kFastBar = 0.04;    // m/s, at 1.5 m/s, where it slides for 1.5 s
constexpr double kStuckBar = 1.0;    // s from the contact until it is told
constexpr double kContact = -3.0;    // m/s^2, of the body that hits something
constexpr double kNear = 0.5;        // m, of the centre of a robot that touches a wall

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

/// A simulated robot under a drive loop, and the odometry beside it.
struct Robot {
  DriveLoop loop;
  Odometry odometry;
  JackalPlant plant;

  Robot(const LoopSetup& setup, const DriveParameters& parameters, std::unique_ptr<VelocityController> controller)
      : loop(parameters, std::move(controller)),
        odometry(makeOdometry(parameters, loop)),
        plant(setup.urdf, setup.plant) {}

  /// Hears a set point and what the sensors say. @param sensed may change a measurement; true if there was one.
  template <class Sensed>
  bool observe(const SetPoint& set_point, const Sensed& sensed) {
    loop.setSetPoint(set_point, plant.time());
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

/// What a run shows.
struct Figures {
  double worst_belief = 0.0;      // of the believed forward speed, later than kAfterAStep [m/s]
  double worst_odometry = 0.0;    // of the odometry's, likewise
  std::optional<double> contact;  // time at which the body was stopped [s]
  std::optional<double> stuck;    // ... and at which that was told
  std::string faults;             // of a sensor or a motor, that were told
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
  DriveLoop& loop = robot.loop;
  const JackalPlant& plant = robot.plant;
  const auto* predictive = dynamic_cast<const PredictiveController*>(&loop.controller());
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
    if (robot.observe({drives ? speed : 0.0, 0.0, 0.0}, [](Observation&) {})) {
      const Fault fault = loop.status().fault;
      if (fault == Fault::stuck && !figures.stuck) figures.stuck = now;
      const bool remark = fault == Fault::stuck || fault == Fault::wheels_off_model || fault == Fault::turn_off_model;
      if (fault != Fault::none && !remark && figures.faults.empty()) figures.faults = text(fault);
      if (now >= kStart + kFirst && std::fmod(into, kHalfPeriod) >= kAfterAStep) {
        const auto grow = [truth](double& worst, double believed) {
          worst = std::max(worst, std::abs(believed - truth));
        };
        if (predictive) grow(figures.worst_belief, predictive->believedVelocity()(kForward));
        grow(figures.worst_odometry, robot.odometry.motion().forward);
      }
    }
  }
  return figures;
}

/// An attitude filter that takes accelerations for tilt, with a gain: that of imu_filter_madgwick, or Mahony's.
struct AttitudeFilter {
  const char* name;
  double madgwick, mahony;
  double gravity = 0.0;  // that it takes out wrongly [m/s^2]

  /// What it leaves of an acceleration [m/s^2] that lasted for a step [s].
  double remove(double acceleration, double step) {
    const double left = acceleration - gravity;
    gravity += step * (2.0 * kGravity * madgwick * (left > 0.0 ? 1.0 : -1.0) + mahony * left);
    return left;
  }
};

struct Cruise {
  const char* plant;
  bool identified;
  double speed;         // m/s
  double acceleration;  // of the set point [m/s^2]
};

/// Ramps up, cruises and stops, twice.
void cruise(const Cruise& c, AttitudeFilter filter) {
  constexpr double kPeriod = 12.0, kUp = 1.0, kDown = 7.0;  // s
  const LoopSetup setup = loadSetup(files(), "predictive", c.plant, {});
  DriveParameters parameters = setup.drive;
  parameters.faults = FaultParameters{};
  parameters.plant_model = c.identified ? monitorModel(files(), c.plant) : assumedModel(files());
  Robot robot(setup, parameters, makeController(parameters));
  double driven = 0.0, believed = 0.0, last = 0.0;
  for (; robot.plant.time() < 2.0 * kPeriod; robot.act()) {
    const double now = robot.plant.time(), into = std::fmod(now, kPeriod);
    const double up = c.acceleration * (into - kUp), down = c.speed - c.acceleration * (into - kDown);
    const double set_point = std::max(0.0, into < kDown ? std::min(c.speed, up) : down);
    robot.observe({set_point, 0.0, 0.0}, [&](Observation& y) {
      y.acceleration_x = filter.remove(y.acceleration_x, std::min(0.1, y.stamp - std::exchange(last, y.stamp)));
    });
    const Fault fault = robot.loop.status().fault;
    ASSERT_EQ(fault, Fault::none) << text(fault) << " at " << now << " s";
    driven += std::abs(robot.plant.truth().linear_velocity.x());
    believed += std::abs(robot.odometry.motion().forward);
  }
  EXPECT_NEAR(believed / driven, 1.0, 0.02);
}

TEST(AttitudeFilterThatTakesAccelerationsForTilt, LeavesTheOdometryAndNobodyStuck) {
  for (const AttitudeFilter& filter :
       {AttitudeFilter{"true", 0.0, 0.0}, AttitudeFilter{"madgwick 0.1", 0.1, 0.0},
        AttitudeFilter{"madgwick 0.04", 0.04, 0.0}, AttitudeFilter{"mahony 0.4", 0.0, 0.4},
        AttitudeFilter{"mahony 1.5", 0.0, 1.5}}) {
    for (const Cruise& c :
         {Cruise{"ground", true, 1.0, 100.0}, Cruise{"ground", true, 1.5, 0.5}, Cruise{"ground", false, 2.0, 100.0},
          Cruise{"ground", false, 0.5, 0.5}, Cruise{"real", true, 1.0, 1.0}, Cruise{"real", false, 1.5, 1.0}}) {
      SCOPED_TRACE(std::string(filter.name) + " on " + c.plant + " at " + std::to_string(c.speed) + " m/s, " +
                   std::to_string(c.acceleration) + " m/s^2" + (c.identified ? "" : ", not identified"));
      cruise(c, filter);
    }
  }
}

TEST(Ice, TheBelievedSpeedIsThatOfTheBodyASecondAfterEveryStep) {
  for (const double speed : {0.3, 0.5, 0.8, 1.0, 1.5, -1.0}) {
    for (const char* seed : {"1", "2"}) {
      const Figures f = drive("predictive", "ground", speed, 4, {{"plant.friction", "0.1"}, {"plant.seed", seed}});
      EXPECT_LE(f.worst_belief, speed < 1.5 ? kBeliefBar : kFastBar) << speed << " m/s, seed " << seed;
      EXPECT_FALSE(f.stuck) << speed << " m/s, seed " << seed;
      EXPECT_EQ(f.faults, "") << speed << " m/s, seed " << seed;
    }
  }
}

TEST(Ice, TheOdometryBesideTheThesisControllerKnowsItToo) {
  for (const double speed : {0.5, 1.0, 1.5}) {
    const Figures f = drive("improved", "ground", speed, 3, {{"plant.friction", "0.1"}});
    EXPECT_LE(f.worst_odometry, speed < 1.5 ? kBeliefBar : kFastBar) << speed << " m/s";
  }
}

TEST(Grip, NobodyIsSaidToBeStuckAndTheWheelsAreBelieved) {
  for (const char* friction : {"0.25", "0.5", "1"}) {
    for (const double speed : {0.1, 0.5, 1.5}) {
      const Figures f = drive("predictive", "ground", speed, 3, {{"plant.friction", friction}});
      EXPECT_LE(f.worst_belief, 0.01) << "friction " << friction << ", " << speed << " m/s";
      EXPECT_FALSE(f.stuck) << "friction " << friction << ", " << speed << " m/s";
    }
  }
}

TEST(Wall, ARobotThatDrivesIntoItOrStartsAgainstItSaysSoWithinASecond) {
  for (const char* controller : {"diff_drive", "standard", "improved", "tuned", "predictive"}) {
    // Almost against it, and at speed; from 1 m/s on the wheels stop with the body, which bounces.
    for (const char* distance : {"0.3", "1.0", "2.5"}) {
      for (const double speed : {0.3, 0.5, 1.0, 1.5}) {
        if (speed < 1.0 && distance == std::string("2.5")) continue;  // it is not there in time
        if (speed > 1.0 && distance != std::string("2.5")) continue;  // it is not that fast yet
        const Figures f =
            drive(controller, "ground", speed, 0, {{"plant.kerb_distance", distance}, {"plant.kerb_height", "0.2"}});
        SCOPED_TRACE(std::string(controller) + ", wall after " + distance + " m, " + std::to_string(speed) + " m/s");
        ASSERT_TRUE(f.contact);
        ASSERT_TRUE(f.stuck);
        EXPECT_GE(*f.stuck, *f.contact);
        EXPECT_LE(*f.stuck - *f.contact, kStuckBar);
        EXPECT_EQ(f.faults, "") << "a healthy sensor is called faulty";
      }
    }
  }
}

/// Through vibration, an IMU of its own rate and a network that delays. At 0.3 m/s it is told in 77 or 78 of 80 drives
/// (seeds 1 to 40, two speeds; before and after the bias was subtracted): which seeds are missed is a draw.
TEST(Wall, ARealRobotThatDrivesIntoItSaysSoWithinASecond) {
  for (const char* controller : {"diff_drive", "standard", "improved", "tuned", "predictive"}) {
    for (const auto& [speed, distance] :
         {std::pair(0.3, "1.0"), std::pair(0.5, "0.3"), std::pair(0.5, "1.0"), std::pair(1.0, "2.5")}) {
      for (const char* seed : {"2", "3"}) {
        const Figures f =
            drive(controller, "real", speed, 0,
                  {{"plant.kerb_distance", distance}, {"plant.kerb_height", "0.2"}, {"plant.seed", seed}});
        SCOPED_TRACE(std::string(controller) + ", " + std::to_string(speed) + " m/s, seed " + seed);
        ASSERT_TRUE(f.contact);
        ASSERT_TRUE(f.stuck);
        EXPECT_GE(*f.stuck, *f.contact);
        EXPECT_LE(*f.stuck - *f.contact, kStuckBar);
        EXPECT_EQ(f.faults, "") << "a healthy sensor is called faulty";
      }
    }
  }
}

}  // namespace
}  // namespace jackal_aic::sim
