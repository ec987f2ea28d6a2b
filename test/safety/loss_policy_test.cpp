#include "jackal_aic/safety/loss_policy.hpp"

#include <gtest/gtest.h>

namespace jackal_aic {
namespace {

constexpr auto kDrive = LossAction::drive, kStop = LossAction::stop;
constexpr ChannelValidity kNoGyro{false, true, true, true}, kNoLeft{true, false, true, true},
    kNoRight{true, true, false, true}, kNoWheels{true, false, false, true}, kNothing{false, false, false, true},
    kLeftAlone{false, true, false, true}, kRightAlone{false, false, true, true};

TEST(LossPolicy, EachLossHasItsNameAndItsKey) {
  const struct {
    ChannelValidity valid;
    Loss loss;
    const char* name;
    LossAction LossPolicyParameters::*key;  // that decides
    bool by_model;                          // only the predictive controller may drive
  } rows[] = {
      {kNoGyro, Loss::yaw_rate, "yaw rate lost", &LossPolicyParameters::imu, false},
      {kNoLeft, Loss::left_encoder, "left encoder lost", &LossPolicyParameters::one_wheel, false},
      {kNoRight, Loss::right_encoder, "right encoder lost", &LossPolicyParameters::one_wheel, false},
      {kNoWheels, Loss::both_encoders, "both encoders lost", &LossPolicyParameters::wheels, true},
      {kNothing, Loss::both_encoders, "both encoders lost", &LossPolicyParameters::wheels, true},
      {kLeftAlone, Loss::encoder_and_yaw_rate, "encoder and yaw rate lost", &LossPolicyParameters::wheels, true},
      {kRightAlone, Loss::encoder_and_yaw_rate, "encoder and yaw rate lost", &LossPolicyParameters::wheels, true}};
  for (const auto& row : rows) {
    SCOPED_TRACE(row.name);
    EXPECT_STREQ(text(row.loss), row.name);
    for (const LossAction action : {kDrive, kStop}) {
      // Its own key says one thing, all others say the opposite.
      const LossAction other = action == kDrive ? kStop : kDrive;
      LossPolicyParameters policy{other, other, other, 1.0};
      policy.*row.key = action;
      for (const LossTolerance tolerance : {LossTolerance::one_of_three, LossTolerance::model}) {
        const LossDecision decision = decideOnLoss(policy, tolerance, row.valid, 1.0, false);
        EXPECT_EQ(decision.loss, row.loss);
        const bool can = !row.by_model || tolerance == LossTolerance::model;
        EXPECT_EQ(decision.action, can ? action : kStop);
        EXPECT_EQ(decideOnLoss(policy, tolerance, row.valid, 1.01, false).action, row.by_model ? kStop : action)
            << "the model alone is good for 1 s";
      }
    }
  }
  for (const LossTolerance tolerance : {LossTolerance::one_of_three, LossTolerance::model}) {
    const LossDecision sound = decideOnLoss({kStop, kStop, kStop, 1.0}, tolerance, ChannelValidity{}, 100.0, false);
    EXPECT_EQ(sound.loss, Loss::none);
    EXPECT_EQ(sound.action, kDrive);
  }
}

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
