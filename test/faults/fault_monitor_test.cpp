#include "jackal_aic/faults/fault_monitor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/gravity.hpp"
#include "jackal_aic/model/wheel_belief.hpp"
#include "jackal_aic/predictive/wheel_controller.hpp"

namespace jackal_aic {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

PlantModel model() {
  PlantModel m;
  m.dead_time = 0.08;
  m.lag = 0.01;
  m.acceleration_limit = 1.65;
  m.effective_track = 0.55;
  return m;
}

/// A robot that does what the model says, with noise, and its monitor.
class Robot {
 public:
  explicit Robot(const FaultParameters& parameters = {}, const PlantModel& plant = model())
      : monitor_(parameters, {}, plant), left_(plant, 0.098, {}), right_(left_) {}

  /// Drives for a time [s] and looks at every sample. @param fault changes the samples.
  template <class Fault>
  const FaultReport& drive(const WheelCommand& command, double duration, Fault fault) {
    for (long k = std::lround(duration / 0.001); k > 0; --k, ++steps_) {
      if (steps_ % 20 == 0) {
        Observation y = sample();
        fault(y);
        monitor_.check(y);
      }
      monitor_.advance(command, 0.001);
      left_.predict(command.left);
      right_.predict(command.right);
    }
    return monitor_.report();
  }

  const FaultReport& drive(const WheelCommand& command, double duration) {
    return drive(command, duration, [](Observation&) {});
  }

  /// A sample now.
  Observation sample() {
    Observation y;
    y.stamp = 0.001 * static_cast<double>(steps_);
    y.wheel_left = left_.speed() + 0.03 * noise_(random_);
    y.wheel_right = right_.speed() + 0.03 * noise_(random_);
    y.yaw_rate = 0.098 * (right_.speed() - left_.speed()) / 0.55 + 0.005 * noise_(random_);
    y.acceleration_x = 0.098 * 0.5 * (left_.acceleration() + right_.acceleration()) + 0.05 * noise_(random_);
    y.acceleration_z = kGravity + 0.05 * noise_(random_);
    return y;
  }

  FaultMonitor& monitor() { return monitor_; }

