// The controller of ros_control as a robot loads it: by pluginlib, with the stock configuration and the shipped extras,
// on the simulated robot. Time is the simulation's, and everything but publishing happens in this thread, in order.

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
#include <future>
#include <numeric>

#include "../counted_allocations.hpp"
#include "../repository.hpp"
#include "../temporary_directory.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "jackal_robot_hw.hpp"
#include "other_node.hpp"
#include "plant_messages.hpp"
#include "plugin_loop.hpp"

// Counts the locks too, which update() must not take either.
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

sim::PlantParameters plantParameters() {
  ParameterMap map;
  addYamlFile(std::string(JACKAL_AIC_SOURCE_DIR) + "/config/plant.yaml", map);
  return readParameters<sim::PlantParameters>(map, "plant");
}

/// Publishes commands and waits until they have come; it listens behind the controller.
class CommandSender {
 public:
  /// To be called when the controller has subscribed.
  void listen(ros::NodeHandle& node, const std::string& topic) {
    subscriber_ =
        node.subscribe<geometry_msgs::Twist>(topic, 10, [this](const geometry_msgs::TwistConstPtr&) { ++heard_; });
  }

  void stopListening() { subscriber_.shutdown(); }

  void send(const ros::Publisher& publisher, const geometry_msgs::Twist& command) {
    const int before = heard_;
    publisher.publish(boost::make_shared<geometry_msgs::Twist>(command));
    for (int i = 0; i < 1000 && heard_ == before && publisher.getNumSubscribers() > 0; ++i) {
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.001));
    }
  }

 private:
  ros::Subscriber subscriber_;
  int heard_ = 0;
};

/// What the robot truly did.
struct Recording {
  std::vector<double> time, forward, yaw_rate, command;
};

