// The certificate of the predictive controller against the time domain: the controller itself on a linear robot that
// differs from its model.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <tuple>

#include "../certificate/ground.hpp"
#include "jackal_aic/certificate/certificate.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"
#include "linear_plant.hpp"
#include "stepped_loop.hpp"

namespace jackal_aic {
namespace {

struct Case {
  PredictiveParameters parameters;
  PlantModel model;
  PlantModel robot;
  double phase = 0.0;  // between sensor and action [s]
};

/// Draws robots far enough from their models that a part of the loops is unstable.
class CaseGenerator {
 public:
  explicit CaseGenerator(std::uint64_t seed) : random_(seed), phase_random_(seed + 1) {}

  Case draw() {
    Case c;
    std::tie(c.parameters.belief_rate, c.parameters.action_rate) = oneOf(kRates);
    c.parameters.belief_learning_rate = uniform(0.2, 1.0);
    c.parameters.action_learning_rate = uniform(0.3, 1.0);
    c.parameters.reference_time = logarithmic(0.005, 0.2);
    c.parameters.wheel_variance = logarithmic(1e-4, 1e-2);
    c.parameters.speed_process_noise = logarithmic(1e-3, 1.0);
    c.parameters.disturbance_process_noise = logarithmic(1e-3, 1.0);
    c.model.dead_time = 0.001 * std::round(uniform(0.0, 150.0));
    c.model.lag = logarithmic(0.005, 0.15);
    c.model.velocity_loop_integral = uniform(0.0, 1.0) < 0.5 ? 0.0 : uniform(1.0, 8.0);
    c.model.gain = uniform(0.8, 1.2);
    c.robot = c.model;
    c.robot.dead_time = 0.001 * std::round(1000.0 * c.model.dead_time * uniform(0.3, 6.0));
    c.robot.lag *= logarithmic(0.5, 2.0);
    c.robot.gain *= logarithmic(0.5, 4.0);
    c.robot.sensor_rate = oneOf(kSensorRates);
    const auto longest = std::lround(1000.0 / std::max(c.robot.sensor_rate, c.parameters.action_rate));
    c.phase = 0.001 * static_cast<double>(std::uniform_int_distribution<long>(0, longest - 1)(phase_random_));
    return c;
  }

 private:
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  template <class Choices>
  typename Choices::value_type oneOf(const Choices& choices) {
    return choices[static_cast<std::size_t>(uniform(0.0, static_cast<double>(choices.size())))];
  }
  double logarithmic(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }

  static constexpr std::array<std::pair<double, double>, 6> kRates{
      {{1000, 50}, {50, 50}, {250, 50}, {100, 100}, {200, 20}, {500, 25}}};
  static constexpr std::array<double, 4> kSensorRates{50, 100, 25, 20};

  std::mt19937_64 random_, phase_random_;
};

/// Drives a robot so little that no limit and no slip learning takes part, then asks for rest and watches whether the
/// loop finds it.
bool comesToRest(const Case& c) {
  constexpr double kTiny = 1e-9;
  constexpr double kNearlyRest = 1e-30;  // a set point of zero would end the closed loop at standstill
  SteppedLoop<LinearPlant, PredictiveController> loop(
      LinearPlant(c.robot, {}), PredictiveController(c.parameters, {}, c.model),
      {c.robot.sensor_rate, c.parameters.belief_rate, c.parameters.action_rate, c.phase});
  const auto excursionInOneSecond = [&loop] {
    double largest = 0.0;
    for (int i = 0; i < 1000; ++i) {
      loop.step();
      const Observation y = loop.plant.observation();
      largest = std::max(
          {largest, std::abs(y.wheel_left), std::abs(y.wheel_right), std::abs(loop.controller.left().disturbance())});
    }
    return largest;
  };
  loop.controller.observe(Observation{});
  for (int i = 0; i < 10; ++i) excursionInOneSecond();  // at rest the gain of the belief converges
  loop.controller.setSetPoint({kTiny, 0.0, kTiny});
  const double reference = excursionInOneSecond();
  loop.controller.setSetPoint({kNearlyRest, 0.0, kNearlyRest});
  excursionInOneSecond();
  double middle = 0.0, last = 0.0;
  for (int second = 2; second < 120; second += 2) {
    last = std::max(excursionInOneSecond(), excursionInOneSecond());
    if (!(last < 1e4 * reference)) return false;
    if (last < 1e-4 * reference) return true;
    if (second == 60) middle = last;
  }
  return last < middle;
}

TEST(PredictiveCertificate, AgreesWithEveryRunOnALinearRobot) {
  CaseGenerator generator(2026);
  int compared = 0, unstable = 0;
  for (int number = 1; compared < 300; ++number) {
    const Case c = generator.draw();
    const double radius =
        LinearLoop(c.parameters, c.model, c.robot).spectralRadius(LoopMode::straight, {1.0, 0.0, c.phase});
    if (std::abs(radius - 1.0) <= 0.005) continue;
    ++compared;
    unstable += radius >= 1.0;
    EXPECT_EQ(comesToRest(c), radius < kStabilityLimit) << "case " << number << ", radius " << radius;
  }
  EXPECT_GT(unstable, compared / 5) << "too few unstable loops to tell";
  EXPECT_LT(unstable, 4 * compared / 5) << "too few stable loops to tell";
}

/// This loop is unstable with 0.0316 to 0.0397 s more dead time and stable again up to 0.051 s.
TEST(PredictiveCertificate, DelayMarginEndsAtTheFirstUnstableDelay) {
  PredictiveParameters parameters;
  parameters.action_learning_rate = 0.839;
  parameters.disturbance_process_noise = 0.05527;
  parameters.speed_process_noise = 0.02543;
  PlantModel model;
  model.dead_time = 0.057;
  model.lag = 0.01869;
  model.velocity_loop_integral = 3.152;
  model.gain = 1.0624;
  PlantModel robot = model;
  robot.dead_time = 0.086389;
  robot.lag = 0.01818;
  robot.gain = 1.2165;
  const LinearLoop loop(parameters, model, robot);
  ASSERT_FALSE(loop.stable({1.0, 0.035}));
  ASSERT_TRUE(loop.stable({1.0, 0.045}));
  EXPECT_NEAR(certify(parameters, model, robot).delay_margin, 0.0315, 3e-4);
}

}  // namespace
}  // namespace jackal_aic