 private:
  FaultMonitor monitor_;
  WheelBelief left_;
  WheelBelief right_;
  long steps_ = 0;
  std::mt19937 random_{5};
  std::normal_distribution<double> noise_{0.0, 1.0};
};

constexpr WheelCommand kStraight{5.0, 5.0};
constexpr WheelCommand kTurn{-1.4, 1.4};

TEST(FaultParametersCheck, MoreFaultSamplesThanTheWindowHoldsAreRefused) {
  FaultParameters parameters;
  parameters.fault_samples = 9;
  try {
    FaultMonitor(parameters, {}, model());
    FAIL();
  } catch (const ParameterError& error) {
    EXPECT_STREQ(error.what(), "faults.fault_samples = 9: must be at most faults.fault_window = 8");
  }
}

TEST(FaultMonitor, SaysNothingWhenNothingIsWrong) {
  Robot robot;
  for (const WheelCommand& command : {kStraight, kTurn, WheelCommand{}, WheelCommand{-3.0, 4.0}}) {
    const FaultReport& report = robot.drive(command, 3.0);
    EXPECT_FALSE(report.faulty());
    EXPECT_TRUE(report.valid().all());
    EXPECT_STREQ(report.reason(), "");
  }
}

/// A robot without an identified model: what differs from its model is a remark.
PlantModel assumed() {
  PlantModel m = model();
  m.identified = false;
  return m;
}

TEST(FaultMonitor, ARemarkOnTheWheelsTellsHowFarTheyReachTheirCommands) {
  for (const double scale : {0.5, 1.9}) {
    Robot robot({}, assumed());
    const auto scaled = [&](Observation& y) {
      y.wheel_left *= scale;
      y.wheel_right *= scale;
    };
    const FaultReport& report = robot.drive(kStraight, 1.5, scaled);
    ASSERT_TRUE(report.wheels_off_model) << scale << " " << report.reason();
    EXPECT_NEAR(report.wheel_share, scale, 0.05);
  }
}

TEST(FaultMonitor, ARemarkOnTheTurnTellsHowFarItReachesThatOfTheWheels) {
  for (const double scale : {0.4, 1.8}) {
    Robot robot({}, assumed());
    const FaultReport& report = robot.drive(kTurn, 1.5, [&](Observation& y) { y.yaw_rate *= scale; });
    ASSERT_TRUE(report.turn_off_model) << scale << " " << report.reason();
    EXPECT_NEAR(report.turn_share, scale, 0.05);
  }
}

TEST(FaultText, OfARemarkHasItsNumber) {
  EXPECT_EQ(text(Fault::wheels_off_model, 0.496), "wheels reach 50 % of their commands");
  EXPECT_EQ(text(Fault::wheels_off_model, -1.0), "wheels reach -100 % of their commands");
  EXPECT_EQ(text(Fault::wheels_off_model, std::numeric_limits<double>::infinity()),
            "wheels reach 999 % of their commands");
  EXPECT_EQ(text(Fault::turn_off_model, 1.8), "robot reaches 180 % of the yaw rate of its wheels");
  EXPECT_EQ(text(Fault::stuck, 0.5), text(Fault::stuck)) << "no number";
}

TEST(FaultMonitor, TellsWhichSideAndWhy) {
  const auto reason = [](auto fault) {
    Robot robot;
    robot.drive(kStraight, 3.0);
    return std::string(robot.drive(kStraight, 0.3, fault).reason());
  };
  EXPECT_EQ(reason([](Observation& y) { y.wheel_left = 5.01; }), "left encoder frozen");
  EXPECT_EQ(reason([](Observation& y) { y.wheel_right = 5.01; }), "right encoder frozen");
  EXPECT_EQ(reason([](Observation& y) { y.wheel_left += 2.0; }), "left encoder wrong");
  EXPECT_EQ(reason([](Observation& y) { y.wheel_right -= 2.0; }), "right encoder wrong");
  EXPECT_EQ(reason([](Observation& y) { y.yaw_rate += 0.2; }), "gyro disagrees with the wheels");
  EXPECT_EQ(reason([](Observation& y) { y.yaw_rate = 0.001; }), "gyro frozen");
  EXPECT_EQ(reason([](Observation& y) { y.acceleration_z = -9.8; }), "IMU upside down");
  EXPECT_EQ(reason([](Observation& y) { y.acceleration_x += 8.0; }), "accelerometer wrong");
  const double turn = 0.098 * 5.0 / 0.55;  // yaw rate when one wheel stands
  EXPECT_EQ(reason([&](Observation& y) { y.wheel_left = 0.0, y.yaw_rate += turn; }),
            "left wheels do not follow their command");
  EXPECT_EQ(reason([&](Observation& y) { y.wheel_right = 0.0, y.yaw_rate -= turn; }),
            "right wheels do not follow their command");
  EXPECT_EQ(reason([&](Observation& y) { y.wheel_left = y.wheel_right = 0.0; }), "wheels do not follow their command");
}

/// A driver that publishes zero for every small rate: at rest, on a straight line and in between.
TEST(FaultMonitor, AGyroWithADeadZoneIsNotFrozen) {
  for (const double dead_zone : {0.005, 0.01, 0.03, 0.05}) {
    Robot robot;
    int zeros = 0;
    const auto cut = [&](Observation& y) {
      EXPECT_FALSE(robot.monitor().report().faulty())
          << robot.monitor().report().reason() << ", " << dead_zone << " rad/s, at " << y.stamp << " s";
      if (std::abs(y.yaw_rate) >= dead_zone) return;
      y.yaw_rate = 0.0;
      ++zeros;
    };
    for (const WheelCommand& command : {WheelCommand{}, kTurn, kStraight, WheelCommand{}, kStraight, kTurn,
                                        WheelCommand{4.9, 5.1}, WheelCommand{-3.0, 4.0}, kStraight, WheelCommand{}}) {
      robot.drive(command, 3.0, cut);
    }
    EXPECT_GT(zeros, 400);
  }
}

TEST(FaultMonitor, AGyroThatIsFrozenAtZeroIsFoundWhenTheRobotShouldTurn) {
  const auto freeze = [](Observation& y) { y.yaw_rate = 0.0; };
  for (const bool identified : {true, false}) {
    PlantModel plant = model();
    plant.identified = identified;
    const double in_time = identified ? 1.1 : 1.4;  // s; a drive train may be slow, and reverses its wheels
    for (const WheelCommand& turn : {kTurn, WheelCommand{1.4, -1.4}, WheelCommand{4.0, 6.0}, WheelCommand{2.0, -2.0}}) {
      for (const bool turned_before : {true, false}) {
        for (const WheelCommand& before : {WheelCommand{}, kStraight}) {
          SCOPED_TRACE("to " + std::to_string(turn.left) + " and " + std::to_string(turn.right) + " rad/s");
          Robot robot({}, plant);
          robot.drive(turned_before ? kTurn : kStraight, 3.0);
          robot.drive(before, 2.0);
          EXPECT_FALSE(robot.drive(before, 2.0, freeze).faulty()) << "reads what it should";
          EXPECT_STREQ(robot.drive(turn, in_time, freeze).reason(), "gyro frozen");
          EXPECT_STREQ(robot.drive(before, 3.0, freeze).reason(), "gyro frozen") << "at any reading";
          EXPECT_FALSE(robot.drive(turn, 5.0).faulty()) << "it lives again";
        }
      }
    }
  }
}

TEST(FaultMonitor, GyroOfTheWrongSignIsToldAndStaysOut) {
  Robot robot;
  const auto flip = [](Observation& y) { y.yaw_rate = -y.yaw_rate; };
  robot.drive(kStraight, 3.0, flip);
  EXPECT_FALSE(robot.monitor().report().faulty()) << "a straight line does not tell the sign";
  EXPECT_STREQ(robot.drive(kTurn, 1.2, flip).reason(), "gyro turns against the wheels: mounted upside down?");
  for (const WheelCommand& command : {kStraight, WheelCommand{}, kTurn, WheelCommand{-3.0, 4.0}, kStraight}) {
    const FaultReport& report = robot.drive(command, 5.0, flip);
    EXPECT_FALSE(report.valid().yaw_rate) << "it agrees with the wheels where they do not turn the robot";
    EXPECT_EQ(report.fault(), Fault::gyro_reversed);
  }
  EXPECT_FALSE(robot.drive(kTurn, 12.0).faulty()) << "turned over, it counts again";
}

TEST(FaultMonitor, VibrationOfARealRobotIsNoFaultAndBlindsNobody) {
  // A Husky on asphalt at 1 m/s: 2.07, 2.69 and 0.93 m/s^2 and 0.019 rad/s; it grows with the speed.
  for (const double scale : {0.3, 1.0, 1.5}) {
    Robot robot;
    std::mt19937 random(17);
    std::normal_distribution<double> unit(0.0, 1.0);
    const auto vibrate = [&](Observation& y) {
      const double speed = scale * 0.098 * 0.5 * std::abs(y.wheel_left + y.wheel_right);
      y.acceleration_x += 2.07 * speed * unit(random);
      y.acceleration_y += 2.69 * speed * unit(random);
      *y.acceleration_z += 0.93 * speed * unit(random);
      y.yaw_rate += 0.019 * speed * unit(random);
    };
    int samples = 0, without_accelerometer = 0;
    for (int lap = 0; lap < 10; ++lap) {
      for (const WheelCommand& command : {WheelCommand{10.0, 10.0}, WheelCommand{5.0, 8.0}, WheelCommand{}}) {
        for (int i = 0; i < 200; ++i, ++samples) {
          const FaultReport& report = robot.drive(command, 0.02, vibrate);
          EXPECT_FALSE(isFault(report.fault())) << report.reason() << ", scale " << scale << ", lap " << lap;
          if (isFault(report.fault())) return;
          without_accelerometer += report.valid().acceleration ? 0 : 1;
        }
      }
    }
    EXPECT_LT(without_accelerometer, samples / 50) << scale;
    robot.drive({10.0, 10.0}, 4.0, vibrate);
    const auto blocked = [&](Observation& y) {
      vibrate(y);
      y.yaw_rate += 0.098 * y.wheel_left / 0.55;
      y.wheel_left = 0.0;
    };
    EXPECT_STREQ(robot.drive({10.0, 10.0}, 0.5, blocked).reason(), "left wheels do not follow their command") << scale;
  }
}

TEST(FaultMonitor, FaultyChannelsDoNotCount) {
  Robot robot;
  robot.drive(kTurn, 3.0);
  const auto flip = [](Observation& y) {
    y.yaw_rate = -y.yaw_rate;
    y.acceleration_z = -*y.acceleration_z;
  };
  EXPECT_EQ(robot.drive(kTurn, 0.3, flip).valid(), (ChannelValidity{false, true, true, false}));
}

TEST(FaultMonitor, WheelThatDoesNotFollowKeepsItsEncoder) {
  Robot robot;
  robot.drive(kStraight, 3.0);
  const double turn = 0.098 * 5.0 / 0.55;
  const FaultReport& report =
      robot.drive(kStraight, 0.3, [&](Observation& y) { y.wheel_left = 0.0, y.yaw_rate += turn; });
  EXPECT_TRUE(report.drive_left);
  EXPECT_TRUE(report.valid().wheel_left) << "it tells the truth";
}

TEST(FaultMonitor, OneOutlierIsLeftOutAndForgotten) {
  Robot robot;
  robot.drive(kStraight, 3.0);
  const FaultReport& during = robot.drive(kStraight, 0.02, [](Observation& y) { y.wheel_left += 10.0; });
  EXPECT_EQ(during.wheel_left.state, ChannelState::outlier);
  EXPECT_GT(during.wheel_left.distance, 1.0);
  EXPECT_EQ(during.valid(), (ChannelValidity{true, false, true, true}));
  EXPECT_FALSE(during.faulty());
  EXPECT_TRUE(robot.drive(kStraight, 0.02).valid().all());
}

TEST(FaultMonitor, LearnsTheNoise) {
  Robot robot;
  const auto noisier = [noise = std::normal_distribution<double>(0.0, 0.15), random = std::mt19937(1)](
                           Observation& y) mutable { y.wheel_left += noise(random), y.wheel_right += noise(random); };
  EXPECT_FALSE(robot.drive(kStraight, 60.0, noisier).faulty());
  EXPECT_TRUE(robot.drive(kStraight, 0.3, [](Observation& y) { y.wheel_left = 0.0; }).faulty());
}

TEST(FaultMonitor, SamplesThatAreNoneChangeNothing) {
  Robot robot;
  robot.drive(kStraight, 3.0);
  Observation broken = robot.sample();
  broken.wheel_left = kNan;
  for (int k = 0; k < 20; ++k) EXPECT_FALSE(robot.monitor().check(broken).faulty());
  Observation stale = robot.sample();
  stale.stamp = 1.0;
  stale.wheel_left = 0.0;
  for (int k = 0; k < 20; ++k) EXPECT_FALSE(robot.monitor().check(stale).faulty());
}

TEST(FaultMonitor, LostChannelsAreNotJudged) {
  Robot robot;
  robot.drive(kStraight, 3.0);
  const FaultReport& report = robot.drive(kTurn, 3.0, [](Observation& y) {
    y.valid = {false, false, true, false};
    y.yaw_rate = y.wheel_left = y.acceleration_x = kNan;
  });
  EXPECT_FALSE(report.faulty());
  EXPECT_FALSE(robot.drive(kStraight, 1.0).faulty()) << "nor when they are back";
}

TEST(FaultMonitor, ResetForgetsFaults) {
  Robot robot;
  robot.drive(kStraight, 3.0);
  ASSERT_TRUE(robot.drive(kStraight, 0.3, [](Observation& y) { y.wheel_left = 0.0; }).faulty());
  robot.monitor().reset();
  EXPECT_FALSE(robot.monitor().report().faulty());
}

/// A driver that was started again may have another sign, or another sensor.
TEST(FaultMonitor, RestartForgetsTheSignOfAGyro) {
  Robot robot;
  robot.drive(kTurn, 3.0, [](Observation& y) { y.yaw_rate = -y.yaw_rate; });
  ASSERT_EQ(robot.monitor().report().fault(), Fault::gyro_reversed);
  robot.monitor().restart();
  EXPECT_FALSE(robot.drive(kStraight, 0.5).faulty());
}

/// Rounds the wheel speeds to steps of an encoder.
Observation rounded(Observation y, double step) {
  y.wheel_left = step * std::round(y.wheel_left / step);
  y.wheel_right = step * std::round(y.wheel_right / step);
  return y;
}

TEST(FaultMonitor, WheelsThatAreToStandAndTurnAreMoved) {
  for (double yaw_rate : {0.0, 1.5, -0.7}) {  // pushed straight, turned with the wheels on the ground, spun in the air
    Robot robot;
    robot.drive(kStraight, 3.0);
    // Nearly at rest: a controller's command is hardly ever zero to the bit.
    robot.drive({0.02, -0.01}, 3.0);
    const auto push = [&](Observation& y) { y.wheel_left += 2.0, y.wheel_right += 5.0, y.yaw_rate += yaw_rate; };
    const FaultReport& pushed = robot.drive({0.02, -0.01}, 5.0, push);
    EXPECT_TRUE(pushed.moved);
    EXPECT_FALSE(pushed.drive_left || pushed.drive_right);
    EXPECT_NE(pushed.wheel_left.state, ChannelState::faulty);
    EXPECT_NE(pushed.wheel_right.state, ChannelState::faulty);
    EXPECT_FALSE(pushed.valid().wheel_left || pushed.valid().wheel_right) << "the controller is not to fight it";
    robot.drive({}, 1.5);
    EXPECT_TRUE(robot.monitor().report().valid().wheel_left && robot.monitor().report().valid().wheel_right);
    EXPECT_STREQ(robot.drive(kStraight, 2.0).reason(), "") << "nothing is left of it";
  }
}

TEST(FaultMonitor, TellsThatTheRobotIsMoved) {
  Robot robot;
  robot.drive({}, 2.0);
  const FaultReport& pushed = robot.drive({}, 1.0, [](Observation& y) { y.wheel_left += 3.0, y.wheel_right += 3.0; });
  EXPECT_STREQ(pushed.reason(), "moved from outside");
  EXPECT_FALSE(pushed.faulty());
}

TEST(FaultMonitor, ARobotThatIsMovedAndThenDrivesIsWatchedAgain) {
  Robot robot;
  robot.drive({}, 2.0);
  robot.drive({}, 1.0, [](Observation& y) { y.wheel_left += 3.0, y.wheel_right += 3.0; });
  EXPECT_STREQ(robot.drive(kStraight, 3.0).reason(), "");
  EXPECT_STREQ(robot.drive(kStraight, 0.3, [](Observation& y) { y.wheel_left = y.wheel_right = 0.0; }).reason(),
               "wheels do not follow their command");
}

TEST(FaultMonitor, ABodyThatIsStillMovedIsNoFaultOfTheInstrumentThatSeesIt) {
  for (const bool turned : {true, false}) {
    Robot robot;
    robot.drive({}, 3.0);
    robot.drive({}, 0.5, [](Observation& y) { y.yaw_rate += 1.0, y.acceleration_x += 12.0; });
    ASSERT_TRUE(robot.monitor().report().moved);
    const FaultReport& goes_on = robot.drive({}, 0.5, [turned](Observation& y) {
      if (turned) y.yaw_rate += 1.0;
      if (!turned) y.acceleration_x += 12.0;
    });
    EXPECT_TRUE(goes_on.moved) << turned;
    EXPECT_FALSE(goes_on.faulty()) << goes_on.reason();
  }
}

TEST(FaultMonitor, CommandsThatNobodyKnowsBlameNoWheelUntilTheyAreKnown) {
  FaultMonitor monitor({}, {}, model());
  WheelBelief left(model(), 0.098, {}), right(left);
  std::mt19937 random(8);
  std::normal_distribution<double> noise(0.0, 1.0);
  const auto drive = [&](const WheelCommand& command, bool known, double duration, double off) {
    static long k = 0;
    for (const long end = k + std::lround(duration / 0.001); k < end; ++k) {
      if (k % 20 == 0) {
        Observation y;
        y.stamp = 0.001 * static_cast<double>(k);
        y.wheel_left = left.speed() + 0.03 * noise(random) + off;
        y.wheel_right = right.speed() + 0.03 * noise(random);
        y.yaw_rate = 0.098 * (right.speed() - left.speed()) / 0.55 + 0.005 * noise(random);
        y.acceleration_x = 0.049 * (left.acceleration() + right.acceleration()) + 0.05 * noise(random);
        y.acceleration_z = kGravity + 0.05 * noise(random);
        monitor.check(y);
        if (off == 0.0) {
          EXPECT_FALSE(monitor.report().faulty()) << monitor.report().reason() << " at " << y.stamp;
        }
      }
      monitor.advance(known ? std::optional(command) : std::nullopt, 0.001);
      left.predict(command.left);
      right.predict(command.right);
    }
  };
  for (const double speed : {5.0, -5.0, 8.0}) drive({speed, speed}, false, 2.0, 0.0);
  drive({8.0, 8.0}, true, 2.0, 0.0);
  drive({8.0, 8.0}, true, 0.6, -3.0);
  EXPECT_STREQ(monitor.report().reason(), "left encoder wrong");
  EXPECT_EQ(monitor.report().wheel_left.cause, FaultCause::prediction);
}

/// Motors without power let the robot coast. A controller takes the slow decay for a disturbance, and so does a
/// monitor.
TEST(FaultMonitor, WhereNobodyTellsTheCommandsAFrozenEncoderIsFound) {
  for (const double gain : {1.0, 0.8}) {
    PlantModel plant = model();
    plant.gain = gain;
    FaultMonitor monitor({}, {}, plant);
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0.0, 0.03);
    double frozen = 0.0;
    for (int k = 0; k < 1000; ++k) {
      Observation y;
      y.stamp = 0.02 * k;
      y.wheel_left = std::min(5.0, 0.05 * k) + noise(random);
      y.wheel_right = std::min(5.0, 0.05 * k) + noise(random);
      y.yaw_rate = 0.1 * noise(random);
      y.acceleration_x = noise(random);
      if (k == 980) frozen = y.wheel_left;
      if (k >= 980) y.wheel_left = frozen;
      monitor.check(y);
      if (k < 980) {
        ASSERT_FALSE(monitor.report().faulty()) << k;
      }
      monitor.advance(std::nullopt, 0.02);
    }
    EXPECT_STREQ(monitor.report().reason(), "left encoder frozen") << gain;
  }
}

