#include "real_time.hpp"

#include <ros/console.h>
#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>
#include <system_error>

namespace jackal_aic {
namespace {

constexpr double kFarAway = 1e6;  // s

}  // namespace

RealTimeThreads::RealTimeThreads(const ros::NodeHandle& node)
    : timer_(node.createTimer(ros::Duration(kFarAway), [](const ros::TimerEvent&) {})) {
  std::error_code ignored;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task", ignored)) {
    threads_.push_back(static_cast<pid_t>(std::stol(thread.path().filename().string())));
  }
}

void RealTimeThreads::schedule(int priority) const {
  if (priority == 0) return;
  sched_param parameters{};
  parameters.sched_priority = priority;
  for (const pid_t thread : threads_) {
    if (sched_setscheduler(thread, SCHED_FIFO, &parameters) == 0 || errno == ESRCH) continue;  // it has ended
    ROS_WARN(
        "realtime_priority = %d: not granted (%s), driving on without it; allow it with a line \"@GROUP - rtprio %d\" "
        "in "
        "/etc/security/limits.d",
        priority, std::strerror(errno), priority);
    return;
  }
  const bool locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  const std::string memory = locked ? "memory locked" : std::string("memory not locked: ") + std::strerror(errno);
  ROS_INFO("Real-time scheduling: SCHED_FIFO with priority %d, %s", priority, memory.c_str());
}

}  // namespace jackal_aic
