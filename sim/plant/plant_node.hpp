#pragma once

/// @file
/// The simulated robot as a ROS node: the stock Jackal's topics and the simulation's clock around a JackalPlant.

#include <geometry_msgs/Wrench.h>
#include <jackal_aic/ControllerState.h>
#include <jackal_aic/SensorGeneralized.h>
#include <jackal_msgs/Drive.h>
#include <ros/node_handle.h>
#include <std_msgs/Float64.h>
#include <std_msgs/Time.h>
#include <std_srvs/Empty.h>
#include <std_srvs/SetBool.h>
#include <tf2_ros/transform_broadcaster.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_plant.hpp"
#include "periodic.hpp"

namespace jackal_aic::sim {

/// Parameters of the node itself, without prefix; those of the plant have the prefix `plant`.
struct PlantNodeParameters {
  double real_time_factor = 1.0;  ///< simulated seconds per wall second; 0 runs as fast as possible
  /// Rate of /clock [Hz]; /clock is also published with each sample and while waiting for a follower. Each message
  /// wakes every node: 200 Hz halve the processor time, and a controller catches up with the steps of its belief
  /// between two.
  double clock_rate = 200.0;
  double command_timeout = 0.0;  ///< age of the last command at which the wheels stop [s]; 0: never
  /// Simulated time since the last action of the controller after which the plant waits for the next [s], for example
  /// 1.1 action periods, because the controller lengthens some periods. So a busy machine slows the simulation and does
  /// not delay the controller. 0: never waits. The stamp of jackal_AIC/state is the time of an action; without a state
  /// it is the arrival of the command. A controller that also uses each sample (sensor_generalized) before the clock
  /// continues, and acts with the next message of the clock, is awaited there too. Then its inputs and times do not
  /// depend on the machine. Another node makes the simulation wait with ~seen (std_msgs/Time), the time up to which it
  /// has received the data.
  double lockstep = 0.0;
  /// Longest wall time of waiting for a silent controller, until its next message [s]. A dead controller is not
  /// awaited; one without two commands in a row is awaited for 0.25 s.
  double patience = 2.0;
  bool publish_clock = true;  ///< false: another node publishes /clock, as for the second of two robots; this follows
};

/// Lists the fields of PlantNodeParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, PlantNodeParameters& p) {
  v.field("real_time_factor", p.real_time_factor, {0.0, 1000.0}, "", Presence::optional);
  v.field("clock_rate", p.clock_rate, {1.0, 1000.0}, "Hz", Presence::optional);
  v.field("command_timeout", p.command_timeout, {0.0, 3600.0}, "s", Presence::optional);
  v.field("lockstep", p.lockstep, {0.0, 1.0}, "s", Presence::optional);
  v.field("patience", p.patience, {0.0, 3600.0}, "s", Presence::optional);
  v.field("publish_clock", p.publish_clock, Presence::optional);
}

/// Steps a plant and publishes /clock (or follows it without publish_clock), joint_states, imu/data, feedback,
/// ground_truth/odom and tf. The latest message of cmd_drive, or of Gazebo's jackal_left_wheel/command and
/// jackal_right_wheel/command, drives it. Service ~reset restarts plant and clock with the present ~plant parameters.
/// ~block_left and ~block_right (std_srvs/SetBool) block the motor of a side or release it. ~pull_imu
/// (std_srvs/SetBool) silences imu/data. ~push (geometry_msgs/Wrench, in base_link: force x and y, torque z) pushes the
/// robot until the next message, and ~lift (std_srvs/SetBool) lifts it. With lockstep it listens to jackal_AIC/state,
/// sensor_generalized and ~seen.
class PlantNode {
 public:
  /// @param node, private_node namespaces of the topics and of ~reset; @param urdf_xml text of the URDF.
  /// @throws ParameterError as JackalPlant.
  PlantNode(ros::NodeHandle node, ros::NodeHandle private_node, const std::string& urdf_xml,
            const PlantParameters& plant_parameters, const PlantNodeParameters& parameters);

  /// Simulates until ROS shuts down or the end is requested, calling back between steps. After a request it continues
  /// until the commands are zero, for at most 2 s of wall time, because the controller, which ends too, brakes on its
  /// clock.
  void run(const std::function<bool()>& end_requested = [] { return false; });

