#include "clock_watch.hpp"

#include <utility>

namespace jackal_aic {
namespace {

/// Wall time between looks at the clock, and how long it may stand still before that is reported [s].
constexpr double kPeriod = 0.5;
constexpr double kPatience = 3.0;

}  // namespace

ClockWatch::ClockWatch(const ros::NodeHandle& node, std::function<void()> look)
    : before_(std::move(look)), advanced_(ros::WallTime::now()) {
  timer_ = node.createWallTimer(ros::WallDuration(kPeriod), [this](const ros::WallTimerEvent&) { ClockWatch::look(); });
}

void ClockWatch::look() {
  before_();
  const ros::Time now = ros::Time::now();
  const ros::WallTime wall = ros::WallTime::now();
  if (now != last_) {
    if (stands_) ROS_INFO("The clock runs again");
    last_ = now;
    advanced_ = wall;
    stands_ = false;
  }
  if (stands_ || (wall - advanced_).toSec() < kPatience) return;
  stands_ = true;
  if (now.isZero()) {
    ROS_ERROR(
        "No clock: /use_sim_time is true and nothing came on /clock for %.0f s. Nothing happens until it does: start "
        "the simulation, or rosparam set /use_sim_time false and start the node again",
        kPatience);
  } else {
    ROS_ERROR("The clock stands still at %.3f s: nothing came on /clock for %.0f s, and no command is sent",
              now.toSec(), kPatience);
  }
}

}  // namespace jackal_aic