TEST(FaultMonitor, WhereNobodyTellsTheCommandsAWheelThatIsNotMeasuredGoesOnAsItWas) {
  PlantModel plant = model();
  plant.gain = 0.8;
  FaultMonitor monitor({}, {}, plant);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.03);
  for (int k = 0; k < 600; ++k) {
    Observation y;
    y.stamp = 0.02 * k;
    y.wheel_left = y.wheel_right = std::min(10.0, 0.05 * k) + noise(random);
    y.yaw_rate = 0.1 * noise(random);
    y.acceleration_x = noise(random);
    y.valid.wheel_left = k < 400;
    monitor.check(y);
    if (k >= 400) {
      ASSERT_LT(monitor.report().gyro.distance, 0.3) << k;
    }
    monitor.advance(std::nullopt, 0.02);
  }
}

TEST(FaultMonitor, WheelsThatCoastWhileTheirCommandRisesAreTold) {
  PlantModel quick = model();
  quick.lag = 0.03;
  quick.acceleration_limit = 10.0;
  for (const double deceleration : {1.5, 2.0, 4.0}) {  // rad/s^2
    FaultMonitor monitor({}, {}, quick);
    WheelController wheel(PredictiveParameters{}, quick, 0.098);
    DriveTrainPrediction motor(quick, 0.098);
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0.0, 1.0);
    double told = HUGE_VAL;
    for (long k = 0; k < 8000; ++k) {
      const double off = std::max(0.0, 0.001 * static_cast<double>(k) - 4.0);  // s without power
      const double speed = off > 0.0 ? std::max(0.0, 5.0 - deceleration * off) : motor.speed();
      if (k % 20 == 0) {
        Observation y;
        y.stamp = 0.001 * static_cast<double>(k);
        y.wheel_left = speed + 0.01 * noise(random);
        y.wheel_right = speed + 0.01 * noise(random);
        y.yaw_rate = 0.005 * noise(random);
        y.acceleration_x = (off > 0.0 && speed > 0.0 ? -0.098 * deceleration : 0.0) + 0.05 * noise(random);
        y.acceleration_z = kGravity;
        if (isFault(monitor.check(y).fault())) told = std::min(told, off);
        wheel.correct(y.wheel_left);
        wheel.act(wheel.input(5.0));
      }
      wheel.predict();
      motor.predict(wheel.action());
      monitor.advance(WheelCommand{wheel.action(), wheel.action()}, 0.001);
    }
    EXPECT_GT(told, 0.0) << deceleration;
    // Half of 5 rad/s is lost by then, and half a second is over.
    EXPECT_LT(told, 2.5 / deceleration + 0.8) << deceleration;
    EXPECT_EQ(monitor.report().fault(), Fault::wheels_blocked) << deceleration;
  }
}

