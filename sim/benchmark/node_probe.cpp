// The robot around a controller node that is measured: samples on the wall clock, and how old they are when a command
// comes.

#include <geometry_msgs/Twist.h>
#include <jackal_msgs/Drive.h>
#include <ros/ros.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/gravity.hpp"

namespace {

using jackal_aic::DriveTrainPrediction;
using jackal_aic::PlantModel;

constexpr const char* kHelp =
    "Usage: rosrun jackal_aic node_probe SECONDS\n"
    "Stands in for a robot that drives an arc as config/plant_model.yaml says: publishes wheels and IMU at 50 Hz,\n"
    "stamped now, and the set point; obeys cmd_drive. After SECONDS (4 to 3600) it prints how old the newest sample\n"
    "was when a command arrived: p50, p99 [ms], number of commands, and by how much the time between two of them was\n"
    "off 20 ms: p99 [ms], and below p50, p99.9 and the largest [ms]. The first two seconds of commands, in which the\n"
    "action timer finds its phase, stand apart: the largest age and the largest that a period was off [ms]. Needs a\n"
    "ROS master, on wall time.\n";

constexpr double kRadius = 0.098;       // m
constexpr double kTrack = 0.547;        // m
constexpr double kActionPeriod = 20.0;  // ms
constexpr double kStart = 2.0;          // s
constexpr double kRest = 1.0;           // s, from the first command on

/// What two commands and their samples were like [ms].
struct Timing {
  std::vector<double> ages;
  std::vector<double> periods;  // off the nominal

  void sort() {
    std::sort(ages.begin(), ages.end());
    std::sort(periods.begin(), periods.end());
  }
};

PlantModel plantModel() {
  PlantModel model;
  model.dead_time = 0.08;
  model.lag = 0.00636;
  model.acceleration_limit = 1.65;
  return model;
}

double percentile(const std::vector<double>& sorted, double part) {
  return sorted[static_cast<std::size_t>(part * static_cast<double>(sorted.size() - 1))];
}

}  // namespace

int main(int argc, char** argv) {
  if (std::any_of(argv, argv + argc, [](const std::string& w) { return w == "--help" || w == "-h"; })) {
    return std::fputs(kHelp, stdout) < 0;
  }
  ros::init(argc, argv, "node_probe");
  const double duration = argc > 1 ? std::strtod(argv[1], nullptr) : 0.0;
  if (!(duration >= 4.0 && duration <= 3600.0)) {
    std::fprintf(stderr, "node_probe: SECONDS = %s: must be from 4 to 3600 (see --help)\n", argc > 1 ? argv[1] : "");
    return 2;
  }
  ros::NodeHandle node;
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  ros::Publisher wheels = node.advertise<sensor_msgs::JointState>("joint_states", 5);
  ros::Publisher imu = node.advertise<sensor_msgs::Imu>("imu/data", 5);
  ros::Publisher set_point = node.advertise<geometry_msgs::Twist>("jackal_AIC/set_point", 5);
  DriveTrainPrediction left(plantModel(), kRadius), right(plantModel(), kRadius);
  double command_left = 0.0, command_right = 0.0, speed_before = 0.0;
  ros::WallTime newest, commanded, first;
  Timing start, steady;
  const ros::Subscriber drive = node.subscribe<jackal_msgs::Drive>(
      "cmd_drive", 5,
      [&](const jackal_msgs::DriveConstPtr& message) {
        const ros::WallTime now = ros::WallTime::now();
        if (first.isZero() && !newest.isZero()) first = now;
        Timing& timing = first.isZero() || (now - first).toSec() < kStart ? start : steady;
        if (!newest.isZero()) timing.ages.push_back(1e3 * (now - newest).toSec());
        if (!commanded.isZero()) timing.periods.push_back(std::abs(1e3 * (now - commanded).toSec() - kActionPeriod));
        commanded = now;
        command_left = message->drivers[jackal_msgs::Drive::LEFT];
        command_right = message->drivers[jackal_msgs::Drive::RIGHT];
      },
      {}, no_delay);
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 1.0);
  const ros::WallTimer samples = node.createWallTimer(ros::WallDuration(0.02), [&](const ros::WallTimerEvent&) {
    for (int i = 0; i < 20; ++i) {
      left.predict(command_left);
      right.predict(command_right);
    }
    const double speed = 0.5 * kRadius * (left.speed() + right.speed());
    sensor_msgs::JointState joints;
    joints.header.stamp = ros::Time::now();
    joints.name = {"front_left_wheel", "front_right_wheel", "rear_left_wheel", "rear_right_wheel"};
    joints.position.resize(4);
    const double w_left = left.speed() + 0.02 * noise(random), w_right = right.speed() + 0.02 * noise(random);
    joints.velocity = {w_left, w_right, w_left, w_right};
    sensor_msgs::Imu sample;
    sample.header.stamp = joints.header.stamp;
    sample.header.frame_id = "base_link";
    sample.orientation.w = 1.0;
    sample.angular_velocity.z = kRadius * (right.speed() - left.speed()) / kTrack + 0.005 * noise(random);
    sample.linear_acceleration.x = (speed - speed_before) / 0.02 + 0.05 * noise(random);
    sample.linear_acceleration.y = 0.05 * noise(random);
    sample.linear_acceleration.z = jackal_aic::kGravity + 0.05 * noise(random);
    speed_before = speed;
    newest = ros::WallTime::now();
    wheels.publish(joints);
    imu.publish(sample);
    geometry_msgs::Twist wanted;
    if (!first.isZero() && (newest - first).toSec() > kRest) {  // a controller that has just started is told to stand
      wanted.linear.x = 0.5;
      wanted.angular.z = 0.2;
    }
    set_point.publish(wanted);
  });
  const ros::WallTimer end = node.createWallTimer(
      ros::WallDuration(duration), [](const ros::WallTimerEvent&) { ros::shutdown(); }, true);
  ros::spin();
  if (start.periods.empty() || steady.periods.empty()) {
    std::fprintf(stderr, "node_probe: no two commands came within %g s, or none after the start\n", duration);
    return 1;
  }
  start.sort();
  steady.sort();
  std::printf("age_p50_ms %.3f age_p99_ms %.3f commands %zu period_off_p99_ms %.3f\n", percentile(steady.ages, 0.5),
              percentile(steady.ages, 0.99), steady.ages.size(), percentile(steady.periods, 0.99));
  std::printf("speed %.3f\n", speed_before);
  std::printf("period_off_p50_ms %.3f period_off_p999_ms %.3f period_off_max_ms %.3f\n",
              percentile(steady.periods, 0.5), percentile(steady.periods, 0.999), steady.periods.back());
  std::printf("start_age_max_ms %.3f start_period_off_max_ms %.3f\n", start.ages.empty() ? 0.0 : start.ages.back(),
              start.periods.back());
  return 0;
}
