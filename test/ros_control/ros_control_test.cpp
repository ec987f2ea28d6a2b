// The controller of ros_control as a robot loads it: by pluginlib, with the stock configuration and the shipped extras,
// on the simulated robot. Time is the simulation's, and everything but publishing happens in this thread, in order.

#include <controller_interface/controller_base.h>
#include <dlfcn.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <geometry_msgs/TwistStamped.h>
#include <gtest/gtest.h>
#include <jackal_aic/ControllerState.h>
#include <nav_msgs/Odometry.h>
#include <pthread.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_msgs/Bool.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <future>
#include <memory>
#include <numeric>
#include <pluginlib/class_loader.hpp>

#include "../counted_allocations.hpp"
#include "../repository.hpp"
#include "../temporary_directory.hpp"
#include "jackal_robot_hw.hpp"
#include "plant_messages.hpp"

// Counts the locks too: an update must neither lock nor allocate.
namespace {
thread_local int locks = 0;
}  // namespace

#if JACKAL_AIC_COUNTS
extern "C" int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  using Lock = int (*)(pthread_mutex_t*);
  static const Lock real = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  if (counting) ++locks;
  return real(mutex);
}
#endif

namespace jackal_aic::test {
namespace {

constexpr const char* kName = "jackal_velocity_controller";
constexpr double kSetPointPeriod = 0.05;  // s

sim::PlantParameters plantParameters(double sensor_rate = 50.0) {
  ParameterMap map = shipped({"plant"});
  map.set("plant.sensor_rate", sensor_rate);
  return readParameters<sim::PlantParameters>(map, "plant");
}

/// What the robot truly did, step by step.
struct Recording {
  std::vector<double> forward, yaw_rate, command;
};

/// Of a step from rest: time until the speed stays within 5 % of its final value [s], and percent of the step.
struct StepFigures {
  double settling, overshoot_pct, steady_error_pct;
};

class RosControl : public testing::Test {
 protected:
  using Controller = controller_interface::ControllerBase;

  explicit RosControl(bool with_imu = false, const sim::PlantParameters& plant = plantParameters())
      : robot(jackalUrdf(), plant, with_imu), start(newStart()) {
    setTime();
    set_points = node.advertise<geometry_msgs::Twist>(std::string(kName) + "/cmd_vel", 1);
    if (!with_imu) imu = node.advertise<sensor_msgs::Imu>("imu/data", 10);
    odometry_subscriber = node.subscribe<nav_msgs::Odometry>(
        std::string(kName) + "/odom", 100, [this](const nav_msgs::OdometryConstPtr& message) { odometry = *message; });
    command_subscriber = node.subscribe<geometry_msgs::TwistStamped>(
        std::string(kName) + "/cmd_vel_out", 100,
        [this](const geometry_msgs::TwistStampedConstPtr& message) { command_out = *message; });
    tf2_msgs::TFMessage mount;
    mount.transforms.resize(1);
    mount.transforms[0].header.frame_id = "base_link";
    mount.transforms[0].child_frame_id = "imu_link";
    mount.transforms[0].transform.rotation.w = 1.0;
    transforms = node.advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
    transforms.publish(mount);
  }

  void TearDown() override {
    EXPECT_EQ(allocations, 0) << "in the updates since the start";
    EXPECT_EQ(locks, 0) << "in the updates since the start";
  }

  ~RosControl() override {
    ros::getGlobalCallbackQueue()->clear();
    for (const char* part : {"/predictive", "/sensors"})
      node.deleteParam(kName + std::string(part));  // as it was changed
  }

  static double newStart() {  // no clock runs back from one test to the next
    static double start = 100.0;
    return start += 1000.0;
  }

  double now() { return start + robot.plant().time(); }
  void setTime() { ros::Time::setNow(ros::Time(now())); }

  static void callBack(double seconds = 0.0) {
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(seconds));
  }

  template <class Condition>
  bool wait(const Condition& condition) {
    for (int i = 0; i < 1000 && !condition(); ++i) callBack(0.01);
    return condition();
  }

  /// Constructs and initialises a controller in place of the one before, as its parameter `type` says. False, with a
  /// message, if it failed. @param remappings of the topics of the robot.
  bool loadPlugin(const std::string& name, const ros::M_string& remappings = {}) {
    try {
      ros::NodeHandle root("", remappings), own(name);
      controller.reset(loader.createUnmanagedInstance(own.param<std::string>("type", "")));
      if (!controller->initRequest(&robot, root, own, claimed)) return false;
      // Behind the controller: what came here came there.
      heard_subscriber =
          own.subscribe<geometry_msgs::Twist>("cmd_vel", 10, [this](const geometry_msgs::TwistConstPtr&) { ++heard; });
      return true;
    } catch (const std::exception& error) {
      ROS_ERROR("Could not load controller '%s': %s", name.c_str(), error.what());
      return false;
    }
  }

