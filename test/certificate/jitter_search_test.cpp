
#include "jackal_aic/certificate/jitter_search.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "ground.hpp"
#include "jackal_aic/aic/spectral_radius.hpp"
#include "jackal_aic/predictive/wheel_controller.hpp"

namespace jackal_aic {
namespace {

using Eigen::MatrixXd;

/// The model is the robot.
LinearLoop groundLoop() { return {PredictiveParameters{}, ground(), ground()}; }

TEST(JitteredMap, IsThePeriodMapWithoutJitter) {
  const LinearLoop loop = groundLoop();
  const Eigen::Vector3d regular = loop.irregularGains(1)[1];
  for (const double phase : {0.0, 0.0055, 0.02}) {
    for (const double extra : {0.0, 0.013}) {
      const MatrixXd map = loop.jitteredMap({phase, extra, regular}, 0.04);
      EXPECT_NEAR(spectralRadiusOf(map).value, loop.spectralRadius(LoopMode::straight, {1.0, extra, phase}), 1e-6)
          << phase << ", " << extra;
    }
  }
}

TEST(JitterSearch, FindsNoGrowthOnASlightlyIrregularClock) {
  for (const Jitter& jitter : {Jitter{0.02, 0}, Jitter{0.0, 3}}) {
    EXPECT_LT(worstGrowth(groundLoop(), jitter), 1.0) << jitter.extra_delay << " s, " << jitter.lost_samples << " lost";
  }
}

TEST(JitterSearch, FindsGrowthInASequenceOfStablePeriods) {
  const LinearLoop loop = groundLoop();
  for (const double delay : {0.0, 0.02, 0.04}) EXPECT_TRUE(loop.stable({1.0, delay})) << delay;
  EXPECT_GT(worstGrowth(loop, {0.04, 0}), 1.0);
}

/// Speed of a wheel after 10 s under its controller, which wants 5 rad/s and is disturbed, on a random clock [rad/s].
double settledSpeed(const Jitter& jitter, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto draw = [&random](int most) { return std::uniform_int_distribution<int>(0, most)(random); };
  PlantModel model = ground();
  model.acceleration_limit = 1e6;
  WheelController controller(PredictiveParameters{}, model, 0.098);
  DriveTrain wheel(model, 0.098);
  controller.restart(0.0);
  Eigen::Vector3d x(0.0, 0.0, -0.5);  // speed, and disturbance of the motor's input
  std::vector<double> sent(100, 0.0);
  for (int k = 0, lost = 0; k < 500; ++k) {
    const int phase = draw(19), delay = 80 + draw(static_cast<int>(std::lround(1000.0 * jitter.extra_delay)));
    const bool loses = lost < jitter.lost_samples && draw(1) == 1;
    lost = loses ? lost + 1 : 0;
    for (int i = 1; i <= 20; ++i) {  // ms
      sent.push_back(controller.action());
      wheel.step(x, sent[sent.size() - 1 - static_cast<std::size_t>(delay)]);
      controller.predict();
      if (i == 20 - phase && !loses) controller.correct(x(0));
    }
    controller.act(controller.input(5.0));
  }
  return x(0);
}

TEST(JitterSearch, WheelSettlesOnAnyClockWithin) {
  for (const Jitter& jitter : {Jitter{0.02, 0}, Jitter{0.0, 3}}) {
    for (std::uint64_t seed = 1; seed <= 100; ++seed) EXPECT_NEAR(settledSpeed(jitter, seed), 5.0, 0.01) << seed;
  }
}

}  // namespace
}  // namespace jackal_aic