 private:
  /// A node that is awaited in lockstep.
  struct Follower {
    double time = 0.0;      ///< time of its last message [s]
    bool awaited = false;   ///< it has not fallen silent
    double patience = 0.0;  ///< longest wait [s of wall time]
  };

  /// Response of a controller to each sample of encoders and IMU, in lockstep.
  struct Response {
    double from = 0.0;             ///< awaited time, or a later one [s]
    std::optional<double> due;     ///< time at which it is due, while it is missing; infinite if not known yet [s]
    std::optional<int> in_stride;  ///< responses in time minus late ones; empty: none so far
  };

  void runByClock();
  bool goesOn();
  void step();
  void restartPace();
  void keepPace(double time);
  void shift(std_msgs::Header& header) const;
  void advertise(ros::NodeHandle& node);
  void subscribe(ros::NodeHandle& node);
  void onDrive(const jackal_msgs::Drive& drive);
  void onState(const ControllerState& state);
  void onSeen(const std_msgs::Time& seen);
  void onTaken(const SensorGeneralized& measurement);
  void onLeftWheel(const std_msgs::Float64& speed);
  void onRightWheel(const std_msgs::Float64& speed);
  bool onReset(std_srvs::Empty::Request& request, std_srvs::Empty::Response& response);
  ros::ServiceServer switchService(const std::string& name, const std::function<void(bool)>& set);
  void onPush(const geometry_msgs::Wrench& push);
  void restart();
  void drive(const WheelCommand& command, std::int8_t mode);
  void ignore(const char* reason);
  void stopIfSilent();
  void waitForFollowers();
  void waitFor(Follower& follower, const std::function<bool()>& is_there);
  void waitFor(Response& response, const ros::Subscriber& subscriber);
  bool waitWhile(const std::function<bool()>& behind, const std::function<bool()>& is_there, double patience);
  void expectResponses(const PlantMeasurement& sample);
  void respond(Response& response, double responded, double at);
  static void count(Response& response, bool in_time);
  void follow(Follower& follower, double time);
  std::optional<double> recentTime(const ros::Time& stamp) const;
  void publish();
  void publishClock();
  void publishMeasurement(const PlantMeasurement& measurement);

  ros::NodeHandle private_node_;
  std::string urdf_xml_;
  PlantParameters plant_parameters_;
  PlantNodeParameters parameters_;
  JackalPlant plant_;
  Periodic clock_schedule_;
  Periodic truth_schedule_;
  Periodic transform_schedule_;
  WheelCommand command_;
  std::int8_t mode_ = jackal_msgs::Drive::MODE_NONE;
  double command_time_ = 0.0;             // of the last command [s]
  std::optional<double> state_time_;      // of the last state with one [s]
  std::optional<double> feedback_stamp_;  // of the feedback published last [s]
  ros::Duration ahead_;                   // of the clock that is followed, before the plant's own time
  std::string tf_prefix_;
  Follower controller_;  // up to its last action
  Follower spectator_;   // publisher of ~seen
  Response taken_;       // of the controller that has the sample
  Response acted_;       // of the controller that acted after it
  bool imu_pulled_ = false;
  std::uint64_t ignored_commands_ = 0;
  double told_time_ = -1.0;  // by /clock, last [s]
  ros::WallTime wall_zero_;  // at which the time of the plant would have been zero
  std::function<bool()> end_requested_;
  std::optional<ros::WallTime> end_;  // of the simulation, at the latest, once its end is requested

  ros::Publisher clock_;
  ros::Publisher joint_states_;
  ros::Publisher imu_;
  ros::Publisher feedback_;
  ros::Publisher truth_;
  tf2_ros::TransformBroadcaster transforms_;
  ros::Subscriber drive_;
  ros::Subscriber measurement_;
  ros::Subscriber state_;
  ros::Subscriber seen_;
  ros::Subscriber left_wheel_;
  ros::Subscriber right_wheel_;
  ros::Subscriber push_;
  std::vector<ros::ServiceServer> services_;
};

}  // namespace jackal_aic::sim
