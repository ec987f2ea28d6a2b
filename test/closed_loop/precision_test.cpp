// Precision learning in the closed loop on the simulated robot: the variances that the controller believes against
// those with which the sensors are made noisy.

#include <gtest/gtest.h>

#include <cmath>

#include "jackal_aic/model/square.hpp"
#include "predictive_loop.hpp"

namespace jackal_aic::sim {
namespace {

class AtNoise : public testing::TestWithParam<std::tuple<const char*, double>> {
 protected:
  PlantParameters robot() const {
    const auto [file, scale] = GetParam();
    auto robot = configured<PlantParameters>(file, "plant");
    robot.noise_scale = scale;
    return robot;
  }
};

void drive(PredictiveLoop& loop, double seconds) {
  const SetPoint legs[] = {{0.5, 0.0, 0.0}, {0.8, 0.0, 0.3}, {0.3, 0.0, -0.5}, {1.0, 0.0, 0.0}};
  loop.drive({}, 1.0);
  for (double time = 0.0; time < seconds; time += 20.0) {
    for (const SetPoint& leg : legs) loop.drive(leg, 5.0);
  }
}

TEST_P(AtNoise, FindsTheNoiseOfEachChannel) {
  PredictiveParameters learning = PredictiveLoop::preset();
  learning.learn_precision = true;
  PredictiveLoop loop({}, learning, robot());
  drive(loop, 60.0);
  const PlantParameters truth = robot();
  const SensorVariances learned = loop.controller.variances();
  const double encoder = square(truth.noise_scale * truth.encoder_noise);
  const double gyro = square(truth.noise_scale * truth.gyro_noise);
  const double accelerometer = square(truth.noise_scale * truth.accelerometer_noise);
  EXPECT_NEAR(learned.wheel_left / encoder, 1.0, 0.2);
  EXPECT_NEAR(learned.wheel_right / encoder, 1.0, 0.2);
  EXPECT_NEAR(learned.gyro / gyro, 1.0, 0.2);
  EXPECT_NEAR(learned.accelerometer / accelerometer, 1.0, 0.2);
}

TEST(Precision, LearnedOnesMakeTheBeliefBetterWhereTheConfiguredOnesAreWrong) {
  PlantParameters noisy = PredictiveLoop::ground();
  noisy.noise_scale = 5.0;
  PredictiveParameters learning = PredictiveLoop::preset();
  learning.learn_precision = true;
  PredictiveLoop fixed({}, PredictiveLoop::preset(), noisy), learned({}, learning, noisy);
  BeliefError with_fixed, with_learned;
  for (auto [loop, error] : {std::pair(&fixed, &with_fixed), std::pair(&learned, &with_learned)}) {
    drive(*loop, 40.0);
    loop->beliefError();
    drive(*loop, 20.0);
    *error = loop->beliefError();
  }
  EXPECT_LT(with_learned.forward, 0.85 * with_fixed.forward);
  EXPECT_LT(with_learned.yaw_rate, 0.6 * with_fixed.yaw_rate);
}

INSTANTIATE_TEST_SUITE_P(Plants, AtNoise,
                         testing::Combine(testing::Values("config/plant.yaml", "config/plant_box.yaml"),
                                          testing::Values(1.0, 5.0)));

}  // namespace
}  // namespace jackal_aic::sim
