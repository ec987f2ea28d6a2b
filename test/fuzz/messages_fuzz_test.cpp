// Hostile set points and sensor messages through everything between the topics and the drive command, without a master:
// whatever comes in, every command is finite and within the limits of speed and acceleration.

#include <gtest/gtest.h>
#include <ros/time.h>
#include <tf2_ros/buffer.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "conversions.hpp"
#include "fuzz.hpp"
#include "jackal_aic/active_inference_controller.hpp"
#include "jackal_aic/drive_gate.hpp"
#include "jackal_aic/predictive_controller.hpp"
#include "jackal_aic/velocity_controller.hpp"
#include "jackal_aic/yaml_parameters.hpp"
#include "node_parameters.hpp"
#include "sensor_pairing.hpp"

namespace jackal_aic::test {
namespace {

constexpr double kActionPeriod = 0.02;  // s
constexpr double kSlack = 1.0 + 1e-9;   // rounding

NodeParameters shipped(const std::string& preset) {
  ParameterMap map;
  addYamlText(packageFile("config/jackal.yaml"), "jackal", map);
  addYamlText(packageFile("config/" + preset + ".yaml"), preset, map);
  addYamlText(packageFile("config/plant_model.yaml"), "plant_model", map);
  return readNodeParameters(map, [] { return packageFile("sim/urdf/jackal.urdf"); });
}

std::unique_ptr<VelocityController> controllerOf(const NodeParameters& parameters) {
  if (const auto* thesis = std::get_if<ControllerParameters>(&parameters.controller)) {
    return std::make_unique<ActiveInferenceController>(*thesis, parameters.geometry);
  }
  return std::make_unique<PredictiveController>(std::get<PredictiveParameters>(parameters.controller),
                                                parameters.geometry, *parameters.plant_model);
}

/// What the node does between its topics, on a time of its own.
class Loop {
 public:
  Loop(const std::string& preset, std::uint64_t seed)
      : random_(seed),
        parameters_(shipped(preset)),
        kinematics_(parameters_.geometry),
        controller_(controllerOf(parameters_)),
        gate_(parameters_.gate, parameters_.geometry, kActionPeriod),
        sensors_(parameters_.robot, transforms_, [this](const Observation& observation, const ros::Time&) {
          taken_ += jackal_aic::taken(controller_->observe(observation)) ? 1 : 0;
        }) {
    geometry_msgs::TransformStamped mounting;
    mounting.header.frame_id = "base_link";
    mounting.child_frame_id = "imu_link";
    mounting.transform.rotation.w = 1.0;
    transforms_.setTransform(mounting, "fuzz", true);
  }

  /// One message of any kind, and an action step when one is due.
  void step() {
    now_ += random_.between(0.0, 0.01);
    switch (random_.below(3)) {
      case 0:
        takeSetPoint();
        break;
      case 1:
        sensors_.addWheels(boost::make_shared<sensor_msgs::JointState>(wheels()), ros::Time(now_));
        break;
      default:
        sensors_.addImu(boost::make_shared<sensor_msgs::Imu>(imu()), ros::Time(now_));
    }
    if (now_ < next_action_) return;
    next_action_ = now_ + kActionPeriod;
    act();
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
    const auto wanted = setPoint(twist);
    if (!wanted || !isPlausible(*wanted, parameters_.gate.limits)) return;
    set_point_ = gate_.reachable(*wanted);
    ASSERT_TRUE(set_point_.vector().allFinite());
    controller_->setSetPoint(set_point_);
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
    for (std::size_t i = 0, size = plain ? 4 : random_.below(8); i < size; ++i) {
      message.name.push_back(kNames[plain ? i : random_.below(kNames.size())]);
    }
    for (std::size_t i = 0, size = plain ? 4 : random_.below(8); i < size; ++i) message.velocity.push_back(value());
    message.position.resize(random_.chance(0.9) ? message.velocity.size() : random_.below(8), value());
    return message;
  }

  sensor_msgs::Imu imu() {
    sensor_msgs::Imu message;
    message.header.stamp = stamp();
    message.header.frame_id = random_.chance(0.95) ? "imu_link" : "";
    message.angular_velocity.x = value();
    message.angular_velocity.z = value();
    message.linear_acceleration.x = value();
    message.linear_acceleration.y = value();
    message.linear_acceleration.z = 9.81;
    message.orientation.w = random_.chance(0.9) ? 1.0 : random_.number();
    return message;
  }

  void act() {
    for (int i = controller_->beliefStepsPerAction(); i > 0; --i) controller_->updateBelief();
    GateInputs inputs;
    inputs.set_point_at_rest = set_point_.vector().isZero(0.0);
    inputs.causes.add(StopCause::set_point_late, random_.chance(0.02))
        .add(StopCause::emergency_stop, random_.chance(0.01))
        .add(StopCause::belief_diverged,
             !isPlausible(controller_->believedVelocity(), controller_->freeEnergy(), parameters_.gate));
    const GateDecision decision = gate_.decide(inputs);
    if (decision.starting || decision.cause == StopCause::belief_diverged) controller_->restart();
    const bool driving = decision.status == DriveStatus::driving;
    const WheelCommand command = driving ? gate_.drive(controller_->updateAction(), set_point_) : gate_.rest();
    if (driving) {
      controller_->hold(command);
    } else {
      controller_->overrule(command);
    }
    driven_ += driving && command != WheelCommand{} ? 1 : 0;
    check(command);
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
  }

  Random random_;
  NodeParameters parameters_;
  SkidSteerKinematics kinematics_;
  std::unique_ptr<VelocityController> controller_;
  DriveGate gate_;
  tf2_ros::Buffer transforms_{ros::Duration(10.0), false};
  SensorPairing sensors_;
  double now_ = 100.0;  // s
  double next_action_ = 100.0;
  SetPoint set_point_;
  WheelCommand last_;
  int driven_ = 0;
  int taken_ = 0;
};

class MessagesFuzz : public testing::TestWithParam<const char*> {};

TEST_P(MessagesFuzz, EveryCommandIsFiniteAndWithinTheLimits) {
  ros::Time::init();
  Loop loop(GetParam(), 4);
  for (int i = fuzzInputs(0.3); i > 0 && !HasFatalFailure(); --i) loop.step();
  EXPECT_GT(loop.taken(), fuzzInputs(0.3) / 100);
  EXPECT_GT(loop.driven(), 100) << "the loop never got going, so that nothing was tested";
}

INSTANTIATE_TEST_SUITE_P(Presets, MessagesFuzz, testing::Values("standard", "improved", "predictive"));

}  // namespace
}  // namespace jackal_aic::test
