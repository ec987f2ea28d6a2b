#include "jackal_aic/safety/loss_policy.hpp"

#include <gtest/gtest.h>

namespace jackal_aic {
namespace {

constexpr auto kDrive = LossAction::drive;
constexpr auto kStop = LossAction::stop;

ChannelValidity channels(bool yaw_rate, bool wheel_left, bool wheel_right) {
  return {yaw_rate, wheel_left, wheel_right, true};
}

TEST(LossPolicy, NamesWhatIsLostAndAsksItsOwnKey) {
  struct Case {
    ChannelValidity valid;
    Loss loss;
    LossAction LossPolicyParameters::*key;  // null: no key lets the thesis' controllers drive
  };
  for (const Case& c : {Case{channels(false, true, true), Loss::yaw_rate, &LossPolicyParameters::imu},
                        Case{channels(true, false, true), Loss::left_encoder, &LossPolicyParameters::one_wheel},
                        Case{channels(true, true, false), Loss::right_encoder, &LossPolicyParameters::one_wheel},
                        Case{channels(true, false, false), Loss::both_encoders, nullptr},
                        Case{channels(false, false, false), Loss::both_encoders, nullptr},
                        Case{channels(false, true, false), Loss::encoder_and_yaw_rate, nullptr},
                        Case{channels(false, false, true), Loss::encoder_and_yaw_rate, nullptr}}) {
    for (const LossAction action : {kDrive, kStop}) {
      LossPolicyParameters policy{kDrive, kDrive, kDrive, 1.0};
      if (c.key != nullptr) policy.*c.key = action;
      const LossDecision decision = decideOnLoss(policy, LossTolerance::one_of_three, c.valid, 0.0, false);
      EXPECT_EQ(decision.loss, c.loss) << text(c.loss);
      EXPECT_EQ(decision.action, c.key != nullptr ? action : kStop) << text(c.loss);
    }
  }
  const LossDecision sound =
      decideOnLoss({kStop, kStop, kStop, 1.0}, LossTolerance::one_of_three, ChannelValidity{}, 100.0, false);
  EXPECT_EQ(sound.loss, Loss::none);
  EXPECT_EQ(sound.action, kDrive);
}

TEST(LossPolicy, OnABoxTheYawRateReplacesNoEncoder) {
  const LossPolicyParameters policy{kDrive, kDrive, kDrive, 1.0};
  const LossDecision decision =
      decideOnLoss(policy, LossTolerance::one_of_three, channels(true, false, true), 0.0, true);
  EXPECT_EQ(decision.loss, Loss::encoder_and_yaw_rate);
  EXPECT_EQ(decision.action, kStop);
}

TEST(LossPolicy, TheModelGoesOnForItsTime) {
  for (const auto& valid : {channels(true, false, false), channels(false, true, false)}) {
    const LossPolicyParameters drives{kStop, kStop, kDrive, 1.0}, stops{kDrive, kDrive, kStop, 1.0};
    EXPECT_EQ(decideOnLoss(drives, LossTolerance::model, valid, 1.0, false).action, kDrive);
    EXPECT_EQ(decideOnLoss(drives, LossTolerance::model, valid, 1.01, false).action, kStop);
    EXPECT_EQ(decideOnLoss(stops, LossTolerance::model, valid, 0.0, false).action, kStop);
  }
}

}  // namespace
}  // namespace jackal_aic
