// Wheel speeds and IMU samples on their way to one observation; no master.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "inputs/sensors.hpp"

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s

class SensorPairingTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { ros::Time::init(); }  // for warnings, which are limited in rate

  SensorPairingTest()
      : sensors_(RobotNames{}, frames_,
                 [this](const Observation& observation, const ros::Time&) { observations_.push_back(observation); }) {}

  static boost::shared_ptr<sensor_msgs::JointState> wheels(double stamp, double speed = 1.0) {
    auto message = boost::make_shared<sensor_msgs::JointState>();
    message->header.stamp = ros::Time(stamp);
    message->name = {"front_left_wheel", "front_right_wheel"};
    message->velocity = {speed, 2.0 * speed};
    return message;
  }

  static boost::shared_ptr<sensor_msgs::Imu> imu(double stamp, double acceleration = 0.0) {
    auto message = boost::make_shared<sensor_msgs::Imu>();
    message->header.stamp = ros::Time(stamp);
    message->header.frame_id = "base_link";
    message->angular_velocity.z = 0.5;
    message->linear_acceleration.x = acceleration;
    return message;
  }

  bool addWheels(double stamp, double now, double speed = 1.0) {
    return sensors_.addWheels(wheels(stamp, speed), ros::Time(now)).has_value();
  }

  bool addImu(double stamp, double now, double acceleration = 0.0) {
    return sensors_.addImu(imu(stamp, acceleration), ros::Time(now)).has_value();
  }

  /// Pairs of samples at 50 Hz from a time on.
  void addPairs(double from, int count) {
    for (int i = 0; i < count; ++i) {
      const double now = from + i * kPeriod;
      EXPECT_TRUE(addWheels(now, now));
      EXPECT_TRUE(addImu(now, now));
    }
  }

  tf2::BufferCore frames_;
  std::vector<Observation> observations_;
  SensorPairing sensors_;
};

/// An IMU on its side, its y axis down, on a mount that stands upright.
TEST(RotationInto, RelatesFramesOverOthers) {
  tf2::BufferCore frames;
  EXPECT_FALSE(rotationInto("base_link", "imu_link", frames));
  const auto relate = [&](const char* parent, const char* child, double half_turn) {
    geometry_msgs::TransformStamped transform;
    transform.header.frame_id = parent;
    transform.child_frame_id = child;
    transform.transform.rotation.w = std::cos(half_turn);
    transform.transform.rotation.x = std::sin(half_turn);
    frames.setTransform(transform, "", true);
  };
  relate("base_link", "mount", 0.0);
  relate("mount", "imu_link", -M_PI_4);
  for (const char* imu : {"imu_link", "/imu_link"}) {  // the slash is that of older drivers
    const auto rotation = rotationInto("base_link", imu, frames);
    ASSERT_TRUE(rotation) << imu;
    EXPECT_NEAR((*rotation * Eigen::Vector3d::UnitY()).z(), -1.0, 1e-12);
  }
  EXPECT_TRUE(rotationInto("base_link", "/base_link", frames)) << "needs no transform";
  EXPECT_FALSE(rotationInto("base_link", "", frames)) << "no frame";
}

TEST_F(SensorPairingTest, WheelSpeedsMayRepeatOnlyWithoutPositions) {
  const auto message = wheels(10.0);
  EXPECT_TRUE(sensors_.addWheels(message, ros::Time(10.0))->may_repeat);
  message->position = {3.0, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_TRUE(sensors_.addWheels(message, ros::Time(10.0))->may_repeat) << "half of them are none";
  message->position = {3.0, 3.0};
  EXPECT_FALSE(sensors_.addWheels(message, ros::Time(10.0))->may_repeat);
}

TEST_F(SensorPairingTest, AnAbsentSensorOfTheImuIsNotValid) {
  for (const bool gyro : {true, false}) {
    const auto message = imu(10.0);
    (gyro ? message->angular_velocity_covariance : message->linear_acceleration_covariance)[0] = -1.0;  // REP 145
    SensorPairing sensors(RobotNames{}, frames_, [](const Observation&, const ros::Time&) {});
    const ChannelValidity valid = sensors.addImu(message, ros::Time(10.0))->observation.valid;
    EXPECT_EQ(valid.yaw_rate, !gyro);
    EXPECT_EQ(valid.acceleration, gyro);
  }
}

/// The frame of a message is anybody's text, and the reason goes into the log.
TEST_F(SensorPairingTest, ARefusedFrameIsNamedInOneShortLine) {
  const auto message = imu(10.0);
  message->header.frame_id = "\n\x1b[31m[FATAL] forged" + std::string(100000, 'x');
  EXPECT_FALSE(sensors_.addImu(message, ros::Time(10.0)));
  const std::string& refusal = sensors_.lastRefusal();
  EXPECT_EQ(refusal.rfind("IMU data in frame '", 0), 0u) << refusal;
  EXPECT_LT(refusal.size(), 200u);
  EXPECT_EQ(refusal.find_first_of("\n\x1b"), std::string::npos) << refusal;
}

/// An IMU of twice the rate: what happens between two pairs is in the second of them.
TEST_F(SensorPairingTest, NoAccelerationFallsBetweenTwoPairs) {
  double sum = 0.0;
  for (int i = 0; i < 20; ++i) {
    const double now = 10.0 + 0.5 * i * kPeriod;
    EXPECT_TRUE(addImu(now, now, i == 9 ? -40.0 : 0.0));
    if (i % 2 == 0) {
      EXPECT_TRUE(addWheels(now, now));
    }
  }
  ASSERT_GE(observations_.size(), 8u);
  for (const Observation& observation : observations_) sum += observation.acceleration_x;
  EXPECT_NEAR(sum, -20.0, 1e-9) << "the change of the speed stays";
}

TEST_F(SensorPairingTest, PairsCloseStampsAtOnceWithoutAWarning) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  for (int i = 0; i < 20; ++i) {
    const double now = 10.0 + i * kPeriod;
    const double soon = now + 0.001 * (2 + i % 8);  // what a busy robot does
    EXPECT_TRUE(addWheels(now, now));
    EXPECT_TRUE(addWheels(soon, soon));
    EXPECT_TRUE(addImu(now + 0.003, now + 0.01));
    EXPECT_TRUE(addImu(soon + 0.004, now + 0.015));
    EXPECT_EQ(observations_.size(), static_cast<std::size_t>(i + 1)) << "it waits for a better partner";
  }
  const std::string said = testing::internal::GetCapturedStdout() + testing::internal::GetCapturedStderr();
  EXPECT_EQ(said.find("lower bound"), std::string::npos) << said;
}

TEST_F(SensorPairingTest, OneStampFromTheFutureHoldsUpNoOtherSample) {
  addPairs(10.0, 5);
  for (const bool wheels : {true, false}) {
    EXPECT_FALSE(wheels ? addWheels(20.0, 10.1, 7.0) : addImu(20.0, 10.1));
    EXPECT_NE(sensors_.lastRefusal().find("future"), std::string::npos);
  }
  const std::size_t before = observations_.size();
  addPairs(10.1, 10);
  EXPECT_GE(observations_.size(), before + 9);
  for (const Observation& observation : observations_) EXPECT_EQ(observation.wheel_left, 1.0);
}

}  // namespace
}  // namespace jackal_aic
