#include "jackal_aic/model/wheel_belief.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098;

PlantModel model(double dead_time, double lag, double acceleration_limit = 1000.0) {
  return {dead_time, lag, 1.0, 0.0, 0.0, acceleration_limit};
}

/// Gives a command for a time [s] to a wheel that keeps a speed [rad/s].
void keep(WheelBelief& wheel, double command, double speed, double seconds) {
  for (int k = 1; k <= std::lround(1000.0 * seconds); ++k) {
    wheel.predict(command);
    if (k % 20 == 0) wheel.correct(speed);
  }
}

TEST(WheelBelief, PredictsDeadTimeAndLag) {
  const double dead_time = 0.05, lag = 0.1;
  WheelBelief wheel(model(dead_time, lag), kRadius, {});
  for (int k = 1; k <= 400; ++k) {
    wheel.predict(3.0);
    const double since = 0.001 * k - dead_time;
    EXPECT_NEAR(wheel.speed(), since > 0.0 ? 3.0 * (1.0 - std::exp(-since / lag)) : 0.0, 1e-9) << k << " ms";
  }
}

/// Largest disturbance that is believed while a wheel follows a step of 1 rad/s late and slowly, and how long after it
/// a wheel that turns 20 % faster than asked is known to do so to a tenth [s].
std::pair<double, double> largestOfASoftLoop(double timing_time_constant, double gain) {
  WheelBeliefParameters parameters;
  parameters.timing_time_constant = timing_time_constant;
  WheelBelief wheel(model(0.04, 0.006), kRadius, parameters);
  WheelBelief truth(model(0.06, gain == 1.0 ? 0.06 : 0.006), kRadius, {});
  double largest = 0.0, known = 0.0;
  for (int k = 1; k <= 2000; ++k) {
    wheel.predict(1.0);
    truth.predict(gain);
    if (k % 20 != 0) continue;
    wheel.correct(truth.speed());
    largest = std::max(largest, std::abs(wheel.disturbance()));
    if (std::abs(wheel.disturbance() - (gain - 1.0)) > 0.1 * std::abs(gain - 1.0)) known = 0.001 * k;
  }
  return {largest, known};
}

TEST(WheelBelief, FadingErrorsAreTimingAndLastingOnesADisturbance) {
  const double white = largestOfASoftLoop(0.0, 1.0).first, coloured = largestOfASoftLoop(0.035, 1.0).first;
  EXPECT_GT(white, 0.1) << "a soft loop that is taken for a disturbance";
  EXPECT_LT(coloured, 0.5 * white);
  EXPECT_LT(largestOfASoftLoop(0.035, 1.2).second, 0.3) << "found as soon as it has outlasted the timing";
}

TEST(WheelBelief, CovarianceIsHonest) {
  // Over many runs with disturbance and noise as modelled, the normalised squared error of w averages 1.
  const WheelBeliefParameters parameters;
  double sum = 0.0;
  std::mt19937 random(5);
  std::normal_distribution<double> unit(0.0, 1.0);
  constexpr int kRuns = 300;
  for (int run = 0; run < kRuns; ++run) {
    WheelBelief wheel(model(0.0, 0.05), kRadius, parameters);
    double w = 0.03 * unit(random), d = 0.3 * unit(random);
    for (int k = 1; k <= 600; ++k) {
      wheel.predict(1.0);
      w +=
          -std::expm1(-0.001 / 0.05) * (1.0 + d - w) + std::sqrt(parameters.speed_process_noise * 0.001) * unit(random);
      d += std::sqrt(parameters.disturbance_process_noise * 0.001) * unit(random);
      // Measured at speeds that hardly change, so that the timing term of the variance plays no part.
      if (k % 20 == 0) wheel.correct(w + 0.03 * unit(random));
    }
    const double error = wheel.speed() - w;
    sum += error * error / wheel.covariance()(0, 0);
  }
  EXPECT_NEAR(sum / kRuns, 1.0, 0.25);
}

