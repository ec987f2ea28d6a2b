// Real-time scheduling of the node's threads, where the system grants it and where it does not.

#include "real_time.hpp"

#include <gtest/gtest.h>
#include <linux/capability.h>
#include <ros/ros.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <thread>

namespace jackal_aic {
namespace {

int policyOf(pid_t thread) { return sched_getscheduler(thread) & ~SCHED_RESET_ON_FORK; }

/// Takes this process what it needs for real-time scheduling, whoever runs it.
void giveUpPermission() {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct data[2]{};
  ASSERT_EQ(syscall(SYS_capset, &header, data), 0);
  const rlimit none{0, 0};
  ASSERT_EQ(setrlimit(RLIMIT_RTPRIO, &none), 0);
}

/// The threads there are, and one that is started afterwards.
void schedule(int priority, int& early, int& late) {
  ros::NodeHandle node;
  const RealTimeThreads threads(node);
  std::atomic<bool> ending{false};
  std::atomic<pid_t> started{0};
  std::thread thread([&] {
    started = static_cast<pid_t>(syscall(SYS_gettid));
    while (!ending) std::this_thread::yield();
  });
  while (started == 0) std::this_thread::yield();
  threads.schedule(priority);
  early = policyOf(0);
  late = policyOf(started);
  ending = true;
  thread.join();
}

/// Whether this machine lets the test do it at all.
bool granted() {
  sched_param parameters{};
  parameters.sched_priority = 1;
  if (sched_setscheduler(0, SCHED_FIFO, &parameters) != 0) return false;
  parameters.sched_priority = 0;
  return sched_setscheduler(0, SCHED_OTHER, &parameters) == 0;
}

/// Ends the process: 0 if the threads have these policies after schedule().
[[noreturn]] void endWith(int priority, int early_policy, int late_policy) {
  int early = -1, late = -1;
  schedule(priority, early, late);
  std::exit(early == early_policy && late == late_policy ? 0 : 1);
}

[[noreturn]] void endWithoutPermission(int priority) {
  giveUpPermission();
  endWith(priority, SCHED_OTHER, SCHED_OTHER);
}

// Each in a process of its own, which keeps the scheduling of the others as it is.

TEST(RealTimeThreadsDeathTest, ThoseThereAreGetItAndLaterOnesDoNot) {
  if (!granted()) GTEST_SKIP() << "this machine grants no real-time scheduling";
  EXPECT_EXIT(endWith(1, SCHED_FIFO, SCHED_OTHER), testing::ExitedWithCode(0), "");
}

TEST(RealTimeThreadsDeathTest, WithoutPermissionItIsToldAndTheNodeRunsOn) {
  EXPECT_EXIT(endWithoutPermission(50), testing::ExitedWithCode(0), "realtime_priority = 50: not granted");
}

TEST(RealTimeThreadsDeathTest, ZeroChangesNothing) {
  EXPECT_EXIT(endWith(0, SCHED_OTHER, SCHED_OTHER), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace jackal_aic

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  testing::GTEST_FLAG(death_test_style) = "threadsafe";
  ros::init(argc, argv, "real_time_test", ros::init_options::AnonymousName);
  return RUN_ALL_TESTS();
}
