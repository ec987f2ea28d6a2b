#include <ros/ros.h>

#include "jackal_aic/config/text.hpp"
#include "node_help.hpp"
#include "ros_parameters.hpp"
#include "stop_request.hpp"
#include "wheel_watchdog.hpp"

int main(int argc, char** argv) {
  if (jackal_aic::printedHelp(
          argc, argv, "wheel_watchdog",
          "Zeroes the wheel topics of output: gazebo when the controller's commands stay away.\n")) {
    return 0;
  }
  ros::init(argc, argv, "jackal_aic_watchdog", ros::init_options::NoSigintHandler);
  ros::NodeHandle handle, private_handle("~");
  jackal_aic::StopRequest stop;
  try {
    jackal_aic::ParameterMap map = jackal_aic::readRosParameters(private_handle);
    const auto parameters = jackal_aic::readParameters<jackal_aic::WheelWatchdogParameters>(map, "");
    map.refuseUnknown();
    jackal_aic::WheelWatchdog watchdog(handle, parameters);
    stop.spinUntilRequested();
    // The controller is to end as well: it may need the watchdog until its wheels stand.
    stop.spinWhile([&] { return !watchdog.atRest(); }, 1.0);
    watchdog.stop();
    stop.flush();
  } catch (const std::exception& error) {
    ROS_FATAL("%s", jackal_aic::onOneLine(error.what()).c_str());
    return 1;
  }
  return 0;
}