/// A robot of 400 kg that is asked to turn faster than its motors can: its wheels stay behind their prediction for
/// seconds, and turn the body as they are measured.
TEST(FaultMonitor, ATurnThatTheMotorsCannotFollowIsNoFaultOfTheEncoders) {
  PlantModel heavy;
  heavy.dead_time = 0.2;
  heavy.lag = 0.047;
  heavy.gain = 0.948;
  heavy.acceleration_limit = 1.56;
  heavy.effective_track = 1.852;
  GeometryParameters geometry;
  geometry.wheel_radius = 0.2;
  FaultMonitor monitor({}, geometry, heavy);
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 1.0);
  double speed = 0.0;
  for (long k = 0; k < 8000; ++k) {
    const double time = 0.001 * static_cast<double>(k);
    const double command = std::clamp(8.2 * (time - 2.0), 0.0, 13.4),
                 acting = std::clamp(8.2 * (time - 2.2), 0.0, 13.4);
    // 6.8 rad/s is all that the torque of the motors makes of it.
    const double wanted = std::min(acting, 6.8);
    speed += (wanted - speed) * 0.001 / (wanted < 6.8 ? 0.05 : 0.45);
    if (k % 10 == 0) {
      Observation y;
      y.stamp = time;
      y.wheel_left = -speed + 0.01 * noise(random);
      y.wheel_right = speed + 0.01 * noise(random);
      y.yaw_rate = 0.4 * speed / 1.852 + 0.005 * noise(random);
      y.acceleration_x = 0.05 * noise(random);
      y.acceleration_z = kGravity;
      EXPECT_FALSE(monitor.check(y).faulty()) << monitor.report().reason() << " at " << time << " s";
    }
    monitor.advance(WheelCommand{-command, command}, 0.001);
    if (monitor.report().faulty()) return;
  }
}

