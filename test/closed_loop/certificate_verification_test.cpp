// The certificate against the time domain: the controller itself on a linear plant, as the simulated robot on its box.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <tuple>

#include "jackal_aic/aic/active_inference_controller.hpp"
#include "jackal_aic/certificate/certificate.hpp"
#include "linear_plant.hpp"
#include "stepped_loop.hpp"

namespace jackal_aic {
namespace {

constexpr double kStep = LinearPlant::kStep;

/// A random closed loop.
struct Case {
  ControllerParameters controller;
  GeometryParameters geometry;
  PlantModel plant;
  double phase = 0.0;  // between sensor and action [s]
};

/// Draws cases whose rates divide 1 kHz and whose dead times are whole milliseconds, as LinearPlant needs.
class CaseGenerator {
 private:
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  double logarithmic(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  template <class List>
  auto oneOf(const List& list) {
    return list[std::uniform_int_distribution<std::size_t>(0, list.size() - 1)(random_)];
  }

 public:
  explicit CaseGenerator(std::uint64_t seed) : random_(seed), phase_random_(seed + 1) {}

  Case draw() {
    Case c;
    ++number;
    std::tie(c.controller.belief_rate, c.controller.action_rate) = oneOf(kRates);
    c.controller.integrator = uniform(0.0, 1.0) < 0.7 ? Integrator::exact : Integrator::euler;
    c.controller.orders = static_cast<int>(uniform(0.0, 6.0));
    c.controller.tau = logarithmic(0.002, 0.3);
    c.controller.kappa_mu = logarithmic(0.003, 3.0);
    c.controller.kappa_a = logarithmic(3.0, 80.0);
    c.controller.state_variances.clear();
    c.controller.sensory_variances.clear();
    for (int i = 0; i <= c.controller.orders; ++i) {
      c.controller.state_variances.push_back(logarithmic(0.5, 10.0));
      c.controller.sensory_variances.push_back(logarithmic(0.5, 10.0) * std::pow(10.0, 2 * i));
    }
    c.plant.dead_time = kStep * std::round(uniform(0.0, 200.0));
    c.plant.lag = uniform(0.0, 1.0) < 0.1 ? 0.0 : logarithmic(0.002, 0.2);
    c.plant.velocity_loop_integral = c.plant.lag > 0.0 && uniform(0.0, 1.0) < 0.5 ? uniform(0.0, 3.0) : 0.0;
    c.plant.gain = uniform(0.8, 1.2);
    c.plant.effective_track = uniform(0.4, 0.8);
    c.plant.on_box = uniform(0.0, 1.0) < 0.3;
    c.plant.sensor_rate = oneOf(kSensorRates);
    const auto longest = std::lround(1.0 / std::max(c.plant.sensor_rate, c.controller.action_rate) / kStep);
    c.phase = kStep * static_cast<double>(std::uniform_int_distribution<long>(0, longest - 1)(phase_random_));
    return c;
  }

  int number = 0;  // of the last case

 private:
  static constexpr std::array<std::pair<double, double>, 7> kRates{
      {{1000, 50}, {1000, 100}, {50, 50}, {100, 100}, {250, 50}, {500, 25}, {200, 20}}};
  static constexpr std::array<double, 4> kSensorRates{50, 100, 25, 20};

  std::mt19937_64 random_, phase_random_;
};

/// Drives a plant for a second, forwards, sideways and turning, so that every mode moves, then asks for rest and
/// watches whether the loop finds it. Neither limits nor a drive gate here.
/// @param decay, growth relative to the largest excursion in the first second at which the verdict is clear;
/// @param longest run [s].
bool comesToRest(const Case& c, double decay, double growth, int longest) {
  SteppedLoop loop(LinearPlant(c.plant, c.geometry),
                   ActiveInferenceController(c.controller, c.geometry, {}, Divergence::allowed),
                   {c.plant.sensor_rate, c.controller.belief_rate, c.controller.action_rate, c.phase});
  const auto excursionInOneSecond = [&loop] {
    double largest = 0.0;
    for (int i = 0; i < std::lround(1.0 / kStep); ++i) {
      loop.step();
      const Observation y = loop.plant.observation();
      const GeneralizedBody& belief = loop.controller.belief();
      largest =
          std::max({largest, std::abs(y.wheel_left), std::abs(y.wheel_right), belief.col(0).cwiseAbs().maxCoeff()});
      if (!std::isfinite(y.wheel_left) || !belief.allFinite()) return HUGE_VAL;
    }
    return largest;
  };
  loop.controller.observe(Observation{});
  loop.controller.setSetPoint({0.5, 0.2, 0.4});
  const double reference = excursionInOneSecond();
  loop.controller.setSetPoint({});
  excursionInOneSecond();
  double middle = 0.0, last = 0.0;
  for (int second = 2; second < longest; ++second) {
    last = std::max(excursionInOneSecond(), excursionInOneSecond());  // slow beats need more than one second
    if (!(last < growth * reference)) return false;
    if (last < decay * reference) return true;
    if (second == longest / 2) middle = last;
  }
  return last < middle;
}

/// Radius of the loop of a case over its period, at its phase; the lateral belief goes on by itself.
double radiusOf(const Case& c) {
  const LinearLoop loop(c.controller, c.geometry, c.plant);
  const LoopChange at_phase{1.0, 0.0, c.phase};
  return std::max({loop.spectralRadius(LoopMode::straight, at_phase), loop.spectralRadius(LoopMode::turn, at_phase),
                   std::pow(loop.beliefSpectralRadius(), std::round(c.controller.belief_rate * loop.period()))});
}

TEST(CertificateVerification, AgreesWithEveryRun) {
  CaseGenerator generator(20221);
  int compared = 0, unstable = 0;
  while (compared < 600) {
    const Case c = generator.draw();
    const double radius = radiusOf(c);
    if (std::abs(radius - 1.0) <= 0.005) continue;
    ++compared;
    unstable += radius >= 1.0;
    EXPECT_EQ(comesToRest(c, 1e-6, 1e6, 200), radius < kStabilityLimit)
        << "case " << generator.number << ", radius " << radius;
  }
  EXPECT_GT(unstable, compared / 5) << "too few unstable sets to tell";
  EXPECT_LT(unstable, 4 * compared / 5) << "too few stable sets to tell";
}

/// At every phase of the timers.
bool comesToRestAtEveryPhase(Case c) {
  const double longest = 1.0 / std::max(c.plant.sensor_rate, c.controller.action_rate);
  for (const double part : {0.0, 0.5, 1.0}) {
    c.phase = kStep * std::floor(part * (longest / kStep - 1.0) + 0.5);
    if (!comesToRest(c, 1e-4, 1e4, 400)) return false;
  }
  return true;
}

/// The margins are where the run changes its verdict.
TEST(CertificateVerification, MarginsHoldInTheTimeDomain) {
  CaseGenerator generator(7);
  int gains = 0, delays = 0;
  const auto expectBetween = [&generator](const Case& below, const Case& above) {
    EXPECT_TRUE(comesToRestAtEveryPhase(below)) << "case " << generator.number;
    EXPECT_FALSE(comesToRestAtEveryPhase(above)) << "case " << generator.number;
  };
  while (gains < 15 || delays < 15) {
    const Case c = generator.draw();
    if (c.plant.lag <= 0.0) continue;  // the measurement then jumps with the phase, and no tick meets the jump
    const Certificate certificate = certify(c.controller, c.geometry, c.plant);
    if (!certificate.stable()) continue;
    // A phase between the ticks of the run may be a little worse than all of these.
    const double a_tick = kStep * std::max(c.plant.sensor_rate, c.controller.action_rate);
    Case below = c, above = c;
    if (gains < 15 && certificate.gain_margin < 100.0) {
      ++gains;
      below.controller.kappa_a *= 0.97 * certificate.gain_margin;
      above.controller.kappa_a *= (1.03 + 0.5 * a_tick) * certificate.gain_margin;
      expectBetween(below, above);
    }
    if (delays < 15 && certificate.delay_margin < 0.9 * kLargestDelayMargin && certificate.delay_margin > 0.04) {
      ++delays;
      below = above = c;
      below.plant.dead_time += 0.97 * certificate.delay_margin - kStep;
      above.plant.dead_time += 1.03 * certificate.delay_margin + 2 * kStep;
      expectBetween(below, above);
    }
  }
}

TEST(CertificateVerification, NoPhaseIsWorseThanTheWorst) {
  CaseGenerator generator(31);
  int compared = 0;
  while (compared < 300) {
    const Case c = generator.draw();
    const LinearLoop loop(c.controller, c.geometry, c.plant);
    const double worst = loop.worstSpectralRadius(LoopMode::straight).value;
    if (!(std::abs(worst - 1.0) < 0.02)) continue;
    ++compared;
    for (int i = 0; i <= 40; ++i) {
      const double radius = loop.spectralRadius(LoopMode::straight, {1.0, 0.0, loop.longestPhase() * i / 40});
      EXPECT_LT(radius, worst + 1e-3) << "case " << generator.number << ", point " << i;
    }
  }
}

}  // namespace
}  // namespace jackal_aic