class RosControl : public testing::Test {
 protected:
  explicit RosControl(bool with_imu = false, const sim::PlantParameters& plant = plantParameters())
      : robot(textOf("sim/urdf/jackal.urdf"), plant, with_imu),
        plugins(&robot),
        start(newStart()),
        imu_of_robot(with_imu) {
    setTime();
    set_points = node.advertise<geometry_msgs::Twist>(std::string(kName) + "/cmd_vel", 1);
    imu = node.advertise<sensor_msgs::Imu>("imu/data", 10);
    transforms = node.advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
    odometry_subscriber = node.subscribe<nav_msgs::Odometry>(
        std::string(kName) + "/odom", 100, [this](const nav_msgs::OdometryConstPtr& message) { odometry = *message; });
    command_subscriber = node.subscribe<geometry_msgs::TwistStamped>(
        std::string(kName) + "/cmd_vel_out", 100,
        [this](const geometry_msgs::TwistStampedConstPtr& message) { command_out = *message; });
    tellImuFrame();
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

  void tellImuFrame() {
    auto message = boost::make_shared<tf2_msgs::TFMessage>();
    message->transforms.resize(1);
    message->transforms[0].header.frame_id = "base_link";
    message->transforms[0].child_frame_id = "imu_link";
    message->transforms[0].transform.rotation.w = 1.0;
    transforms.publish(message);
  }

  double now() { return start + robot.plant().time(); }
  void setTime() { ros::Time::setNow(ros::Time(now())); }

  bool load(const std::string& name = kName) {
    if (!plugins.load(name)) return false;
    sender.listen(node, std::string(kName) + "/cmd_vel");
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(10.0);
    while (name == kName && ros::WallTime::now() < end &&
           (set_points.getNumSubscribers() == 0 || (!imu_of_robot && imu.getNumSubscribers() == 0) ||
            odometry_subscriber.getNumPublishers() == 0)) {
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.01));
    }
    // The transform of the IMU comes from another thread.
    for (int i = 0; i < 20; ++i) ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.01));
    return true;
  }

  /// Starts and stops controllers, as a controller manager does between two updates.
  bool change(const std::vector<std::string>& started, const std::vector<std::string>& stopped) {
    update();
    return plugins.change(started, stopped);
  }

  /// Started, and asked to stand: a controller that starts under set points waits for that.
  bool startController() {
    if (!load() || !change({kName}, {})) return false;
    command(0.0, 0.0);
    run(0.1);
    wanted.reset();
    return true;
  }

  virtual void update() {
    const ros::Time time = ros::Time::now();
    robot.read(time, ros::Duration(period));
    plugins.update(time, ros::Duration(period));
    robot.write(time, ros::Duration(period));
  }

  /// A step of the simulation, with what is due in it.
  void step() {
    const auto& measurement = robot.step();
    setTime();
    if (measurement && imu_works) {
      auto message = boost::make_shared<sensor_msgs::Imu>(sim::toImu(*measurement, plantParameters()));
      message->header.stamp = ros::Time::now();
      imu.publish(message);
    }
    if (wanted && now() - last_set_point >= kSetPointPeriod - 1e-6) {
      last_set_point = now();
      sender.send(set_points, *wanted);
    }
    ros::getGlobalCallbackQueue()->callAvailable();
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

  /// Stands, and publishes no more commands.
  void leaveCommandsToOthers() {
    command(0.0, 0.0);
    run(1.0);
    wanted.reset();
    set_points.shutdown();
    sender.stopListening();
  }

  Recording run(double duration) {
    Recording done;
    const double end = now() + duration;
    while (now() < end) {
      step();
      const auto& truth = robot.plant().truth();
      done.time.push_back(now());
      done.forward.push_back(truth.linear_velocity.x());
      done.yaw_rate.push_back(truth.angular_velocity.z());
      done.command.push_back(commandOf(0));
    }
    return done;
  }

  double commandOf(int wheel) {
    return robot.get<hardware_interface::VelocityJointInterface>()->getHandle(sim::kWheelJoints[wheel]).getCommand();
  }

  /// Of a step from rest: time until the speed stays within 5 % of its final value [s], NaN if it never does, and
  /// percent of the step.
  struct StepFigures {
    double settling, overshoot_pct, steady_error_pct;
  };

  StepFigures stepResponse(double forward, double yaw_rate, double duration = 4.0) {
    const double begin = now(), set_point = forward != 0.0 ? forward : yaw_rate;
    command(forward, yaw_rate);
    const Recording done = run(duration);
    const auto& speed = forward != 0.0 ? done.forward : done.yaw_rate;
    const auto last = static_cast<std::size_t>(
        std::lower_bound(done.time.begin(), done.time.end(), done.time.back() - 0.5) - done.time.begin());
    const double final_speed = std::accumulate(speed.begin() + static_cast<std::ptrdiff_t>(last), speed.end(), 0.0) /
                               static_cast<double>(speed.size() - last);
    std::size_t outside = speed.size() - 1;
    while (outside > 0 && std::abs(speed[outside] - final_speed) <= 0.05 * std::abs(final_speed)) --outside;
    return {outside < last ? done.time[outside] - begin : NAN,
            100.0 * (*std::max_element(speed.begin(), speed.end()) / set_point - 1.0),
            100.0 * (final_speed / set_point - 1.0)};
  }

  /// A step from rest settles in a time [s], and at what was asked for but for an error [%].
  StepFigures expectStep(double forward, double yaw_rate, double settling, double error_pct) {
    const StepFigures found = stepResponse(forward, yaw_rate);
    ROS_INFO("%g m/s, %g rad/s: settling %.3f s, overshoot %.2f %%, error %.2f %%", forward, yaw_rate, found.settling,
             found.overshoot_pct, found.steady_error_pct);
    EXPECT_LE(found.settling, settling);
    EXPECT_NEAR(found.steady_error_pct, 0.0, error_pct);
    return found;
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

  /// @returns what the service says.
  std::string freezeLearning(bool frozen) {
    std_srvs::SetBool freeze;
    freeze.request.data = frozen;
    EXPECT_TRUE(call("freeze_learning", freeze));
    return freeze.response.message;
  }

  std::string saveLearnedModel() {
    std_srvs::Trigger save;
    EXPECT_TRUE(call("save_learned_model", save) && save.response.success) << save.response.message;
    return save.response.message;
  }

  /// Asks for a number by dynamic_reconfigure in a namespace below the controller's; returns what it is afterwards.
  double change(const std::string& part, const std::string& name, double value) {
    dynamic_reconfigure::Reconfigure wanted;
    wanted.request.config.doubles.resize(1);
    wanted.request.config.doubles[0].name = name;
    wanted.request.config.doubles[0].value = value;
    EXPECT_TRUE(call(part + "set_parameters", wanted));
    for (const auto& number : wanted.response.config.doubles) {
      if (number.name == name) return number.value;
    }
    ADD_FAILURE() << "no " << name;
    return NAN;
  }

  /// Waits for the publishing thread.
  template <class Condition>
  bool wait(const Condition& condition) {
    for (int i = 0; i < 500 && !condition(); ++i) ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.01));
    return condition();
  }

  ros::NodeHandle node;
  sim::JackalRobotHW robot;
  PluginLoop plugins;
  double start;
  bool imu_of_robot;
  double period = 0.02;  // s
  ros::Publisher set_points, imu, transforms;
  CommandSender sender;
  ros::Subscriber odometry_subscriber, command_subscriber;
  nav_msgs::Odometry odometry;
  geometry_msgs::TwistStamped command_out;
  std::optional<geometry_msgs::Twist> wanted;
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
  const auto& claimed = plugins.at(kName).claimed;
  ASSERT_EQ(claimed.size(), 1u);
  EXPECT_EQ(claimed[0].hardware_interface, "hardware_interface::VelocityJointInterface");
  EXPECT_EQ(claimed[0].resources.size(), 4u);
  for (const double command : run(1.0).command) ASSERT_EQ(command, 0.0) << "in spite of the noise of its encoders";
  EXPECT_LE(expectStep(0.5, 0.0, 0.45, 0.5).overshoot_pct, 5.0);
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
  EXPECT_NEAR(odometry.twist.twist.linear.x, robot.plant().truth().linear_velocity.x(), 0.02);
  EXPECT_NEAR(robot.plant().truth().linear_velocity.x(), 0.5, 0.02) << "starts again, and follows the set point";
}

