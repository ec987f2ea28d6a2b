#include "jackal_aic/predictive/precision_learning.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace jackal_aic {
namespace {

TEST(LogPrecision, FindsTheVarianceOfNoise) {
  for (double deviation : {0.01, 0.03, 0.15}) {
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0.0, deviation);
    LogPrecision precision(9e-4, 10.0);
    double sum = 0.0;
    for (int k = 0; k < 20000; ++k) {
      precision.learn(noise(random), 0.0, 0.02);
      if (k >= 10000) sum += precision.variance() / 10000.0;
    }
    EXPECT_NEAR(sum, deviation * deviation, 0.05 * deviation * deviation);
  }
}

TEST(LogPrecision, DescendsTheFreeEnergy) {
  // F(zeta) = 1/2 e^zeta n^2 - 1/2 zeta has its minimum at Sigma = n^2; a small step goes down from both sides.
  const auto free_energy = [](double variance) { return 0.5 * 0.04 / variance + 0.5 * std::log(variance); };
  for (double start : {0.01, 0.2}) {
    LogPrecision precision(start, 10.0);
    precision.learn(0.2, 0.0, 0.02);
    EXPECT_LT(free_energy(precision.variance()), free_energy(start));
  }
  LogPrecision at_minimum(0.04, 10.0);
  at_minimum.learn(0.2, 0.0, 0.02);
  EXPECT_NEAR(at_minimum.variance(), 0.04, 1e-12);
}

TEST(LogPrecision, IsBoundedAndSurvivesAnOutlier) {
  LogPrecision precision(1.0, 1.0);
  precision.learn(1e9, 0.0, 0.01);
  EXPECT_LT(precision.variance(), 2.0) << "one outlier";
  for (int k = 0; k < 10000; ++k) precision.learn(1e9, 0.0, 0.02);
  EXPECT_DOUBLE_EQ(precision.variance(), LogPrecision::kRange);
  for (int k = 0; k < 10000; ++k) precision.learn(0.0, 0.0, 0.02);
  EXPECT_DOUBLE_EQ(precision.variance(), 1.0 / LogPrecision::kRange);
}

TEST(SensorPrecisions, AreUnbiasedThoughTheBeliefTrustsItsModelTooLittle) {
  // The belief's fluctuations are those of a controller; the wheel has none. Neglecting that, as the posterior term of
  // an honest filter does, finds hardly more than half of the variance.
  PlantModel model;
  model.dead_time = 0.0;
  model.lag = 0.05;
  for (double fluctuation : {0.0, 0.01, 0.1}) {
    WheelBeliefParameters trust;
    trust.disturbance_process_noise = trust.speed_process_noise = fluctuation;
    WheelBelief left(model, 0.098, trust), right(model, 0.098, trust), truth(model, 0.098, trust);
    SensorPrecisions precisions({9e-4, 9e-4, 2.5e-5, 2.5e-3}, 10.0);
    precisions.start(left, right);
    std::mt19937 random(1);
    std::normal_distribution<double> unit(0.0, 1.0);
    for (int k = 1; k <= 2000000; ++k) {
      for (WheelBelief* wheel : {&left, &right, &truth}) wheel->predict(4.0);
      precisions.predict(left, right);
      if (k % 20 != 0) continue;
      left.correct(truth.speed() + 0.02 * unit(random));
      right.correct(truth.speed() + 0.06 * unit(random));
      precisions.correct(left, right);
      precisions.learnWheels(0.02);
      left.setMeasurementVariance(precisions.variances().wheel_left);
      right.setMeasurementVariance(precisions.variances().wheel_right);
    }
    EXPECT_NEAR(precisions.variances().wheel_left, 4e-4, 0.15 * 4e-4) << fluctuation;
    EXPECT_NEAR(precisions.variances().wheel_right, 3.6e-3, 0.15 * 3.6e-3) << fluctuation;
  }
}

}  // namespace
}  // namespace jackal_aic
