// Sequences of phases, delays and lost samples that destabilise the loop, and the wheel's controller on such a clock.

#include "jackal_aic/certificate/jitter_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
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

/// A wheel under its controller in steps of 1 ms, with a clock as that of the search.
class JitteredWheel {
 public:
  explicit JitteredWheel(std::uint64_t seed)
      : random_(seed), controller_(PredictiveParameters{}, model(), kRadius), wheel_(model(), kRadius) {
    controller_.restart(0.0);
    controller_.restart(0.0);
  }

  /// @param wanted speed [rad/s]; @param disturbance of the motor's input [rad/s].
  void period(double wanted, double disturbance, const Jitter& jitter) {
    const int phase = draw(19), delay = 80 + draw(static_cast<int>(std::lround(1000.0 * jitter.extra_delay)));
    const bool lost = lost_ < jitter.lost_samples && draw(1) == 1;
    lost_ = lost ? lost_ + 1 : 0;
    x_(2) = disturbance;
    for (int i = 1; i <= 20; ++i) {
      sent_.push_back(controller_.action());
      const auto now = static_cast<int>(sent_.size()) - 1;
      wheel_.step(x_, now >= delay ? sent_[static_cast<std::size_t>(now - delay)] : 0.0);
      controller_.predict();
      if (i != 20 - phase || lost) continue;
      controller_.correct(x_(0));
    }
    controller_.act(controller_.input(wanted));
  }

  double speed() const { return x_(0); }

  static PlantModel model() {
    PlantModel model = ground();
    model.acceleration_limit = 1e6;
    return model;
  }

 private:
  static constexpr double kRadius = 0.098;  // m
  int draw(int most) { return std::uniform_int_distribution<int>(0, most)(random_); }

  std::mt19937_64 random_;
  WheelController controller_;
  DriveTrain wheel_;
  Eigen::Vector3d x_ = Eigen::Vector3d::Zero();
  std::vector<double> sent_;
  int lost_ = 0;
};

TEST(JitterSearch, WheelSettlesOnAnyClockWithin) {
  for (const Jitter& jitter : {Jitter{0.02, 0}, Jitter{0.0, 3}}) {
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
      JitteredWheel wheel(seed);
      for (int k = 0; k < 500; ++k) wheel.period(5.0, -0.5, jitter);
      EXPECT_NEAR(wheel.speed(), 5.0, 0.01) << "seed " << seed;
    }
  }
}

}  // namespace
}  // namespace jackal_aic