TEST_F(RosControl, StopsWithoutTheImuWhereItMayNotGoOn) {
  node.setParam(std::string(kName) + "/on_loss/imu", "stop");
  ASSERT_TRUE(startController());
  node.deleteParam(std::string(kName) + "/on_loss");
  command(0.5, 0.0);
  EXPECT_NEAR(run(3.0).forward.back(), 0.5, 0.02);
  imu_works = false;
  EXPECT_NEAR(run(2.0).forward.back(), 0.0, 0.01);
}

TEST_F(RosControlWithImu, ReadsTheImuOfTheRobot) {
  ASSERT_TRUE(startController());
  run(1.0);
  EXPECT_EQ(imu.getNumSubscribers(), 0u);
  expectStep(0.0, 0.5, 0.4, 2.0);
}

/// A robot whose wheels can be read at any time, as in Gazebo.
class RosControlWithLiveWheels : public RosControl {
 protected:
  RosControlWithLiveWheels() : RosControl(false, live()) {}

  static sim::PlantParameters live() {
    sim::PlantParameters plant = plantParameters();
    plant.sensor_rate = 1000.0;
    return plant;
  }
};

TEST_F(RosControlWithLiveWheels, ReadsTheWheelsWithEachSampleOfTheImu) {
  constexpr int kImuPeriod = 20, kImuPhase = 7;  // steps
  period = 0.001;
  node.setParam(std::string(kName) + "/publish_rate", 2000.0);
  ASSERT_TRUE(startController());
  node.deleteParam(std::string(kName) + "/publish_rate");
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
  // The wheels are still turning when it starts again.
  ASSERT_TRUE(change({}, {kName}));
  EXPECT_EQ(commandOf(0), 0.0);
  const double before = run(0.2).forward.back();
  ASSERT_GT(before, 0.3);
  ASSERT_TRUE(change({kName}, {}));
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
  ASSERT_TRUE(load() && change({kName}, {}));
  for (const double command : run(3.0).command) ASSERT_EQ(command, 0.0);
  wanted.reset();
  run(1.0);
  command(0.5, 0.0);
  EXPECT_NEAR(run(3.0).forward.back(), 0.5, 0.02) << "after a pause";
}

