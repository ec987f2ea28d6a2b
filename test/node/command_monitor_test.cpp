// The witness of the commands: silent about a controller that keeps its requirements, and not about one that does not.

#include "command_monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s

/// Commands every 20 ms, with set points and wheel speeds as often unless they are switched off.
class Stream {
 public:
  explicit Stream(const GateParameters& gate = gentle(), const GeometryParameters& geometry = {},
                  double longest_blind = 0.0)
      : monitor({}, gate, geometry, longest_blind) {}

  /// 1 m/s^2 and 2 rad/s^2, which show what is too sudden.
  static GateParameters gentle() {
    GateParameters gate;
    gate.limits.linear_acceleration = 1.0;
    gate.limits.angular_acceleration = 2.0;
    gate.brake.linear_deceleration = 1.0;
    gate.brake.angular_deceleration = 2.0;
    gate.brake.time = 2.5;
    return gate;
  }

  /// @return the first breach in a time [s] with one command [rad/s].
  std::optional<Breach> run(const WheelCommand& command, double duration) {
    for (const double end = now + duration; now < end; now += kPeriod) {
      if (sends_set_points) monitor.takeSetPoint(forward, 0.0, now);
      if (sends_wheels) monitor.takeWheels(now);
      const std::optional<Breach> breach = monitor.takeCommand(command, now);
      if (breach) return breach;
    }
    return std::nullopt;
  }

  /// A ramp that the limits allow [m/s].
  std::optional<Breach> rampTo(double speed) {
    const double target = speed / GeometryParameters{}.wheel_radius;
    const double step = (target > wheel ? 1.0 : -1.0) * 0.2;
    while (std::abs(target - wheel) > std::abs(step)) {
      wheel += step;
      if (const auto breach = run({wheel, wheel}, 0.5 * kPeriod)) return breach;
    }
    wheel = target;
    return run({wheel, wheel}, 0.5 * kPeriod);
  }

  CommandMonitor monitor;
  double now = 1.0;      // s
  double forward = 0.5;  // of the set point [m/s]
  double wheel = 0.0;    // rad/s
  bool sends_set_points = true;
  bool sends_wheels = true;
};

TEST(CommandMonitor, SaysNothingOfADriveWithinTheLimits) {
  Stream stream;
  EXPECT_FALSE(stream.rampTo(0.5));
  EXPECT_FALSE(stream.run({stream.wheel, stream.wheel}, 60.0));
  stream.forward = 0.0;
  EXPECT_FALSE(stream.rampTo(0.0));
  EXPECT_FALSE(stream.run({}, 60.0));
  EXPECT_GT(stream.monitor.commands(), 6000u);
}

TEST(CommandMonitor, AccusesWhatIsTooFastOrTooSuddenOrNoNumber) {
  Stream stream;
  EXPECT_EQ(stream.run({25.0, 25.0}, 0.1), Breach::speed) << "2.45 m/s";
  EXPECT_EQ(stream.run({-6.0, 6.0}, 0.1), Breach::acceleration);
  EXPECT_EQ(stream.run({std::numeric_limits<double>::quiet_NaN(), 0.0}, 0.1), Breach::not_finite);
  EXPECT_EQ(stream.monitor.count(Breach::speed), 1u);
  EXPECT_EQ(stream.monitor.count(Breach::acceleration), 1u);
  EXPECT_EQ(stream.monitor.count(Breach::not_finite), 1u);
}

TEST(CommandMonitor, AccusesMotionThatNobodyAskedFor) {
  Stream stream;
  stream.sends_set_points = false;
  EXPECT_EQ(stream.run({0.1, 0.1}, 0.1), Breach::no_set_point);
  Stream silent;
  EXPECT_FALSE(silent.rampTo(0.2));
  silent.sends_set_points = false;
  const double since = silent.now;
  EXPECT_EQ(silent.run({silent.wheel, silent.wheel}, 10.0), Breach::old_set_point);
  EXPECT_NEAR(silent.now - since, 0.5 + 2.5, 0.1) << "deadline and the brake's time";
}

