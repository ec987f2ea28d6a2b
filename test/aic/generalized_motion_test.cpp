#include "jackal_aic/aic/generalized_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "jackal_aic/aic/active_inference_controller.hpp"

namespace jackal_aic {
namespace {

/// The windowed form of eq. 3-21 for one channel with a constant step h: E of size (p+1) x (p+1), applied to the
/// samples (y_{k-p}, ..., y_k), oldest first. Row i holds the backward difference of order i. Equal to the recursion
/// 3-22 once the window is full.
Eigen::MatrixXd backwardDifferenceMatrix(int orders, double step) {
  const int n = orders + 1;
  Eigen::MatrixXd E = Eigen::MatrixXd::Zero(n, n);
  for (int order = 0; order < n; ++order) {
    double binomial = 1.0;
    for (int back = 0; back <= order; ++back) {
      E(order, n - 1 - back) = (back % 2 == 0 ? binomial : -binomial) / std::pow(step, order);
      binomial = binomial * (order - back) / (back + 1);
    }
  }
  return E;
}

constexpr double kShortestGap = 0.005;  // s

struct Generalization : jackal_aic::Generalization<kSensorSize> {
  using jackal_aic::Generalization<kSensorSize>::Generalization;
  SampleVerdict update(const Observation& y) {
    return jackal_aic::Generalization<kSensorSize>::update(y.stamp, y.vector());
  }
};

Observation sample(double stamp, double value) { return {stamp, value, 2 * value, -value, 0.5 * value, 3 * value}; }

TEST(Generalization, StartsAsAConstantSignalWithoutASpike) {
  for (int p = 0; p <= kMaxOrders; ++p) {
    Generalization generalization(p, kShortestGap, 0.2);
    for (const double start : {10.0, 0.02}) {  // a reset forgets the stamps too
      EXPECT_FALSE(generalization.hasMeasurement());
      EXPECT_EQ(generalization.update(sample(start, 4.0)), SampleVerdict::restarted);
      EXPECT_EQ(generalization.measurement().col(0), sample(start, 4.0).vector());
      EXPECT_EQ(generalization.measurement().rightCols(p).norm(), 0.0);
      EXPECT_EQ(generalization.update(sample(start + 0.02, 4.0)), SampleVerdict::accepted);
      EXPECT_EQ(generalization.measurement().rightCols(p).norm(), 0.0);
      generalization.update(sample(start + 0.04, 5.0));
      generalization.reset();
    }
  }
}

TEST(Generalization, RecursionEqualsTheWindowedFormOf321) {
  constexpr double kStep = 0.01;
  for (int p = 0; p <= kMaxOrders; ++p) {
    Generalization generalization(p, kShortestGap, 0.2);
    Eigen::VectorXd window(40);
    for (int k = 0; k < 40; ++k) {
      window(k) = std::sin(0.3 * k) + 0.1 * k;
      generalization.update(sample(k * kStep, window(k)));
    }
    const Eigen::VectorXd windowed = backwardDifferenceMatrix(p, kStep) * window.tail(p + 1);
    for (int i = 0; i <= p; ++i) {
      EXPECT_NEAR(generalization.measurement()(kYawRate, i), windowed(i), 1e-7 * std::pow(1 / kStep, i)) << p << i;
    }
  }
}

TEST(Generalization, SamplesCloseTogetherHoldTheDerivatives) {
  Generalization generalization(2, kShortestGap, 0.2), of_the_others(generalization);
  for (const double stamp : {1.0, 1.02, 1.04}) {
    generalization.update(sample(stamp, stamp));
    of_the_others.update(sample(stamp, stamp));
  }
  const GeneralizedSensor before = generalization.measurement();
  EXPECT_EQ(generalization.update(sample(1.0401, 7.0)), SampleVerdict::accepted);
  EXPECT_EQ(generalization.measurement().col(0), sample(1.0401, 7.0).vector());
  EXPECT_EQ(generalization.measurement().rightCols(2), before.rightCols(2));
  EXPECT_EQ(generalization.stamp(), 1.0401);
  const GeneralizedSensor held = generalization.measurement();
  for (const double stamp : {1.0401, 1.03}) {
    EXPECT_EQ(generalization.update(sample(stamp, 8.0)), SampleVerdict::stale);
    EXPECT_EQ(generalization.measurement(), held) << "never differenced twice";
  }
  generalization.update(sample(1.06, 2.0));
  of_the_others.update(sample(1.06, 2.0));
  EXPECT_EQ(generalization.measurement(), of_the_others.measurement()) << "without the close sample";
}

TEST(Generalization, RefusesNumbersThatAreNotFinite) {
  Generalization generalization(2, kShortestGap, 0.2);
  generalization.update(sample(1.00, 2.0));
  const GeneralizedSensor before = generalization.measurement();
  for (const Observation& bad : {sample(1.02, std::nan("")), sample(1.02, HUGE_VAL), sample(std::nan(""), 1.0)}) {
    EXPECT_EQ(generalization.update(bad), SampleVerdict::not_finite);
  }
  EXPECT_EQ(generalization.measurement(), before);
}

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