  bool load() {
    if (!loadPlugin(kName)) return false;
    wait([this] {
      return set_points.getNumSubscribers() > 0 && (!imu || imu.getNumSubscribers() > 0) &&
             odometry_subscriber.getNumPublishers() > 0;
    });
    for (int i = 0; i < 20; ++i) callBack(0.01);  // the transform of the IMU comes from another thread
    return true;
  }

  /// Starts and stops as a controller manager does: between two updates.
  bool startRequest() {
    update();
    return controller->startRequest(ros::Time::now());
  }
  bool stopRequest() {
    update();
    return controller->stopRequest(ros::Time::now());
  }

  /// Started, and asked to stand: a controller that starts under set points waits for that.
  bool startController() {
    if (!load() || !startRequest()) return false;
    command(0.0, 0.0);
    run(0.1);
    wanted.reset();
    allocations = locks = 0;
    return true;
  }

  /// The same with a parameter, which is gone afterwards.
  template <class Value>
  bool startController(const std::string& key, const Value& value) {
    node.setParam(kName + ("/" + key), value);
    const bool started = startController();
    node.deleteParam(kName + ("/" + key.substr(0, key.find('/'))));
    return started;
  }

  void update() {
    const ros::Time time = ros::Time::now();
    robot.read(time, ros::Duration(period));
    counting = true;
    controller->updateRequest(time, ros::Duration(period));
    counting = false;
    robot.write(time, ros::Duration(period));
  }

  /// A step of the simulation, with what is due in it.
  void step() {
    const auto& measurement = robot.step();
    setTime();
    if (measurement && imu_works && imu) {
      auto message = boost::make_shared<sensor_msgs::Imu>(sim::toImu(*measurement, plantParameters()));
      message->header.stamp = ros::Time::now();
      imu.publish(message);
    }
    if (wanted && now() - last_set_point >= kSetPointPeriod - 1e-6) {
      last_set_point = now();
      const int before = heard;
      set_points.publish(boost::make_shared<geometry_msgs::Twist>(*wanted));
      for (int i = 0; i < 1000 && heard == before && set_points.getNumSubscribers() > 0; ++i) callBack(0.001);
    }
    callBack();
    if (now() - last_update < period - 1e-6) return;
    last_update = now();
    update();
  }

  void command(double forward, double yaw_rate) {
    wanted.emplace();
    wanted->linear.x = forward;
    wanted->angular.z = yaw_rate;
    last_set_point = -1.0;
  }

  Recording run(double duration) {
    Recording done;
    const double end = now() + duration;
    while (now() < end) {
      step();
      const auto& truth = robot.plant().truth();
      done.forward.push_back(truth.linear_velocity.x());
      done.yaw_rate.push_back(truth.angular_velocity.z());
      done.command.push_back(commandOf(0));
    }
    return done;
  }

  double speed() { return robot.plant().truth().linear_velocity.x(); }

  double commandOf(int wheel) {
    return robot.get<hardware_interface::VelocityJointInterface>()->getHandle(sim::kWheelJoints[wheel]).getCommand();
  }

  StepFigures stepResponse(double forward, double yaw_rate) {
    const double set_point = forward != 0.0 ? forward : yaw_rate;
    command(forward, yaw_rate);
    const Recording done = run(4.0);
    const auto& speed = forward != 0.0 ? done.forward : done.yaw_rate;
    const double final_speed = std::accumulate(speed.end() - 500, speed.end(), 0.0) / 500.0;
    const auto outside = std::find_if(speed.rbegin(), speed.rend(), [final_speed](double value) {
      return std::abs(value - final_speed) > 0.05 * std::abs(final_speed);
    });
    return {sim::JackalPlant::kStep * static_cast<double>(speed.rend() - outside),
            100.0 * (*std::max_element(speed.begin(), speed.end()) / set_point - 1.0),
            100.0 * (final_speed / set_point - 1.0)};
  }

  /// A step from rest settles in a time [s], and at what was asked for but for an error [%].
  void expectStep(double forward, double yaw_rate, double settling, double error_pct) {
    const StepFigures found = stepResponse(forward, yaw_rate);
    EXPECT_LE(found.settling, settling);
    EXPECT_LE(found.overshoot_pct, 5.0);
    EXPECT_NEAR(found.steady_error_pct, 0.0, error_pct);
  }

