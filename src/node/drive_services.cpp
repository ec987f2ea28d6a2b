#include "drive_services.hpp"

#include <ros/console.h>

#include <utility>

namespace jackal_aic {
namespace {

constexpr double kResting = 0.1;  // of a wheel, rad/s: 1 cm/s

}  // namespace

DriveServices::DriveServices(const ros::NodeHandle& node, double set_point_deadline, Actions actions)
    : actions_(std::move(actions)),
      set_point_deadline_(set_point_deadline),
      enable_service_(ros::NodeHandle(node).advertiseService("enable", &DriveServices::onEnable, this)),
      reset_service_(ros::NodeHandle(node).advertiseService("reset", &DriveServices::onReset, this)) {}

bool DriveServices::resting(const WheelCommand& command) { return command.vector().cwiseAbs().maxCoeff() < kResting; }

void DriveServices::noteSetPoint(const SetPoint& wanted) {
  wanted_ = wanted;
  wanted_at_ = ros::Time::now();
}

bool DriveServices::onEnable(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
  actions_.enable(request.data);
  response.success = true;
  response.message = request.data ? "enabled" : "disabled: the robot brakes, and stands until it is enabled again";
  ROS_INFO("Service enable: %s", response.message.c_str());
  return true;
}

bool DriveServices::onReset(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  // A robot that had a fault must not set off under a set point that was meant before it.
  if (!actions_.at_rest()) {
    response.message = "the robot is being driven: stop it first";
  } else if (askedToMove()) {
    response.message = "set points that are not zero are coming: send zero, or none, first";
  } else {
    actions_.reset();
    response.success = true;
    response.message = "started anew; what was learned of the robot stays";
  }
  ROS_INFO("Service reset: %s", response.message.c_str());
  return true;
}

bool DriveServices::askedToMove() const {
  const double age = (ros::Time::now() - wanted_at_).toSec();
  const bool counts = age >= 0.0 && (set_point_deadline_ == 0.0 || age <= set_point_deadline_);
  return counts && !wanted_.vector().isZero(0.0);
}

}  // namespace jackal_aic
