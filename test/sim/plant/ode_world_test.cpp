// A step is solved along the tree of the robot's joints; ODE's own solver, which takes all of them at a time, has to
// come to the same.

#include "ode_world.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "test_plant.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kStep = 0.001;  // s

/// A world and the same with ODE's solver.
struct Pair {
  explicit Pair(const WorldParameters& parameters, const RobotModel& model = readRobotModel(jackalUrdf()))
      : ours(model, parameters), ode(model, byOde(parameters)) {}

  static WorldParameters byOde(WorldParameters parameters) {
    parameters.ode_solver = true;
    return parameters;
  }

  void step(double left, double right) {
    for (OdeWorld* world : {&ours, &ode}) {
      for (const Wheel wheel : {kFrontLeft, kRearLeft}) world->setWheelReference(wheel, left);
      for (const Wheel wheel : {kFrontRight, kRearRight}) world->setWheelReference(wheel, right);
      world->step(kStep);
    }
  }

  void expectTheSame(double tolerance, const std::string& when) const {
    const ChassisState a = ours.chassis(), b = ode.chassis();
    EXPECT_LT((a.position - b.position).norm(), tolerance) << when;
    EXPECT_LT(a.orientation.angularDistance(b.orientation), tolerance) << when;
    EXPECT_LT((a.velocity - b.velocity).norm(), tolerance) << when;
    EXPECT_LT((a.angular_velocity - b.angular_velocity).norm(), tolerance) << when;
    for (std::size_t wheel = 0; wheel < 4; ++wheel) {
      EXPECT_NEAR(ours.wheelSpeed(wheel), ode.wheelSpeed(wheel), tolerance) << when;
      // Four wheels that stick share a load as the rounding of their positions has it.
      EXPECT_NEAR(ours.wheelTorque(wheel), ode.wheelTorque(wheel), 0.1) << when;
    }
  }

  OdeWorld ours, ode;
};

/// Starts, a turn, reverse, a turn in place and a stop, within the motors' limits or beyond them.
void drive(Pair& pair, double acceleration, double tolerance) {
  const double references[][2] = {{5.0, 5.0}, {2.0, 8.0}, {-4.0, -4.0}, {-6.0, 6.0}, {0.0, 0.0}};
  double left = 0.0, right = 0.0;
  for (const auto& [wanted_left, wanted_right] : references) {
    for (int k = 0; k < 600; ++k) {
      left += std::clamp(wanted_left - left, -acceleration * kStep, acceleration * kStep);
      right += std::clamp(wanted_right - right, -acceleration * kStep, acceleration * kStep);
      pair.step(left, right);
      pair.expectTheSame(tolerance, std::to_string(wanted_left) + ", " + std::to_string(k));
      if (testing::Test::HasFailure()) return;
    }
  }
}

TEST(OdeWorld, MovesAsWithOdesOwnSolver) {
  struct {
    WorldParameters parameters;
    double acceleration;  // of the references [rad/s^2]
  } rows[4] = {{{}, 20.0}, {{}, 500.0}, {{}, 50.0}, {{}, 500.0}};
  rows[1].parameters.friction = 0.25;  // the tyres skid, the motors are at their limit
  rows[1].parameters.torque_limit = 4.0;
  rows[1].parameters.stiffness = 5.0;
  rows[2].parameters.slope = 0.15;  // uphill on rough ground
  rows[2].parameters.terrain.roughness = 0.005;
  rows[2].parameters.terrain.roughness_length = 0.3;
  rows[3].parameters.fixed_chassis = true;
  rows[3].parameters.torque_limit = 0.05;
  for (const auto& row : rows) {
    Pair pair(row.parameters);
    drive(pair, row.acceleration, row.parameters.fixed_chassis ? 1e-9 : 1e-7);
    if (&row == rows) {
      EXPECT_GT(pair.ours.chassis().position.head<2>().norm(), 0.1);
    }
  }
  RobotModel unbalanced = readRobotModel(jackalUrdf());
  for (WheelModel& wheel : unbalanced.wheels) wheel.body.centre += Eigen::Vector3d(0.004, 0.01, -0.003);
  Pair pair({}, unbalanced);
  drive(pair, 50.0, 1e-7);
}

TEST(OdeWorld, IsPushedLiftedAndSetDownAsWithOdesOwnSolver) {
  Pair pair({});
  for (int k = 0; k < 3000; ++k) {
    for (OdeWorld* world : {&pair.ours, &pair.ode}) {
      world->push({k > 100 && k < 500 ? 60.0 : 0.0, 0.0, 0.0}, k > 300 && k < 600 ? 20.0 : 0.0);
      world->lift(k > 1000 && k < 1500);
    }
    pair.step(3.0, 3.0);
    pair.expectTheSame(1e-7, std::to_string(k));
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace jackal_aic::sim
