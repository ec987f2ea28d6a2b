#include "jackal_aic/model/drive_train_belief.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "jackal_aic/model/wheel_belief.hpp"

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098;  // m

PlantModel model() {
  PlantModel m;
  m.dead_time = 0.0;
  m.lag = 0.02;
  m.acceleration_limit = 1.65;
  m.velocity_loop_integral = 5.0;
  return m;
}

/// At the acceleration limit and below it, in runs of every length.
TEST(DriveTrainBelief, EqualsAWheelBeliefWithoutFurtherLearning) {
  const WheelBeliefParameters trust;
  const DriveTrainBeliefParameters parameters{trust.measurement_variance, trust.speed_process_noise,
                                              trust.disturbance_process_noise, trust.disturbance_deviation,
                                              trust.dead_time_deviation};
  DriveTrainBelief belief(model(), kRadius, parameters);
  WheelBelief wheel(model(), kRadius, trust, 0.0);
  std::mt19937 random(4);
  std::normal_distribution<double> draw;
  PerStep acting, speeds, rates;
  acting.fill(0.0);
  for (int k = 0; k < 2000; ++k) {
    const std::size_t number = 1 + random() % kMostSteps;
    if (random() % 5 == 0) acting.fill(5.0 * draw(random));
    belief.predict(acting, number, speeds, rates);
    for (std::size_t i = 0; i < number; ++i) {
      wheel.predictActing(acting[i]);
      ASSERT_NEAR(speeds[i], wheel.speed(), 1e-9) << k;
      ASSERT_NEAR(rates[i], wheel.acceleration(), 1e-6) << k;
    }
    ASSERT_NEAR(belief.speedVariance() / wheel.covariance()(0, 0), 1.0, 1e-9) << k;
    if (random() % 3 != 0) continue;
    const double measured = wheel.speed() + 0.1 * draw(random), added = random() % 2 == 0 ? 0.0 : 0.04;
    belief.correct(measured, added);
    wheel.correct(measured, added);
    ASSERT_NEAR(belief.speed(), wheel.speed(), 1e-9) << k;
  }
  belief.reset(3.0);
  EXPECT_EQ(belief.speed(), 3.0);
  EXPECT_EQ(belief.speedVariance(), trust.measurement_variance);
}

}  // namespace
}  // namespace jackal_aic
