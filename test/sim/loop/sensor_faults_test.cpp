#include "sensor_faults.hpp"

#include <gtest/gtest.h>

namespace jackal_aic::sim {
namespace {

constexpr double kEver = 1e9;  // s

SensorFault faultOf(FaultKind kind, FaultChannel channel, double amount = 0.0, double start = 0.0,
                    double duration = kEver) {
  return {kind, channel, amount, start, duration};
}

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

TEST(SensorFaults, FrozenEncoderRepeatsItsLastGoodSampleWithFreshStamps) {
  SensorFaults faults({faultOf(FaultKind::freeze, FaultChannel::left, 0.0, 2.0, 2.0)});
  faults.apply(sampleAt(1.0));
  for (double stamp : {2.0, 3.0}) {
    const PlantMeasurement sample = faults.apply(sampleAt(stamp));
    EXPECT_EQ(sample.stamp, stamp);
    for (Wheel wheel : {kFrontLeft, kRearLeft}) {
      EXPECT_EQ(sample.wheel_velocity[wheel], 2.0);
      EXPECT_EQ(sample.wheel_position[wheel], 1.0);
    }
    EXPECT_EQ(sample.wheel_velocity[kFrontRight], 2.0 + stamp);
    EXPECT_EQ(sample.angular_velocity.z(), 0.5 + stamp);
  }
  EXPECT_EQ(faults.apply(sampleAt(4.0)).wheel_velocity[kFrontLeft], 5.0);
}

TEST(SensorFaults, ChannelReadsAValueAnOffsetOrItsLastSample) {
  SensorFaults value({faultOf(FaultKind::set, FaultChannel::right, -3.0)});
  EXPECT_EQ(value.apply(sampleAt(1.0)).wheel_velocity, (std::array<double, 4>{2.0, -3.0, 2.0, -3.0}));
  SensorFaults encoder({faultOf(FaultKind::bias, FaultChannel::left, 4.0)});
  EXPECT_EQ(encoder.apply(sampleAt(1.0)).wheel_velocity, (std::array<double, 4>{6.0, 3.0, 6.0, 3.0}));
  SensorFaults frozen({faultOf(FaultKind::freeze, FaultChannel::gyro, 0.0, 2.0)});
  frozen.apply(sampleAt(1.0));
  EXPECT_EQ(frozen.apply(sampleAt(5.0)).angular_velocity, sampleAt(1.0).angular_velocity);
  SensorFaults gyro({faultOf(FaultKind::bias, FaultChannel::gyro, 0.2)});
  EXPECT_DOUBLE_EQ(gyro.apply(sampleAt(1.0)).angular_velocity.z(), 1.7);
  EXPECT_DOUBLE_EQ(gyro.apply(sampleAt(1.0)).angular_velocity.x(), 1.01);
}

TEST(SensorFaults, FlippedImuSeesGravityAndTheTurnUpsideDown) {
  SensorFaults faults({faultOf(FaultKind::upside_down, FaultChannel::all)});
  const PlantMeasurement sample = faults.apply(sampleAt(1.0));
  EXPECT_NEAR(sample.angular_velocity.z(), -1.5, 1e-12);
  EXPECT_NEAR(sample.angular_velocity.x(), 1.01, 1e-12);
  EXPECT_NEAR(sample.linear_acceleration.z(), -10.81, 1e-12);
  EXPECT_NEAR(sample.linear_acceleration.x(), 0.3, 1e-12);
  EXPECT_NEAR((sample.orientation * Eigen::Vector3d::UnitZ()).z(), -1.0, 1e-12);
}

}  // namespace
}  // namespace jackal_aic::sim
