#include "jackal_aic/safety/step_schedule.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace jackal_aic {
namespace {

constexpr std::int64_t kMs = 1000000;

/// Serves both timers like the node does and writes down the steps: b for belief, A for action.
struct Timers {
  StepSchedule schedule{kMs, 20, 5};
  std::string steps;

  void belief(std::int64_t now) {
    for (int due = schedule.beliefStepsDue(now); due > 0; --due) beliefStep();
  }
  void action(std::int64_t expected) {
    for (int periods = schedule.actionPeriodsDue(expected); periods > 0; --periods) {
      while (schedule.beliefStepsLeft() > 0) beliefStep();
      steps += 'A';
      schedule.actionStepDone(expected);
    }
  }
  void beliefStep() {
    steps += 'b';
    schedule.beliefStepDone();
  }
};

std::string periods(int n) {
  std::string steps;
  for (int i = 0; i < n; ++i) steps += std::string(20, 'b') + 'A';
  return steps;
}

TEST(StepSchedule, RunsTwentyBeliefStepsPerActionOnTime) {
  Timers timers;
  timers.schedule.start(0);
  for (std::int64_t t = 1; t <= 100; ++t) {
    timers.belief(t * kMs);
    if (t % 20 == 0) timers.action(t * kMs);
  }
  EXPECT_EQ(timers.steps, periods(5));
}

TEST(StepSchedule, SequenceDoesNotDependOnHowTheTimersAreServed) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 200; ++trial) {
    Timers timers;
    timers.schedule.start(0);
    for (std::int64_t t = 1; t <= 100; ++t) {
      const bool action = t % 20 == 0;
      const bool action_first = random() % 2 == 0;
      if (action && action_first) timers.action(t * kMs);
      if (random() % 3 != 0) timers.belief(t * kMs + static_cast<std::int64_t>(random() % kMs));
      if (action && !action_first) timers.action(t * kMs);
    }
    EXPECT_EQ(timers.steps.substr(0, 105), periods(5));
  }
}

TEST(StepSchedule, BeliefWaitsAtTheBoundaryForALateAction) {
  Timers timers;
  timers.schedule.start(0);
  timers.belief(50 * kMs);
  EXPECT_EQ(timers.steps, std::string(20, 'b'));
  timers.action(40 * kMs);
  EXPECT_EQ(timers.steps, periods(2));
}

TEST(StepSchedule, LateTimerCatchesUpByWholePeriodsUpToABound) {
  Timers timers;
  timers.schedule.start(0);
  timers.action(60 * kMs);
  EXPECT_EQ(timers.steps, periods(3));
  timers.action((60 + 20 * 12) * kMs);
  EXPECT_EQ(timers.steps, periods(8));
  EXPECT_EQ(timers.schedule.droppedPeriods(), 7u);
}

TEST(StepSchedule, PutOffTimerMovesTheBoundaryAndLosesNoStep) {
  Timers timers;
  timers.schedule.start(0);
  timers.action(27 * kMs);  // put off by 7 ms
  timers.belief(30 * kMs);
  timers.action(47 * kMs);
  EXPECT_EQ(timers.steps, periods(2));
}

TEST(StepSchedule, TimerBroughtForwardALittleRunsEveryStepOnce) {
  Timers timers;
  timers.schedule.start(0);
  std::int64_t expected = 0;
  for (int i = 0; i < 10; ++i) {
    expected += 20 * kMs - kMs / 2;
    timers.belief(expected - kMs / 4);
    timers.action(expected);
    timers.action(expected + kMs);
  }
  EXPECT_EQ(timers.steps.substr(0, 210), periods(10));
  EXPECT_EQ(timers.steps.size(), 210u);
  timers.action(expected + 18 * kMs);
  EXPECT_EQ(timers.steps.size(), 210u) << "a tenth of a period is no jitter";
}

TEST(StepSchedule, NothingIsDueBeforeTheStartOrTwiceAtOnce) {
  Timers timers;
  timers.belief(100 * kMs);
  timers.action(100 * kMs);
  EXPECT_EQ(timers.steps, "");
  timers.schedule.start(100 * kMs);
  timers.belief(100 * kMs);
  timers.action(100 * kMs);
  EXPECT_EQ(timers.steps, "");
  timers.action(120 * kMs);
  timers.action(120 * kMs);
  EXPECT_EQ(timers.steps, periods(1));
}

TEST(StepSchedule, KeepsARateThatIsNoDivisorOfTheCallersClock) {
  StepSchedule schedule(1000000000 / 300, 10, 5);
  schedule.start(0);
  int beliefs = 0, actions = 0;
  for (std::int64_t t = 1; t <= 1000; ++t) {
    const std::int64_t now = t * kMs;
    for (int due = schedule.beliefStepsDue(now); due > 0; --due, ++beliefs) schedule.beliefStepDone();
    const std::int64_t boundary = schedule.lastBoundary(now);
    for (int due = schedule.actionPeriodsDue(boundary); due > 0; --due, ++actions) {
      for (; schedule.beliefStepsLeft() > 0; ++beliefs) schedule.beliefStepDone();
      schedule.actionStepDone(boundary);
    }
  }
  EXPECT_EQ(actions, 30);
  EXPECT_EQ(beliefs, 300);
}

TEST(StepSchedule, EqualRatesAlternate) {
  StepSchedule schedule(20 * kMs, 1, 5);
  schedule.start(0);
  EXPECT_EQ(schedule.beliefStepsDue(19 * kMs), 0);
  EXPECT_EQ(schedule.beliefStepsDue(20 * kMs), 1);
  EXPECT_EQ(schedule.actionPeriodsDue(20 * kMs), 1);
}

}  // namespace
}  // namespace jackal_aic
