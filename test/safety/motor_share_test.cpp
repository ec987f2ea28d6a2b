#include "jackal_aic/safety/motor_share.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s

/// Our commands reach the motors after a delay, unless another's are applied.
class MotorShareTest : public testing::Test {
 protected:
  /// Sends a command, or an offer while another drives, and tells what the motors get. @param another in place of ours.
  void step(const WheelCommand& wish, const WheelCommand* another = nullptr) {
    time_ += kPeriod;
    const WheelCommand sent = share.ours(time_) ? wish : share.offer(wish);
    share.apply(time_, another ? *another : delayed_, AppliedSource::drive);
    delayed_ = before_;
    before_ = sent;
    share.send(time_, sent);
  }

  void steps(double duration, const WheelCommand& wish, const WheelCommand* another = nullptr) {
    for (double end = time_ + duration; time_ < end;) step(wish, another);
  }

  MotorShare share;
  double time_ = 0.0;
  WheelCommand before_, delayed_;
};

TEST_F(MotorShareTest, OffersAroundAnothersCommandDoNotMakeItOurs) {
  const WheelCommand joystick{2.0, 2.0};
  steps(1.0, {});
  steps(1.0, {5.0, 5.0}, &joystick);
  ASSERT_FALSE(share.ours(time_));
  for (int i = 0; i < 50; ++i) {
    const double wish = i % 2 == 0 ? 8.0 : -8.0;
    step({wish, wish}, &joystick);
    ASSERT_FALSE(share.ours(time_)) << i;
  }
}

TEST_F(MotorShareTest, ToleranceIsThreeTenthsPlusATwentieth) {
  steps(1.0, {});
  const WheelCommand within{0.31, -0.31}, beyond{0.32, 0.0};  // 0.3 + 0.05 x 0.31 is 0.3155
  steps(1.0, {}, &within);
  EXPECT_TRUE(share.ours(time_));
  steps(1.0, {}, &beyond);
  EXPECT_FALSE(share.ours(time_));
}

/// Whether commands that approach ours by so much every 0.18 s are ours.
bool isApproach(double step) {
  MotorShare share;
  share.send(0.0, {10.0, 10.0});
  share.apply(0.0, {10.0, 10.0}, AppliedSource::drive);
  double wheels = 0.0, time = kPeriod;
  for (int i = 0; i < 20; ++i, wheels += step) {
    for (int k = 0; k < 9; ++k, time += kPeriod) {
      share.send(time, {10.0, 10.0});
      share.apply(time, {wheels, wheels}, AppliedSource::drive);
      if (!share.ours(time)) return false;
    }
  }
  return true;
}

TEST(MotorShareApproach, NeedsTwoTenthsWithinThePatience) {
  EXPECT_TRUE(isApproach(0.24));
  EXPECT_FALSE(isApproach(0.15));
}

TEST(MotorShareMemory, CoversTheSameTimeAtAnyRate) {
  for (const int rate : {50, 500, 1000}) {
    MotorShare share;
    const int late = rate / 5;  // of a ramp through a transport of 0.2 s
    for (int k = 0; k < 2 * rate; ++k) {
      const double time = 1.0 * k / rate, then = std::max(0.0, time - 1.0 * late / rate);
      share.send(time, {8.0 * time, 8.0 * time});
      share.apply(time, {8.0 * then, 8.0 * then}, AppliedSource::drive);
      ASSERT_TRUE(share.ours(time)) << rate << " Hz, " << time << " s";
    }
  }
}

}  // namespace
}  // namespace jackal_aic
