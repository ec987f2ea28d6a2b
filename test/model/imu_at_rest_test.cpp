#include "jackal_aic/model/imu_at_rest.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "jackal_aic/model/gravity.hpp"

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s

/// A sample of a robot that rests. @param force specific force along x, y, z [m/s^2].
Observation sample(double yaw_rate, const Eigen::Vector3d& force) {
  return {0.0, yaw_rate, 0.0, 0.0, force.x(), force.y(), force.z()};
}

/// The last of some samples, calibrated. @param at_rest the motors have no command.
Observation after(ImuAtRest& imu, double seconds, const Observation& y, bool at_rest = true) {
  Observation calibrated;
  for (double t = 0.0; t < seconds; t += kPeriod) {
    imu.advance(at_rest, kPeriod);
    calibrated = y;
    imu.calibrate(calibrated, kPeriod);
  }
  return calibrated;
}

const Eigen::Vector3d kUpright(0.0, 0.0, kGravity);

TEST(ImuAtRest, LearnsTheBiasOfTheGyroWithinASecond) {
  ImuAtRest imu;
  EXPECT_NEAR(after(imu, 1.0, sample(0.03, kUpright)).yaw_rate, 0.0, 1e-9);
  EXPECT_NEAR(after(imu, 1.0, sample(0.53, kUpright), false).yaw_rate, 0.5, 1e-9) << "it stays on the move";
}

TEST(ImuAtRest, MovingRobotHasNoBias) {
  ImuAtRest driven, pushed, turned;
  after(driven, 2.0, sample(0.03, kUpright), false);
  EXPECT_EQ(driven.withoutBias(0.03), 0.03);
  Observation rolling = sample(0.03, kUpright);
  rolling.wheel_left = 1.0;
  after(pushed, 2.0, rolling);
  EXPECT_EQ(pushed.withoutBias(0.03), 0.03);
  after(turned, 2.0, sample(0.3, kUpright));
  EXPECT_EQ(turned.withoutBias(0.3), 0.3);
}

TEST(ImuAtRest, AccelerometerCountsAfterItHasReadGravity) {
  const struct {
    const char* what;
    Eigen::Vector3d force;
    bool counts;
  } rows[] = {{"upright", kUpright, true},
              {"upside down, which the fault detection reports", -kUpright, true},
              {"ten percent off", 1.1 * kUpright, true},
              {"on a slope of 20 degrees", {3.36, 0.0, 9.22}, true},
              {"absent", {0.0, 0.0, 0.0}, false},
              {"in g", kUpright / kGravity, false},
              {"at half", 0.5 * kUpright, false},
              {"on its side", {kGravity, 0.0, 0.0}, false}};
  for (const auto& row : rows) {
    ImuAtRest imu;
    const Observation y = sample(0.0, row.force);
    EXPECT_FALSE(imu.accelerometerCounts(y)) << row.what << ": it has read nothing yet";
    EXPECT_EQ(after(imu, 1.0, y).valid.acceleration, row.counts) << row.what;
    EXPECT_EQ(imu.accelerometerCounts(y), row.counts) << row.what;
    EXPECT_EQ(imu.accelerometerWrong(), !row.counts) << row.what;
  }
  ImuAtRest imu;
  Observation no_vertical_axis = sample(0.0, kUpright);
  no_vertical_axis.acceleration_z.reset();
  EXPECT_TRUE(after(imu, 1.0, no_vertical_axis).valid.acceleration);
  EXPECT_TRUE(imu.accelerometerCounts(no_vertical_axis));
}

TEST(GravityReaction, FollowsTheTiltAndNotTheYaw) {
  const Eigen::Quaterniond nose_up(Eigen::AngleAxisd(-0.1, Eigen::Vector3d::UnitY()));
  const Eigen::Vector3d expected(kGravity * std::sin(0.1), 0.0, kGravity * std::cos(0.1));
  EXPECT_TRUE(gravityReaction(nose_up).isApprox(expected, 1e-12));
  const Eigen::Quaterniond tilted(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1.0, -2.0, 0.0).normalized()));
  const Eigen::Quaterniond turned = Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitZ()) * tilted;
  EXPECT_TRUE(gravityReaction(turned).isApprox(gravityReaction(tilted)));
}

TEST(UnitAttitude, TakesRoundedQuaternionsAndRefusesOthers) {
  const auto rounded = unitAttitude({0.9239, 0.3827, 0.0, 0.0});
  ASSERT_TRUE(rounded);
  EXPECT_NEAR(rounded->norm(), 1.0, 1e-15);
  for (const double w : {0.0, 2.0, 1e200, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_FALSE(unitAttitude({w, 0.0, 0.0, 0.0})) << w;
  }
}

}  // namespace
}  // namespace jackal_aic
