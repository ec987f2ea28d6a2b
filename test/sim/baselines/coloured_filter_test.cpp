// Estimators for coloured noise, on a wheel that does what its model says.

#include "coloured_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace jackal_aic::sim {
namespace {

constexpr double kStep = 0.02;  // s
constexpr double kWhite = 9e-4;

PlantModel model() {
  PlantModel m;
  m.dead_time = 0.03;
  m.lag = 0.03;
  m.velocity_loop_integral = 5.0;
  m.acceleration_limit = 20.0;
  m.on_box = true;
  return m;
}

struct Found {
  double error = 0.0;        // of the forward speed over the last half, RMS [m/s]
  Eigen::Vector2d learned;   // of the left encoder
  double correlation = 0.0;  // of successive innovations that are left
};

/// Two minutes of steps of 10 s each with noise of first order, sampled every 20 ms.
Found drive(std::unique_ptr<NoiseModel> (*make)(), double deviation, double correlation_time) {
  const PlantModel m = model();
  const GeometryParameters geometry;
  ColouredNoiseFilter filter({}, geometry, m, [make](bool) { return make(); });
  DriveTrainPrediction truth(m, geometry.wheel_radius);
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal;
  const double kept = correlation_time > 0.0 ? std::exp(-kStep / correlation_time) : 0.0;
  double left = 0.0, right = 0.0, sum = 0.0;
  int samples = 0;
  Found found;
  for (int k = 0; k < 120000; ++k) {
    const double command = (k / 10000) % 2 == 0 ? 4.0 : 8.0;
    truth.predict(command);
    filter.predict({command, command});
    if (k % 20 == 19) {
      for (double* noise : {&left, &right}) {
        *noise = kept * *noise + std::sqrt(1.0 - kept * kept) * deviation * normal(generator);
      }
      Observation y;
      y.stamp = 1e-3 * k;
      y.wheel_left = truth.speed() + left + std::sqrt(kWhite) * normal(generator);
      y.wheel_right = truth.speed() + right + std::sqrt(kWhite) * normal(generator);
      filter.correct(y);
    }
    if (k < 60000) continue;
    const double error = filter.velocity()(kForward) - geometry.wheel_radius * truth.speed();
    sum += error * error;
    ++samples;
  }
  found.error = std::sqrt(sum / samples);
  found.learned = filter.wheelNoise().learned();
  return found;
}

std::unique_ptr<NoiseModel> takenForSmall() {
  return std::make_unique<KnownNoise<SmoothNoise>>(SmoothNoise{kWhite, 0.0, 0.0});
}
std::unique_ptr<NoiseModel> takenForWhite() {
  return std::make_unique<KnownNoise<SmoothNoise>>(SmoothNoise{kWhite, 0.04, 0.0});
}
std::unique_ptr<NoiseModel> known() {
  return std::make_unique<KnownNoise<ExponentialNoise>>(ExponentialNoise{kWhite, 0.04, 0.1});
}
std::unique_ptr<NoiseModel> learned() {
  return std::make_unique<LearnedSmoothNoise>(SmoothNoise{kWhite, kWhite, 0.01}, 10.0);
}
std::unique_ptr<NoiseModel> whitened() {
  return std::make_unique<WhitenedNoise>(ExponentialNoise{kWhite, kWhite, 0.01}, 10.0, kStep);
}

TEST(ColouredNoiseFilter, WhoeverKnowsThatTheNoiseHasAMemoryErrsLess) {
  const double white = drive(takenForWhite, 0.2, 0.1).error;
  EXPECT_LT(white, 0.6 * drive(takenForSmall, 0.2, 0.1).error);
  EXPECT_LT(drive(known, 0.2, 0.1).error, white);
  EXPECT_LT(drive(learned, 0.2, 0.1).error, white);
  EXPECT_LT(drive(whitened, 0.2, 0.1).error, white);
}

TEST(ColouredNoiseFilter, LearningCostsLittleWhereTheNoiseIsAsConfigured) {
  const double right = drive(takenForSmall, 0.0, 0.0).error;
  EXPECT_LT(drive(learned, 0.0, 0.0).error, 1.05 * right);
  EXPECT_LT(drive(whitened, 0.0, 0.0).error, 1.05 * right);
}

TEST(WhitenedNoise, FindsNoiseOfFirstOrder) {
  const Eigen::Vector2d found = drive(whitened, 0.2, 0.1).learned;
  EXPECT_NEAR(found(0), 0.2, 0.05);
  EXPECT_NEAR(std::exp(-kStep / found(1)), std::exp(-kStep / 0.1), 0.1);
}

TEST(LearnedSmoothNoise, FindsHowLargeWhiteNoiseIsThatNobodyTold) {
  const Found found = drive(learned, 0.2, 0.0);
  EXPECT_NEAR(found.learned(0), 0.2, 0.02);
  EXPECT_LT(found.learned(1), 0.5 * kStep);
}

}  // namespace
}  // namespace jackal_aic::sim
