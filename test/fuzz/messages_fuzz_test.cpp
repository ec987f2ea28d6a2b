// Hostile set points and sensor messages through everything between the topics and the drive command, without a master:
// for any input, every command is finite and within the limits of speed and acceleration.

#include <gtest/gtest.h>
#include <ros/time.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "../repository.hpp"
#include "inputs/sensors.hpp"
#include "inputs/set_points.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic::test {
namespace {

constexpr double kActionPeriod = 0.02;  // s
constexpr double kSlack = 1.0 + 1e-9;   // rounding

/// Messages of a run, JACKAL_AIC_FUZZ_INPUTS: a million is JACKAL_AIC_FUZZ_INPUTS=1000000 ./scripts/test --only fuzz
int fuzzInputs() {
  const char* text = std::getenv("JACKAL_AIC_FUZZ_INPUTS");
  return text != nullptr ? std::max(1, std::atoi(text)) : 6000;
}

/// Seeded source of everything random. Spelled out where the standard leaves the numbers to the library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  std::size_t below(std::size_t size) { return size == 0 ? 0 : static_cast<std::size_t>(engine_() % size); }
  double fraction() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  bool chance(double probability) { return fraction() < probability; }
  double between(double low, double high) { return low + (high - low) * fraction(); }

  /// Mostly a number of everyday size, else one that arithmetic may stumble over.
  double number() {
    constexpr double kOdd[] = {0.0,   -0.0,   1e-320,  DBL_MIN,  1e15,      -1e38,
                               1e300, -1e308, DBL_MAX, HUGE_VAL, -HUGE_VAL, NAN};
    return chance(0.7) ? between(-5.0, 5.0) : kOdd[below(std::size(kOdd))];
  }

 private:
  std::mt19937_64 engine_;
};

/// What the node does between its topics, on a time of its own.
class Loop {
 public:
  Loop(const std::string& preset, std::uint64_t seed)
      : random_(seed),
        parameters_(readNodeParameters(shipped({"jackal", preset, "plant_model"}), jackalUrdf)),
        kinematics_(parameters_.geometry),
        loop_(parameters_, makeController(parameters_)),
        sensors_(parameters_.robot, frames_, [this](const Observation& observation, const ros::Time&) {
          taken_ += loop_.observe(observation, now_);
        }) {
    geometry_msgs::TransformStamped mounting;
    mounting.header.frame_id = "base_link";
    mounting.child_frame_id = "imu_link";
    mounting.transform.rotation.w = 1.0;
    frames_.setTransform(mounting, "", true);
  }

  /// One message of any kind, and the steps that are due.
  void step() {
    now_ += random_.between(0.0, 0.01);
    if (random_.chance(0.0005)) now_ += random_.between(-0.5, 0.5);
    const std::size_t kind = random_.below(3);
    if (kind == 0) takeSetPoint();
    if (kind == 1) {
      const auto reading = sensors_.addWheels(boost::make_shared<sensor_msgs::JointState>(wheels()), ros::Time(now_));
      taken_ += reading && loop_.receiveWheels(*reading, now_);
    }
    if (kind == 2) {
      const auto reading = sensors_.addImu(boost::make_shared<sensor_msgs::Imu>(imu()), ros::Time(now_));
      taken_ += reading && loop_.receiveImu(*reading, now_);
    }
    RobotStatus status;
    status.emergency_stop = random_.chance(0.01);
    loop_.report(status, now_);
    if (const auto command = loop_.advance(now_)) check(*command);
  }

  int driven() const { return driven_; }  ///< action steps in which the robot was driven and moved
  int taken() const { return taken_; }    ///< measurements that the controller took

 private:
  void takeSetPoint() {
    geometry_msgs::Twist twist;
    // Zero now and then, which acknowledges a fault.
    if (random_.chance(0.7)) twist.linear.x = random_.number();
    if (twist.linear.x != 0.0) twist.angular.z = random_.number();
    if (random_.chance(0.05)) twist.linear.y = random_.number();
    loop_.setSetPoint(setPoint(twist), now_);
    ASSERT_TRUE(loop_.setPoint().vector().allFinite());
  }