TEST(FaultMonitor, AWheelThatTheBodyDragsAlongIsGivenHalfASecond) {
  Robot robot;
  robot.drive(kStraight, 3.0);
  const auto dragged = [](Observation& y) { y.wheel_left += 2.0, y.yaw_rate -= 0.098 * 2.0 / 0.55; };
  EXPECT_STREQ(robot.drive(kStraight, 0.5, dragged).reason(), "");
  EXPECT_STREQ(robot.drive(kStraight, 0.5, dragged).reason(), "left wheels do not follow their command");
}

TEST(FaultMonitor, AWheelThatIsSlowedDownAndTurnsOnIsNotBlocked) {
  const auto slowedTo = [](double part, bool gyro = true) {
    return [part, gyro](Observation& y) {
      const double off = (part - 1.0) * y.wheel_right;
      y.wheel_right += off, y.yaw_rate += 0.098 * off / 0.55;
      y.valid.yaw_rate = gyro;
    };
  };
  Robot slow;
  slow.drive(kStraight, 3.0);
  EXPECT_STREQ(slow.drive(kStraight, 3.0, slowedTo(0.6)).reason(), "");
  EXPECT_TRUE(slow.monitor().report().valid().all()) << "what it measures counts";
  EXPECT_STREQ(slow.drive(kStraight, 0.3, slowedTo(0.0)).reason(), "right wheels do not follow their command");
  Robot weak;
  weak.drive(kStraight, 3.0);
  EXPECT_STREQ(weak.drive(kStraight, 0.3, slowedTo(0.4)).reason(), "right wheels do not follow their command");
  Robot alone;  // without a gyro it is as well an encoder that is wrong
  alone.drive(kStraight, 3.0);
  EXPECT_STREQ(alone.drive(kStraight, 0.45, slowedTo(0.6, false)).reason(), "");
  EXPECT_STREQ(alone.drive(kStraight, 2.0, slowedTo(1.0, false)).reason(), "");
  EXPECT_STREQ(alone.drive(kStraight, 0.45, slowedTo(0.6, false)).reason(), "") << "what is over is forgotten";
  EXPECT_STREQ(alone.drive(kStraight, 0.2, slowedTo(0.6, false)).reason(), "right wheels do not follow their command");
}

