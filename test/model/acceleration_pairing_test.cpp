#include "jackal_aic/model/acceleration_pairing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace jackal_aic {
namespace {

constexpr double kImuPeriod = 0.0125;  // s
constexpr double kPeriod = 0.02;       // s

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
