#include "jackal_plant.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <thread>
#include <vector>

#include "ode_world.hpp"
#include "test_plant.hpp"

namespace jackal_aic::sim {
namespace {

JackalPlant plantOf(const PlantParameters& parameters) { return JackalPlant(jackalUrdf(), parameters); }

/// Everything a sample and the truth say, for comparisons to the bit.
std::vector<double> numbersOf(const JackalPlant& plant) {
  const PlantTruth& t = plant.truth();
  std::vector<double> numbers{t.time, t.acting_command.left, t.acting_command.right};
  const auto append = [&](const double* values, std::size_t n) { numbers.insert(numbers.end(), values, values + n); };
  append(t.position.data(), 3);
  append(t.orientation.coeffs().data(), 4);
  append(t.linear_velocity.data(), 3);
  append(t.angular_velocity.data(), 3);
  append(t.wheel_position.data(), 4);
  append(t.wheel_velocity.data(), 4);
  if (plant.measurement()) {
    const PlantMeasurement& m = *plant.measurement();
    append(m.wheel_velocity.data(), 4);
    append(m.wheel_effort.data(), 4);
    append(m.angular_velocity.data(), 3);
    append(m.linear_acceleration.data(), 3);
    append(m.orientation.coeffs().data(), 4);
  }
  return numbers;
}

/// A drive with forward motion and turns, recorded in every step.
class Recording {
 public:
  explicit Recording(const PlantParameters& parameters) : plant_(plantOf(parameters)) {}

  void step() {
    const int n = steps_++;
    if (n % 200 == 0) plant_.command(n % 400 == 0 ? rolling(0.5, 0.3) : rolling(-0.2, 0.6));
    plant_.step();
    for (double number : numbersOf(plant_)) numbers_.push_back(number);
  }

  void run(int steps) {
    for (int n = 0; n < steps; ++n) step();
  }

  void reset() {
    plant_.setFriction(0.1);
    plant_.reset();
    numbers_.clear();
    steps_ = 0;
  }

  const std::vector<double>& numbers() const { return numbers_; }