TEST(FaultMonitor, AnotherAccelerationLimitIsNoFault) {
  for (double ratio : {0.5, 1.8, 3.0}) {
    PlantModel real = model();
    real.acceleration_limit *= ratio;
    WheelBelief left(real, 0.098, {}), right(left);
    FaultMonitor monitor({}, {}, model());
    std::mt19937 random(8);
    std::normal_distribution<double> noise(0.0, 1.0);
    WheelCommand command;
    for (int k = 0; k < 300000; ++k) {
      if (k % 700 == 0) command = {12.0 * noise(random), 12.0 * noise(random)};
      if (k % 20 == 0) {
        Observation y;
        y.stamp = 0.001 * k;
        y.wheel_left = left.speed() + 0.03 * noise(random);
        y.wheel_right = right.speed() + 0.03 * noise(random);
        y.yaw_rate = 0.098 * (right.speed() - left.speed()) / 0.55 + 0.005 * noise(random);
        y.acceleration_x = 0.049 * (left.acceleration() + right.acceleration()) + 0.05 * noise(random);
        y.acceleration_z = kGravity + 0.05 * noise(random);
        ASSERT_STREQ(monitor.check(y).reason(), "") << "limit x " << ratio << " at " << y.stamp << " s";
      }
      monitor.advance(command, 0.001);
      left.predict(command.left);
      right.predict(command.right);
    }
  }
}

