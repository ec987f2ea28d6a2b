#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "jackal_aic/predictive/turn_model.hpp"
#include "jackal_aic/predictive/yaw_rate_belief.hpp"

namespace jackal_aic {
namespace {

constexpr double kRatio = 1.8;  // 1/m
constexpr double kPeriod = 0.02;

/// A motion of the wheels [m/s].
struct Motion {
  double x, v;
};

double yawRateOf(const Eigen::Vector4d& q, const Motion& m) {
  return q(0) * m.x + q(1) * m.x * std::abs(m.v) + q(2) * m.v + q(3) * m.v * std::abs(m.x);
}

/// A sample of a gyro: of a turn, or of a straight line where the wheels hardly differ.
void take(TurnModel& model, double yaw_rate, const Motion& m, double step = kPeriod) {
  model.pass(step);
  model.learn(model.error(yaw_rate, m.x, m.v), m.x, m.v, 2.5e-5, step);
}

/// Drives random motions for a second each, with a gyro as noisy as a real one; learns from it.
void drive(const Eigen::Vector4d& truth, int motions, TurnModel& model, double largest_speed = 1.0) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> speed(-largest_speed, largest_speed), turn(-0.8, 0.8);
  std::normal_distribution<double> noise(0.0, 0.01);
  for (int i = 0; i < motions; ++i) {
    const Motion m{turn(random), speed(random)};
    for (int k = 0; k < 50; ++k) take(model, yawRateOf(truth, m) + noise(random), m);
  }
  model.pass(60.0);
}

TEST(TurnModel, LearnsHowTheTurnDependsOnTheMotion) {
  for (const Eigen::Vector4d& truth :
       {Eigen::Vector4d(1.5, 0.1, 0.03, -0.08), Eigen::Vector4d(2.4, -0.12, -0.05, 0.1)}) {
    TurnModel model(kRatio);
    drive(truth, 120, model);
    EXPECT_LT((model.mean() - truth).cwiseAbs().maxCoeff(), 0.05) << model.mean().transpose();
    constexpr double h = 1e-6;
    for (const auto& [x, v] : {Motion{0.5, 0.8}, Motion{-0.5, 0.8}, Motion{0.4, -0.8}, Motion{-0.2, -0.3}}) {
      EXPECT_NEAR(model.yawRate(x, v), yawRateOf(truth, {x, v}), 0.02);
      EXPECT_NEAR(model.difference(yawRateOf(truth, {x, v}), v), x, 0.01);
      EXPECT_NEAR(model.perDifference(x, v), (model.yawRate(x + h, v) - model.yawRate(x - h, v)) / (2 * h), 1e-6);
      EXPECT_NEAR(model.perSpeed(x, v), (model.yawRate(x, v + h) - model.yawRate(x, v - h)) / (2 * h), 1e-6);
    }
  }
  TurnModel one(kRatio);
  drive({1.4, 0.0, 0.0, 0.0}, 120, one);
  EXPECT_NEAR(one.inPlace(), 1.4, 0.005);
  EXPECT_LT(one.mean().tail<3>().cwiseAbs().maxCoeff(), 0.01 * kRatio) << "stays one track";
}

TEST(TurnModel, LearnsByTimeAndNotByTheNumberOfSamples) {
  TurnModel slow(kRatio), fast(kRatio);  // gyros at 50 and at 200 Hz
  for (int k = 0; k < 50; ++k) take(slow, 0.8, {0.5, 0.5}, 0.02);
  for (int k = 0; k < 200; ++k) take(fast, 0.8, {0.5, 0.5}, 0.005);
  const Eigen::Vector4d deviations = slow.coefficients().covariance.diagonal().cwiseSqrt();
  EXPECT_LT((slow.mean() - fast.mean()).cwiseAbs().maxCoeff(), 0.05 * deviations(0));
  EXPECT_LT((slow.coefficients().covariance - fast.coefficients().covariance).cwiseAbs().maxCoeff(),
            0.02 * slow.coefficients().covariance.cwiseAbs().maxCoeff());
}

TEST(TurnModel, StraightLineShowsTheVeerAlone) {
  TurnModel model(kRatio);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.01);
  for (int k = 0; k < 50 * 1800; ++k) {  // half an hour; x is the encoders' noise
    model.pass(kPeriod);
    const double x = 0.3 * noise(random);
    model.learnVeer(model.error(0.02 * 0.8 + noise(random), x, 0.8), x, 0.8, 2.5e-5, kPeriod);
  }
  EXPECT_NEAR(model.mean()(2), 0.02, 0.002);
  EXPECT_NEAR(model.inPlace(), kRatio, 1e-3 * kRatio);
  const double known = model.coefficients().covariance(2, 2);
  TurnModel turned = model;
  for (int k = 0; k < 50 * 300; ++k) take(turned, 0.9, {0.5, 0.0});
  EXPECT_GT(turned.coefficients().covariance(2, 2), 2.0 * known) << "five minutes of turning forget it";
}

TEST(TurnModel, ForgetsDownToThePriorAndNotBelow) {
  TurnModel model(kRatio);
  const Eigen::Matrix4d prior = model.coefficients().covariance;
  drive({1.5, 0.2, 0.03, -0.1}, 60, model);
  EXPECT_LT(model.coefficients().covariance(1, 1), 0.6 * prior(1, 1));
  const Eigen::Vector4d learned = model.mean();
  const Motion in_place{0.5, 0.0};  // says nothing about the speed
  model.pass(60.0);
  for (int k = 0; k < 150000; ++k) take(model, yawRateOf(learned, in_place), in_place);
  const Eigen::Matrix4d left = model.coefficients().covariance;
  const Eigen::Matrix4d forgotten = left - prior;
  EXPECT_LT(forgotten.bottomRightCorner(3, 3).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(left(0, 0), 0.01 * prior(0, 0));
  EXPECT_LT((model.mean() - learned).cwiseAbs().maxCoeff(), 1e-9) << "what was learned stays";
}

TEST(TurnModel, StaysInvertibleUnderRandomSamples) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-5.0, 5.0);
  TurnModel model(kRatio);
  for (int k = 0; k < 5000; ++k) take(model, any(random), {any(random), any(random)});
  ASSERT_TRUE(model.mean().allFinite());
  for (int k = 0; k < 1000; ++k) {
    const Motion m{any(random), any(random)};
    EXPECT_GE(model.perDifference(m.x, m.v), kRatio / 1.5 - 1e-12);
    EXPECT_LE(model.perDifference(m.x, m.v), kRatio * 1.5 + 1e-12);
    EXPECT_NEAR(model.difference(model.yawRate(m.x, m.v), m.v), m.x, 1e-9);
  }
}

/// The ground of one turn does not last: the next turn is that of the robot.
TEST(TurnModel, GroundOfATurnFades) {
  TurnModel model(kRatio);
  drive({1.5, 0.0, 0.0, 0.0}, 120, model);
  for (int k = 0; k < 25; ++k) take(model, 1.3 * 0.5, {0.5, 0.0});  // half a second on slippery ground
  EXPECT_NEAR(model.yawRate(0.5, 0.0), 1.3 * 0.5, 0.02);
  EXPECT_NEAR(model.usualYawRate(0.5, 0.0), 1.5 * 0.5, 0.02);
  for (int k = 0; k < 150; ++k) model.pass(kPeriod);
  EXPECT_NEAR(model.yawRate(0.5, 0.0), 1.5 * 0.5, 0.03);
  EXPECT_NEAR(model.difference(0.75, 0.0), 0.5, 0.02);
}

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