  /// Calls a service of the controller while the robot goes on.
  template <class Service>
  bool call(const std::string& service, Service& call) {
    auto answered = std::async(std::launch::async, [&] {
      return ros::service::call(std::string(kName) + "/" + service, call.request, call.response);
    });
    while (answered.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) step();
    return answered.get();
  }

  std_srvs::SetBoolResponse set(const std::string& service, bool on) {
    std_srvs::SetBool wish;
    wish.request.data = on;
    EXPECT_TRUE(call(service, wish) && wish.response.success) << wish.response.message;
    return wish.response;
  }

  std_srvs::TriggerResponse trigger(const std::string& service) {
    std_srvs::Trigger wish;
    EXPECT_TRUE(call(service, wish));
    return wish.response;
  }

  /// Asks for a number by dynamic_reconfigure in a namespace below the controller's; returns what it is afterwards.
  double change(const std::string& part, const std::string& name, double value) {
    dynamic_reconfigure::Reconfigure wish;
    wish.request.config.doubles.resize(1);
    wish.request.config.doubles[0].name = name;
    wish.request.config.doubles[0].value = value;
    EXPECT_TRUE(call(part + "set_parameters", wish));
    for (const auto& number : wish.response.config.doubles) {
      if (number.name == name) return number.value;
    }
    ADD_FAILURE() << "no " << name;
    return NAN;
  }

