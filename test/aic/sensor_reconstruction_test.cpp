#include "jackal_aic/aic/sensor_reconstruction.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jackal_aic {
namespace {

constexpr ChannelValidity kAll, kNoGyro{false, true, true, true}, kNoLeft{true, false, true, true},
    kNoRight{true, true, false, true}, kNoAccelerometer{true, true, true, false};

/// A robot in an arc to the left: 0.5 m/s, 0.8 rad/s.
class Arc : public testing::Test {
 protected:
  Arc() {
    const WheelCommand wheels = kinematics.wheelSpeeds(0.5, 0.8);
    complete = {3.0, 0.8, wheels.left, wheels.right, 0.3, 0.0};
  }

  const SkidSteerKinematics kinematics{GeometryParameters{0.098, 0.5621, 0.9}};
  Observation complete;
};

TEST_F(Arc, LostChannelFollowsFromTheOthers) {
  for (const ChannelValidity& valid : {kAll, kNoGyro, kNoLeft, kNoRight, kNoAccelerometer}) {
    Observation observation = complete, expected = complete;
    observation.valid = valid;
    if (!valid.yaw_rate) observation.yaw_rate = std::nan("");
    if (!valid.wheel_left) observation.wheel_left = std::nan("");
    if (!valid.wheel_right) observation.wheel_right = std::nan("");
    if (!valid.acceleration) observation.acceleration_x = std::nan("");
    if (!valid.acceleration) expected.acceleration_x = 0.0;
    const Observation found = reconstructed(observation, kinematics).value();
    EXPECT_TRUE(found.vector().isApprox(expected.vector(), 1e-12)) << found.vector().transpose();
    EXPECT_EQ(found.stamp, 3.0);
    EXPECT_TRUE(found.valid.all());
  }
}

TEST_F(Arc, TwoLostChannelsAreNotReconstructed) {
  for (const ChannelValidity& valid : {ChannelValidity{true, false, false, true},
                                       {false, true, false, true},
                                       {false, false, true, true},
                                       {false, false, false, true}}) {
    complete.valid = valid;
    EXPECT_FALSE(reconstructed(complete, kinematics));
  }
}

}  // namespace
}  // namespace jackal_aic
