#include "jackal_aic/safety/phase_lock.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

namespace jackal_aic {
namespace {

using Times = std::vector<std::int64_t>;
constexpr std::int64_t kMs = 1000000, kSecond = 1000 * kMs, kPeriod = 20 * kMs;

/// What a timer of 50 Hz does that the lock sets.
struct Drive {
  std::vector<double> ages;     // of the newest measurement at each action [ms]
  std::vector<double> periods;  // between actions [ms]

  double age(double part) const {
    std::vector<double> sorted = ages;
    std::sort(sorted.begin(), sorted.end());
    return sorted.at(static_cast<std::size_t>(part * static_cast<double>(sorted.size() - 1)));
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
Times arrivals(
    std::int64_t period, std::int64_t end, std::int64_t first = 0,
    const std::function<std::int64_t()>& jitter = [] { return 0; }) {
  Times times;
  for (std::int64_t t = first; t < end; t += period) times.push_back(t + jitter());
  std::sort(times.begin(), times.end());
  return times;
}

Times operator+(Times a, const Times& b) {
  a.insert(a.end(), b.begin(), b.end());
  std::sort(a.begin(), a.end());
  return a;
}

TEST(PhaseLock, LocksToTheFirstMeasurementWhereverTheTimerStarted) {
  for (std::int64_t first = 0; first < kPeriod; first += kMs / 2) {
    const Drive locked = run(arrivals(kPeriod, 4 * kSecond), 4 * kSecond, first, kSecond);
    EXPECT_LE(locked.age(1.0), 0.6) << first;
    locked.expectPeriods(1e-3);
    const Drive starting = run(arrivals(kPeriod, kSecond, kMs / 10), kSecond, first, 50 * kMs);
    EXPECT_LE(starting.age(1.0), 0.6) << first;
    EXPECT_LE(*std::max_element(starting.periods.begin(), starting.periods.end()), 40.0);
    EXPECT_GE(*std::min_element(starting.periods.begin(), starting.periods.end()), 19.999);
  }
}

TEST(PhaseLock, KeepsItsRateWithoutMeasurementsAndLocksAgain) {
  run({}, 3 * kSecond).expectPeriods(0.0);
  run(arrivals(kPeriod, kSecond), 5 * kSecond, 3 * kMs, kSecond).expectPeriods(1e-3);
  const Times silence = arrivals(kPeriod, 2 * kSecond) + arrivals(kPeriod, 6 * kSecond, 4 * kSecond + 9 * kMs);
  EXPECT_LE(run(silence, 6 * kSecond, 0, 4 * kSecond + 50 * kMs).age(1.0), 0.6);
  const Times restarted = arrivals(kPeriod, 4 * kSecond) + arrivals(kPeriod, 8 * kSecond, 4 * kSecond + 12 * kMs);
  const Drive moved = run(restarted, 8 * kSecond, 0, 4 * kSecond);
  EXPECT_LE(moved.age(0.7), 0.6);
  moved.expectPeriods(0.6);
  EXPECT_LE(run(restarted, 8 * kSecond, 0, 6 * kSecond).age(1.0), 0.6);
}

TEST(PhaseLock, WaitsForJitterAndNotForRareDelays) {
  for (const double spread : {0.05, 0.1, 0.2}) {  // ms
    std::mt19937 random(5);
    std::normal_distribution<double> normal(0.0, spread * kMs);
    const auto late = [&] { return std::llabs(std::llround(normal(random))); };
    const Drive found = run(arrivals(kPeriod, 60 * kSecond, 0, late), 60 * kSecond);
    EXPECT_LE(found.age(0.5), 0.4 + 3.0 * spread) << spread;
    EXPECT_LE(found.age(0.99), 0.4 + 5.0 * spread) << spread;
    found.expectPeriods(0.6);
  }
  std::mt19937 random(6);
  const auto rarely = [&] { return random() % 100 == 0 ? 8 * kMs : static_cast<std::int64_t>(random() % 100000); };
  const Drive found = run(arrivals(kPeriod, 60 * kSecond, 0, rarely), 60 * kSecond);
  EXPECT_LE(found.age(0.98), 1.0);
  found.expectPeriods(0.5);
}

TEST(PhaseLock, FollowsDriftButNotATenthOfAMillisecond) {
  for (const double percent : {-1.0, -0.1, -0.01, 0.01, 0.1, 1.0}) {
    const std::int64_t period = kPeriod + std::llround(0.01 * percent * kPeriod);
    const Drive found = run(arrivals(period, 60 * kSecond), 60 * kSecond);
    EXPECT_LE(found.age(0.5), 0.7) << percent;
    EXPECT_LE(found.age(0.99), 1.5) << percent;
    found.expectPeriods(0.6);
  }
  Times times = arrivals(kPeriod, 20 * kSecond);
  for (std::int64_t& t : times) t -= t > 5 * kSecond ? kMs / 10 : 0;
  run(times, 20 * kSecond).expectPeriods(0.0);
}

TEST(PhaseLock, LostAndHeldBackMeasurementsDoNotDisturbIt) {
  std::mt19937 random(7);
  Times lossy, held, burst;
  for (std::int64_t t : arrivals(kPeriod, 60 * kSecond)) {
    if (random() % 5 != 0) lossy.push_back(t);
  }
  // Held back for 100 ms, once in a second.
  for (std::int64_t t : arrivals(kPeriod, 20 * kSecond)) {
    held.push_back(t % kSecond < 100 * kMs ? t / kSecond * kSecond + 109 * kMs : t);
  }
  for (std::int64_t begin = kSecond + 7 * kMs; begin < 10 * kSecond; begin += kSecond) {
    for (int i = 0; i < 100; ++i) burst.push_back(begin + i * kMs / 100);
  }
  const struct {
    Times times;
    double part, age, period;  // -, ms, ms
  } rows[] = {
      {lossy, 0.75, 0.6, 1e-3}, {held, 0.8, 0.6, 1e-3}, {arrivals(kPeriod, 10 * kSecond) + burst, 0.9, 0.6, 0.1}};
  for (const auto& row : rows) {
    const Drive found = run(row.times, row.times.back());
    EXPECT_LE(found.age(row.part), row.age);
    found.expectPeriods(row.period);
  }
}

TEST(PhaseLock, MeetsMeasurementsOfAnotherRateWhereItCan) {
  // Each pair of wheels at 50 Hz and an IMU at 80 Hz comes with the IMU sample after that of the wheels: the pairs
  // spread over 10 ms, and a free timer would find ages of up to 30 ms, 15 on average.
  Times pairs;
  constexpr std::int64_t kImu = 12500000;
  for (std::int64_t t : arrivals(kPeriod, 20 * kSecond)) pairs.push_back((t + 3 * kMs + kImu - 1) / kImu * kImu);
  const struct {
    Times times;
    double part, age, period;  // -, ms, ms
  } rows[] = {{arrivals(10 * kMs, 20 * kSecond), 1.0, 0.6, 0.5},
              {arrivals(50 * kMs, 20 * kSecond), 0.19, 0.6, 1e-3},
              {arrivals(kImu, 20 * kSecond), 1.0, 12.5, 0.5},
              {pairs, 1.0, 13.0, 0.1},
              {pairs, 0.5, 8.0, 0.1}};
  for (const auto& row : rows) {
    const Drive found = run(row.times, 20 * kSecond);
    EXPECT_LE(found.age(row.part), row.age);
    found.expectPeriods(row.period);
  }
}

TEST(PhaseLock, ActsOncePerPeriodWhateverTheArrivals) {
  std::mt19937 random(8);
  for (int trial = 0; trial < 50; ++trial) {
    Times times;
    for (std::int64_t t = 0; t < 20 * kSecond; t += static_cast<std::int64_t>(random() % (40 * kMs))) {
      times.push_back(t);
    }
    run(times, 20 * kSecond).expectPeriods(0.5);
  }
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

}  // namespace
}  // namespace jackal_aic
