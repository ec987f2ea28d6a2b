#include "jackal_aic/faults/wheel_monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "jackal_aic/model/wheel_belief.hpp"

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;   // s
constexpr double kRadius = 0.098;  // m

PlantModel model() {
  PlantModel m;
  m.dead_time = 0.08;
  m.lag = 0.01;
  m.acceleration_limit = 1.65;
  m.identified = true;
  return m;
}

/// A wheel, and the monitor that watches its encoder.
class WatchedWheel {
 public:
  explicit WatchedWheel(const PlantModel& real = model(), const FaultParameters& parameters = {})
      : monitor(parameters, model(), kRadius), wheel_(real, kRadius, {}) {
    monitor.start(0.0);
  }

  /// Drives for some samples; returns how many of them did not count. @param measured makes of the true speed
  /// [rad/s] what the encoder says.
  template <class Measured>
  int drive(double command, int samples, Measured measured) {
    int left_out = 0;
    for (int i = 0; i < samples; ++i) {
      for (int k = 0; k < 20; ++k) {
        monitor.predict(command);
        wheel_.predict(command);
      }
      const double y = measured(wheel_.speed());
      monitor.compare(y, kPeriod);
      monitor.conclude(y, kPeriod);
      left_out += monitor.state() == ChannelState::ok ? 0 : 1;
    }
    return left_out;
  }

  int drive(double command, int samples) {
    return drive(command, samples, [this](double speed) { return speed + noise(); });
  }

  double noise() { return 0.03 * normal_(random_); }

  WheelMonitor monitor;

 private:
  WheelBelief wheel_;
  std::mt19937 random_{3};
  std::normal_distribution<double> normal_{0.0, 1.0};
};

TEST(WheelMonitor, AWheelThatIsEarlierOrLaterThanItsModelIsNoFault) {
  for (const double dead_time : {0.01, 0.04, 0.12, 0.16}) {
    PlantModel real = model();
    real.dead_time = dead_time;
    WatchedWheel wheel(real);
    int left_out = 0;
    for (const double command : {5.0, -5.0, 10.0, 0.0, -8.0, 8.0, 0.0}) left_out += wheel.drive(command, 75);
    EXPECT_EQ(left_out, 0) << dead_time;
  }
}

TEST(WheelMonitor, AnEncoderThatHoldsItsValueIsBelievedUpAndDown) {
  WatchedWheel wheel;
  int k = 0;
  double held = 0.0;
  const auto holds = [&](double speed) {
    if (k++ % 3 == 0) held = speed + wheel.noise();
    return held;
  };
  for (const double command : {5.0, -5.0, 0.0}) wheel.drive(command, 75, holds);  // it learns for how long
  for (const double command : {5.0, -5.0, 10.0, 0.0, -10.0, 0.0, 3.0, 0.0}) {
    EXPECT_EQ(wheel.drive(command, 75, holds), 0) << "to " << command;
  }
}

TEST(WheelMonitor, AFineEncoderThatStaysWhereItWasWhileItsWheelMovesIsFrozen) {
  for (const double direction : {1.0, -1.0}) {
    WatchedWheel wheel;
    const auto quantised = [&](double speed) { return 0.1 * std::round((speed + wheel.noise()) / 0.1); };
    wheel.drive(5.0 * direction, 150, quantised);
    wheel.drive(8.0 * direction, 40, [&](double) { return 5.0 * direction; });
    EXPECT_TRUE(wheel.monitor.frozen()) << direction;
    EXPECT_EQ(wheel.monitor.state(), ChannelState::faulty);
  }
}

TEST(WheelMonitor, ACoarseEncoderDoesNotMissWhatIsSmallerThanItsSteps) {
  WatchedWheel wheel;
  const auto quantised = [](double speed) { return 0.2 * std::round(speed / 0.2); };
  wheel.drive(5.0, 150, quantised);
  for (const double command : {5.05, 4.95, 5.08}) {
    EXPECT_EQ(wheel.drive(command, 100, quantised), 0) << command;
    EXPECT_FALSE(wheel.monitor.frozen());
  }
}

TEST(WheelMonitor, AWheelThatSomebodyElseDrivesIsFollowed) {
  WatchedWheel wheel;
  wheel.drive(0.0, 50);
  wheel.monitor.follow(6.0);
  EXPECT_NEAR(wheel.monitor.speed(), 6.0, 1e-9);
  for (int k = 0; k < 20; ++k) wheel.monitor.predict(6.0);
  wheel.monitor.compare(6.0, kPeriod);
  EXPECT_FALSE(wheel.monitor.suspect());
  EXPECT_LT(wheel.monitor.uncertainty(), 0.1) << "it does not come from rest";
}

/// Stiction: a wheel that stands starts at 0.75 rad/s, and one that turns goes on down to rest.
TEST(WheelMonitor, AWheelThatSticksAtASmallCommandAndThenStartsIsNoFault) {
  for (const double sign : {1.0, -1.0}) {
    WatchedWheel wheel;
    bool stands = true;
    const auto sticks = [&](double speed) {
      stands = stands ? std::abs(speed) < 0.75 : std::abs(speed) < 0.02;
      return stands ? 0.0 : speed + wheel.noise();
    };
    const auto coarse = [&](double speed) { return 0.06 * std::round(sticks(speed) / 0.06); };
    wheel.drive(3.0 * sign, 100, coarse);
    int left_out = 0;
    for (int k = 0; k < 100; ++k) left_out += wheel.drive(sign * (0.2 - 0.01 * k), 1, coarse);  // to the other side
    for (int k = 0; k < 100; ++k) left_out += wheel.drive(sign * (-0.8 + 0.01 * k), 1, coarse);
    EXPECT_EQ(left_out, 0) << sign;
  }
}

TEST(WheelMonitor, AnUnidentifiedDriveTrainMayBeSlow) {
  PlantModel unknown = model();
  unknown.identified = false;
  PlantModel soft = model();
  soft.lag = 0.25;
  WheelMonitor monitor({}, unknown, kRadius);
  WheelBelief wheel(soft, kRadius, {});
  monitor.start(0.0);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  int left_out = 0;
  for (const double command : {3.0, -3.0, 5.0, 0.0}) {
    for (int i = 0; i < 100; ++i) {
      for (int k = 0; k < 20; ++k) {
        monitor.predict(command);
        wheel.predict(command);
      }
      const double y = wheel.speed() + 0.03 * normal(random);
      monitor.compare(y, kPeriod);
      monitor.conclude(y, kPeriod);
      left_out += monitor.state() == ChannelState::ok ? 0 : 1;
    }
  }
  EXPECT_EQ(left_out, 0);
}

}  // namespace
}  // namespace jackal_aic
