// Stability under any sequence of phases, delays and lost samples: against sequences that an adversary draws, and
// against the wheel's controller itself.

#include "jackal_aic/certificate/jitter_certificate.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "../../src/certificate/form_search.hpp"
#include "jackal_aic/aic/spectral_radius.hpp"
#include "jackal_aic/predictive/wheel_controller.hpp"

namespace jackal_aic {
namespace {

using Eigen::MatrixXd;

/// The drive train of config/plant_model.yaml, which is the model too.
PlantModel ground() {
  PlantModel model;
  model.dead_time = 0.08;
  model.lag = 0.00636;
  model.velocity_loop_integral = 0.678;
  return model;
}

PredictiveLinearLoop groundLoop() { return {PredictiveParameters{}, ground(), ground()}; }

MatrixXd matrix(double a, double b, double c, double d) { return (Eigen::Matrix2d() << a, b, c, d).finished(); }

TEST(FormSearch, FindsWhatFallsAndNothingElse) {
  const MatrixXd map = matrix(0.5, 3.0, 0.0, 0.5);  // of norm 3.1 and radius 0.5
  const std::vector<FormEdge> edges{{&map, 0, 0}};
  FormSearch search(2, 1);
  ASSERT_TRUE(search.solve(edges, 0.55));
  const MatrixXd P = search.form(0);
  EXPECT_GT(
      (0.55 * 0.55 * P - map.transpose() * P * map).eval().selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(),
      0.0);
  EXPECT_FALSE(FormSearch(2, 1).solve(edges, 0.45));
}

TEST(FormSearch, SeesThatStableMapsMayBeUnstableInTurn) {
  const MatrixXd a = matrix(0.0, 2.0, 0.0, 0.0), b = matrix(0.0, 0.0, 2.0, 0.0);
  EXPECT_TRUE(FormSearch(2, 1).solve({{&a, 0, 0}}, 1.0));
  EXPECT_TRUE(FormSearch(2, 1).solve({{&b, 0, 0}}, 1.0));
  EXPECT_FALSE(FormSearch(2, 1).solve({{&a, 0, 0}, {&b, 0, 0}}, 1.0));
  // If b only follows on b, and a leads there, nothing grows.
  EXPECT_TRUE(FormSearch(2, 2).solve({{&a, 0, 1}, {&b, 1, 1}}, 1.0));
}

TEST(JitteredMap, IsThePeriodMapWhereNothingJitters) {
  const PredictiveLinearLoop loop = groundLoop();
  const Eigen::Vector3d regular = loop.irregularGains(1)[1];
  for (const double phase : {0.0, 0.0055, 0.02}) {
    for (const double extra : {0.0, 0.013}) {
      const MatrixXd map = loop.jitteredMap({phase, extra, regular}, 0.04);
      EXPECT_NEAR(spectralRadiusOf(map).value, loop.spectralRadius({1.0, extra, phase}), 1e-6)
          << phase << ", " << extra;
    }
  }
}

TEST(JitteredMap, NeedsASampleInEachPeriod) {
  PlantModel slow = ground();
  slow.sensor_rate = 25.0;
  EXPECT_THROW(PredictiveLinearLoop(PredictiveParameters{}, ground(), slow).jitteredMap({}, 0.0), ParameterError);
}

/// Draws sequences at the ends and between them.
class Adversary {
 public:
  Adversary(const PredictiveLinearLoop& loop, const Jitter& jitter)
      : loop_(loop), jitter_(jitter), gains_(loop.irregularGains(jitter.lost_samples + 2)) {}

  /// The largest growth per period of sequences of 1 to 10 periods that are repeated for ever.
  double worst(int sequences) {
    double worst = 0.0;
    for (int i = 0; i < sequences; ++i) {
      const int length = 1 + static_cast<int>(10.0 * draw());
      worst = std::max(worst, std::pow(spectralRadiusOf(product(length)).value, 1.0 / length));
    }
    return worst;
  }

 private:
  double draw() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }

  double oneOf(double high) {
    const double kind = draw();
    return kind < 0.4 ? 0.0 : kind < 0.8 ? high : high * draw();
  }

