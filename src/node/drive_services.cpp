#include "drive_services.hpp"

#include <ros/console.h>

#include <utility>

namespace jackal_aic {
namespace {

constexpr double kResting = 0.1;  // of a wheel, rad/s: 1 cm/s

}  // namespace

DriveServices::DriveServices(const ros::NodeHandle& node, Actions actions)
    : actions_(std::move(actions)),
      enable_service_(ros::NodeHandle(node).advertiseService("enable", &DriveServices::onEnable, this)),
      reset_service_(ros::NodeHandle(node).advertiseService("reset", &DriveServices::onReset, this)) {}

bool DriveServices::resting(const WheelCommand& command) { return command.vector().cwiseAbs().maxCoeff() < kResting; }

bool DriveServices::onEnable(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
  actions_.enable(request.data);
  response.success = true;
  response.message = request.data ? "enabled" : "disabled: the robot brakes, and stands until it is enabled again";
  ROS_INFO("Service enable: %s", response.message.c_str());
  return true;
}

bool DriveServices::onReset(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  response.success = actions_.at_rest();
  if (response.success) actions_.reset();
  response.message =
      response.success ? "restarted; what was learned of the robot stays" : "the robot is being driven: stop it first";
  ROS_INFO("Service reset: %s", response.message.c_str());
  return true;
}

}  // namespace jackal_aic