TEST_F(RosControl, ALatchedEmergencyStopIsHeardBeforeTheFirstCommand) {
  const OtherNode stop("rostopic pub /e_stop std_msgs/Bool 'data: true' >/dev/null 2>&1");  // it latches
  bool engaged = false;
  auto subscriber = node.subscribe<std_msgs::Bool>(
      "e_stop", 1, [&](const std_msgs::BoolConstPtr& message) { engaged = message->data; });
  for (int i = 0; i < 12 && !engaged; ++i) wait([&] { return engaged; });  // until a busy machine has started it
  ASSERT_TRUE(engaged);
  subscriber.shutdown();
  ASSERT_TRUE(plugins.load(kName) && change({kName}, {}));
  sender.listen(node, std::string(kName) + "/cmd_vel");  // else it waits a second for each command
  command(0.0, 0.0);
  run(0.1);
  command(0.5, 0.0);
  for (const double command : run(3.0).command) ASSERT_EQ(command, 0.0);
}

TEST_F(RosControl, UpdateNeitherLocksNorAllocates) {
#if !JACKAL_AIC_COUNTS
  GTEST_SKIP() << "the sanitizers lock and allocate";
#endif
  ASSERT_TRUE(startController());
  command(0.5, 0.3);
  controller_interface::ControllerBase* controller = plugins.at(kName).controller.get();
  int updates = 0;
  allocations = locks = 0;
  for (int i = 0; i < 4000; ++i) {
    if (i == 1000) {  // other gains, which the update below takes over
      dynamic_reconfigure::Reconfigure gains;
      gains.request.config.doubles.resize(1);
      gains.request.config.doubles[0].name = "reference_time";
      gains.request.config.doubles[0].value = 0.02;
      auto answered = std::async(std::launch::async, [&gains] {
        return ros::service::call(std::string(kName) + "/predictive/set_parameters", gains.request, gains.response);
      });
      while (answered.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) {
        ros::getGlobalCallbackQueue()->callAvailable();
      }
      ASSERT_TRUE(answered.get());
    }
    if (i == 2000) imu_works = false;  // a loss
    if (i == 2500) wanted.reset();     // a time-out
    if (i == 3200) command(-0.3, -0.5);
    last_update = now() + 1.0;
    step();
    if (i % 20 != 0) continue;
    const ros::Time time = ros::Time::now();
    robot.read(time, ros::Duration(period));
    counting = true;
    controller->updateRequest(time, ros::Duration(period));
    counting = false;
    robot.write(time, ros::Duration(period));
    ++updates;
  }
  EXPECT_EQ(updates, 200);
  EXPECT_EQ(allocations, 0);
  EXPECT_EQ(locks, 0);
  EXPECT_LT(robot.plant().truth().linear_velocity.x(), -0.2) << "it did drive";
}

TEST_F(RosControl, MultipliersChangeWhileItRuns) {
  ASSERT_TRUE(startController());
  EXPECT_EQ(change("", "left_wheel_radius_multiplier", 50.0), 1.0) << "beyond its range";
  EXPECT_EQ(change("", "wheel_separation_multiplier", 1.3), 1.3);
  run(0.1);
  EXPECT_EQ(freezeLearning(true).find("frozen: effective track 0.488"), 0u);
  command(0.5, 0.0);
  run(2.0);
  const double before = commandOf(0);
  for (const char* side : {"left", "right"}) change("", std::string(side) + "_wheel_radius_multiplier", 0.9);
  run(3.0);
  EXPECT_NEAR(commandOf(0), before / 0.9, 0.3) << "smaller wheels turn faster";
}

TEST_F(RosControl, GainsChangeWhileItRuns) {
  ASSERT_TRUE(startController());
  command(0.5, 0.0);
  run(2.0);
  EXPECT_EQ(change("predictive/", "reference_time", 0.3), 0.3);
  EXPECT_EQ(change("predictive/", "reference_time", 20.0), 0.3) << "beyond its range";
  EXPECT_EQ(change("sensors/", "wheel_variance", 2e-3), 2e-3);
  command(0.0, 0.0);
  run(2.0);
  const auto metrics = stepResponse(0.5, 0.0);
  EXPECT_GT(metrics.settling, 0.8) << "slow, as asked for";
  EXPECT_NEAR(metrics.steady_error_pct, 0.0, 0.5);
}

