#include "jackal_aic/aic/sensor_reconstruction.hpp"

#include <gtest/gtest.h>

#include <limits>

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

  /// The reconstructed arc when a channel is lost and reads nonsense.
  Observation without(bool ChannelValidity::*channel, double Observation::*value) const {
    Observation observation = complete_;
    observation.valid.*channel = false;
    observation.*value = std::numeric_limits<double>::quiet_NaN();
    return reconstructed(observation, kinematics_).value();
  }

  SkidSteerKinematics kinematics_{GeometryParameters{0.098, 0.5621, 0.9}};
  Observation complete_;
};

TEST_F(Arc, LostChannelFollowsFromTheOthers) {
  const Observation same = reconstructed(complete_, kinematics_).value();
  EXPECT_EQ(same.vector(), complete_.vector());
  EXPECT_EQ(same.stamp, 3.0);
  EXPECT_NEAR(without(&ChannelValidity::yaw_rate, &Observation::yaw_rate).yaw_rate, 0.8, 1e-12);
  EXPECT_NEAR(without(&ChannelValidity::wheel_left, &Observation::wheel_left).wheel_left, complete_.wheel_left, 1e-12);
  EXPECT_NEAR(without(&ChannelValidity::wheel_right, &Observation::wheel_right).wheel_right, complete_.wheel_right,
              1e-12);
  const Observation still = without(&ChannelValidity::acceleration, &Observation::acceleration_x);
  EXPECT_EQ(still.acceleration_x, 0.0);
  EXPECT_TRUE(still.valid.all());
}

TEST_F(Arc, TwoLostChannelsAreNotReconstructed) {
  for (const ChannelValidity& valid :
       {ChannelValidity{true, false, false, true}, ChannelValidity{false, true, false, true},
        ChannelValidity{false, false, true, true}, ChannelValidity{false, false, false, true}}) {
    Observation observation = complete_;
    observation.valid = valid;
    EXPECT_FALSE(reconstructed(observation, kinematics_));
  }
}

}  // namespace
}  // namespace jackal_aic
