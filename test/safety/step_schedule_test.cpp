#include "jackal_aic/safety/step_schedule.hpp"

#include <gtest/gtest.h>

#include <string>

namespace jackal_aic {
namespace {

constexpr std::int64_t kMs = 1000000;

/// Serves both timers as the drive loop does and records the steps: b for belief, A for action. Times in ms.
struct Timers {
  StepSchedule schedule{kMs, 20, 5};
  std::string steps;

  Timers() { schedule.start(0); }

  void belief(double now) {
    for (int due = schedule.beliefStepsDue(nanoseconds(now)); due > 0; --due) beliefStep();
  }
  void action(double expected) {
    for (int periods = schedule.actionPeriodsDue(nanoseconds(expected)); periods > 0; --periods) {
      while (schedule.beliefStepsLeft() > 0) beliefStep();
      steps += 'A';
      schedule.actionStepDone(nanoseconds(expected));
    }
  }
  void beliefStep() {
    steps += 'b';
    schedule.beliefStepDone();
  }
  static std::int64_t nanoseconds(double ms) { return static_cast<std::int64_t>(ms * kMs); }
};

std::string periods(int n) {
  std::string steps;
  for (int i = 0; i < n; ++i) steps += std::string(20, 'b') + 'A';
  return steps;
}

TEST(StepSchedule, TimerThatIsPutOffOrBroughtForwardRunsEveryStepOnce) {
  Timers late;
  late.action(27);
  late.belief(30);
  late.action(47);
  EXPECT_EQ(late.steps, periods(2));
  Timers early;
  double expected = 0.0;
  for (int i = 0; i < 10; ++i) {
    expected += 19.5;
    early.belief(expected - 0.25);
    early.action(expected);
    early.action(expected + 1);
  }
  EXPECT_EQ(early.steps, periods(10));
  early.action(expected + 18);
  EXPECT_EQ(early.steps, periods(10)) << "a tenth of a period early is no jitter";
}

TEST(StepSchedule, NothingIsDueBeforeTheStartOrTwiceAtOnce) {
  Timers timers;
  timers.schedule = StepSchedule(kMs, 20, 5);
  timers.belief(100);
  timers.action(100);
  EXPECT_EQ(timers.steps, "");
  timers.schedule.start(100 * kMs);
  timers.belief(100);
  timers.action(100);
  EXPECT_EQ(timers.steps, "");
  timers.action(120);
  timers.action(120);
  EXPECT_EQ(timers.steps, periods(1));
}

}  // namespace
}  // namespace jackal_aic
