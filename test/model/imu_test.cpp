#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "jackal_aic/model/acceleration_pairing.hpp"
#include "jackal_aic/model/gravity.hpp"
#include "jackal_aic/model/imu_at_rest.hpp"

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
  for (const double yaw : {0.0, 1.2}) {
    EXPECT_TRUE(gravityReaction(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * nose_up).isApprox(expected, 1e-12));
  }
}

TEST(UnitAttitude, TakesRoundedQuaternionsAndRefusesOthers) {
  const auto rounded = unitAttitude({0.9239, 0.3827, 0.0, 0.0});
  ASSERT_TRUE(rounded);
  EXPECT_NEAR(rounded->norm(), 1.0, 1e-15);
  for (const double w : {0.0, 2.0, 1e200, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_FALSE(unitAttitude({w, 0.0, 0.0, 0.0})) << w;
  }
}

constexpr double kImuPeriod = 0.0125;  // s

/// An IMU of 80 Hz over a network of up to 20 ms, and joint states of 50 Hz whose stamps are up to 5 ms late.
/// @returns the largest difference of the change of velocity by the pairs from that by the IMU [m/s].
double largestDifference(const std::function<double(int)>& acceleration, double from) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> delay(0.0, 0.02), jitter(0.0, 0.005);
  AccelerationPairing pairing;
  double by_imu = 0.0, by_pairs = 0.0, before = 0.0, largest = 0.0, arrival = 0.0;
  int sample = 1;
  double arrives = kImuPeriod + delay(random);
  for (int i = 1; i < 500; ++i) {
    const double stamp = i * kPeriod + jitter(random);
    arrival = stamp + delay(random);
    for (; arrives <= arrival; ++sample, arrives = std::max(arrives, sample * kImuPeriod + delay(random))) {
      pairing.add({acceleration(sample), 0.0, 9.81}, sample * kImuPeriod);
      by_imu += kImuPeriod * acceleration(sample);
    }
    if (sample == 1) continue;
    by_pairs += pairing.take(stamp).x() * (stamp - before);
    before = stamp;
    if (stamp > from) largest = std::max(largest, std::abs(by_pairs - by_imu));
  }
  return largest;
}

TEST(AccelerationPairing, CollisionKeepsItsChangeOfVelocity) {
  // 0.5 m/s within two samples, in any place
  for (int place = 200; place < 240; ++place) {
    const auto collision = [place](int i) { return i == place || i == place + 1 ? -20.0 : 0.0; };
    EXPECT_LT(largestDifference(collision, 0.0), 0.1) << place;
  }
}

TEST(AccelerationPairing, SteadyAccelerationIsUnchanged) {
  AccelerationPairing pairing;
  for (int i = 0; i < 100; ++i) {
    pairing.add({1.5, -0.5, 9.81}, i * kImuPeriod);
    if (i % 3 != 0) continue;
    const Eigen::Vector3d paired = pairing.take(0.001 * (i % 7) + i * kImuPeriod);
    EXPECT_EQ(paired, Eigen::Vector3d(1.5, -0.5, 9.81)) << "unchanged, so that a frozen source stays one";
  }
}

/// After a stall of the process, five samples of the IMU and then five of the wheels.
TEST(AccelerationPairing, SamplesOfABurstArePairedByTheirStamps) {
  constexpr int kStall = 5;
  const auto acceleration = [](int i) { return i < 50 ? 0.0 : 1.5; };
  AccelerationPairing pairing;
  for (int i = 0; i < 100; i += kStall) {
    for (int k = i; k < i + kStall; ++k) pairing.add({acceleration(k), 0.0, 9.81 + 0.01 * (k % 2)}, k * kPeriod);
    Eigen::Vector3d last = Eigen::Vector3d::Zero();
    for (int k = i; k < i + kStall; ++k) {
      const Eigen::Vector3d paired = pairing.take(k * kPeriod);
      EXPECT_GE(paired.x(), -0.1) << k;
      EXPECT_LE(paired.x(), 2.0 * 1.5 + 0.1) << k << ": the acceleration of all of them at once";
      if (k > i && k < i + kStall - 1) {
        EXPECT_NE(paired.z(), last.z()) << k << ": as if the source were frozen";
      }
      last = paired;
    }
  }
}

TEST(AccelerationPairing, WithoutAnImuSampleTheUsualAccelerationGoesOn) {
  AccelerationPairing pairing;
  for (int i = 0; i < 100; ++i) {
    pairing.add({i % 2 == 0 ? 1.1 : 0.9, 0.0, 9.81}, i * kPeriod);
    pairing.take(i * kPeriod);
  }
  EXPECT_NEAR(pairing.take(100 * kPeriod).x(), 1.0, 0.02);
}

}  // namespace
}  // namespace jackal_aic