  ros::NodeHandle node;
  sim::JackalRobotHW robot;
  pluginlib::ClassLoader<Controller> loader{"controller_interface", "controller_interface::ControllerBase"};
  Controller::ClaimedResources claimed;
  std::unique_ptr<Controller> controller;  // destroyed before the loader, which holds its code
  double start;
  double period = 0.02;  // s
  ros::Publisher set_points, imu, transforms;
  ros::Subscriber odometry_subscriber, command_subscriber, heard_subscriber;
  nav_msgs::Odometry odometry;
  geometry_msgs::TwistStamped command_out;
  std::optional<geometry_msgs::Twist> wanted;
  int heard = 0;  // set points
  double last_set_point = -1.0, last_update = -1.0;
  bool imu_works = true;
};

class RosControlWithImu : public RosControl {
 protected:
  RosControlWithImu() : RosControl(true) {}
};

TEST_F(RosControl, StepIsFastAndExactAndPublishedAndEndsWithItsCommands) {
  node.setParam("tf_prefix", "/robot1/");
  ASSERT_TRUE(startController());
  node.deleteParam("tf_prefix");
  ASSERT_EQ(claimed.size(), 1u);
  EXPECT_EQ(claimed[0].hardware_interface, "hardware_interface::VelocityJointInterface");
  EXPECT_EQ(claimed[0].resources.size(), 4u);
  for (const double command : run(1.0).command) ASSERT_EQ(command, 0.0) << "in spite of the noise of its encoders";
  expectStep(0.5, 0.0, 0.45, 0.5);
  ASSERT_TRUE(wait([&] { return now() - command_out.header.stamp.toSec() < 0.05; }));
  EXPECT_NEAR(command_out.twist.linear.x, 0.098 * commandOf(0), 0.02);
  EXPECT_EQ(odometry.header.frame_id, "robot1/odom");
  EXPECT_EQ(odometry.child_frame_id, "robot1/base_link");
  EXPECT_EQ(odometry.twist.covariance[7], 0.001);
  EXPECT_EQ(odometry.pose.covariance[35], 0.03);
  wanted.reset();
  const Recording done = run(2.0);
  EXPECT_NEAR(done.forward[200], 0.5, 0.03) << "cmd_vel_timeout is 0.25 s";
  EXPECT_NEAR(done.forward.back(), 0.0, 0.01);
  EXPECT_EQ(commandOf(0), 0.0);
}

TEST_F(RosControl, StepIsTheSameInAFastLoop) {
  period = 0.001;
  ASSERT_TRUE(startController());
  run(1.0);
  expectStep(0.5, 0.0, 0.45, 0.5);
}

TEST_F(RosControl, AClockThatRanBackLeavesNoSilence) {
  ASSERT_TRUE(startController());
  command(0.5, 0.0);
  run(2.0);
  ASSERT_TRUE(wait([&] { return now() - odometry.header.stamp.toSec() < 0.05; }));
  start -= 50.0;
  last_update = last_set_point = -1.0;
  run(2.5);
  ASSERT_TRUE(wait([&] { return std::abs(now() - odometry.header.stamp.toSec()) < 0.05; }));
  EXPECT_NEAR(odometry.twist.twist.linear.x, speed(), 0.02);
  EXPECT_NEAR(speed(), 0.5, 0.02) << "starts again, and follows the set point";
}

TEST_F(RosControl, StopsWithoutTheImuWhereItMayNotGoOn) {
  ASSERT_TRUE(startController("on_loss/imu", "stop"));
  command(0.5, 0.0);
  EXPECT_NEAR(run(3.0).forward.back(), 0.5, 0.02);
  imu_works = false;
  EXPECT_NEAR(run(2.0).forward.back(), 0.0, 0.01);
}

TEST_F(RosControlWithImu, ReadsTheImuOfTheRobot) {
  ASSERT_TRUE(startController());
  run(1.0);
  expectStep(0.0, 0.5, 0.4, 2.0);
}

/// A robot whose wheels can be read at any time, as in Gazebo.
class RosControlWithLiveWheels : public RosControl {
 protected:
  RosControlWithLiveWheels() : RosControl(false, plantParameters(1000.0)) {}
};

TEST_F(RosControlWithLiveWheels, ReadsTheWheelsWithEachSampleOfTheImu) {
  constexpr int kImuPeriod = 20, kImuPhase = 7;  // steps
  period = 0.001;
  ASSERT_TRUE(startController("publish_rate", 2000.0));
  ControllerState state;
  const auto states = node.subscribe<ControllerState>(
      std::string(kName) + "/state", 10, [&state](const ControllerStateConstPtr& message) { state = *message; });
  ASSERT_TRUE(wait([&] { return states.getNumPublishers() > 0; }));
  std::vector<int> taken;  // steps in which the wheels were read
  double last = 0.0;
  for (int i = 0; i < 500; ++i) {
    imu_works = i % kImuPeriod == kImuPhase;
    step();
    ASSERT_TRUE(wait([&] { return state.header.stamp == ros::Time::now(); }));
    if (state.measured_forward != last) taken.push_back(i);  // no two are alike, by the noise
    last = state.measured_forward;
  }
  ASSERT_GE(taken.size(), 20u);
  for (std::size_t i = taken.size() - 20; i < taken.size(); ++i) {
    EXPECT_EQ(taken[i] - taken[i - 1], kImuPeriod);
    EXPECT_LE((taken[i] - kImuPhase) % kImuPeriod, 1) << "an old sample of the IMU under a new stamp";
  }
}

TEST_F(RosControl, IsStoppedAndStartedOnTheMoveWithoutAJump) {
  ASSERT_TRUE(startController());
  command(0.8, 0.0);
  run(3.0);
  ASSERT_TRUE(stopRequest());
  EXPECT_EQ(commandOf(0), 0.0);
  const double before = run(0.2).forward.back();
  ASSERT_GT(before, 0.3);
  ASSERT_TRUE(startRequest());
  const Recording done = run(3.0);
  EXPECT_NEAR(0.098 * done.command[1], before, 0.15) << "brakes from the speed of the wheels";
  double largest = 0.0;
  for (std::size_t i = 1; i < done.command.size(); ++i) {
    largest = std::max(largest, 0.098 * std::abs(done.command[i] - done.command[i - 1]));
  }
  EXPECT_LE(largest, 20.0 * 0.02 + 1e-6) << "the limit of the acceleration holds from the first command on";
  EXPECT_NEAR(done.forward.back(), 0.0, 0.01) << "under set points that go on since before its start";
  command(0.0, 0.0);
  run(0.1);
  command(0.8, 0.0);
  EXPECT_NEAR(run(3.0).forward.back(), 0.8, 0.02);
}

TEST_F(RosControl, LoadedAndStartedUnderSetPointsItStands) {
  command(0.5, 0.0);
  ASSERT_TRUE(load() && startRequest());
  for (const double command : run(3.0).command) ASSERT_EQ(command, 0.0);
  wanted.reset();
  run(1.0);
  command(0.5, 0.0);
  EXPECT_NEAR(run(3.0).forward.back(), 0.5, 0.02) << "after a pause";
}

TEST_F(RosControl, ALatchedEmergencyStopIsHeardBeforeTheFirstCommand) {
  const char* kStop = "/latched_stop";  // of another node
  ASSERT_TRUE(ros::topic::waitForMessage<std_msgs::Bool>(kStop, ros::Duration(60.0))->data);
  ASSERT_TRUE(loadPlugin(kName, {{"e_stop", kStop}}) && startRequest());
  command(0.0, 0.0);
  run(0.1);
  command(0.5, 0.0);
  for (const double command : run(3.0).command) ASSERT_EQ(command, 0.0);
}

TEST_F(RosControl, MultipliersAndGainsChangeWhileItRuns) {
  ASSERT_TRUE(startController());
  EXPECT_EQ(change("", "left_wheel_radius_multiplier", 50.0), 1.0) << "beyond its range";
  EXPECT_EQ(change("", "wheel_separation_multiplier", 1.3), 1.3);
  run(0.1);
  EXPECT_EQ(set("freeze_learning", true).message.find("frozen: effective track 0.488"), 0u);
  command(0.5, 0.0);
  run(2.0);
  const double before = commandOf(0);
  for (const char* side : {"left", "right"}) change("", std::string(side) + "_wheel_radius_multiplier", 0.9);
  run(3.0);
  EXPECT_NEAR(commandOf(0), before / 0.9, 0.3) << "smaller wheels turn faster";
  for (const char* side : {"left", "right"}) change("", std::string(side) + "_wheel_radius_multiplier", 1.0);
  EXPECT_EQ(change("predictive/", "reference_time", 0.3), 0.3);
  EXPECT_EQ(change("predictive/", "reference_time", 20.0), 0.3) << "beyond its range";
  EXPECT_EQ(change("sensors/", "wheel_variance", 2e-3), 2e-3);
  command(0.0, 0.0);
  run(2.0);
  const StepFigures slow = stepResponse(0.5, 0.0);
  EXPECT_GT(slow.settling, 0.8) << "as asked for";
  EXPECT_NEAR(slow.steady_error_pct, 0.0, 0.5);
}

TEST_F(RosControl, StandsWhileItIsDisabled) {
  ASSERT_TRUE(startController());
  command(0.5, 0.0);
  run(2.0);
  EXPECT_FALSE(trigger("reset").success) << "on the move";
  set("enable", false);
  EXPECT_NEAR(run(1.0).forward.back(), 0.0, 0.01);
  EXPECT_EQ(commandOf(0), 0.0);
  set("enable", true);
  EXPECT_NEAR(run(1.0).forward.back(), 0.0, 0.01) << "until a zero set point has come";
  command(0.0, 0.0);
  run(0.5);
  EXPECT_TRUE(trigger("reset").success);
  run(0.1);  // still asked to stand, as after every start
  command(0.5, 0.0);
  EXPECT_NEAR(run(2.0).forward.back(), 0.5, 0.02);
}

TEST_F(RosControl, KeepsWhatItLearnedInAFile) {
  static const TemporaryDirectory directory;  // outlives the controller, which writes at its end
  const std::string file = directory.write("slip.yaml", "slip: {effective_track: 0.7, slip_factor: 1.0}");
  const auto saved = [&] { return trigger("save_learned_model").message; };
  ASSERT_TRUE(startController("slip/file", file));
  EXPECT_EQ(set("freeze_learning", true).message.find("frozen: effective track 0.7 m, slip factor 1"), 0u);
  command(0.0, 0.5);
  run(3.0);
  EXPECT_EQ(saved().find(file + ": effective track 0.7 m, slip factor 1, dead time "), 0u);
  set("freeze_learning", false);
  run(3.0);
  EXPECT_EQ(saved().find(file + ": effective track 0.5"), 0u);
}

TEST_F(RosControl, WhatCannotDriveIsNotLoaded) {
  const std::string name = "bad_controller";
  node.setParam(name + "/type", "jackal_aic/ActiveInferenceController");
  EXPECT_FALSE(loadPlugin(name)) << "no wheels";
  node.setParam(name + "/left_wheel", "front_left_wheel");
  node.setParam(name + "/right_wheel", "no_such_wheel");
  node.setParam(name + "/wheel_separation", 0.4);
  node.setParam(name + "/wheel_radius", 0.1);
  EXPECT_FALSE(loadPlugin(name)) << "the robot does not have the joint";
  node.setParam(name + "/right_wheel", "front_right_wheel");
  EXPECT_TRUE(loadPlugin(name));
  node.deleteParam(name);
}

}  // namespace
}  // namespace jackal_aic::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "ros_control_test");
  ros::NodeHandle keep_alive;  // roscpp ends with its last handle
  return RUN_ALL_TESTS();
}