  ros::Time stamp() {
    if (random_.chance(0.9)) return ros::Time(now_);
    const double times[] = {0.0, now_ - 1.0, now_ + 1.0, 4e9};
    return ros::Time(std::max(0.0, times[random_.below(4)]));
  }

  /// Mostly plausible, so that the messages behind the first checks are reached too.
  double value() { return random_.chance(0.995) ? random_.between(-2.0, 2.0) : random_.number(); }

  sensor_msgs::JointState wheels() {
    static const std::vector<std::string> kNames{
        "front_left_wheel", "front_right_wheel", "rear_left_wheel", "rear_right_wheel", "mast", ""};
    sensor_msgs::JointState message;
    message.header.stamp = stamp();
    const bool plain = random_.chance(0.8);
    message.name.resize(plain ? 4 : random_.below(8));
    message.velocity.resize(plain ? 4 : random_.below(8));
    for (std::size_t i = 0; i < message.name.size(); ++i) {
      message.name[i] = kNames[plain ? i : random_.below(kNames.size())];
    }
    for (double& velocity : message.velocity) velocity = value();
    message.position.resize(random_.chance(0.9) ? message.velocity.size() : random_.below(8), value());
    return message;
  }

  sensor_msgs::Imu imu() {
    sensor_msgs::Imu message;
    message.header.stamp = stamp();
    message.header.frame_id = random_.chance(0.95) ? "imu_link" : "";
    for (double* number : {&message.angular_velocity.x, &message.angular_velocity.z, &message.linear_acceleration.x,
                           &message.linear_acceleration.y}) {
      *number = value();
    }
    message.linear_acceleration.z = 9.81;
    message.orientation.w = random_.chance(0.9) ? 1.0 : random_.number();
    return message;
  }

  void check(const WheelCommand& command) {
    const LimitParameters& limits = parameters_.gate.limits;
    ASSERT_TRUE(command.vector().allFinite());
    const BodyVector body = kinematics_.bodyVelocity(command);
    ASSERT_LE(std::abs(body(kForward)), kSlack * limits.linear_speed);
    ASSERT_LE(std::abs(body(kYaw)), kSlack * limits.angular_speed);
    ASSERT_LE(command.vector().cwiseAbs().maxCoeff(), kSlack * limits.wheel_speed);
    const BodyVector change = body - kinematics_.bodyVelocity(last_);
    ASSERT_LE(std::abs(change(kForward)), kSlack * kActionPeriod * limits.linear_acceleration + 1e-12);
    ASSERT_LE(std::abs(change(kYaw)), kSlack * kActionPeriod * limits.angular_acceleration + 1e-12);
    last_ = command;
    driven_ += loop_.status().decision.status == DriveStatus::driving && command != WheelCommand{};
  }

  Random random_;
  NodeParameters parameters_;
  SkidSteerKinematics kinematics_;
  DriveLoop loop_;
  tf2::BufferCore frames_;
  SensorPairing sensors_;
  double now_ = 100.0;  // s
  WheelCommand last_;
  int driven_ = 0;
  int taken_ = 0;
};

TEST(MessagesFuzz, EveryCommandIsFiniteAndWithinTheLimits) {
  ros::Time::init();
  for (const char* preset : {"standard", "improved", "predictive"}) {
    SCOPED_TRACE(preset);
    Loop loop(preset, 4);
    for (int i = fuzzInputs(); i > 0 && !HasFatalFailure(); --i) loop.step();
    EXPECT_GT(loop.taken(), fuzzInputs() / 100);
    EXPECT_GT(loop.driven(), 100) << "the loop never got going, so that nothing was tested";
  }
}

}  // namespace
}  // namespace jackal_aic::test
