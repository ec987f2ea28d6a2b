#include "jackal_aic/predictive/yaw_rate_belief.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace jackal_aic {
namespace {

constexpr double kStep = 0.001;

TEST(YawRateBelief, FollowsTheWheelsBetweenSamplesOfTheGyro) {
  YawRateBelief yaw({}), steady({});
  for (int k = 0; k < 100; ++k) yaw.predict(4.0, kStep);
  EXPECT_NEAR(yaw.yawRate(), 0.4, 1e-12);
  for (int k = 0; k < 100; ++k) steady.predict(0.0, kStep);
  yaw.correct(0.3);  // the body is behind
  steady.correct(-0.1);
  EXPECT_NEAR(yaw.yawRate(), 0.3, 0.005);
  EXPECT_GT(steady.yawRate(), -0.08) << "a single reading moves it less when nothing was asked for";
}

TEST(YawRateBelief, VarianceIsThatOfItsError) {
  YawRateBeliefParameters parameters;
  std::mt19937 random(9);
  std::normal_distribution<double> unit(0.0, 1.0);
  double sum = 0.0;
  constexpr int kRuns = 2000;
  for (int run = 0; run < kRuns; ++run) {
    YawRateBelief yaw(parameters);
    double truth = 0.005 * unit(random);
    for (int k = 0; k < 20; ++k) {
      yaw.predict(0.0, 0.02);
      truth += std::sqrt(parameters.process_noise * 0.02) * unit(random);
      yaw.correct(truth + 0.005 * unit(random));
    }
    sum += std::pow(yaw.yawRate() - truth, 2) / yaw.variance();
  }
  EXPECT_NEAR(sum / kRuns, 1.0, 0.1);
}

}  // namespace
}  // namespace jackal_aic
