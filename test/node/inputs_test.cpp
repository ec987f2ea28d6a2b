// From ROS messages to observations and set points; no master.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "inputs/sensors.hpp"
#include "inputs/set_points.hpp"

namespace jackal_aic {
namespace {

const std::vector<std::string> kLeft{"front_left_wheel", "rear_left_wheel"};
const double kNaN = std::numeric_limits<double>::quiet_NaN();

sensor_msgs::JointState joints(const std::vector<std::string>& names, const std::vector<double>& velocities) {
  sensor_msgs::JointState message;
  message.name = names;
  message.velocity = velocities;
  return message;
}

sensor_msgs::Imu imu(const Eigen::Vector3d& turn, const Eigen::Vector3d& force) {
  sensor_msgs::Imu message;
  auto &w = message.angular_velocity, &a = message.linear_acceleration;
  std::tie(w.x, w.y, w.z, a.x, a.y, a.z) = std::tuple(turn.x(), turn.y(), turn.z(), force.x(), force.y(), force.z());
  return message;
}

/// What a sensor at rest reports whose frame is turned by `attitude` against the level, and that attitude.
sensor_msgs::Imu atRest(const Eigen::Quaterniond& attitude) {
  sensor_msgs::Imu message = imu({0.0, 0.0, 0.0}, attitude.conjugate() * Eigen::Vector3d(0.0, 0.0, 9.81));
  auto& q = message.orientation;
  std::tie(q.w, q.x, q.y, q.z) = std::tuple(attitude.w(), attitude.x(), attitude.y(), attitude.z());
  return message;
}

/// A robot that drives up a slope of 5 degrees: nose up is a negative turn about y.
Eigen::Quaterniond uphill() {
  return Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()) *
                            Eigen::AngleAxisd(-5.0 * M_PI / 180.0, Eigen::Vector3d::UnitY()));
}

TEST(MeanVelocity, GoesByNameAndRefusesWhatIsMissingOrNotFinite) {
  const auto message = joints({"rear_right_wheel", "mast", "front_left_wheel", "front_right_wheel", "rear_left_wheel"},
                              {7.0, 99.0, 1.0, 5.0, 3.0});
  const auto mean = wheelObservation(message, RobotNames{});
  ASSERT_TRUE(mean);
  EXPECT_DOUBLE_EQ(mean->wheel_left, 2.0);
  EXPECT_DOUBLE_EQ(mean->wheel_right, 6.0);
  EXPECT_DOUBLE_EQ(wheelObservation(joints({"rear_left_wheel", "rear_right_wheel"}, {4.0, 5.0}), {})->wheel_left, 4.0);
  EXPECT_TRUE(mentionsAny(message, kLeft));
  EXPECT_FALSE(mentionsAny(joints({"mast"}, {4.0}), kLeft));
  const std::vector<std::string> all{"front_left_wheel", "rear_left_wheel", "front_right_wheel", "rear_right_wheel"};
  for (const auto& bad : {joints({"rear_left_wheel"}, {4.0}), joints(all, {1.0, 1.0, 1.0}), joints(all, {}),
                          joints(all, {1.0, kNaN, 1.0, 1.0}), joints(all, {1.7e308, 1.7e308, 1.0, 1.0})}) {
    EXPECT_FALSE(wheelObservation(bad, {}));
  }
}

/// Yaw rate and accelerations of a message; empty if it is refused.
std::optional<Eigen::Vector4d> planarMotion(const sensor_msgs::Imu& message, const Eigen::Quaterniond& rotation) {
  const auto y = imuObservation(message, rotation);
  if (!y) return std::nullopt;
  return Eigen::Vector4d(y->yaw_rate, y->acceleration_x, y->acceleration_y, *y->acceleration_z);
}

TEST(PlanarMotion, RotatesIntoTheBaseFrameAndRefusesWhatIsNotFinite) {
  const Eigen::Quaterniond none = Eigen::Quaterniond::Identity();
  const std::pair<Eigen::Quaterniond, Eigen::Vector4d> rows[] = {
      {none, {0.3, 1.0, 2.0, 9.8}},
      {Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX())), {-0.3, 1.0, -2.0, -9.8}},
      {Eigen::Quaterniond(Eigen::AngleAxisd(M_PI_2, Eigen::Vector3d::UnitZ())), {0.3, -2.0, 1.0, 9.8}}};
  for (const auto& [mounting, motion] : rows) {
    EXPECT_TRUE(planarMotion(imu({0.1, 0.2, 0.3}, {1.0, 2.0, 9.8}), mounting)->isApprox(motion)) << motion.transpose();
  }
  EXPECT_FALSE(planarMotion(imu({0.0, 0.0, kNaN}, {0.0, 0.0, 9.8}), none));
  EXPECT_FALSE(planarMotion(imu({0.0, 0.0, 0.0}, {kNaN, 0.0, 9.8}), none));
}

