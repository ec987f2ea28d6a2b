#include "jackal_aic/safety/phase_lock.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

namespace jackal_aic {
namespace {

constexpr std::int64_t kMs = 1000000, kSecond = 1000 * kMs, kPeriod = 20 * kMs;

/// What a timer at 50 Hz, kept by the lock, does beside measurements.
struct Drive {
  std::vector<double> ages;     // of the newest measurement at each action [ms]
  std::vector<double> periods;  // between actions [ms]

  static double percentile(std::vector<double> values, double part) {
    std::sort(values.begin(), values.end());
    return values.at(static_cast<std::size_t>(part * static_cast<double>(values.size() - 1)));
  }
  double age(double part) const { return percentile(ages, part); }
  double longest() const { return *std::max_element(periods.begin(), periods.end()); }
  double shortest() const { return *std::min_element(periods.begin(), periods.end()); }
};

/// Measurements that come at these times [ns], sorted; the timer starts at `first`, and what it does from `from` on
/// counts.
Drive run(const std::vector<std::int64_t>& arrivals, std::int64_t end, std::int64_t first = 7 * kMs,
          std::int64_t from = 2 * kSecond) {
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
std::vector<std::int64_t> arrivals(
    std::int64_t period, std::int64_t end, std::int64_t first = 0,
    const std::function<std::int64_t()>& jitter = [] { return 0; }) {
  std::vector<std::int64_t> times;
  for (std::int64_t t = first; t < end; t += period) times.push_back(t + jitter());
  std::sort(times.begin(), times.end());
  return times;
}

TEST(PhaseLock, ActsRightAfterTheMeasurementWhereverTheTimerStarted) {
  for (std::int64_t first = 0; first < kPeriod; first += kMs / 2) {
    const Drive found = run(arrivals(kPeriod, 4 * kSecond), 4 * kSecond, first, kSecond);
    EXPECT_LE(found.age(1.0), 0.6) << first;
    EXPECT_NEAR(found.longest(), 20.0, 1e-3) << first;
    EXPECT_NEAR(found.shortest(), 20.0, 1e-3) << first;
  }
}

TEST(PhaseLock, IsLockedWithTheFirstMeasurement) {
  for (std::int64_t first = 0; first < kPeriod; first += kMs) {
    const Drive found = run(arrivals(kPeriod, kSecond, kMs / 10), kSecond, first, 50 * kMs);
    EXPECT_LE(found.age(1.0), 0.6) << first;
    EXPECT_LE(found.longest(), 40.0);
    EXPECT_GE(found.shortest(), 19.999);
  }
}

TEST(PhaseLock, KeepsItsRateWithoutMeasurements) {
  const Drive never = run({}, 3 * kSecond);
  EXPECT_EQ(never.longest(), 20.0);
  EXPECT_EQ(never.shortest(), 20.0);
  const Drive silent = run(arrivals(kPeriod, kSecond), 5 * kSecond, 3 * kMs, kSecond);
  EXPECT_NEAR(silent.longest(), 20.0, 1e-3);
  EXPECT_NEAR(silent.shortest(), 20.0, 1e-3);
}

TEST(PhaseLock, LocksAnewAfterASilence) {
  auto times = arrivals(kPeriod, 2 * kSecond);
  const auto later = arrivals(kPeriod, 6 * kSecond, 4 * kSecond + 9 * kMs);
  times.insert(times.end(), later.begin(), later.end());
  EXPECT_LE(run(times, 6 * kSecond, 0, 4 * kSecond + 50 * kMs).age(1.0), 0.6);
}

TEST(PhaseLock, WaitsForJitterAndKeepsThePeriod) {
  for (const double spread : {0.05, 0.1, 0.2}) {  // ms
    std::mt19937 random(5);
    std::normal_distribution<double> normal(0.0, spread * kMs);
    const auto late = [&] { return std::llabs(std::llround(normal(random))); };
    const Drive found = run(arrivals(kPeriod, 60 * kSecond, 0, late), 60 * kSecond);
    EXPECT_LE(found.age(0.5), 0.4 + 3.0 * spread) << spread;
    EXPECT_LE(found.age(0.99), 0.4 + 5.0 * spread) << spread;
    EXPECT_LE(found.longest(), 20.6) << spread;
    EXPECT_GE(found.shortest(), 19.4) << spread;
  }
}

TEST(PhaseLock, DoesNotWaitForWhatIsLateOnceInAWhile) {
  std::mt19937 random(6);
  const auto late = [&] { return random() % 100 == 0 ? 8 * kMs : static_cast<std::int64_t>(random() % 100000); };
  const Drive found = run(arrivals(kPeriod, 60 * kSecond, 0, late), 60 * kSecond);
  EXPECT_LE(found.age(0.98), 1.0);
  EXPECT_NEAR(found.longest(), 20.0, 0.5);
  EXPECT_NEAR(found.shortest(), 20.0, 0.5);
}

TEST(PhaseLock, FollowsDrift) {
  for (const double percent : {-1.0, -0.1, -0.01, 0.01, 0.1, 1.0}) {
    const std::int64_t period = kPeriod + std::llround(0.01 * percent * kPeriod);
    const Drive found = run(arrivals(period, 60 * kSecond), 60 * kSecond);
    EXPECT_LE(found.age(0.5), 0.7) << percent;
    EXPECT_LE(found.age(0.99), 1.5) << percent;
    EXPECT_LE(found.longest(), 20.6) << percent;
    EXPECT_GE(found.shortest(), 19.4) << percent;
  }
}

TEST(PhaseLock, DoesNotMoveForATenthOfAMillisecond) {
  std::vector<std::int64_t> times = arrivals(kPeriod, 20 * kSecond);
  for (std::int64_t& t : times) t -= t > 5 * kSecond ? kMs / 10 : 0;
  const Drive found = run(times, 20 * kSecond);
  EXPECT_EQ(found.longest(), 20.0);
  EXPECT_EQ(found.shortest(), 20.0);
}

TEST(PhaseLock, FollowsSensorsThatStartAnewAtAnotherPhase) {
  auto times = arrivals(kPeriod, 4 * kSecond);
  const auto later = arrivals(kPeriod, 8 * kSecond, 4 * kSecond + 12 * kMs);
  times.insert(times.end(), later.begin(), later.end());
  const Drive found = run(times, 8 * kSecond, 0, 4 * kSecond);
  EXPECT_LE(found.age(0.7), 0.6);
  EXPECT_LE(found.longest(), 20.6);
  EXPECT_GE(found.shortest(), 19.4);
  EXPECT_LE(run(times, 8 * kSecond, 0, 6 * kSecond).age(1.0), 0.6);
}

TEST(PhaseLock, LostMeasurementsDoNotDisturbIt) {
  std::mt19937 random(7);
  std::vector<std::int64_t> times;
  for (std::int64_t t : arrivals(kPeriod, 60 * kSecond)) {
    if (random() % 5 != 0) times.push_back(t);
  }
  const Drive found = run(times, 60 * kSecond);
  EXPECT_LE(found.age(0.75), 0.6);
  EXPECT_NEAR(found.longest(), 20.0, 1e-3);
  EXPECT_NEAR(found.shortest(), 20.0, 1e-3);
}

TEST(PhaseLock, ABurstDoesNotDisturbIt) {
  std::vector<std::int64_t> times;
  for (std::int64_t t = 0; t < 20 * kSecond; t += kPeriod) {
    // Held up for 100 ms, once in a second.
    const std::int64_t held = t % kSecond < 100 * kMs ? t / kSecond * kSecond + 109 * kMs : t;
    times.push_back(held);
  }
  const Drive found = run(times, 20 * kSecond);
  EXPECT_LE(found.age(0.8), 0.6);
  EXPECT_NEAR(found.longest(), 20.0, 1e-3);
  EXPECT_NEAR(found.shortest(), 20.0, 1e-3);
}

TEST(PhaseLock, MeasurementsAtAnotherRateAreMetWhereTheyCanBe) {
  // Every action has one at 100 Hz, every fifth period two; at 20 Hz two actions of five.
  EXPECT_LE(run(arrivals(10 * kMs, 20 * kSecond), 20 * kSecond).age(1.0), 0.6);
  const Drive slow = run(arrivals(50 * kMs, 20 * kSecond), 20 * kSecond);
  EXPECT_LE(slow.age(0.19), 0.6);
  EXPECT_NEAR(slow.longest(), 20.0, 1e-3);
  EXPECT_NEAR(slow.shortest(), 20.0, 1e-3);
  const Drive fast = run(arrivals(12500000, 20 * kSecond), 20 * kSecond);
  EXPECT_LE(fast.age(1.0), 12.5);
  EXPECT_NEAR(fast.longest(), 20.0, 0.5);
  EXPECT_NEAR(fast.shortest(), 20.0, 0.5);
}

TEST(PhaseLock, WheelsAtFiftyBesideAnImuAtEightyAreMetOnceTheirPartnerHasCome) {
  // Each pair is there with the next IMU sample after the wheels'.
  std::vector<std::int64_t> times;
  constexpr std::int64_t kImu = 12500000;
  for (std::int64_t t = 0; t < 20 * kSecond; t += kPeriod) times.push_back((t + 3 * kMs + kImu - 1) / kImu * kImu);
  const Drive found = run(times, 20 * kSecond);
  // The pairs spread over 10 ms; a timer beside them finds ages of up to 30 ms, 15 on average.
  EXPECT_LE(found.age(1.0), 13.0);
  EXPECT_LE(found.age(0.5), 8.0);
  EXPECT_NEAR(found.longest(), 20.0, 0.1);
  EXPECT_NEAR(found.shortest(), 20.0, 0.1);
}

TEST(PhaseLock, NeverTwiceInAPeriodWhateverComes) {
  std::mt19937 random(8);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<std::int64_t> times;
    for (std::int64_t t = 0; t < 20 * kSecond; t += static_cast<std::int64_t>(random() % (40 * kMs))) {
      times.push_back(t);
    }
    const Drive found = run(times, 20 * kSecond);
    EXPECT_GE(found.shortest(), 19.5);
    EXPECT_LE(found.longest(), 20.5);
  }
}

TEST(PhaseLock, ATimerThatComesPeriodsLateGoesOnFromNow) {
  PhaseLock lock(kPeriod);
  EXPECT_EQ(lock.next(0, 13 * kMs), kPeriod) << "late by less than a period keeps the phase";
  EXPECT_EQ(lock.next(0, 39 * kMs), kPeriod);
  EXPECT_EQ(lock.next(0, 70 * kMs), 70 * kMs);
}

TEST(PhaseLock, ForgetsWithAReset) {
  PhaseLock lock(kPeriod);
  lock.arrived(5 * kMs);
  lock.reset();
  EXPECT_EQ(lock.next(7 * kMs, 7 * kMs), 27 * kMs);
}

TEST(PhaseLock, ABurstIsNoMeasurementOfItsOwn) {
  std::vector<std::int64_t> times = arrivals(kPeriod, 10 * kSecond);
  for (std::int64_t burst = kSecond + 7 * kMs; burst < 10 * kSecond; burst += kSecond) {
    for (int i = 0; i < 100; ++i) times.push_back(burst + i * kMs / 100);
  }
  std::sort(times.begin(), times.end());
  const Drive drive = run(times, 10 * kSecond);
  EXPECT_LT(drive.longest(), 20.1);
  EXPECT_GT(drive.shortest(), 19.9);
}

}  // namespace
}  // namespace jackal_aic