TEST(WheelBelief, SlowMotorIsNoDisturbance) {
  // A ramp of the command at the model's limit, then the goal; the wheel by its own limit.
  for (const double limit_factor : {0.0, 0.5, 0.8, 1.0, 2.0}) {
    WheelBeliefParameters parameters;
    parameters.limit_deviation = 0.6;
    const PlantModel drive = model(0.08, 0.006, 1.65);
    WheelBelief wheel(drive, kRadius, parameters);
    const double limit = drive.acceleration_limit / kRadius * WheelBelief::kStep;
    CommandsUnderWay commands(drive.dead_time);
    commands.fill(0.0);
    double command = 0.0, speed = 0.0, largest = 0.0;
    for (int k = 0; k < 2000; ++k) {
      command = std::min(10.0, command + limit);
      speed += std::clamp(commands.step(command) - speed, -limit_factor * limit, limit_factor * limit);
      wheel.predict(command);
      if (k % 20 == 19) wheel.correct(speed);
      largest = std::max(largest, std::abs(wheel.disturbance()));
    }
    EXPECT_NEAR(wheel.speed(), speed, 0.05) << limit_factor;
    if (limit_factor > 0.0) {
      EXPECT_LT(largest, 0.2) << limit_factor;
    }
  }
}

TEST(WheelBelief, CorrectionIsTheMinimumOfTheFreeEnergyTimesTheLearningRate) {
  WheelBeliefParameters parameters, slow;
  slow.learning_rate = 0.1;
  WheelBelief a(model(0.0, 0.05), kRadius, parameters), b(model(0.0, 0.05), kRadius, slow);
  const double variance = a.covariance()(0, 0) + parameters.measurement_variance;
  EXPECT_NEAR(a.correct(0.2), 0.5 * 0.04 / variance, 1e-9) << "F = 1/2 eps^2 / (C P C' + Sigma)";
  b.correct(0.2);
  EXPECT_NEAR(b.speed(), 0.1 * a.speed(), 1e-12);
  EXPECT_DOUBLE_EQ(a.measurement() - a.predicted(), 0.2);
}

TEST(WheelBelief, SeedKeepsTheCommandsUnderWayAndResetForgetsThem) {
  WheelBelief seeded(model(0.1, 0.02), kRadius, {});
  for (int k = 0; k < 90; ++k) seeded.predict(5.0);
  WheelBelief reset = seeded;
  reset.reset(0.0);
  for (int k = 0; k < 90; ++k) reset.predict(0.0);
  EXPECT_EQ(reset.speed(), 0.0);
  seeded.restart(3.0);
  EXPECT_EQ(seeded.speed(), 3.0);
  for (int k = 0; k < 100; ++k) seeded.predict(0.0);
  EXPECT_NEAR(seeded.speed(), 5.0, 0.1);
  for (int k = 0; k < 200; ++k) seeded.predict(0.0);
  EXPECT_NEAR(seeded.speed(), 0.0, 0.1);
}

TEST(WheelBelief, WrongDisturbanceIsFoundAtConstantSpeed) {
  // Its own limit, which the wheel does not follow, would hide for ever that the disturbance is another one now.
  WheelBelief belief(model(0.0, 0.036, 0.8), kRadius, {});
  belief.reset(5.1);
  keep(belief, 8.1, 5.1, 5.0);
  EXPECT_NEAR(belief.disturbance(), -3.0, 0.1);
  keep(belief, -2.6, -2.2, 6.0);
  EXPECT_NEAR(belief.disturbance(), 0.4, 0.1);
  EXPECT_NEAR(belief.speed(), -2.2, 0.02);
}

TEST(WheelBelief, VarianceAtTheLimitStaysPositive) {
  // At the limit its motion is out of the covariance, and with it how that goes with the timing.
  PlantModel told, robot;
  told.acceleration_limit = 0.8;
  robot.gain = 0.5;
  WheelBeliefParameters parameters;
  parameters.dead_time_deviation = 0.01;
  parameters.timing_time_constant = 0.2;
  for (const double limit : {0.3, 0.6, 1.0}) {
    robot.acceleration_limit = limit;
    WheelBelief belief(told, kRadius, parameters);
    WheelBelief motor(robot, kRadius, {});
    std::mt19937 random(1);
    std::uniform_real_distribution<double> any(-8.0, 8.0);
    double command = 0.0;
    for (int k = 1; k <= 60000 && !HasFailure(); ++k) {
      if (k % 700 == 1) command = any(random);
      belief.predict(command);
      motor.predict(command);
      EXPECT_GT(belief.speedVariance(), 0.0) << k << " ms";
      if (k % 20 == 0) belief.correct(std::round(motor.speed() / 0.1) * 0.1);
    }
  }
}

}  // namespace
}  // namespace jackal_aic