 private:
  JackalPlant plant_;
  int steps_ = 0;
  std::vector<double> numbers_;
};

bool sameBytes(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

/// Steady turn: yaw rate [rad/s] and the effective track (v_right - v_left) / yaw rate [m].
struct Turn {
  double yaw_rate;
  double effective_track;
  double forward;
};

Turn steadyTurn(JackalPlant& plant) {
  constexpr int kSteps = 1000;
  Turn mean{0.0, 0.0, 0.0};
  double difference = 0.0;
  for (int n = 0; n < kSteps; ++n) {
    plant.step();
    const PlantTruth& truth = plant.truth();
    mean.yaw_rate += truth.angular_velocity.z() / kSteps;
    mean.forward += truth.linear_velocity.x() / kSteps;
    difference += kWheelRadius * (truth.wheel_velocity[kFrontRight] - truth.wheel_velocity[kFrontLeft]) / kSteps;
  }
  mean.effective_track = difference / mean.yaw_rate;
  return mean;
}

Turn turnWith(double left, double right, double friction) {
  PlantParameters parameters = quiet();
  parameters.friction = friction;
  JackalPlant plant = plantOf(parameters);
  plant.command(rolling(left, right));
  run(plant, 2.0);
  return steadyTurn(plant);
}

// --- On the box -----------------------------------------------------------------------------------------------------

PlantParameters onBox(PlantParameters parameters = quiet()) {
  parameters.support = Support::box;
  return parameters;
}

TEST(PlantOnBox, FollowsDeadTimeAndLagExactly) {
  JackalPlant plant = plantOf(onBox());
  run(plant, 0.05);
  plant.command({5.0, -3.0});
  for (int n = 1; n <= 500; ++n) {
    plant.step();
    const double lagging = 1.0 - std::exp(-std::max(0.0, n * 0.001 - 0.11) / 0.035);
    const auto& speed = plant.truth().wheel_velocity;
    EXPECT_NEAR(speed[kFrontLeft], 5.0 * lagging, 1e-6);
    EXPECT_NEAR(speed[kRearLeft], 5.0 * lagging, 1e-6);
    EXPECT_NEAR(speed[kFrontRight], -3.0 * lagging, 1e-6);
    EXPECT_NEAR(speed[kRearRight], -3.0 * lagging, 1e-6);
  }
}

TEST(PlantOnBox, DeadTimeIsExactToTheStep) {
  for (const int steps : {0, 1, 37, 135}) {
    PlantParameters parameters = onBox();
    parameters.dead_time = 0.001 * steps;
    JackalPlant plant = plantOf(parameters);
    plant.command({5.0, 5.0});
    for (int n = 0; n < steps; ++n) plant.step();
    EXPECT_EQ(plant.truth().wheel_velocity[kFrontLeft], 0.0) << steps;
    plant.step();
    EXPECT_GT(plant.truth().wheel_velocity[kFrontLeft], 0.1) << steps;
    EXPECT_EQ(plant.truth().acting_command, (WheelCommand{5.0, 5.0}));
  }
}

TEST(PlantOnBox, WheelGainIsTheRatioOfTrueToCommandedSpeed) {
  PlantParameters parameters = onBox();
  parameters.wheel_gain = 0.8;
  parameters.velocity_loop_integral = 5.0;
  JackalPlant plant = plantOf(parameters);
  plant.command({10.0, -5.0});
  run(plant, 4.0);
  EXPECT_NEAR(plant.truth().wheel_velocity[kFrontLeft], 8.0, 1e-5);
  EXPECT_NEAR(plant.truth().wheel_velocity[kFrontRight], -4.0, 1e-5);
}

TEST(PlantOnGround, ASoftMotorGivesTorqueByTheErrorOfItsSpeed) {
  PlantParameters parameters = direct();
  parameters.velocity_loop_stiffness = 3.5;
  parameters.acceleration_limit = 0.1;  // is none of a soft motor's
  parameters.slope = 10.0;
  for (const double integral : {0.0, 8.0}) {
    parameters.velocity_loop_integral = integral;
    JackalPlant plant = plantOf(parameters);
    plant.command({5.0, 5.0});
    run(plant, 3.0);
    const double torque = nextMeasurement(plant).wheel_effort[kFrontLeft];
    EXPECT_GT(torque, 0.3) << "uphill";
    EXPECT_NEAR(5.0 - plant.truth().wheel_velocity[kFrontLeft], integral > 0.0 ? 0.0 : torque / 3.5, 1e-3);
  }
}

TEST(PlantOnGround, ASoftMotorHasATorqueLimitAndNoWindUp) {
  PlantParameters parameters = direct();
  parameters.velocity_loop_stiffness = 3.5;
  parameters.velocity_loop_integral = 8.0;
  parameters.torque_limit = 0.7;
  JackalPlant plant = plantOf(parameters);
  plant.command({10.0, 10.0});
  double largest = 0.0, fastest = 0.0;
  for (int n = 0; n < 100; ++n) {
    largest = std::max(largest, std::abs(nextMeasurement(plant).wheel_effort[kFrontLeft]));
    fastest = std::max(fastest, plant.truth().wheel_velocity[kFrontLeft]);
  }
  EXPECT_NEAR(largest, 0.7, 1e-3);
  EXPECT_LT(fastest, 1.1 * 10.0);
  EXPECT_NEAR(plant.truth().wheel_velocity[kFrontLeft], 10.0, 0.01);
}

TEST(PlantOnBox, RespectsTheAccelerationLimit) {
  PlantParameters parameters = onBox(direct());
  parameters.acceleration_limit = 2.0;
  JackalPlant plant = plantOf(parameters);
  plant.command(rolling(1.0, -1.0));
  run(plant, 0.25);
  EXPECT_NEAR(kWheelRadius * plant.truth().wheel_velocity[kFrontLeft], 0.5, 1e-6);
  EXPECT_NEAR(kWheelRadius * plant.truth().wheel_velocity[kFrontRight], -0.5, 1e-6);
}

TEST(PlantOnBox, TorqueLimitSetsTheAccelerationOfAFreeWheel) {
  PlantParameters parameters = onBox(direct());
  parameters.torque_limit = 0.1;
  parameters.acceleration_limit = 1000.0;
  JackalPlant plant = plantOf(parameters);
  plant.command({20.0, 20.0});
  const PlantMeasurement sample = nextMeasurement(plant);
  EXPECT_NEAR(sample.wheel_velocity[kFrontLeft], 0.1 / 0.0024 * 0.02, 1e-6);
  EXPECT_NEAR(sample.wheel_effort[kFrontLeft], 0.1, 1e-6);
  run(plant, 1.0);
  EXPECT_NEAR(plant.truth().wheel_velocity[kFrontLeft], 20.0, 1e-6);
}

TEST(PlantOnBox, ChassisStaysAndWheelsTurn) {
  JackalPlant plant = plantOf(onBox());
  const PlantTruth start = plant.truth();
  plant.command({5.0, 3.0});
  run(plant, 2.0);
  EXPECT_EQ(plant.truth().position, start.position);
  EXPECT_EQ(plant.truth().linear_velocity, Eigen::Vector3d::Zero());
  EXPECT_EQ(plant.truth().angular_velocity, Eigen::Vector3d::Zero());
  // The wheels lag by dead time plus lag, and angles count on past a revolution.
  EXPECT_NEAR(plant.truth().wheel_position[kFrontLeft], 5.0 * (2.0 - 0.145), 0.01);
  EXPECT_NEAR(plant.truth().wheel_position[kRearRight], 3.0 * (2.0 - 0.145), 0.01);
}

// --- On the ground --------------------------------------------------------------------------------------------------

TEST(PlantOnGround, RestsAtRest) {
  JackalPlant plant = plantOf(quiet());
  const Eigen::Vector3d start = plant.truth().position;
  for (int n = 0; n < 5000; ++n) {
    plant.step();
    ASSERT_LT(plant.truth().linear_velocity.norm(), 1e-5);
    ASSERT_LT(plant.truth().angular_velocity.norm(), 1e-5);
  }
  EXPECT_LT((plant.truth().position - start).norm(), 1e-7);
}

TEST(PlantOnGround, StandsOnItsWheels) {
  // base_link is the wheel radius less the axle's height above the ground; the tyres give by less than a millimetre.
  EXPECT_NEAR(plantOf(quiet()).truth().position.z(), kWheelRadius - 0.0345, 5e-4);
  EXPECT_EQ(plantOf(quiet()).truth().position.head<2>(), Eigen::Vector2d::Zero());
}

TEST(PlantOnGround, AccelerometerReadsGravityUpwards) {
  JackalPlant plant = plantOf(quiet());
  run(plant, 0.5);
  const Eigen::Vector3d force = nextMeasurement(plant).linear_acceleration;
  EXPECT_NEAR(force.z(), kGravity, 1e-3);
  EXPECT_NEAR(force.x(), 0.0, 2e-3);
  EXPECT_NEAR(force.y(), 0.0, 1e-3);
}

TEST(PlantOnGround, DrivesStraight) {
  JackalPlant plant = plantOf(quiet());
  plant.command(rolling(0.5, 0.5));
  run(plant, 4.0);
  const PlantTruth& truth = plant.truth();
  EXPECT_NEAR(truth.linear_velocity.x(), 0.5, 1e-4);
  EXPECT_NEAR(truth.linear_velocity.y(), 0.0, 1e-5);
  EXPECT_NEAR(truth.angular_velocity.z(), 0.0, 1e-5);
  EXPECT_NEAR(truth.position.x(), 0.5 * (4.0 - 0.145), 0.03);
  EXPECT_NEAR(truth.position.y(), 0.0, 1e-3);
}

/// The Jackal with its centre of mass in the middle and without products of inertia, which mirrors exactly.
std::string symmetricUrdf() {
  std::string urdf = jackalUrdfWith("xyz=\"0.012 0.002 0.067\"", "xyz=\"0 0 0.067\"");
  const std::string products = "ixy=\"-0.0008\" ixz=\"0.0164\" iyy=\"0.3922\" iyz=\"-0.0009\"";
  return urdf.replace(urdf.find(products), products.size(), "ixy=\"0\" ixz=\"0\" iyy=\"0.3922\" iyz=\"0\"");
}

TEST(PlantOnGround, MirrorsLeftAndRight) {
  JackalPlant a(symmetricUrdf(), quiet()), b(symmetricUrdf(), quiet());
  a.command(rolling(0.3, 0.6));
  b.command(rolling(0.6, 0.3));
  run(a, 2.0);
  run(b, 2.0);
  EXPECT_NEAR(a.truth().linear_velocity.x(), b.truth().linear_velocity.x(), 1e-5);
  EXPECT_NEAR(a.truth().linear_velocity.y(), -b.truth().linear_velocity.y(), 1e-5);
  EXPECT_NEAR(a.truth().angular_velocity.z(), -b.truth().angular_velocity.z(), 1e-5);
  EXPECT_GT(a.truth().angular_velocity.z(), 0.3);
  EXPECT_NEAR(a.truth().position.y(), -b.truth().position.y(), 1e-4);
}

TEST(PlantOnGround, MirrorsForwardAndBackward) {
  JackalPlant a(symmetricUrdf(), quiet()), b(symmetricUrdf(), quiet());
  a.command(rolling(0.3, 0.6));
  b.command(rolling(-0.3, -0.6));
  run(a, 2.0);
  run(b, 2.0);
  EXPECT_NEAR(a.truth().linear_velocity.x(), -b.truth().linear_velocity.x(), 1e-5);
  EXPECT_NEAR(a.truth().angular_velocity.z(), -b.truth().angular_velocity.z(), 1e-5);
}

TEST(PlantOnGround, AccelerometerAndGyroAgreeWithTheMotion) {
  // Steady arc to the left: the centripetal acceleration v x yaw rate points left.
  JackalPlant plant = plantOf(quiet());
  plant.command(rolling(0.4, 0.6));
  run(plant, 3.0);
  const PlantMeasurement sample = nextMeasurement(plant);
  const double v = plant.truth().linear_velocity.x(), yaw_rate = plant.truth().angular_velocity.z();
  EXPECT_GT(yaw_rate, 0.2);
  EXPECT_NEAR(sample.angular_velocity.z(), yaw_rate, 1e-9);
  EXPECT_NEAR(sample.linear_acceleration.y(), v * yaw_rate, 0.01);
}

TEST(PlantOnGround, AccelerometerIntegratesToTheSpeedAtAnyRate) {
  for (double rate : {1000.0, 50.0}) {
    PlantParameters parameters = quiet();
    parameters.sensor_rate = rate;
    parameters.motor_lag = 0.005;  // accelerates in bursts within a sample, which single values would miss
    JackalPlant plant = plantOf(parameters);
    double integral = 0.0;
    for (int n = 0; n < 2000; ++n) {
      if (n % 20 == 0) plant.command(rolling(0.0005 * n, 0.0005 * n));
      plant.step();
      if (!plant.measurement()) continue;
      const Eigen::Vector3d force = plant.measurement()->orientation * plant.measurement()->linear_acceleration;
      integral += force.x() / rate;
    }
    EXPECT_NEAR(integral, plant.truth().linear_velocity.x(), 3e-3) << rate << " Hz";
    EXPECT_GT(integral, 0.8);
  }
}

/// The Jackal with its IMU half a metre ahead of base_link, turned by an angle about x.
std::string urdfWithImuAhead(const std::string& roll) {
  const std::string joint = "<child link=\"imu_link\"/>\n    <origin xyz=";
  return jackalUrdfWith(joint + "\"0 0 0\" rpy=\"0 0 0\"/>", joint + "\"0.5 0 0\" rpy=\"" + roll + " 0 0\"/>");
}

TEST(PlantOnGround, AMountedImuSeesItsOwnPlace) {
  // Turned by 180 degrees about x, y and z change sign; the spot accelerates centripetally.
  JackalPlant turned(urdfWithImuAhead("3.141592653589793"), quiet()), plain(jackalUrdf(), quiet());
  for (JackalPlant* plant : {&turned, &plain}) {
    plant->command(rolling(-0.5, 0.5));
    run(*plant, 2.0);
  }
  const PlantMeasurement there = nextMeasurement(turned), here = nextMeasurement(plain);
  const double yaw_rate = here.angular_velocity.z();
  EXPECT_GT(yaw_rate, 1.0);
  EXPECT_NEAR(there.angular_velocity.z(), -yaw_rate, 1e-9);
  EXPECT_NEAR(there.linear_acceleration.z(), -kGravity, 0.05);
  EXPECT_NEAR(there.linear_acceleration.x() - here.linear_acceleration.x(), -yaw_rate * yaw_rate * 0.5, 0.02);
}

TEST(PlantOnGround, AMountedImuFeelsTheYawAcceleration) {
  PlantParameters parameters = quiet();
  parameters.sensor_rate = 1000.0;
  JackalPlant ahead(urdfWithImuAhead("0"), parameters), plain(jackalUrdf(), parameters);
  double sideways = 0.0;
  for (int n = 0; n < 180; ++n) {
    for (JackalPlant* plant : {&ahead, &plain}) {
      if (n == 0) plant->command(rolling(-0.5, 0.5));
      plant->step();
    }
    sideways += JackalPlant::kStep *
                (ahead.measurement()->linear_acceleration.y() - plain.measurement()->linear_acceleration.y());
  }
  EXPECT_GT(plain.truth().angular_velocity.z(), 0.5);
  EXPECT_NEAR(sideways, 0.5 * plain.truth().angular_velocity.z(), 0.01);
}

TEST(PlantOnGround, TrueVelocityIsTheDerivativeOfTheTruePose) {
  JackalPlant plant = plantOf(quiet());
  plant.command(rolling(-0.2, 0.8));
  run(plant, 1.0);
  for (int n = 0; n < 100; ++n) {
    const PlantTruth before = plant.truth();
    plant.step();
    const PlantTruth& after = plant.truth();
    const Eigen::Vector3d velocity = (after.position - before.position) / JackalPlant::kStep;
    ASSERT_LT((after.orientation * after.linear_velocity - velocity).norm(), 1e-3);
    const Eigen::AngleAxisd turn(before.orientation.conjugate() * after.orientation);
    ASSERT_NEAR(turn.angle() / JackalPlant::kStep, after.angular_velocity.norm(), 1e-3);
  }
}

TEST(PlantOnGround, WheelsSlipWhenTheyAccelerateBeyondFriction) {
  PlantParameters parameters = direct();
  parameters.friction = 0.25;
  JackalPlant plant = plantOf(parameters);
  plant.command(rolling(2.0, 2.0));
  run(plant, 0.4);
  // All wheels are driven, so friction can give mu g and no more; some of it spins the wheels up no longer.
  EXPECT_NEAR(plant.truth().linear_velocity.x(), 0.25 * kGravity * 0.4, 0.05);
  EXPECT_NEAR(kWheelRadius * plant.truth().wheel_velocity[kFrontLeft], 2.0, 1e-3);
}

// --- Turning --------------------------------------------------------------------------------------------------------

/// Coulomb friction in a turn in place: with wheels at (+-a, +-t/2) the slip that balances the moments makes the
/// effective track t (1 + (a / (t/2))^2), whatever friction and speed. The Jackal's centre of mass, off the middle,
/// takes a few per cent.
constexpr double kCoulombTrack = kTrack * (1.0 + 0.131 * 0.131 / (0.25 * kTrack * kTrack));

TEST(PlantInATurn, TurnsLeftWhenTheRightWheelsAreFaster) {
  const Turn turn = turnWith(-0.15, 0.15, 0.5);
  EXPECT_GT(turn.yaw_rate, 0.3);
  EXPECT_GT(turn.effective_track, 1.3 * kTrack);
  EXPECT_LT(turnWith(0.15, -0.15, 0.5).yaw_rate, -0.3);
}

TEST(PlantInATurn, SlipsAsCoulombFrictionAsks) {
  JackalPlant plant(symmetricUrdf(), quiet());
  plant.command(rolling(-0.15, 0.15));
  run(plant, 2.0);
  EXPECT_NEAR(steadyTurn(plant).effective_track, kCoulombTrack, 0.01 * kCoulombTrack);
}

TEST(PlantInATurn, TurnInPlaceDoesNotDependOnFrictionOrSpeed) {
  for (const double friction : {0.25, 0.5, 1.0}) {
    for (const double speed : {0.03, 0.15, 0.3}) {
      EXPECT_NEAR(turnWith(-speed, speed, friction).effective_track, 0.5475, 0.004) << friction << " " << speed;
    }
  }
}

TEST(PlantInATurn, SlipInAnArcDependsOnFriction) {
  // The centrifugal force uses up lateral friction, so that less of it brakes the turn.
  const Turn slippery = turnWith(0.3, 0.7, 0.25), grippy = turnWith(0.3, 0.7, 1.0);
  EXPECT_LT(slippery.effective_track, grippy.effective_track - 0.02);
  EXPECT_GT(slippery.yaw_rate, grippy.yaw_rate);
  EXPECT_NEAR(grippy.forward, 0.5, 0.01);
}

TEST(PlantInATurn, FrictionMayChangeOnTheWay) {
  PlantParameters parameters = quiet();
  parameters.friction = 1.0;
  JackalPlant plant = plantOf(parameters);
  plant.command(rolling(0.3, 0.7));
  run(plant, 2.0);
  const Turn before = steadyTurn(plant);
  plant.setFriction(0.25);
  run(plant, 1.0);
  const Turn after = steadyTurn(plant);
  EXPECT_LT(after.effective_track, before.effective_track - 0.05);
  EXPECT_NEAR(before.effective_track, turnWith(0.3, 0.7, 1.0).effective_track, 5e-3);
  EXPECT_NEAR(after.effective_track, turnWith(0.3, 0.7, 0.25).effective_track, 5e-3);
}

TEST(PlantInATurn, MotorsWorkAgainstTheSkid) {
  JackalPlant plant = plantOf(quiet());
  plant.command(rolling(-0.15, 0.15));
  run(plant, 2.0);
  const PlantMeasurement sample = nextMeasurement(plant);
  EXPECT_GT(sample.wheel_effort[kFrontRight], 0.5);
  EXPECT_LT(sample.wheel_effort[kFrontLeft], -0.5);
}

// --- Slope and load -------------------------------------------------------------------------------------------------

TEST(PlantOnSlope, StandsStillAndFeelsGravityAlongTheSlope) {
  PlantParameters parameters = quiet();
  parameters.slope = 10.0;
  JackalPlant plant = plantOf(parameters);
  run(plant, 2.0);
  EXPECT_LT(plant.truth().position.head<2>().norm(), 1e-6);
  const PlantMeasurement sample = nextMeasurement(plant);
  const double slope = 10.0 * M_PI / 180.0;
  EXPECT_NEAR(sample.linear_acceleration.x(), kGravity * std::sin(slope), 5e-3);
  EXPECT_NEAR(sample.linear_acceleration.z(), kGravity * std::cos(slope), 5e-3);
  // Accelerometer and attitude describe the same gravity.
  const Eigen::Vector3d level = sample.orientation * sample.linear_acceleration;
  EXPECT_NEAR(level.x(), 0.0, 1e-4);
  EXPECT_NEAR(level.z(), kGravity, 1e-4);
}

TEST(PlantOnSlope, ObservationIsFreeOfGravityAndSeesTheSpeedChange) {
  PlantParameters parameters = quiet();
  parameters.slope = 5.0;
  JackalPlant plant = plantOf(parameters);
  run(plant, 1.0);
  const PlantMeasurement rest = nextMeasurement(plant);
  ASSERT_GT(rest.linear_acceleration.x(), 0.8);
  EXPECT_NEAR(rest.observation().acceleration_x, 0.0, 1e-4);
  EXPECT_NEAR(rest.observation().acceleration_y, 0.0, 1e-4);
  EXPECT_EQ(rest.observation().acceleration_z, rest.linear_acceleration.z());

  plant.command(rolling(0.5, 0.5));
  double speed = 0.0, before = rest.stamp;
  while (plant.time() < 3.0) {
    const PlantMeasurement sample = nextMeasurement(plant);
    speed += (sample.stamp - before) * sample.observation().acceleration_x;
    before = sample.stamp;
  }
  EXPECT_NEAR(speed, plant.truth().linear_velocity.x(), 0.01);
}

TEST(PlantOnSlope, HoldsOnlyWithEnoughFriction) {
  PlantParameters parameters = quiet();
  parameters.slope = 20.0;
  parameters.friction = 0.3;  // less than tan(20 deg) = 0.364
  JackalPlant plant = plantOf(parameters);
  run(plant, 1.0);
  const double slope = 20.0 * M_PI / 180.0;
  const double slide = kGravity * (std::sin(slope) - 0.3 * std::cos(slope));
  EXPECT_NEAR(plant.truth().linear_velocity.x(), -slide, 0.02 * slide);
  plant.setFriction(0.5);
  run(plant, 2.0);
  EXPECT_NEAR(plant.truth().linear_velocity.x(), 0.0, 1e-4);
}

TEST(PlantOnSlope, DrivesUphillWithTheTorqueThatTakes) {
  PlantParameters parameters = quiet();
  parameters.slope = 10.0;
  parameters.payload = 8.0;
  JackalPlant plant = plantOf(parameters);
  plant.command(rolling(0.5, 0.5));
  run(plant, 3.0);
  EXPECT_NEAR(plant.truth().linear_velocity.x(), 0.5, 1e-4);
  double torque = 0.0;
  for (const double effort : nextMeasurement(plant).wheel_effort) torque += effort;
  const double mass = 16.523 + 4 * 0.477 + 8.0;
  EXPECT_NEAR(torque, mass * kGravity * std::sin(10.0 * M_PI / 180.0) * kWheelRadius, 0.05);
}

TEST(PlantWithPayload, SinksDeeperAndAcceleratesLessAtTheTorqueLimit) {
  PlantParameters parameters = direct();
  parameters.torque_limit = 0.5;
  JackalPlant light = plantOf(parameters);
  parameters.payload = 20.0;
  JackalPlant heavy = plantOf(parameters);
  EXPECT_LT(heavy.truth().position.z(), light.truth().position.z() - 1e-4);
  for (JackalPlant* plant : {&light, &heavy}) {
    plant->command(rolling(2.0, 2.0));
    run(*plant, 0.5);
  }
  // Four wheels at 0.5 N m push mass and the wheels' own inertia.
  const double push = 4 * 0.5 / kWheelRadius, wheels = 4 * 0.0024 / (kWheelRadius * kWheelRadius);
  const double mass = 16.523 + 4 * 0.477 + wheels;
  EXPECT_NEAR(light.truth().linear_velocity.x(), push / mass * 0.5, 0.01);
  EXPECT_NEAR(heavy.truth().linear_velocity.x(), push / (mass + 20.0) * 0.5, 0.01);
}

TEST(PlantWithPayload, HasTheInertiaOfItsLoad) {
  // Load and chassis of equal mass and spread double mass and inertia: friction turns both robots alike, but for the
  // wheels.
  PlantParameters parameters = direct();
  JackalPlant light = plantOf(parameters);
  parameters.payload = 16.523;
  JackalPlant heavy = plantOf(parameters);
  for (JackalPlant* plant : {&light, &heavy}) {
    plant->command(rolling(-2.0, 2.0));
    run(*plant, 0.1);
  }
  EXPECT_GT(light.truth().angular_velocity.z(), 0.5);
  EXPECT_NEAR(heavy.truth().angular_velocity.z() / light.truth().angular_velocity.z(), 1.0, 0.1);
}

// --- Sensors, commands, determinism ---------------------------------------------------------------------------------

TEST(Plant, SamplesAtTheSensorRateFromTimeZero) {
  JackalPlant plant = plantOf(quiet());
  ASSERT_TRUE(plant.measurement());
  EXPECT_EQ(plant.measurement()->stamp, 0.0);
  EXPECT_NEAR(plant.measurement()->linear_acceleration.z(), kGravity, 1e-3);
  for (int n = 1; n <= 100; ++n) {
    plant.step();
    EXPECT_EQ(plant.measurement().has_value(), n % 20 == 0) << n;
    EXPECT_NEAR(plant.time(), 0.001 * n, 1e-12);
  }
}

TEST(Plant, JitterMakesSamplesComeLateAndInOrder) {
  PlantParameters parameters = quiet();
  parameters.stamp_jitter = 0.009;
  JackalPlant plant = plantOf(parameters);
  std::vector<double> stamps{plant.measurement()->stamp};
  for (int n = 0; n < 1000; ++n) {
    plant.step();
    if (!plant.measurement()) continue;
    EXPECT_EQ(plant.measurement()->stamp, plant.time());
    stamps.push_back(plant.measurement()->stamp);
  }
  ASSERT_GE(stamps.size(), 50u);
  double shortest = 1.0, longest = 0.0;
  for (std::size_t k = 1; k < stamps.size(); ++k) {
    const double late = stamps[k] - static_cast<double>(k) / parameters.sensor_rate;
    EXPECT_GE(late, -1e-9);
    EXPECT_LE(late, 0.0101);
    shortest = std::min(shortest, stamps[k] - stamps[k - 1]);
    longest = std::max(longest, stamps[k] - stamps[k - 1]);
  }
  EXPECT_LT(shortest, 0.015);
  EXPECT_GT(longest, 0.025);
}

TEST(Plant, EncoderFilterLagsBehindTheWheel) {
  PlantParameters parameters = onBox();
  parameters.encoder_filter = 0.1;
  JackalPlant plant = plantOf(parameters);
  plant.command({5.0, 5.0});
  run(plant, 0.2);
  EXPECT_LT(plant.measurement()->wheel_velocity[kFrontLeft], 0.8 * plant.truth().wheel_velocity[kFrontLeft]);
  run(plant, 2.0);
  EXPECT_NEAR(plant.measurement()->wheel_velocity[kFrontLeft], 5.0, 1e-3);
}

TEST(Plant, IgnoresCommandsThatAreNotFinite) {
  PlantParameters parameters = onBox(direct());
  JackalPlant plant = plantOf(parameters);
  EXPECT_TRUE(plant.command({2.0, 2.0}));
  EXPECT_FALSE(plant.command({std::numeric_limits<double>::quiet_NaN(), 1.0}));
  EXPECT_FALSE(plant.command({1.0, -std::numeric_limits<double>::infinity()}));
  plant.step();
  EXPECT_EQ(plant.truth().acting_command, (WheelCommand{2.0, 2.0}));
}

TEST(Plant, SurvivesAHugeCommand) {
  JackalPlant plant = plantOf(quiet());
  EXPECT_TRUE(plant.command({1e300, -1e300}));
  run(plant, 2.0);
  EXPECT_LE(kWheelRadius * plant.truth().wheel_velocity[kFrontLeft], 2.5 + 1e-6);
  EXPECT_TRUE(plant.truth().position.allFinite());
  EXPECT_LT(plant.truth().angular_velocity.z(), 0.0);
}

TEST(Plant, RefusesAFrictionThatIsNone) {
  JackalPlant plant = plantOf(quiet());
  EXPECT_EQ(messageOf<ParameterError>([&] { plant.setFriction(-0.1); }), "friction = -0.1: must be 0 or more");
  EXPECT_THROW(plant.setFriction(std::numeric_limits<double>::quiet_NaN()), ParameterError);
}

TEST(Plant, EqualSeedsGiveEqualBytes) {
  Recording a(PlantParameters{}), b(PlantParameters{});
  a.run(1000);
  b.run(1000);
  EXPECT_TRUE(sameBytes(a.numbers(), b.numbers()));
  PlantParameters other;
  other.seed = 2;
  Recording c(other);
  c.run(1000);
  EXPECT_FALSE(sameBytes(a.numbers(), c.numbers()));
}

TEST(Plant, BlockedMotorStopsItsWheelsAndTurnsTheRobot) {
  JackalPlant plant = plantOf(quiet());
  plant.command(rolling(0.5, 0.5));
  run(plant, 2.0);
  plant.blockWheels(Side::left, true);
  run(plant, 0.3);
  for (Wheel wheel : {kFrontLeft, kRearLeft}) EXPECT_NEAR(plant.truth().wheel_velocity[wheel], 0.0, 1e-3);
  for (Wheel wheel : {kFrontRight, kRearRight})
    EXPECT_NEAR(plant.truth().wheel_velocity[wheel], 0.5 / kWheelRadius, 0.05);
  EXPECT_NEAR(nextMeasurement(plant).observation().wheel_left, 0.0, 1e-3);
  EXPECT_GT(plant.truth().angular_velocity.z(), 0.3);
  plant.blockWheels(Side::left, false);
  run(plant, 2.0);
  EXPECT_NEAR(plant.truth().wheel_velocity[kFrontLeft], 0.5 / kWheelRadius, 0.05);
  EXPECT_NEAR(plant.truth().angular_velocity.z(), 0.0, 0.02);
}

TEST(Plant, APushMovesTheRobotAndSoftMotorsLetTheWheelsTurn) {
  PlantParameters parameters = quiet();
  for (double torque_limit : {20.0, 0.3}) {
    parameters.torque_limit = torque_limit;
    JackalPlant plant = plantOf(parameters);
    run(plant, 0.1);
    plant.push(150.0, 0.0, 0.0);
    run(plant, 0.5);
    EXPECT_GT(plant.truth().linear_velocity.x(), 0.5);
    EXPECT_EQ(plant.truth().wheel_velocity[kFrontLeft] > 3.0, torque_limit < 1.0) << "hard motors slide";
    plant.push(0.0, 0.0, 0.0);
    run(plant, 10.0);
    EXPECT_NEAR(plant.truth().linear_velocity.x(), 0.0, 0.02);
  }
}

TEST(Plant, ALiftTakesTheWheelsOffTheGroundAndSetsThemDownAgain) {
  JackalPlant plant = plantOf(quiet());
  run(plant, 0.1);
  const double on_ground = plant.truth().position.z();
  plant.lift(true);
  run(plant, 2.0);
  EXPECT_NEAR(plant.truth().position.z(), on_ground + 0.3, 0.01);
  EXPECT_NEAR(plant.truth().angular_velocity.z(), 0.8, 1e-6);
  plant.lift(false);
  run(plant, 2.0);
  EXPECT_NEAR(plant.truth().position.z(), on_ground, 1e-3);
  EXPECT_NEAR(plant.truth().angular_velocity.norm(), 0.0, 1e-3);
  plant.command({5.0, 5.0});
  run(plant, 1.0);
  EXPECT_NEAR(plant.truth().linear_velocity.x(), 5.0 * kWheelRadius, 0.02) << "and drives on";
}

TEST(Plant, ResetLetsBlockedMotorsGo) {
  JackalPlant plant = plantOf(quiet());
  plant.blockWheels(Side::right, true);
  plant.reset();
  plant.command(rolling(0.5, 0.5));
  run(plant, 2.0);
  EXPECT_NEAR(plant.truth().wheel_velocity[kFrontRight], 0.5 / kWheelRadius, 0.01);
}

TEST(Plant, ResetRepeatsTheRun) {
  Recording recording{PlantParameters{}};
  recording.run(777);
  const std::vector<double> first = recording.numbers();
  recording.reset();
  recording.run(777);
  EXPECT_TRUE(sameBytes(first, recording.numbers()));
}

TEST(Plant, ResetIsAtRestAtTimeZero) {
  JackalPlant plant = plantOf(quiet());
  const std::vector<double> start = numbersOf(plant);
  plant.command(rolling(0.5, 1.0));
  run(plant, 1.0);
  plant.command(rolling(0.5, 1.0));
  plant.reset();
  EXPECT_TRUE(sameBytes(start, numbersOf(plant)));
  run(plant, 0.5);
  EXPECT_EQ(plant.truth().acting_command, WheelCommand{});
}

TEST(Plant, PlantsAreIndependent) {
  PlantParameters other;
  other.friction = 0.2;
  other.seed = 9;
  Recording alone{PlantParameters{}}, one{PlantParameters{}}, two{other};
  alone.run(600);
  for (int n = 0; n < 600; ++n) {
    one.step();
    two.step();
  }
  EXPECT_TRUE(sameBytes(alone.numbers(), one.numbers()));
  EXPECT_FALSE(sameBytes(alone.numbers(), two.numbers()));
}

TEST(Plant, RunsInSeveralThreads) {
  Recording alone{PlantParameters{}};
  alone.run(500);
  std::vector<std::vector<double>> results(4);
  std::vector<std::thread> threads;
  threads.reserve(results.size());
  for (auto& result : results) {
    threads.emplace_back([&result] {
      Recording recording{PlantParameters{}};
      recording.run(500);
      result = recording.numbers();
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& result : results) EXPECT_TRUE(sameBytes(alone.numbers(), result));
}

TEST(Plant, CanBeMoved) {
  JackalPlant plant = plantOf(quiet());
  plant.command(rolling(0.5, 0.5));
  JackalPlant moved = std::move(plant);
  run(moved, 2.0);
  EXPECT_NEAR(moved.truth().linear_velocity.x(), 0.5, 1e-3);
}

// --- What a real robot has beside
// -------------------------------------------------------------------------------------

/// Every step of a drive with one parameter changed.
template <class Change>
std::vector<double> drivenWith(Change change) {
  PlantParameters parameters;
  change(parameters);
  Recording recording(parameters);
  recording.run(800);
  return recording.numbers();
}

using P = PlantParameters;

/// Keys of which a value says nothing while the one that switches them is off.
TEST(RealPlant, WhatIsOffLeavesEveryByte) {
  const std::vector<double> as_is = drivenWith([](P&) {});
  EXPECT_TRUE(sameBytes(as_is, drivenWith([](P& p) { p.roughness_length = 0.5; })));
  EXPECT_TRUE(sameBytes(as_is, drivenWith([](P& p) { p.ramp_start = 0.1; })));
  EXPECT_TRUE(sameBytes(as_is, drivenWith([](P& p) { p.patch_size = 0.2; })));
  EXPECT_TRUE(sameBytes(as_is, drivenWith([](P& p) { p.kerb_height = 0.5; })));
  EXPECT_TRUE(sameBytes(as_is, drivenWith([](P& p) { p.push_force = 100.0; })));
  EXPECT_TRUE(sameBytes(as_is, drivenWith([](P& p) { p.gyro_bias_time = 7.0; })));
  EXPECT_TRUE(sameBytes(as_is, drivenWith([](P& p) { p.vibration_time = 0.5; })));
  EXPECT_TRUE(sameBytes(as_is, drivenWith([](P& p) { p.payload_x = 0.1; }))) << "without a payload";
  EXPECT_TRUE(sameBytes(as_is, drivenWith([](P& p) { p.wheel_radius_left = p.wheel_radius_right = kWheelRadius; })));
}

TEST(RealPlant, EveryKeyHasAnEffectThatTheSeedRepeats) {
  void (*const changes[])(P&) = {[](P& p) { p.wheel_offset = 0.5; },
                                 [](P& p) { p.wheel_breakaway = 7.0; },
                                 [](P& p) { p.wheel_radius_left = 0.0965; },
                                 [](P& p) { p.wheel_radius_right = 0.095; },
                                 [](P& p) { p.battery_sag = 0.2; },
                                 [](P& p) { p.battery_discharge = 0.2; },
                                 [](P& p) { p.payload = 5.0, p.payload_x = 0.1; },
                                 [](P& p) { p.payload = 5.0, p.payload_y = 0.1; },
                                 [](P& p) { p.payload = 5.0, p.payload_z = 0.1; },
                                 [](P& p) { p.roughness = 0.005; },
                                 [](P& p) { p.ramp = 5.0, p.ramp_start = 0.1; },
                                 [](P& p) { p.patch_friction = 0.3, p.patch_size = 0.1; },
                                 [](P& p) { p.kerb_distance = 0.25; },
                                 [](P& p) { p.push_force = 50.0, p.push_time = 0.1, p.push_duration = 0.1; },
                                 [](P& p) { p.lift_time = 0.1, p.lift_duration = 1.0; },
                                 [](P& p) { p.imu_rate = 80.0; },
                                 [](P& p) { p.feedback_rate = 10.0; },
                                 [](P& p) { p.feedback_repeats = 0.5; },
                                 [](P& p) { p.gyro_bias = 0.01; },
                                 [](P& p) { p.vibration_x = 1.0; },
                                 [](P& p) { p.vibration_gyro = 0.02; },
                                 [](P& p) { p.network_delay = 0.02; }};
  const std::vector<double> as_is = drivenWith([](P&) {});
  for (std::size_t i = 0; i < std::size(changes); ++i) {
    const std::vector<double> changed = drivenWith(changes[i]);
    EXPECT_FALSE(sameBytes(as_is, changed)) << i;
    EXPECT_TRUE(sameBytes(changed, drivenWith(changes[i]))) << i;
  }
}

TEST(RealPlant, WheelsTurnSlowerByTheOffset) {
  PlantParameters parameters = quiet();
  parameters.wheel_offset = 0.5;
  JackalPlant plant = plantOf(parameters);
  plant.command({0.45, 0.45});
  run(plant, 1.0);
  EXPECT_NEAR(plant.truth().position.x(), 0.0, 1e-4);
  plant.command({5.0, 5.0});
  run(plant, 2.0);
  EXPECT_NEAR(plant.truth().wheel_velocity[kFrontLeft], 4.5, 0.01);
}

TEST(RealPlant, ASmallerTyreTurnsTheRobotToItsSide) {
  PlantParameters parameters = quiet();
  parameters.wheel_radius_left = 0.095;
  JackalPlant plant = plantOf(parameters);
  run(plant, 0.1);
  EXPECT_NEAR(plant.truth().linear_velocity.norm(), 0.0, 1e-3) << "stands from the start";
  plant.command({5.0, 5.0});
  run(plant, 2.0);
  EXPECT_GT(plant.truth().angular_velocity.z(), 0.01);
  EXPECT_NEAR(plant.truth().linear_velocity.x(), 5.0 * 0.0965, 0.005);
}

TEST(RealPlant, AnEmptyingBatteryLowersTheTopSpeed) {
  PlantParameters parameters = onBox();
  parameters.battery_discharge = 10.0;
  JackalPlant plant = plantOf(parameters);
  plant.command({100.0, 100.0});
  run(plant, 18.0);
  EXPECT_NEAR(kWheelRadius * plant.truth().wheel_velocity[kFrontLeft], 2.5 * 0.95, 0.01);
}

TEST(RealPlant, ALoadBehindMakesTheWheelsBehindHoldTheTurn) {
  const auto sideways = [](double offset) {  // speed of base_link across itself, in a turn in place [m/s]
    PlantParameters parameters = quiet();
    parameters.payload = 8.0;
    parameters.payload_x = offset;
    JackalPlant plant = plantOf(parameters);
    plant.command(rolling(-0.4, 0.4));
    run(plant, 2.0);
    return plant.truth().linear_velocity.y();
  };
  EXPECT_GT(sideways(-0.15), sideways(0.15) + 0.02) << "the robot turns about its heavy end";
}

TEST(RealPlant, UnevenGroundTossesTheRobotOnceItHasLeftTheLevel) {
  PlantParameters parameters = quiet();
  parameters.roughness = 0.01;
  JackalPlant plant = plantOf(parameters);
  const double on_ground = plant.truth().position.z();
  run(plant, 0.2);
  EXPECT_LT(plant.truth().angular_velocity.norm(), 0.01);
  plant.command(rolling(0.8, 0.8));
  double tossed = 0.0;
  for (int n = 0; n < 6000; ++n) {
    plant.step();
    tossed = std::max(tossed, plant.truth().angular_velocity.head<2>().norm());
  }
  EXPECT_GT(tossed, 0.05);
  EXPECT_GT(plant.truth().position.x(), 3.0) << "and drives on";
  EXPECT_NEAR(plant.truth().position.z(), on_ground, 0.05);
}

TEST(RealPlant, ARampIsClimbedAtItsInclinationAndLeftAgain) {
  PlantParameters parameters = quiet();
  parameters.ramp = 10.0;
  parameters.ramp_start = 1.0;
  parameters.ramp_length = 2.0;
  JackalPlant plant = plantOf(parameters);
  const double on_ground = plant.truth().position.z();
  plant.command(rolling(0.5, 0.5));
  const auto climbed = [&plant] {
    const Eigen::Vector3d x = plant.truth().orientation * Eigen::Vector3d::UnitX();
    return std::atan2(x.z(), x.head<2>().norm()) * 57.29577951308232;
  };
  run(plant, 1.5);
  EXPECT_NEAR(climbed(), 0.0, 0.1);
  run(plant, 3.0);
  EXPECT_NEAR(climbed(), 10.0, 0.1);
  EXPECT_NEAR(nextMeasurement(plant).linear_acceleration.x(), kGravity * std::sin(climbed() / 57.29577951308232), 0.1);
  run(plant, 5.0);
  EXPECT_NEAR(climbed(), 0.0, 0.1);
  EXPECT_NEAR(plant.truth().position.z() - on_ground, 2.0 * std::tan(10.0 / 57.29577951308232), 0.01);
}

TEST(RealPlant, AKerbStopsTheRobotWhileItsWheelsTurn) {
  PlantParameters parameters = quiet();
  parameters.kerb_distance = 0.7;
  parameters.kerb_height = 0.3;
  parameters.friction = 0.3;
  JackalPlant plant = plantOf(parameters);
  plant.command(rolling(0.3, 0.3));
  run(plant, 4.0);
  EXPECT_NEAR(plant.truth().position.x(), 0.7 - 0.131 - kWheelRadius, 0.03);
  EXPECT_NEAR(plant.truth().linear_velocity.x(), 0.0, 0.03);
  EXPECT_GT(plant.truth().wheel_velocity[kRearLeft], 2.5);
}

TEST(RealPlant, AThresholdIsDrivenOver) {
  PlantParameters parameters = quiet();
  parameters.kerb_distance = 0.7;
  parameters.kerb_height = 0.015;
  JackalPlant plant = plantOf(parameters);
  const double on_ground = plant.truth().position.z();
  plant.command(rolling(0.5, 0.5));
  run(plant, 4.0);
  EXPECT_GT(plant.truth().position.x(), 1.2);
  EXPECT_NEAR(plant.truth().position.z(), on_ground + 0.015, 1e-3);
}

TEST(RealPlant, AThresholdBehindARampIsDrivenOver) {
  for (const double ramp : {-4.0, 4.0}) {
    PlantParameters parameters = quiet();
    parameters.ramp = ramp;
    parameters.ramp_start = 0.5;
    parameters.ramp_length = 1.0;
    parameters.kerb_distance = 2.5;
    parameters.kerb_height = 0.015;
    JackalPlant plant = plantOf(parameters);
    const double on_ground = plant.truth().position.z();
    plant.command(rolling(0.5, 0.5));
    run(plant, 8.0);
    EXPECT_GT(plant.truth().position.x(), 3.0) << ramp;
    const double risen = std::tan(ramp / 57.29577951308232) + 0.015;
    EXPECT_NEAR(plant.truth().position.z(), on_ground + risen, 1e-3) << ramp;
  }
}

/// Drives a robot with one turn after the other [rad/s of a track of 8 radii], each for some seconds.
void turnAside(const PlantParameters& parameters, double forward, std::initializer_list<double> turns,
               double duration) {
  JackalPlant plant = plantOf(parameters);
  for (const double turn : turns) {
    plant.command({forward / kWheelRadius - 4.0 * turn, forward / kWheelRadius + 4.0 * turn});
    run(plant, duration);
  }
}

/// A sill of a sixth of a millimetre, which a wheel that turns aside on it touches beside the ground in the same place.
TEST(RealPlant, OfAWheelThatSlidesOnTwoSurfacesTheForcesAreFound) {
  const long before = OdeWorld::unsolvedSteps();
  for (const double distance : {0.1, 0.25, 0.4}) {
    for (const double forward : {0.0, 0.3, 1.0}) {
      PlantParameters parameters = quiet();
      parameters.friction = 0.86;
      parameters.kerb_distance = distance;
      parameters.kerb_height = 1.6e-4;
      parameters.wheel_radius_right = 0.096;
      parameters.roughness = 0.003;
      turnAside(parameters, forward, {1.2, -1.2, 0.8}, 4.0);
    }
  }
  EXPECT_EQ(OdeWorld::unsolvedSteps() - before, 0);
}

/// Drives of which ODE leaves forces of one or two steps out, between the bounds of two contacts.
TEST(RealPlant, OfAWheelThatSlidesOnTwoSurfacesTheForcesAreFoundBeyondTheirBounds) {
  struct Drive {
    std::uint64_t seed;
    double friction, distance, height, radius, roughness, patch_friction, patch_size, payload, forward, turn;
  };
  const long before = OdeWorld::unsolvedSteps();
  for (const Drive& drive : {Drive{27, 0.50399989098559139, 0.13794651928761476, 0.00011670999770785369,
                                   0.097804616593671956, 0.0031283680795727688, 0.5587969937201962, 0.53292552906563895,
                                   2.9880022403140711, 1.0318602834439969, 0.18511430285921346},
                             Drive{29, 0.61248675660990304, 0.3960358545940238, 0.00014241605596259873,
                                   0.0969809956899996, 0.00074951431860168871, 0.56114328405365477, 2.3077585256969928,
                                   4.7515273754139713, 1.0065352906265794, 0.13928004943585717},
                             Drive{58, 0.69389751393672583, 0.29715937855050956, 0.00016274761775732113,
                                   0.095084808508194549, 0.00027187456887032028, 0.48794160698612804,
                                   2.0456688650772179, 4.0713064143430291, 0.63921273278943691, 0.44641035455376887}}) {
    PlantParameters parameters = quiet();
    parameters.seed = drive.seed;
    parameters.friction = drive.friction;
    parameters.kerb_distance = drive.distance;
    parameters.kerb_height = drive.height;
    parameters.wheel_radius_right = drive.radius;
    parameters.roughness = drive.roughness;
    parameters.patch_friction = drive.patch_friction;
    parameters.patch_size = drive.patch_size;
    parameters.payload = drive.payload;
    turnAside(parameters, drive.forward, {1.2 + drive.turn, -1.2 - drive.turn, 0.8 + drive.turn}, 3.0);
  }
  EXPECT_EQ(OdeWorld::unsolvedSteps() - before, 0);
}

TEST(RealPlant, SomebodyPushesAndLiftsByTheClock) {
  PlantParameters parameters = quiet();
  parameters.push_time = 1.0;
  parameters.push_duration = 0.3;
  parameters.push_force = 150.0;
  parameters.lift_time = 4.0;
  parameters.lift_duration = 2.0;
  JackalPlant plant = plantOf(parameters);
  run(plant, 0.99);
  EXPECT_NEAR(plant.truth().linear_velocity.x(), 0.0, 1e-3);
  run(plant, 0.31);
  EXPECT_GT(plant.truth().linear_velocity.x(), 0.3);
  run(plant, 2.5);
  EXPECT_NEAR(plant.truth().linear_velocity.x(), 0.0, 0.02);
  const double on_ground = plant.truth().position.z();
  run(plant, 2.0);
  EXPECT_NEAR(plant.truth().position.z(), on_ground + 0.3, 0.01);
  run(plant, 2.5);
  EXPECT_NEAR(plant.truth().position.z(), on_ground, 1e-3);
}

TEST(RealPlant, TheImuComesAtItsOwnRate) {
  PlantParameters parameters = quiet();
  parameters.imu_rate = 80.0;
  JackalPlant plant = plantOf(parameters);
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
    EXPECT_NEAR(by_pairs, by_imu, 0.03) << "what changes the speed does not get lost";
    since_joints = 0;
  }
  EXPECT_EQ(inertial, 160);
  EXPECT_EQ(joints, 100);
}

TEST(RealPlant, AnImuOfItsOwnRateIsLateAndLostAsJointStatesAre) {
  PlantParameters parameters = quiet();
  parameters.imu_rate = 80.0;
  parameters.measurement_loss = 0.1;
  parameters.stamp_jitter = 0.005;
  JackalPlant plant = plantOf(parameters);
  int came = 0;
  double latest = 0.0;
  for (int n = 0; n < 20000; ++n) {
    plant.step();
    if (!plant.imuMeasurement()) continue;
    ++came;
    const double sampled = std::floor(plant.imuMeasurement()->stamp * 80.0 + 1e-6) / 80.0;
    latest = std::max(latest, plant.imuMeasurement()->stamp - sampled);
  }
  EXPECT_NEAR(came, 0.9 * 1600, 40);
  EXPECT_GT(latest, 0.004);
  EXPECT_LT(latest, 0.007);
}

TEST(RealPlant, JointStatesRepeatTheNewestFeedback) {
  PlantParameters parameters = quiet();
  parameters.feedback_rate = 10.0;
  parameters.noise_scale = 1.0;
  JackalPlant plant = plantOf(parameters);
  plant.command(rolling(0.5, 0.5));
  std::vector<double> speeds, stamps;
  for (int n = 0; n < 50; ++n) {
    const PlantMeasurement sample = nextMeasurement(plant);
    speeds.push_back(sample.wheel_velocity[kFrontLeft]);
    stamps.push_back(sample.feedback_stamp);
    EXPECT_EQ(sample.stamp, plant.time());
    EXPECT_LT(sample.stamp - sample.feedback_stamp, 0.1);
  }
  EXPECT_EQ(std::unique(speeds.begin(), speeds.end()) - speeds.begin(), 11);
  EXPECT_EQ(std::unique(stamps.begin(), stamps.end()) - stamps.begin(), 11);
}

TEST(RealPlant, TheNetworkDelaysSensorsAndCommands) {
  PlantParameters parameters = onBox(direct());
  parameters.network_delay = 0.02;
  JackalPlant plant = plantOf(parameters);
  double oldest = 0.0, slowest = 0.0;
  int arrived = 0, underway = 0;
  double wanted = 0.0;
  for (int n = 0; n < 4000; ++n) {
    if (n % 100 == 0) {
      wanted = n % 200 == 0 ? 5.0 : -5.0;
      plant.command({wanted, wanted});
      underway = 0;
    }
    plant.step();
    ++underway;
    if (plant.truth().acting_command.left != wanted) slowest = std::max(slowest, 0.001 * underway);
    if (!plant.measurement()) continue;
    ++arrived;
    oldest = std::max(oldest, plant.time() - plant.measurement()->stamp);
  }
  EXPECT_GE(arrived, 198);
  EXPECT_GT(oldest, 0.015);
  EXPECT_LE(oldest, 0.021);
  EXPECT_GT(slowest, 0.012);
  EXPECT_LE(slowest, 0.021);
}

TEST(JackalPlant, MotorsThatChangeDoSoUntilReset) {
  JackalPlant plant(jackalUrdf(), direct());
  const auto speed = [&] {
    plant.command({5.0, 5.0});
    run(plant, 1.0);
    return plant.truth().wheel_velocity[kFrontLeft];
  };
  EXPECT_NEAR(speed(), 5.0, 0.01);
  plant.changeMotors(0.8, 0.5);
  EXPECT_NEAR(speed(), 0.8 * (5.0 - 0.5), 0.01);
  plant.reset();
  EXPECT_NEAR(speed(), 5.0, 0.01);
  EXPECT_THROW(plant.changeMotors(0.0, 0.0), ParameterError);
  EXPECT_THROW(plant.changeMotors(1.0, -1.0), ParameterError);
}

}  // namespace
}  // namespace jackal_aic::sim