TEST_F(RosControl, StandsWhileItIsDisabled) {
  ASSERT_TRUE(startController());
  command(0.5, 0.0);
  run(2.0);
  std_srvs::Trigger reset;
  ASSERT_TRUE(call("reset", reset));
  EXPECT_FALSE(reset.response.success) << "on the move";
  std_srvs::SetBool enable;
  ASSERT_TRUE(call("enable", enable) && enable.response.success);
  EXPECT_NEAR(run(1.0).forward.back(), 0.0, 0.01);
  EXPECT_EQ(commandOf(0), 0.0);
  enable.request.data = true;
  ASSERT_TRUE(call("enable", enable));
  EXPECT_NEAR(run(1.0).forward.back(), 0.0, 0.01) << "until a zero set point has come";
  command(0.0, 0.0);
  run(0.5);
  ASSERT_TRUE(call("reset", reset));
  EXPECT_TRUE(reset.response.success) << reset.response.message;
  run(0.1);  // still asked to stand, as after every start
  command(0.5, 0.0);
  EXPECT_NEAR(run(2.0).forward.back(), 0.5, 0.02);
}

TEST_F(RosControl, KeepsWhatItLearnedInAFile) {
  static const TemporaryDirectory directory;  // outlives the controller, which writes at its end
  const std::string file = directory.write("slip.yaml", "slip: {effective_track: 0.7, slip_factor: 1.0}");
  node.setParam(std::string(kName) + "/slip/file", file);
  ASSERT_TRUE(startController());
  node.deleteParam(std::string(kName) + "/slip");
  EXPECT_EQ(freezeLearning(true).find("frozen: effective track 0.7 m, slip factor 1"), 0u);
  command(0.0, 0.5);
  run(3.0);
  EXPECT_EQ(saveLearnedModel().find(file + ": effective track 0.7 m, slip factor 1, dead time "), 0u);
  freezeLearning(false);
  run(3.0);
  EXPECT_EQ(saveLearnedModel().find(file + ": effective track 0.5"), 0u);
}

TEST_F(RosControl, TakesStampedCommandsAndHeedsTheirStamp) {
  ASSERT_TRUE(startController());
  leaveCommandsToOthers();
  auto stamped = node.advertise<geometry_msgs::TwistStamped>(std::string(kName) + "/cmd_vel_stamped", 1);
  ASSERT_TRUE(wait([&] { return stamped.getNumSubscribers() > 0; }));
  const auto drive = [&](double duration, double age) {
    for (const double end = now() + duration; now() < end;) {
      auto message = boost::make_shared<geometry_msgs::TwistStamped>();
      message->header.stamp = ros::Time::now() - ros::Duration(age);
      message->twist.linear.x = 0.5;
      stamped.publish(message);
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.01));
      run(0.05);
    }
    return robot.plant().truth().linear_velocity.x();
  };
  EXPECT_NEAR(drive(2.0, 0.0), 0.5, 0.02);
  EXPECT_NEAR(drive(1.5, 5.0), 0.0, 0.02) << "said long ago";
}

TEST_F(RosControl, WhatCannotDriveIsNotLoaded) {
  const std::string name = "bad_controller";
  node.setParam(name + "/type", "jackal_aic/ActiveInferenceController");
  EXPECT_FALSE(load(name)) << "no wheels";
  node.setParam(name + "/left_wheel", "front_left_wheel");
  node.setParam(name + "/right_wheel", "no_such_wheel");
  EXPECT_FALSE(load(name));
  node.setParam(name + "/wheel_separation", 0.4);
  node.setParam(name + "/wheel_radius", 0.1);
  EXPECT_FALSE(load(name)) << "the robot does not have the joint";
  node.setParam(name + "/right_wheel", "front_right_wheel");
  EXPECT_TRUE(load(name));
  node.deleteParam(name);
}

}  // namespace
}  // namespace jackal_aic::test
