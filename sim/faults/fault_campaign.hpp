#pragma once

/// @file
/// The fault-injection node between the simulated robot and the controller: leads both through scenarios, records.

#include <XmlRpcValue.h>
#include <diagnostic_msgs/DiagnosticArray.h>
#include <nav_msgs/Odometry.h>
#include <ros/message_event.h>
#include <ros/node_handle.h>
#include <rosgraph_msgs/Clock.h>

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "faulty_topic.hpp"
#include "jackal_aic/ControllerState.h"
#include "judge.hpp"
#include "scenario.hpp"

namespace jackal_aic::sim {

/// Names of the nodes that the campaign deals with.
struct CampaignNodes {
  std::string controller = "/jackal_aic";
  std::string plant = "/plant";
};

/// Stands between a plant and a controller. From the plant it takes robot/clock, robot/joint_states, robot/imu/data and
/// robot/feedback, and hands them on without "robot/", with the faults of a scenario; from the controller it takes
/// cmd_drive and hands it on as robot/cmd_drive. It also is the operator (jackal_AIC/set_point, e_stop) and the robot's
/// firmware (status). Time is that of robot/clock, so that faults come at the same simulated time in every run.
class FaultCampaign {
 public:
  /// Opens the topics in the namespace of `node`.
  FaultCampaign(const ros::NodeHandle& node, const CampaignNodes& nodes);

  /// Puts robot and clock back to the start, runs a scenario and returns what happened.
  RunRecord run(const Scenario& scenario);

  /// Process id of the controller; 0 if it does not run.
  int controllerProcess() const;

  /// Time simulated in all runs so far [s].
  double simulatedTime() const { return simulated_; }

 private:
  /// Something to do at a time of a run.
  struct Task {
    double time;
    std::function<void()> action;
  };

  void onClock(const rosgraph_msgs::Clock& message);
  void onCommand(const ros::MessageEvent<const jackal_msgs::Drive>& event);
  void onTruth(const nav_msgs::Odometry& message);
  void onState(const ControllerState& message);
  void onDiagnostics(const diagnostic_msgs::DiagnosticArray& message);
  template <class Message>
  void pass(FaultyTopic<Message>& topic, Message message);

  void arm(const Scenario& scenario);
  void planSystemFault(const SystemFault& fault, double onset);
  void pressStop(bool pressed);
  void intrude(double speed);
  void pushRobot(double force, double torque);
  void switchPlant(const std::string& service, bool on);
  void changePlant(const Scenario& scenario);
  void startWorldAnew();
  void endController(int signal);
  void endMaster();
  bool restart(const Scenario& scenario);
  bool controllerIsConnected() const;
  bool stands() const;
  void resetPlant();
  void perform();
  bool waitFor(const std::function<bool()>& condition);
  void sendPeriodically();
  void pausePlant(double wall_seconds);
  void breakDown(const std::string& reason);
  bool silent() const;
  void checkProcess();

  ros::NodeHandle node_;
  CampaignNodes nodes_;
  double time_ = 0.0;                     // since the start of the run, in steps of the plant's clock [s]
  double base_ = 0.0;                     // run time at which the plant's clock was last put back to zero [s]
  double offset_ = 0.0;                   // of the clock that the controller sees, and of all stamps [s]
  double simulated_ = 0.0;                // in runs before this one [s]
  ros::Time plant_clock_;                 // as the plant gave it
  ros::Time told_seen_;                   // the plant was told that this node has come up to here
  std::uint64_t ticks_ = 0, resets_ = 0;  // of the plant's clock
  bool recording_ = false;
  bool end_requested_ = false;  // of the controller's process, and its successor was not heard yet
  bool world_is_new_ = false;   // and no command of this new world was heard yet
  bool succeeded_ = false;      // a successor was heard
  int controller_ = 0;          // process id at the start of the run
  double next_set_point_ = 0.0, next_status_ = 0.0, next_intrusion_ = 0.0;
  geometry_msgs::Twist set_point_;
  double intruder_speed_ = 0.0;
  std::vector<Task> tasks_;  // to come, in the order of their times
  RunRecord record_;
  std::vector<ControllerState> states_since_reset_;

  FaultyTopic<sensor_msgs::JointState> joint_states_;
  FaultyTopic<sensor_msgs::Imu> imu_;
  FaultyTopic<jackal_msgs::Feedback> feedback_;
  FaultyTopic<jackal_msgs::Status> status_;
  FaultyTopic<geometry_msgs::Twist> set_points_;
  FaultyTopic<jackal_msgs::Drive> commands_;
  ros::Publisher clock_, e_stop_, push_, seen_, intruder_;
  /// Parameters of the plant that a scenario changed, as they were before; empty: not given.
  std::vector<std::pair<std::string, std::optional<XmlRpc::XmlRpcValue>>> plant_before_;
  std::vector<ros::Subscriber> subscribers_;
};

}  // namespace jackal_aic::sim
