#include "jackal_plant.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "jackal_aic/config/yaml.hpp"
#include "motor.hpp"
#include "test_plant.hpp"

namespace jackal_aic::sim {
namespace {

using P = PlantParameters;
constexpr double kDegree = M_PI / 180.0;

JackalPlant plantOf(const P& parameters) { return JackalPlant(jackalUrdf(), parameters); }

/// quiet() or direct() with changes.
template <class Change>
P with(P parameters, Change change) {
  change(parameters);
  return parameters;
}

P onBox(P parameters = quiet()) {
  parameters.support = Support::box;
  return parameters;
}

/// A plant that was driven for a time [s] with speeds of the wheel circumference [m/s].
JackalPlant driven(const P& parameters, double left, double right, double seconds) {
  JackalPlant plant = plantOf(parameters);
  plant.command(rolling(left, right));
  run(plant, seconds);
  return plant;
}

double forward(const JackalPlant& plant) { return plant.truth().linear_velocity.x(); }
double yawRate(const JackalPlant& plant) { return plant.truth().angular_velocity.z(); }
double wheelSpeed(const JackalPlant& plant, Wheel wheel = kFrontLeft) { return plant.truth().wheel_velocity[wheel]; }

/// What a plant tells of itself, true and measured.
std::vector<double> numbersOf(const JackalPlant& plant) {
  const PlantTruth& t = plant.truth();
  std::vector<double> numbers{t.time, t.acting_command.left, t.acting_command.right};
  const auto add = [&](const auto& values) {
    numbers.insert(numbers.end(), values.data(), values.data() + values.size());
  };
  add(t.position), add(t.orientation.coeffs()), add(t.linear_velocity), add(t.angular_velocity);
  add(t.wheel_position), add(t.wheel_velocity);
  if (!plant.measurement()) return numbers;
  const PlantMeasurement& m = *plant.measurement();
  add(m.wheel_velocity), add(m.wheel_effort), add(m.angular_velocity), add(m.linear_acceleration),
      add(m.orientation.coeffs());
  return numbers;
}

/// The numbers of every step of a drive with forward motion and turns.
std::vector<double> recorded(JackalPlant plant, int steps = 800) {
  std::vector<double> numbers;
  for (int n = 0; n < steps; ++n) {
    if (n % 200 == 0) plant.command(n % 400 == 0 ? rolling(0.5, 0.3) : rolling(-0.2, 0.6));
    plant.step();
    const std::vector<double> now = numbersOf(plant);
    numbers.insert(numbers.end(), now.begin(), now.end());
  }
  return numbers;
}

// ---- motors

TEST(CommandDelay, ActsAfterTheDeadTimeInOrder) {
  CommandDelay delay(0.110, 0.001), at_once(0.0, 0.001), late(0.010, 0.001);
  delay.push(5, {1.0, 2.0});
  delay.push(8, {3.0, 3.0});
  delay.push(8, {4.0, 4.0});
  EXPECT_EQ(delay.acting(114), WheelCommand{});
  EXPECT_EQ(delay.acting(115), (WheelCommand{1.0, 2.0}));
  EXPECT_EQ(delay.acting(117).left, 1.0);
  EXPECT_EQ(delay.acting(118).left, 4.0);
  EXPECT_EQ(delay.acting(1000).left, 4.0);
  at_once.push(7, {1.0, 1.0});
  EXPECT_EQ(at_once.acting(7).left, 1.0);
  late.push(0, {1.0, 1.0}, 15);
  late.push(5, {2.0, 2.0}, 2);
  EXPECT_EQ(late.acting(24), WheelCommand{});
  EXPECT_EQ(late.acting(25), (WheelCommand{2.0, 2.0})) << "both come at once";
}

/// T w'' + w' + k w = k r after the dead time, w(0) = 0, w'(0) = r/T; without the integral, k, this is a lag T.
TEST(PlantMotors, FollowDeadTimeLagAndIntegralExactly) {
  struct Case {
    int steps;  // of dead time
    double integral, tolerance;
  };
  for (const Case& c :
       {Case{0, 0.0, 1e-6}, Case{1, 0.0, 1e-6}, Case{37, 0.0, 1e-6}, Case{110, 0.0, 1e-6}, Case{0, 3.0, 0.01}}) {
    JackalPlant plant =
        plantOf(with(onBox(), [&](P& p) { p.dead_time = 0.001 * c.steps, p.velocity_loop_integral = c.integral; }));
    run(plant, 0.05);
    plant.command({5.0, -3.0});
    const double lag = quiet().motor_lag, root = std::sqrt(1.0 - 4.0 * lag * c.integral);
    const double slow = (-1.0 + root) / (2.0 * lag), fast = (-1.0 - root) / (2.0 * lag);
    const double a = (1.0 / lag + fast) / (slow - fast);
    for (int n = 1; n <= 2000; ++n) {
      plant.step();
      const double t = 0.001 * std::max(0, n - c.steps);
      const double reached = 1.0 + a * std::exp(slow * t) - (1.0 + a) * std::exp(fast * t);
      const auto& speed = plant.truth().wheel_velocity;
      for (Wheel wheel : {kFrontLeft, kRearLeft}) ASSERT_NEAR(speed[wheel], 5.0 * reached, c.tolerance) << c.steps;
      for (Wheel wheel : {kFrontRight, kRearRight}) ASSERT_NEAR(speed[wheel], -3.0 * reached, c.tolerance) << c.steps;
    }
    EXPECT_EQ(plant.truth().acting_command, (WheelCommand{5.0, -3.0}));
  }
}

TEST(PlantMotors, KeepGainAccelerationAndTorqueLimit) {
  JackalPlant gain = plantOf(with(onBox(), [](P& p) { p.wheel_gain = 0.8, p.velocity_loop_integral = 5.0; }));
  gain.command({10.0, -5.0});
  run(gain, 4.0);
  EXPECT_NEAR(wheelSpeed(gain), 8.0, 1e-5);
  EXPECT_NEAR(wheelSpeed(gain, kFrontRight), -4.0, 1e-5);
  const JackalPlant slow = driven(with(onBox(direct()), [](P& p) { p.acceleration_limit = 2.0; }), 1.0, -1.0, 0.25);
  EXPECT_NEAR(kWheelRadius * wheelSpeed(slow), 0.5, 1e-6);
  EXPECT_NEAR(kWheelRadius * wheelSpeed(slow, kFrontRight), -0.5, 1e-6);
  JackalPlant weak = plantOf(with(onBox(direct()), [](P& p) { p.torque_limit = 0.1, p.acceleration_limit = 1000.0; }));
  weak.command({20.0, 20.0});
  const PlantMeasurement sample = nextMeasurement(weak);
  EXPECT_NEAR(sample.wheel_velocity[kFrontLeft], 0.1 / 0.0024 * 0.02, 1e-6);
  EXPECT_NEAR(sample.wheel_effort[kFrontLeft], 0.1, 1e-6);
  run(weak, 1.0);
  EXPECT_NEAR(wheelSpeed(weak), 20.0, 1e-6);
}

TEST(PlantMotors, AccelerationLimitDoesNotWindUpAndAnOffsetIsADeadBand) {
  JackalPlant limited =
      plantOf(with(onBox(), [](P& p) { p.acceleration_limit = 0.5, p.velocity_loop_integral = 5.0; }));
  limited.command({8.0, 8.0});
  double highest = 0.0;
  for (int n = 0; n < 5000; ++n) {
    limited.step();
    highest = std::max(highest, wheelSpeed(limited));
  }
  EXPECT_NEAR(wheelSpeed(limited), 8.0, 1e-3);
  EXPECT_LT(highest, 8.0 * 1.1) << "1.6 s of acceleration would add 8 rad/s";
  for (const auto& [command, speed] : {std::pair(3.0, 2.5), {-3.0, -2.5}, {0.5, 0.0}}) {
    JackalPlant plant = plantOf(with(onBox(), [](P& p) { p.wheel_offset = 0.5, p.velocity_loop_integral = 5.0; }));
    plant.command({command, command});
    run(plant, 3.0);
    EXPECT_NEAR(wheelSpeed(plant), speed, 1e-5) << command;
  }
}

TEST(PlantMotors, SoftMotorGivesTorqueByTheErrorOfItsSpeed) {
  P parameters = with(direct(), [](P& p) { p.velocity_loop_stiffness = 3.5, p.slope = 10.0; });
  parameters.acceleration_limit = 0.1;  // a soft motor has none
  for (const double integral : {0.0, 8.0}) {
    parameters.velocity_loop_integral = integral;
    JackalPlant plant = plantOf(parameters);
    plant.command({5.0, 5.0});
    run(plant, 3.0);
    const double torque = nextMeasurement(plant).wheel_effort[kFrontLeft];
    EXPECT_GT(torque, 0.3) << "uphill";
    EXPECT_NEAR(5.0 - wheelSpeed(plant), integral > 0.0 ? 0.0 : torque / 3.5, 1e-3);
  }
  parameters = with(direct(), [](P& p) { p.velocity_loop_stiffness = 3.5, p.velocity_loop_integral = 8.0; });
  parameters.torque_limit = 0.7;
  JackalPlant plant = plantOf(parameters);
  plant.command({10.0, 10.0});
  double largest = 0.0, fastest = 0.0;
  for (int n = 0; n < 100; ++n) {
    largest = std::max(largest, std::abs(nextMeasurement(plant).wheel_effort[kFrontLeft]));
    fastest = std::max(fastest, wheelSpeed(plant));
  }
  EXPECT_NEAR(largest, 0.7, 1e-3);
  EXPECT_LT(fastest, 1.1 * 10.0) << "no wind-up";
  EXPECT_NEAR(wheelSpeed(plant), 10.0, 0.01);
}

// ---- the body on the ground

TEST(PlantOnGround, StandsOnItsWheelsAndIsSampledAtTheSensorRate) {
  JackalPlant plant = plantOf(quiet());
  ASSERT_TRUE(plant.measurement());
  EXPECT_EQ(plant.measurement()->stamp, 0.0);
  EXPECT_NEAR(plant.measurement()->linear_acceleration.z(), kGravity, 1e-3);
  const Eigen::Vector3d start = plant.truth().position;
  // base_link is the wheel radius less the axle's height above the ground; the tyres give by less than a millimetre.
  EXPECT_NEAR(start.z(), kWheelRadius - 0.0345, 5e-4);
  EXPECT_EQ(start.head<2>(), Eigen::Vector2d::Zero());
  for (int n = 1; n <= 5000; ++n) {
    plant.step();
    ASSERT_LT(plant.truth().linear_velocity.norm(), 1e-5);
    ASSERT_LT(plant.truth().angular_velocity.norm(), 1e-5);
    ASSERT_EQ(plant.measurement().has_value(), n % 20 == 0) << n;
    ASSERT_NEAR(plant.time(), 0.001 * n, 1e-12);
  }
  EXPECT_LT((plant.truth().position - start).norm(), 1e-7);
  EXPECT_LT((nextMeasurement(plant).linear_acceleration - Eigen::Vector3d(0.0, 0.0, kGravity)).norm(), 2e-3);
}

/// The Jackal with its centre of mass in the middle and without products of inertia, which mirrors exactly.
std::string symmetricUrdf() {
  std::string urdf = jackalUrdfWith("xyz=\"0.012 0.002 0.067\"", "xyz=\"0 0 0.067\"");
  const std::string products = "ixy=\"-0.0008\" ixz=\"0.0164\" iyy=\"0.3922\" iyz=\"-0.0009\"";
  return urdf.replace(urdf.find(products), products.size(), "ixy=\"0\" ixz=\"0\" iyy=\"0.3922\" iyz=\"0\"");
}

TEST(PlantOnGround, MirrorsLeftAndRightForwardAndBackward) {
  JackalPlant plants[] = {{symmetricUrdf(), quiet()}, {symmetricUrdf(), quiet()}, {symmetricUrdf(), quiet()}};
  const WheelCommand commands[] = {rolling(0.3, 0.6), rolling(0.6, 0.3), rolling(-0.3, -0.6)};
  for (int i = 0; i < 3; ++i) {
    plants[i].command(commands[i]);
    run(plants[i], 2.0);
  }
  const PlantTruth &a = plants[0].truth(), &mirrored = plants[1].truth(), &backward = plants[2].truth();
  EXPECT_GT(a.angular_velocity.z(), 0.3);
  EXPECT_NEAR(a.linear_velocity.x(), mirrored.linear_velocity.x(), 1e-5);
  EXPECT_NEAR(a.linear_velocity.y(), -mirrored.linear_velocity.y(), 1e-5);
  EXPECT_NEAR(a.angular_velocity.z(), -mirrored.angular_velocity.z(), 1e-5);
  EXPECT_NEAR(a.position.y(), -mirrored.position.y(), 1e-4);
  EXPECT_NEAR(a.linear_velocity.x(), -backward.linear_velocity.x(), 1e-5);
  EXPECT_NEAR(a.angular_velocity.z(), -backward.angular_velocity.z(), 1e-5);
}

TEST(PlantOnGround, AccelerometerAndGyroAgreeWithTheMotion) {
  JackalPlant arc = driven(quiet(), 0.4, 0.6, 3.0);
  const PlantMeasurement sample = nextMeasurement(arc);
  EXPECT_GT(yawRate(arc), 0.2);
  EXPECT_NEAR(sample.angular_velocity.z(), yawRate(arc), 1e-9);
  EXPECT_NEAR(sample.linear_acceleration.y(), forward(arc) * yawRate(arc), 0.01) << "centripetal, to the left";
  for (double rate : {1000.0, 50.0}) {
    // Accelerates in bursts within a sample, which single values would miss.
    JackalPlant plant = plantOf(with(quiet(), [&](P& p) { p.sensor_rate = rate, p.motor_lag = 0.005; }));
    double integral = 0.0;
    for (int n = 0; n < 2000; ++n) {
      if (n % 20 == 0) plant.command(rolling(0.0005 * n, 0.0005 * n));
      plant.step();
      if (!plant.measurement()) continue;
      integral += (plant.measurement()->orientation * plant.measurement()->linear_acceleration).x() / rate;
    }
    EXPECT_NEAR(integral, forward(plant), 3e-3) << rate << " Hz";
    EXPECT_GT(integral, 0.8);
  }
}

// ---- turns

struct Turn {
  double yaw_rate = 0.0, forward = 0.0;
  double track = 0.0;  // effective, (v_right - v_left) / yaw rate [m]
};

Turn steadyTurn(JackalPlant& plant) {
  constexpr int kSteps = 1000;
  Turn mean;
  double difference = 0.0;
  for (int n = 0; n < kSteps; ++n) {
    plant.step();
    mean.yaw_rate += yawRate(plant) / kSteps;
    mean.forward += forward(plant) / kSteps;
    difference += kWheelRadius * (wheelSpeed(plant, kFrontRight) - wheelSpeed(plant)) / kSteps;
  }
  mean.track = difference / mean.yaw_rate;
  return mean;
}

Turn turnWith(double left, double right, double friction) {
  JackalPlant plant = driven(with(quiet(), [&](P& p) { p.friction = friction; }), left, right, 2.0);
  return steadyTurn(plant);
}

/// With wheels at (+-a, +-t/2) the Coulomb friction that balances the moments makes the effective track of a turn in
/// place t (1 + (a / (t/2))^2), at any friction and speed. The Jackal's centre of mass, off the middle, takes a few
/// per cent.
TEST(PlantInATurn, SlipsInPlaceByCoulombFrictionAtAnyFrictionAndSpeed) {
  constexpr double kCoulombTrack = kTrack * (1.0 + 0.131 * 0.131 / (0.25 * kTrack * kTrack));
  JackalPlant symmetric(symmetricUrdf(), quiet());
  symmetric.command(rolling(-0.15, 0.15));
  run(symmetric, 2.0);
  EXPECT_NEAR(steadyTurn(symmetric).track, kCoulombTrack, 0.01 * kCoulombTrack);
  for (const double friction : {0.25, 0.5, 1.0}) {
    for (const double speed : {0.03, 0.15, 0.3}) {
      const Turn turn = turnWith(-speed, speed, friction);
      EXPECT_NEAR(turn.track, 0.5475, 0.004) << friction << " " << speed;
      EXPECT_NEAR(turn.yaw_rate, 2.0 * speed / 0.5475, 0.01 * turn.yaw_rate);
    }
  }
  EXPECT_LT(turnWith(0.15, -0.15, 0.5).yaw_rate, -0.3);
  JackalPlant plant = driven(quiet(), -0.15, 0.15, 2.0);
  const PlantMeasurement sample = nextMeasurement(plant);
  EXPECT_GT(sample.wheel_effort[kFrontRight], 0.5) << "the motors work against the skid";
  EXPECT_LT(sample.wheel_effort[kFrontLeft], -0.5);
}

// ---- slope and load

TEST(PlantOnSlope, StandsAndItsObservationIsFreeOfGravity) {
  for (const double slope : {5.0, 10.0}) {
    JackalPlant plant = plantOf(with(quiet(), [&](P& p) { p.slope = slope; }));
    run(plant, 2.0);
    EXPECT_LT(plant.truth().position.head<2>().norm(), 1e-6);
    const PlantMeasurement rest = nextMeasurement(plant);
    EXPECT_NEAR(rest.linear_acceleration.x(), kGravity * std::sin(slope * kDegree), 5e-3);
    EXPECT_NEAR(rest.linear_acceleration.z(), kGravity * std::cos(slope * kDegree), 5e-3);
    EXPECT_LT((rest.orientation * rest.linear_acceleration - Eigen::Vector3d(0.0, 0.0, kGravity)).norm(), 5e-4);
    EXPECT_NEAR(rest.observation().acceleration_x, 0.0, 1e-4);
    EXPECT_NEAR(rest.observation().acceleration_y, 0.0, 1e-4);
    EXPECT_EQ(rest.observation().acceleration_z, rest.linear_acceleration.z());
    plant.command(rolling(0.5, 0.5));
    double speed = 0.0, before = rest.stamp;
    while (plant.time() < 4.0) {
      const PlantMeasurement sample = nextMeasurement(plant);
      speed += (sample.stamp - before) * sample.observation().acceleration_x;
      before = sample.stamp;
    }
    EXPECT_NEAR(speed, forward(plant), 0.01);
  }
}

TEST(PlantWithPayload, SinksDeeperAndAcceleratesByItsMass) {
  const double push = 4 * 0.5 / kWheelRadius, wheels = 4 * 0.0024 / (kWheelRadius * kWheelRadius);
  double height = 1.0;
  for (const double payload : {0.0, 20.0}) {
    const P parameters = with(direct(), [&](P& p) { p.torque_limit = 0.5, p.payload = payload; });
    EXPECT_LT(plantOf(parameters).truth().position.z(), height - 1e-4);
    height = plantOf(parameters).truth().position.z();
    EXPECT_NEAR(forward(driven(parameters, 2.0, 2.0, 0.5)), push / (16.523 + 4 * 0.477 + wheels + payload) * 0.5, 0.01);
  }
  // Load and chassis of equal mass and spread double mass and inertia: friction turns both robots alike, but for the
  // wheels.
  const double light = yawRate(driven(direct(), -2.0, 2.0, 0.1));
  const double heavy = yawRate(driven(with(direct(), [](P& p) { p.payload = 16.523; }), -2.0, 2.0, 0.1));
  EXPECT_GT(light, 0.5);
  EXPECT_NEAR(heavy / light, 1.0, 0.1);
  const auto sideways = [](double x) {  // speed of base_link across itself, in a turn in place [m/s]
    return driven(with(quiet(), [&](P& p) { p.payload = 8.0, p.payload_x = x; }), -0.4, 0.4, 2.0)
        .truth()
        .linear_velocity.y();
  };
  EXPECT_GT(sideways(-0.15), sideways(0.15) + 0.02) << "the robot turns about its heavy end";
}

// ---- sensors, commands, determinism

TEST(Plant, IgnoresCommandsThatAreNotFiniteAndBoundsOthers) {
  JackalPlant plant = plantOf(onBox(direct()));
  EXPECT_TRUE(plant.command({2.0, 2.0}));
  EXPECT_FALSE(plant.command({std::numeric_limits<double>::quiet_NaN(), 1.0}));
  EXPECT_FALSE(plant.command({1.0, -std::numeric_limits<double>::infinity()}));
  plant.step();
  EXPECT_EQ(plant.truth().acting_command, (WheelCommand{2.0, 2.0}));
  const JackalPlant huge = driven(quiet(), 1e300, -1e300, 2.0);
  EXPECT_LE(kWheelRadius * wheelSpeed(huge), 2.5 + 1e-6);
  EXPECT_TRUE(huge.truth().position.allFinite());
  EXPECT_LT(yawRate(huge), 0.0);
}

// ---- handling from outside

TEST(Plant, PushMovesTheRobotAndTurnsTheWheelsOfSoftMotors) {
  for (double torque_limit : {20.0, 0.3}) {
    JackalPlant plant = plantOf(with(quiet(), [&](P& p) { p.torque_limit = torque_limit; }));
    run(plant, 0.1);
    plant.push(150.0, 0.0, 0.0);
    run(plant, 0.5);
    EXPECT_GT(forward(plant), 0.5);
    EXPECT_EQ(wheelSpeed(plant) > 3.0, torque_limit < 1.0) << "hard motors slide";
    plant.push(0.0, 0.0, 0.0);
    run(plant, 10.0);
    EXPECT_NEAR(forward(plant), 0.0, 0.02);
  }
}

// ---- imperfections of a real robot

/// Keys without an effect while the key that enables them is off, and all others.
TEST(RealPlant, EveryKeyHasARepeatableEffectOnceItIsEnabled) {
  const auto recordedWith = [](const std::string& keys) {
    ParameterMap map;
    addYamlText("plant: {" + keys + "}", "keys", map);
    return recorded(plantOf(readParameters<P>(map, "plant")));
  };
  const std::vector<double> as_is = recorded(plantOf({}));
  for (const char* keys :
       {"roughness_length: 0.5", "ramp_start: 0.1", "patch_size: 0.2", "kerb_height: 0.5", "gyro_bias_time: 7.0",
        "vibration_time: 0.5", "payload_x: 0.1", "wheel_radius_left: 0.098, wheel_radius_right: 0.098"}) {
    EXPECT_EQ(recordedWith(keys), as_is) << keys;
  }
  std::istringstream enabled(
      "wheel_offset: 0.5; wheel_breakaway: 7.0; wheel_radius_left: 0.0965; wheel_radius_right: 0.095; battery_sag: "
      "0.2; battery_discharge: 0.2; payload: 5.0, payload_x: 0.1; payload: 5.0, payload_y: 0.1; payload: 5.0, "
      "payload_z: 0.1; roughness: 0.005; ramp: 5.0, ramp_start: 0.1; patch_friction: 0.3, patch_size: 0.1; "
      "kerb_distance: 0.25; imu_rate: 80.0; feedback_rate: 10.0; feedback_repeats: 0.5; gyro_bias: 0.01; vibration_x: "
      "1.0; vibration_gyro: 0.02; network_delay: 0.02");
  for (std::string keys; std::getline(enabled, keys, ';');) {
    const std::vector<double> changed = recordedWith(keys);
    EXPECT_NE(changed, as_is) << keys;
    EXPECT_EQ(recordedWith(keys), changed) << keys;
  }
}

TEST(RealPlant, TyresBatteryAndEncoderFilterChangeTheWheels) {
  JackalPlant tyre = plantOf(with(quiet(), [](P& p) { p.wheel_radius_left = 0.095; }));
  run(tyre, 0.1);
  EXPECT_NEAR(tyre.truth().linear_velocity.norm(), 0.0, 1e-3) << "stands from the start";
  tyre.command({5.0, 5.0});
  run(tyre, 2.0);
  EXPECT_GT(yawRate(tyre), 0.01) << "to the side of the smaller one";
  EXPECT_NEAR(forward(tyre), 5.0 * 0.0965, 0.005);

  JackalPlant battery = plantOf(with(onBox(), [](P& p) { p.battery_discharge = 10.0; }));
  battery.command({100.0, 100.0});
  run(battery, 18.0);
  EXPECT_NEAR(kWheelRadius * wheelSpeed(battery), 2.5 * 0.95, 0.01);

  JackalPlant filtered = plantOf(with(onBox(), [](P& p) { p.encoder_filter = 0.1; }));
  filtered.command({5.0, 5.0});
  run(filtered, 0.2);
  EXPECT_LT(filtered.measurement()->wheel_velocity[kFrontLeft], 0.8 * wheelSpeed(filtered));
  run(filtered, 2.0);
  EXPECT_NEAR(filtered.measurement()->wheel_velocity[kFrontLeft], 5.0, 1e-3);
}

TEST(RealPlant, RampIsClimbedAtItsInclination) {
  JackalPlant plant = plantOf(with(quiet(), [](P& p) { p.ramp = 10.0, p.ramp_start = 1.0, p.ramp_length = 2.0; }));
  const double on_ground = plant.truth().position.z();
  plant.command(rolling(0.5, 0.5));
  for (const auto& [seconds, degrees] : {std::pair(1.5, 0.0), std::pair(3.0, 10.0), std::pair(5.0, 0.0)}) {
    run(plant, seconds);
    const Eigen::Vector3d x = plant.truth().orientation * Eigen::Vector3d::UnitX();
    EXPECT_NEAR(std::atan2(x.z(), x.head<2>().norm()) / kDegree, degrees, 0.1);
    EXPECT_NEAR(nextMeasurement(plant).linear_acceleration.x(), kGravity * x.z(), 0.1);
  }
  EXPECT_NEAR(plant.truth().position.z() - on_ground, 2.0 * std::tan(10.0 * kDegree), 0.01);
}

TEST(RealPlant, KerbStopsTheRobotAndAThresholdIsDrivenOver) {
  const JackalPlant stopped =
      driven(with(quiet(), [](P& p) { p.kerb_distance = 0.7, p.kerb_height = 0.3, p.friction = 0.3; }), 0.3, 0.3, 4.0);
  EXPECT_NEAR(stopped.truth().position.x(), 0.7 - 0.131 - kWheelRadius, 0.03);
  EXPECT_NEAR(forward(stopped), 0.0, 0.03);
  EXPECT_GT(wheelSpeed(stopped, kRearLeft), 2.5);
  for (const double ramp : {0.0, -4.0, 4.0}) {
    const P parameters = with(quiet(), [&](P& p) {
      p.ramp = ramp, p.ramp_start = 0.5, p.ramp_length = 1.0, p.kerb_distance = 2.5, p.kerb_height = 0.015;
    });
    const double on_ground = plantOf(parameters).truth().position.z();
    const JackalPlant plant = driven(parameters, 0.5, 0.5, 8.0);
    EXPECT_GT(plant.truth().position.x(), 3.0) << ramp;
    EXPECT_NEAR(plant.truth().position.z(), on_ground + std::tan(ramp * kDegree) + 0.015, 1e-3) << ramp;
  }
}

TEST(RealPlant, ImuComesAtItsOwnRate) {
  JackalPlant plant = plantOf(with(quiet(), [](P& p) { p.imu_rate = 80.0; }));
  plant.command(rolling(0.1, 0.4));
  int inertial = 0, joints = 0, since_joints = 0;
  double newest = 0.0, by_imu = 0.0, by_pairs = 0.0, before = 0.0;
  for (int n = 0; n < 2000; ++n) {
    plant.step();
    if (plant.imuMeasurement()) {
      ++inertial;
      ++since_joints;
      newest = plant.imuMeasurement()->angular_velocity.z();
      by_imu += plant.imuMeasurement()->linear_acceleration.x() / 80.0;
    }
    if (!plant.measurement()) continue;
    ++joints;
    EXPECT_EQ(plant.measurement()->stamp, plant.time());
    EXPECT_EQ(plant.measurement()->angular_velocity.z(), newest);
    ASSERT_GT(since_joints, 0);
    by_pairs += plant.measurement()->linear_acceleration.x() * (plant.time() - before);
    before = plant.time();
    EXPECT_NEAR(by_pairs, by_imu, 0.03) << "no change of the speed gets lost";
    since_joints = 0;
  }
  EXPECT_EQ(inertial, 160);
  EXPECT_EQ(joints, 100);
}

}  // namespace
}  // namespace jackal_aic::sim
