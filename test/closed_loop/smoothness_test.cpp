// What a belief gains that learns the smoothness of its sensors' noise, on drives of the simulated robot.

#include <gtest/gtest.h>

#include "coloured_noise_table.hpp"

namespace jackal_aic::sim {
namespace {

const PackageFiles kFiles{JACKAL_AIC_SOURCE_DIR};

const EstimatorFigures& of(const std::vector<EstimatorFigures>& all, Estimator estimator) {
  return all[static_cast<std::size_t>(estimator)];
}

class ColouredNoise : public testing::TestWithParam<const char*> {};

TEST_P(ColouredNoise, LearnedSmoothnessIsAsGoodAsAKnownOne) {
  const auto all = estimateUnderNoise(kFiles, GetParam(), {"s = 0.1 s", true, 0.1, 0.2, 0.02}, 2);
  ASSERT_EQ(all.size(), 6u);
  const EstimatorFigures &learned = of(all, Estimator::smoothness_learned), &known = of(all, Estimator::known),
                         &white = of(all, Estimator::taken_for_white);
  EXPECT_NEAR(learned.wheel_noise(1), 0.1, 0.02);
  EXPECT_NEAR(learned.wheel_noise(0), 0.2, 0.03);
  EXPECT_LT(learned.forward, 1.1 * known.forward);
  EXPECT_LT(learned.yaw_rate, 1.1 * known.yaw_rate);
  EXPECT_LT(learned.forward, 0.9 * white.forward);
  EXPECT_LT(learned.yaw_rate, 0.9 * white.yaw_rate);
}

TEST_P(ColouredNoise, LearningCostsNothingWhereItIsWhite) {
  const auto all = estimateUnderNoise(kFiles, GetParam(), {"white", true, 0.0, 0.06, 0.01}, 2);
  const EstimatorFigures &learned = of(all, Estimator::smoothness_learned), &known = of(all, Estimator::known);
  EXPECT_LT(learned.wheel_noise(1), 0.01);  // s of less than half a step
  EXPECT_LT(learned.forward, 1.02 * known.forward);
  EXPECT_LT(learned.yaw_rate, 1.02 * known.yaw_rate);
}

INSTANTIATE_TEST_SUITE_P(Plants, ColouredNoise, testing::Values("box", "ground"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace jackal_aic::sim