TEST(FaultMonitor, AQuantisedEncoderIsAliveAsLongAsNothingSaysOtherwise) {
  for (double step : {0.0065, 0.0131, 0.06, 0.0606, 0.1}) {
    Robot robot;
    for (const WheelCommand& command : {kStraight, kTurn, WheelCommand{8.0, 7.0}, WheelCommand{0.9, 1.1}}) {
      const FaultReport& report = robot.drive(command, 60.0, [&](Observation& y) { y = rounded(y, step); });
      EXPECT_STREQ(report.reason(), "") << step;
    }
  }
}

TEST(FaultMonitor, BlindGyroOfABoxIsNoWitness) {
  PlantModel box = model();
  box.on_box = true;
  Robot robot({}, box);
  const auto blind = [](Observation& y) { y.yaw_rate = 0.01 * std::sin(40.0 * y.stamp), y.acceleration_x *= 0.0; };
  EXPECT_FALSE(robot.drive(kTurn, 3.0, blind).faulty());
}

TEST(FaultMonitor, EncodersThatFreezeTogetherAreFoundTogether) {
  Robot robot;
  robot.drive(kStraight, 3.0);
  robot.drive({5.0, 5.1}, 1.0, [](Observation& y) {
    if (std::fmod(y.stamp, 0.2) < 0.015) y.wheel_left = 5.0;  // the left one repeats now and then: less is known of it
  });
  for (int k = 0; k < 20; ++k) {
    const FaultReport& report =
        robot.drive({5.0, 5.1}, 0.02, [](Observation& y) { y.wheel_left = 5.01, y.wheel_right = 5.12; });
    EXPECT_EQ(report.wheel_left.cause == FaultCause::frozen, report.wheel_right.cause == FaultCause::frozen) << k;
  }
  EXPECT_EQ(robot.monitor().report().wheel_left.cause, FaultCause::frozen);
}