TEST(CommandMonitor, AccusesARobotThatIsToldToStandAndDoesNot) {
  Stream stream;
  EXPECT_FALSE(stream.rampTo(0.001));
  stream.forward = 0.0;
  const double since = stream.now;
  EXPECT_EQ(stream.run({stream.wheel, stream.wheel}, 10.0), Breach::no_standstill);
  EXPECT_NEAR(stream.now - since, 5.0, 0.1);
  stream.forward = 0.5;
  EXPECT_FALSE(stream.run({stream.wheel, stream.wheel}, 10.0));
}

TEST(CommandMonitor, AccusesDrivingWithoutWheelSpeedsAndPastAnEmergencyStop) {
  Stream blind;
  EXPECT_FALSE(blind.rampTo(0.2));
  blind.sends_wheels = false;
  const double since = blind.now;
  EXPECT_EQ(blind.run({blind.wheel, blind.wheel}, 10.0), Breach::no_wheels);
  EXPECT_NEAR(blind.now - since, 0.2 + 2.5, 0.1);
  Stream stopped;
  EXPECT_FALSE(stopped.rampTo(0.2));
  stopped.monitor.takeEmergencyStop(true, stopped.now);
  EXPECT_EQ(stopped.run({stopped.wheel, stopped.wheel}, 10.0), Breach::stop_ignored);
  stopped.monitor.takeEmergencyStop(false, stopped.now);
  EXPECT_FALSE(stopped.run({stopped.wheel, stopped.wheel}, 10.0));
}

TEST(CommandMonitor, ReckonsWithTheSlipFactor) {
  GateParameters gate;
  gate.limits.linear_acceleration = gate.limits.angular_acceleration = 0.0;
  GeometryParameters slipping;
  slipping.slip_factor = 0.9;
  const double limit = gate.limits.linear_speed / (0.9 * slipping.wheel_radius);
  EXPECT_FALSE(Stream(gate, slipping).run({limit, limit}, 0.1));
  EXPECT_EQ(Stream(gate, slipping).run({1.01 * limit, 1.01 * limit}, 0.1), Breach::speed);
}

TEST(CommandMonitor, WhereAnAccelerationIsNotBoundedNoneIsTooSudden) {
  GateParameters gate = Stream::gentle();
  gate.limits.linear_acceleration = 0.0;
  gate.limits.linear_deceleration = 1.0;
  Stream stream(gate);
  EXPECT_FALSE(stream.run({}, 0.1));
  EXPECT_FALSE(stream.run({15.0, 15.0}, 0.1));
  EXPECT_EQ(stream.run({9.0, 21.0}, 0.1), Breach::acceleration) << "the turn is bounded";
}

TEST(CommandMonitor, AllowsWhatTheControllerMayDriveBlind) {
  Stream blind(Stream::gentle(), {}, 4.0);
  EXPECT_FALSE(blind.rampTo(0.2));
  blind.sends_wheels = false;
  const double since = blind.now;
  EXPECT_EQ(blind.run({blind.wheel, blind.wheel}, 20.0), Breach::no_wheels);
  EXPECT_NEAR(blind.now - since, 4.0 + 0.2 + 2.5, 0.1);
  Stream open_loop(Stream::gentle(), {}, HUGE_VAL);
  open_loop.sends_wheels = false;
  EXPECT_FALSE(open_loop.rampTo(0.2));
  EXPECT_FALSE(open_loop.run({open_loop.wheel, open_loop.wheel}, 20.0));
}

TEST(CommandMonitor, EveryBreachHasItsRequirement) {
  EXPECT_STREQ(kMonitored[static_cast<std::size_t>(Breach::speed)].id, "LIM-1");
  EXPECT_STREQ(kMonitored[static_cast<std::size_t>(Breach::stop_ignored)].id, "STO-1");
}

}  // namespace
}  // namespace jackal_aic
