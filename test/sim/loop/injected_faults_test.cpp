#include "injected_faults.hpp"

#include <gtest/gtest.h>

namespace jackal_aic::sim {
namespace {

/// A sample whose every number depends on its stamp.
PlantMeasurement sampleAt(double stamp) {
  PlantMeasurement sample;
  sample.stamp = stamp;
  sample.wheel_position = {stamp, 2.0 * stamp, stamp, 2.0 * stamp};
  sample.wheel_velocity = {1.0 + stamp, 2.0 + stamp, 1.0 + stamp, 2.0 + stamp};
  sample.wheel_effort = {0.1, 0.2, 0.3, 0.4};
  sample.angular_velocity = {0.01 + stamp, 0.02, 0.5 + stamp};
  sample.linear_acceleration = {0.3, -0.2, 9.81 + stamp};
  sample.orientation = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ());
  return sample;
}

TEST(InjectedFaults, FrozenEncoderRepeatsItsLastGoodSampleWithFreshStamps) {
  FaultInjector faults({{FaultKind::freeze, FaultChannel::left, 0.0, 2.0, 2.0}}, {});
  faults.falsified(sampleAt(1.0));
  for (double stamp : {2.0, 3.0}) {
    const PlantMeasurement sample = faults.falsified(sampleAt(stamp));
    EXPECT_EQ(sample.stamp, stamp);
    for (Wheel wheel : {kFrontLeft, kRearLeft}) {
      EXPECT_EQ(sample.wheel_velocity[wheel], 2.0);
      EXPECT_EQ(sample.wheel_position[wheel], 1.0);
    }
    EXPECT_EQ(sample.wheel_velocity[kFrontRight], 2.0 + stamp);
    EXPECT_EQ(sample.angular_velocity.z(), 0.5 + stamp);
  }
  EXPECT_EQ(faults.falsified(sampleAt(4.0)).wheel_velocity[kFrontLeft], 5.0);
}

TEST(InjectedFaults, ChannelReadsAValueAnOffsetOrItsLastSample) {
  FaultInjector value({{FaultKind::set, FaultChannel::right, -3.0}}, {});
  EXPECT_EQ(value.falsified(sampleAt(1.0)).wheel_velocity, (std::array<double, 4>{2.0, -3.0, 2.0, -3.0}));
  FaultInjector encoder({{FaultKind::bias, FaultChannel::left, 4.0}}, {});
  EXPECT_EQ(encoder.falsified(sampleAt(1.0)).wheel_velocity, (std::array<double, 4>{6.0, 3.0, 6.0, 3.0}));
  FaultInjector frozen({{FaultKind::freeze, FaultChannel::gyro, 0.0, 2.0}}, {});
  frozen.falsified(sampleAt(1.0));
  EXPECT_EQ(frozen.falsified(sampleAt(5.0)).angular_velocity, sampleAt(1.0).angular_velocity);
  FaultInjector gyro({{FaultKind::bias, FaultChannel::gyro, 0.2}}, {});
  EXPECT_DOUBLE_EQ(gyro.falsified(sampleAt(1.0)).angular_velocity.z(), 1.7);
  EXPECT_DOUBLE_EQ(gyro.falsified(sampleAt(1.0)).angular_velocity.x(), 1.01);
}

TEST(InjectedFaults, FlippedImuSeesGravityAndTheTurnUpsideDown) {
  FaultInjector faults({{FaultKind::upside_down, FaultChannel::all}}, {});
  const PlantMeasurement sample = faults.falsified(sampleAt(1.0));
  EXPECT_NEAR(sample.angular_velocity.z(), -1.5, 1e-12);
  EXPECT_NEAR(sample.angular_velocity.x(), 1.01, 1e-12);
  EXPECT_NEAR(sample.linear_acceleration.z(), -10.81, 1e-12);
  EXPECT_NEAR(sample.linear_acceleration.x(), 0.3, 1e-12);
  EXPECT_NEAR((sample.orientation * Eigen::Vector3d::UnitZ()).z(), -1.0, 1e-12);
}

}  // namespace
}  // namespace jackal_aic::sim