TEST(FaultMonitor, FreezingCanBeSwitchedOff) {
  FaultParameters parameters;
  parameters.frozen_samples = 0;
  Robot robot(parameters);
  robot.drive(kStraight, 3.0);
  EXPECT_FALSE(robot.drive(kStraight, 3.0, [](Observation& y) { y.wheel_left = 5.01; }).faulty());
}

TEST(PredictionEnvelope, IsNarrowWhileNothingChanges) {
  PredictionEnvelope envelope(90, 80);
  envelope.start(2.0, 5.0);
  for (int k = 0; k < 200; ++k) envelope.add(2.0, 5.0);
  EXPECT_EQ(envelope.range().low, 2.0);
  EXPECT_EQ(envelope.range().high, 2.0);
}

TEST(PredictionEnvelope, HoldsWhatComesEarlierOrLater) {
  // A step from 0 to 1 in step 500; the prediction ahead sees it 80 steps before.
  PredictionEnvelope envelope(90, 80);
  envelope.start(0.0, 0.0);
  for (int k = 1; k <= 700; ++k) {
    envelope.add(k >= 500 ? 1.0 : 0.0, k >= 420 ? 1.0 : 0.0);
    EXPECT_EQ(envelope.range().low, k < 590 ? 0.0 : 1.0) << k;
    EXPECT_EQ(envelope.range().high, k >= 420 ? 1.0 : 0.0) << k;
  }
}

TEST(PredictionEnvelope, OnlyChangesOfThePredictionAheadCount) {
  PredictionEnvelope envelope(10, 10);
  envelope.start(2.0, 5.0);
  for (int k = 0; k < 5; ++k) envelope.add(2.0, 4.0);
  EXPECT_EQ(envelope.range().low, 1.0);
  EXPECT_EQ(envelope.range().high, 2.0);
  envelope.start(2.0, 5.0);
  for (int k = 0; k < 5; ++k) envelope.add(2.0, 6.0);
  EXPECT_EQ(envelope.range().low, 2.0);
  EXPECT_EQ(envelope.range().high, 3.0);
}

TEST(FaultMonitor, KeepsTheTimeOfAnyStep) {
  for (const int steps : {8, 12, 14, 7}) {  // of 20 ms: 400, 600, 700 and 350 Hz
    FaultMonitor by_steps({}, {}, model()), by_milliseconds({}, {}, model());
    WheelBelief wheel(model(), 0.098, {});
    for (int k = 1; k <= 150; ++k) {
      const WheelCommand command = k < 100 ? WheelCommand{8.0, 8.0} : WheelCommand{};
      for (int i = 0; i < steps; ++i) by_steps.advance(command, 0.02 / steps);
      for (int i = 0; i < 20; ++i) by_milliseconds.advance(command, 0.001);
      for (int i = 0; i < 20; ++i) wheel.predict(command.left);
      Observation y;
      y.stamp = 0.02 * k;
      y.wheel_left = y.wheel_right = wheel.speed() + 0.03 * std::sin(7.0 * k);
      y.acceleration_x = 0.098 * wheel.acceleration() + 0.02 * std::sin(5.0 * k);
      const double expected = by_milliseconds.check(y).wheel_left.distance;
      ASSERT_NEAR(by_steps.check(y).wheel_left.distance, expected, 0.03) << steps << " steps, sample " << k;
    }
  }
}

}  // namespace
}  // namespace jackal_aic