  MatrixXd product(int length) {
    MatrixXd product;
    int lost = 0;
    for (int i = 0; i < length; ++i) {
      JitteredPeriod period{oneOf(loop_.longestPhase() - 1e-9), oneOf(jitter_.extra_delay), {}};
      // The last has a sample, so that the sequence may follow on itself.
      lost = lost < jitter_.lost_samples && i + 1 < length && draw() < 0.6 ? lost + 1 : 0;
      const auto gain = static_cast<std::size_t>(draw() * static_cast<double>(gains_.size()));
      if (lost == 0) period.gain = gains_[gain];
      const MatrixXd map = loop_.jitteredMap(period, jitter_.extra_delay);
      product = i == 0 ? map : MatrixXd(map * product);
    }
    return product;
  }

  const PredictiveLinearLoop& loop_;
  Jitter jitter_;
  std::vector<Eigen::Vector3d> gains_;
  std::mt19937_64 random_{1};
};

TEST(JitterCertificate, NoSequenceInsideGrowsFasterThanItsBound) {
  const PredictiveLinearLoop loop = groundLoop();
  for (const Jitter& jitter : {Jitter{0.02, 0}, Jitter{0.0, 3}}) {
    const double bound = growthBound(loop, jitter);
    EXPECT_LT(bound, 1.0) << jitter.extra_delay << " s, " << jitter.lost_samples << " lost";
    EXPECT_LE(Adversary(loop, jitter).worst(10000), bound);
  }
}

TEST(JitterCertificate, OutsideASequenceOfStablePeriodsGrows) {
  const PredictiveLinearLoop loop = groundLoop();
  const Jitter outside{0.04, 0};
  for (const double delay : {0.0, 0.02, 0.04}) EXPECT_LT(loop.worstSpectralRadius({1.0, delay}), 1.0) << delay;
  EXPECT_GT(Adversary(loop, outside).worst(10000), 1.0);
  EXPECT_GE(growthBound(loop, outside), 1.0);
}

/// A wheel under its controller in steps of 1 ms, with a clock as the certificate's.
class JitteredWheel {
 public:
  explicit JitteredWheel(std::uint64_t seed)
      : random_(seed), controller_(PredictiveParameters{}, model(), kRadius), wheel_(model(), kRadius) {
    controller_.start(0.0);
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
      gains.push_back(controller_.belief().lastGain());
    }
    controller_.act(controller_.input(wanted));
  }

  double speed() const { return x_(0); }

  std::vector<Eigen::Vector3d> gains;  // of the belief

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

TEST(JitterCertificate, TheWheelItselfComesToRestOnAnyClockInside) {
  for (const Jitter& jitter : {Jitter{0.02, 0}, Jitter{0.0, 3}}) {
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
      JitteredWheel wheel(seed);
      for (int k = 0; k < 500; ++k) wheel.period(5.0, -0.5, jitter);
      EXPECT_NEAR(wheel.speed(), 5.0, 0.01) << "seed " << seed;
    }
  }
}

TEST(JitterCertificate, CoversTheGainsOfARealBelief) {
  PredictiveParameters parameters;
  const PredictiveLinearLoop loop(parameters, ground(), ground());
  const Jitter jitter{0.0, 2};
  const auto covered = loop.irregularGains(jitter.lost_samples + 2);
  JitteredWheel wheel(1);
  for (int k = 0; k < 2000; ++k) wheel.period(0.0, 0.0, jitter);
  std::size_t checked = 0;
  for (std::size_t i = wheel.gains.size() / 2; i < wheel.gains.size(); ++i, ++checked) {
    for (const int state : {0, 2}) {
      const auto by_state = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a(state) < b(state); };
      const auto [low, high] = std::minmax_element(covered.begin(), covered.end(), by_state);
      EXPECT_GE(wheel.gains[i](state), 0.98 * (*low)(state)) << state;
      EXPECT_LE(wheel.gains[i](state), 1.02 * (*high)(state)) << state;
    }
  }
  EXPECT_GT(checked, 500u);
}

}  // namespace
}  // namespace jackal_aic
