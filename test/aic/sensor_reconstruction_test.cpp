#include "jackal_aic/aic/sensor_reconstruction.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "jackal_aic/safety/loss_policy.hpp"

namespace jackal_aic {
namespace {

/// A robot in an arc to the left: 0.5 m/s, 0.8 rad/s.
class Arc : public testing::Test {
 protected:
  Arc() {
    const WheelCommand wheels = kinematics_.wheelSpeeds(0.5, 0.8);
    complete_.stamp = 3.0;
    complete_.yaw_rate = 0.8;
    complete_.wheel_left = wheels.left;
    complete_.wheel_right = wheels.right;
    complete_.acceleration_x = 0.3;
  }

  /// What the reconstruction makes of the arc when a channel is lost and reads nonsense.
  Observation without(bool ChannelValidity::*channel, double Observation::*value) const {
    Observation observation = complete_;
    observation.valid.*channel = false;
    observation.*value = std::numeric_limits<double>::quiet_NaN();
    return reconstructed(observation, kinematics_).value();
  }

  SkidSteerKinematics kinematics_{GeometryParameters{0.098, 0.5621, 0.9}};
  Observation complete_;
};

TEST_F(Arc, CompleteObservationStaysAsItIs) {
  const Observation same = reconstructed(complete_, kinematics_).value();
  EXPECT_EQ(same.vector(), complete_.vector());
  EXPECT_EQ(same.stamp, 3.0);
}

TEST_F(Arc, AnyLostChannelFollowsFromTheOthers) {
  EXPECT_NEAR(without(&ChannelValidity::yaw_rate, &Observation::yaw_rate).yaw_rate, 0.8, 1e-12);
  EXPECT_NEAR(without(&ChannelValidity::wheel_left, &Observation::wheel_left).wheel_left, complete_.wheel_left, 1e-12);
  EXPECT_NEAR(without(&ChannelValidity::wheel_right, &Observation::wheel_right).wheel_right, complete_.wheel_right,
              1e-12);
  const Observation still = without(&ChannelValidity::acceleration, &Observation::acceleration_x);
  EXPECT_EQ(still.acceleration_x, 0.0);
  EXPECT_TRUE(still.valid.all());
}

TEST_F(Arc, TwoLostChannelsAreTooMany) {
  for (const ChannelValidity& valid :
       {ChannelValidity{true, false, false, true}, ChannelValidity{false, true, false, true},
        ChannelValidity{false, false, true, true}, ChannelValidity{false, false, false, true}}) {
    Observation observation = complete_;
    observation.valid = valid;
    EXPECT_FALSE(reconstructed(observation, kinematics_));
  }
}

constexpr ChannelValidity kAll{};
constexpr ChannelValidity kNoImu{false, true, true, false};
constexpr ChannelValidity kNoLeft{true, false, true, true};
constexpr ChannelValidity kNoRight{true, true, false, true};
constexpr ChannelValidity kNoWheels{true, false, false, true};
constexpr ChannelValidity kNoLeftNoImu{false, false, true, false};

LossAction actionOf(const LossPolicyParameters& policy, LossTolerance tolerance, const ChannelValidity& valid,
                    double blind_time = 0.0, bool on_box = false) {
  return decideOnLoss(policy, tolerance, valid, blind_time, on_box).action;
}

TEST(LossPolicy, EachLossHasItsAnswer) {
  LossPolicyParameters drive{LossAction::drive, LossAction::drive, LossAction::drive, 1.0};
  for (const ChannelValidity& valid : {kAll, kNoImu, kNoLeft, kNoRight, kNoWheels, kNoLeftNoImu}) {
    EXPECT_EQ(actionOf(drive, LossTolerance::model, valid), LossAction::drive);
  }
  LossPolicyParameters stop{LossAction::stop, LossAction::stop, LossAction::stop, 1.0};
  for (const ChannelValidity& valid : {kNoImu, kNoLeft, kNoRight, kNoWheels, kNoLeftNoImu}) {
    EXPECT_EQ(actionOf(stop, LossTolerance::model, valid), LossAction::stop);
  }
  EXPECT_EQ(actionOf(stop, LossTolerance::model, kAll), LossAction::drive) << "nothing is lost";
}

TEST(LossPolicy, NamesWhatIsLost) {
  const LossPolicyParameters policy;
  const auto reason = [&](const ChannelValidity& valid) {
    return std::string(text(decideOnLoss(policy, LossTolerance::model, valid, 0.0, false).loss));
  };
  EXPECT_EQ(reason(kAll), "");
  EXPECT_EQ(reason(kNoImu), "yaw rate lost");
  EXPECT_EQ(reason(kNoLeft), "left encoder lost");
  EXPECT_EQ(reason(kNoRight), "right encoder lost");
  EXPECT_EQ(reason(kNoWheels), "both encoders lost");
  EXPECT_EQ(reason(kNoLeftNoImu), "encoder and yaw rate lost");
}

TEST(LossPolicy, TheModelAloneDrivesForABoundedTime) {
  const LossPolicyParameters policy{LossAction::drive, LossAction::drive, LossAction::drive, 1.0};
  EXPECT_EQ(actionOf(policy, LossTolerance::model, kNoWheels, 1.0), LossAction::drive);
  EXPECT_EQ(actionOf(policy, LossTolerance::model, kNoWheels, 1.02), LossAction::stop);
  EXPECT_EQ(actionOf(policy, LossTolerance::model, kNoLeft, 100.0), LossAction::drive);
}

TEST(LossPolicy, TheThesisStructuresNeedTwoChannels) {
  const LossPolicyParameters policy{LossAction::drive, LossAction::drive, LossAction::drive, 1.0};
  EXPECT_EQ(actionOf(policy, LossTolerance::one_of_three, kNoLeft), LossAction::drive);
  EXPECT_EQ(actionOf(policy, LossTolerance::one_of_three, kNoWheels), LossAction::stop);
  EXPECT_EQ(actionOf(policy, LossTolerance::one_of_three, kNoLeftNoImu), LossAction::stop);
}

TEST(LossPolicy, OnABoxTheYawRateDoesNotStandInForAnEncoder) {
  const LossPolicyParameters policy{LossAction::drive, LossAction::drive, LossAction::stop, 1.0};
  EXPECT_EQ(actionOf(policy, LossTolerance::model, kNoLeft, 0.0, false), LossAction::drive);
  EXPECT_EQ(actionOf(policy, LossTolerance::model, kNoLeft, 0.0, true), LossAction::stop);
  EXPECT_EQ(actionOf(policy, LossTolerance::model, kNoImu, 0.0, true), LossAction::drive);
}

}  // namespace
}  // namespace jackal_aic
