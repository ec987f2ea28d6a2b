#include "jackal_aic/safety/loss_policy.hpp"

#include <gtest/gtest.h>

namespace jackal_aic {
namespace {

constexpr auto kDrive = LossAction::drive, kStop = LossAction::stop;
constexpr ChannelValidity kNoGyro{false, true, true, true}, kNoLeft{true, false, true, true};

TEST(LossPolicy, OnABoxTheYawRateReplacesNoEncoder) {
  const LossPolicyParameters policy{kDrive, kDrive, kStop, 1.0};
  for (const LossTolerance tolerance : {LossTolerance::one_of_three, LossTolerance::model}) {
    const LossDecision decision = decideOnLoss(policy, tolerance, kNoLeft, 0.0, true);
    EXPECT_EQ(decision.loss, Loss::encoder_and_yaw_rate);
    EXPECT_EQ(decision.action, kStop);
    EXPECT_EQ(decideOnLoss(policy, tolerance, kNoGyro, 0.0, true).action, kDrive);
  }
}

}  // namespace
}  // namespace jackal_aic
