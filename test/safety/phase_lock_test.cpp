#include "jackal_aic/safety/phase_lock.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "jackal_aic/safety/step_schedule.hpp"

namespace jackal_aic {
namespace {

using Times = std::vector<std::int64_t>;
constexpr std::int64_t kMs = 1000000, kSecond = 1000 * kMs, kPeriod = 20 * kMs;

/// What a timer of 50 Hz does that the lock sets.
struct Drive {
  std::vector<double> ages;     // of the newest measurement at each action [ms]
  std::vector<double> periods;  // between actions [ms]

  /// That this part of the actions does not exceed.
  double age(double part) {
    std::sort(ages.begin(), ages.end());
    return ages.at(static_cast<std::size_t>(part * static_cast<double>(ages.size() - 1)));
  }
  void expectPeriods(double tolerance) const {
    EXPECT_LE(*std::max_element(periods.begin(), periods.end()), 20.0 + tolerance);
    EXPECT_GE(*std::min_element(periods.begin(), periods.end()), 20.0 - tolerance);
  }
};

/// Measurements at these times [ns], sorted; the timer starts at `first`, and its actions count from `from` on.
Drive run(const Times& arrivals, std::int64_t end, std::int64_t first = 7 * kMs, std::int64_t from = 2 * kSecond) {
  PhaseLock lock(kPeriod);
  Drive found;
  auto next = arrivals.begin();
  std::int64_t before = 0;
  for (std::int64_t due = first; due < end;) {
    for (; next != arrivals.end() && *next <= due; ++next) lock.arrived(*next);
    if (due >= from) {
      if (next != arrivals.begin()) found.ages.push_back(1e-6 * static_cast<double>(due - *(next - 1)));
      found.periods.push_back(1e-6 * static_cast<double>(due - before));
    }
    before = due;
    due = lock.next(due, due);
  }
  return found;
}

/// Measurements of a rate from `first` on.
Times arrivals(std::int64_t period, std::int64_t end, std::int64_t first = 0,
               const std::function<std::int64_t()>& jitter = {}) {
  Times times;
  for (std::int64_t t = first; t < end; t += period) times.push_back(t + (jitter ? jitter() : 0));
  std::sort(times.begin(), times.end());
  return times;
}

Times operator+(Times a, const Times& b) {
  a.insert(a.end(), b.begin(), b.end());
  std::sort(a.begin(), a.end());
  return a;
}

TEST(PhaseLock, KeepsItsRateWithoutMeasurementsAndLocksAgain) {
  run({}, 3 * kSecond).expectPeriods(0.0);
  run(arrivals(kPeriod, kSecond), 5 * kSecond, 3 * kMs, kSecond).expectPeriods(1e-3);
  const Times silence = arrivals(kPeriod, 2 * kSecond) + arrivals(kPeriod, 6 * kSecond, 4 * kSecond + 9 * kMs);
  EXPECT_LE(run(silence, 6 * kSecond, 0, 4 * kSecond + 50 * kMs).age(1.0), 0.6);
  const Times restarted = arrivals(kPeriod, 4 * kSecond) + arrivals(kPeriod, 8 * kSecond, 4 * kSecond + 12 * kMs);
  Drive moved = run(restarted, 8 * kSecond, 0, 4 * kSecond);
  EXPECT_LE(moved.age(0.7), 0.6);
  moved.expectPeriods(0.6);
  EXPECT_LE(run(restarted, 8 * kSecond, 0, 6 * kSecond).age(1.0), 0.6);
}

TEST(PhaseLock, WaitsForJitterAndNotForRareDelays) {
  for (const double spread : {0.05, 0.1, 0.2}) {  // ms
    std::mt19937 random(5);
    std::normal_distribution<double> normal(0.0, spread * kMs);
    const auto late = [&] { return std::llabs(std::llround(normal(random))); };
    Drive found = run(arrivals(kPeriod, 60 * kSecond, 0, late), 60 * kSecond);
    EXPECT_LE(found.age(0.5), 0.4 + 3.0 * spread) << spread;
    EXPECT_LE(found.age(0.99), 0.4 + 5.0 * spread) << spread;
    found.expectPeriods(0.6);
  }
  std::mt19937 random(6);
  const auto rarely = [&] { return random() % 100 == 0 ? 8 * kMs : static_cast<std::int64_t>(random() % 100000); };
  Drive found = run(arrivals(kPeriod, 60 * kSecond, 0, rarely), 60 * kSecond);
  EXPECT_LE(found.age(0.98), 1.0);
  found.expectPeriods(0.5);
}

TEST(PhaseLock, FollowsDriftButNotATenthOfAMillisecond) {
  for (const double percent : {-1.0, -0.1, -0.01, 0.01, 0.1, 1.0}) {
    const std::int64_t period = kPeriod + std::llround(0.01 * percent * kPeriod);
    Drive found = run(arrivals(period, 60 * kSecond), 60 * kSecond);
    EXPECT_LE(found.age(0.5), 0.7) << percent;
    EXPECT_LE(found.age(0.99), 1.5) << percent;
    found.expectPeriods(0.6);
  }
  Times times = arrivals(kPeriod, 20 * kSecond);
  for (std::int64_t& t : times) t -= t > 5 * kSecond ? kMs / 10 : 0;
  run(times, 20 * kSecond).expectPeriods(0.0);
}

TEST(PhaseLock, LateTimerGoesOnFromNowAndResetForgets) {
  PhaseLock lock(kPeriod);
  EXPECT_EQ(lock.next(0, 13 * kMs), kPeriod) << "late by less than a period keeps the phase";
  EXPECT_EQ(lock.next(0, 39 * kMs), kPeriod);
  EXPECT_EQ(lock.next(0, 70 * kMs), 70 * kMs);
  lock.arrived(5 * kMs);
  lock.reset();
  EXPECT_EQ(lock.next(7 * kMs, 7 * kMs), 27 * kMs);
}

TEST(StepSchedule, RunsATimerBroughtForwardAndNothingBeforeTheStartOrTwice) {
  StepSchedule schedule(kMs, 20, 5);
  EXPECT_EQ(schedule.beliefStepsDue(kSecond) + schedule.actionPeriodsDue(kSecond), 0);
  schedule.start(kSecond);
  EXPECT_EQ(schedule.actionPeriodsDue(kSecond), 0);
  EXPECT_EQ(schedule.actionPeriodsDue(kSecond + 18 * kMs), 0) << "a tenth of a period early is no jitter";
  EXPECT_EQ(schedule.actionPeriodsDue(kSecond + 19 * kMs), 1);
  schedule.actionStepDone(kSecond + 19 * kMs);
  EXPECT_EQ(schedule.actionPeriodsDue(kSecond + 19 * kMs), 0);
}

}  // namespace
}  // namespace jackal_aic