TEST(PlanarMotion, AttitudeTakesGravityOutHoweverTheSensorIsMounted) {
  for (const Eigen::Quaterniond& mounting :
       {Eigen::Quaterniond::Identity(), Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX())),
        Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1.0, 2.0, -1.0).normalized()))}) {
    const auto motion = planarMotion(atRest(uphill() * mounting), mounting);
    EXPECT_NEAR(motion->segment<2>(1).norm(), 0.0, 1e-12);
    EXPECT_NEAR((*motion)(3), 9.81 * std::cos(5.0 * M_PI / 180.0), 1e-12);
    EXPECT_TRUE(imuObservation(atRest(uphill() * mounting), mounting)->level);
  }
  sensor_msgs::Imu driving = atRest(uphill());
  driving.linear_acceleration.x += 0.3;
  EXPECT_NEAR((*planarMotion(driving, Eigen::Quaterniond::Identity()))(1), 0.3, 1e-12);
  sensor_msgs::Imu no_estimate = atRest(uphill()), unset = no_estimate, not_finite = no_estimate, fixed = no_estimate;
  no_estimate.orientation_covariance[0] = -1.0;
  not_finite.orientation.x = kNaN;
  unset.orientation = fixed.orientation = geometry_msgs::Quaternion();
  fixed.orientation.w = 1.0;
  for (const auto& message : {no_estimate, unset, not_finite, fixed}) {  // 9.81 sin(5 deg)
    EXPECT_NEAR((*planarMotion(message, Eigen::Quaterniond::Identity()))(1), 0.855, 1e-3) << "gravity stays";
    EXPECT_FALSE(imuObservation(message, Eigen::Quaterniond::Identity())->level);
  }
}

TEST(SetPointOfTwist, TakesForwardSpeedAndYawRate) {
  geometry_msgs::Twist twist;
  twist.linear.x = 0.5;
  twist.linear.y = 0.3;
  twist.angular.z = -0.4;
  const SetPoint wanted = setPoint(twist);
  EXPECT_EQ(wanted.forward, 0.5);
  EXPECT_EQ(wanted.lateral, 0.0) << "a skid-steer robot cannot go sideways";
  EXPECT_EQ(wanted.yaw_rate, -0.4);
  twist.angular.x = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(setPoint(twist).vector().allFinite()) << "a message that is broken anywhere is not trusted";
}

constexpr double kPeriod = 0.02;  // s

class SensorPairingTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { ros::Time::init(); }  // for warnings, which are limited in rate

  SensorPairingTest()
      : sensors_(RobotNames{}, frames_,
                 [this](const Observation& observation, const ros::Time&) { observations_.push_back(observation); }) {}

  static boost::shared_ptr<sensor_msgs::JointState> wheelsAt(double stamp, double speed = 1.0) {
    auto message = boost::make_shared<sensor_msgs::JointState>(
        joints({"front_left_wheel", "front_right_wheel"}, {speed, 2.0 * speed}));
    message->header.stamp = ros::Time(stamp);
    return message;
  }

  static boost::shared_ptr<sensor_msgs::Imu> imuAt(double stamp, double acceleration = 0.0) {
    auto message = boost::make_shared<sensor_msgs::Imu>(imu({0.0, 0.0, 0.5}, {acceleration, 0.0, 0.0}));
    message->header.stamp = ros::Time(stamp);
    message->header.frame_id = "base_link";
    return message;
  }

  bool addWheels(double stamp, double now, double speed = 1.0) {
    return sensors_.addWheels(wheelsAt(stamp, speed), ros::Time(now)).has_value();
  }

  bool addImu(double stamp, double now, double acceleration = 0.0) {
    return sensors_.addImu(imuAt(stamp, acceleration), ros::Time(now)).has_value();
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
  const auto message = wheelsAt(10.0);
  EXPECT_TRUE(sensors_.addWheels(message, ros::Time(10.0))->may_repeat);
  message->position = {3.0, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_TRUE(sensors_.addWheels(message, ros::Time(10.0))->may_repeat) << "half of them are none";
  message->position = {3.0, 3.0};
  EXPECT_FALSE(sensors_.addWheels(message, ros::Time(10.0))->may_repeat);
}

TEST_F(SensorPairingTest, AnAbsentSensorOfTheImuIsNotValid) {
  for (const bool gyro : {true, false}) {
    const auto message = imuAt(10.0);
    (gyro ? message->angular_velocity_covariance : message->linear_acceleration_covariance)[0] = -1.0;  // REP 145
    SensorPairing sensors(RobotNames{}, frames_, [](const Observation&, const ros::Time&) {});
    const ChannelValidity valid = sensors.addImu(message, ros::Time(10.0))->observation.valid;
    EXPECT_EQ(valid.yaw_rate, !gyro);
    EXPECT_EQ(valid.acceleration, gyro);
  }
}

/// The frame of a message is anybody's text, and the reason goes into the log.
TEST_F(SensorPairingTest, ARefusedFrameIsNamedInOneShortLine) {
  const auto message = imuAt(10.0);
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
