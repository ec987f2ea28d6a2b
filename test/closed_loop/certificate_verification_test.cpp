// The certificates against the time domain: the controllers themselves on a linear plant, as the simulated robot on its
// box; the predictive one on robots that differ from its model.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <tuple>
#include <utility>

#include "jackal_aic/aic/active_inference_controller.hpp"
#include "jackal_aic/certificate/certificate.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"
#include "linear_plant.hpp"

namespace jackal_aic {
namespace {

constexpr double kStep = LinearPlant::kStep;

/// Random closed loops, whose rates divide 1 kHz and whose dead times are whole milliseconds, as LinearPlant needs.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed), phase_random_(seed + 1) {}

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  double logarithmic(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  bool chance(double share) { return uniform(0.0, 1.0) < share; }

  /// Rates of belief and action [Hz].
  std::pair<double, double> rates() {
    constexpr std::array<std::pair<double, double>, 7> kRates{
        {{1000, 50}, {1000, 100}, {50, 50}, {100, 100}, {250, 50}, {500, 25}, {200, 20}}};
    return oneOf(kRates);
  }
  double sensorRate() { return oneOf(std::array<double, 4>{50, 100, 25, 20}); }

  /// Of a sensor's sample at an action [s].
  double phase(double sensor_rate, double action_rate) {
    const auto longest = std::lround(1.0 / std::max(sensor_rate, action_rate) / kStep);
    return kStep * static_cast<double>(std::uniform_int_distribution<long>(0, longest - 1)(phase_random_));
  }

 private:
  template <class List>
  typename List::value_type oneOf(const List& list) {
    return list[std::uniform_int_distribution<std::size_t>(0, list.size() - 1)(random_)];
  }

  std::mt19937_64 random_, phase_random_;
};

/// When a loop that was moved and is to rest is clearly stable or unstable: excursions in parts of the first, and the
/// pairs of seconds that are watched.
struct Verdict {
  double decay, growth;
  int pairs;
};

/// Largest number that a controller believes.
double believed(const ActiveInferenceController& controller) {
  const GeneralizedBody& belief = controller.belief();
  return belief.allFinite() ? belief.col(0).cwiseAbs().maxCoeff() : HUGE_VAL;
}
double believed(const PredictiveController& controller) { return std::abs(controller.left().disturbance()); }

/// Plant, sensor, belief and action, in this order, in steps of 1 ms. Not a DriveLoop: what is tested is the map of the
/// controller itself, whose growth the gate, the limits and the fault monitor would bound.
template <class Controller>
class SteppedLoop {
 public:
  /// @param gains has the rates of belief and action; @param phase of the sensor ahead of the action [s].
  template <class Gains>
  SteppedLoop(LinearPlant plant, Controller controller, double sensor_rate, const Gains& gains, double phase)
      : plant(std::move(plant)),
        controller(std::move(controller)),
        sensor_(steps(1.0 / sensor_rate)),
        belief_(steps(1.0 / gains.belief_rate)),
        action_(steps(1.0 / gains.action_rate)),
        phase_(steps(phase)) {}

  void step() {
    plant.step();
    ++now_;
    if ((now_ + phase_) % sensor_ == 0) controller.observe(plant.observation());
    if (now_ % belief_ == 0) controller.updateBelief();
    if (now_ % action_ == 0) plant.command(controller.updateAction());
  }

  /// Of wheel speeds and belief.
  double largestInOneSecond() {
    double largest = 0.0;
    for (int i = 0; i < std::lround(1.0 / kStep); ++i) {
      step();
      const Observation y = plant.observation();
      largest = std::max({largest, std::abs(y.wheel_left), std::abs(y.wheel_right), believed(controller)});
      if (!std::isfinite(y.wheel_left) || !std::isfinite(largest)) return HUGE_VAL;
    }
    return largest;
  }

  /// Whether the largest excursions in a second decay. Slow beats need two seconds.
  bool decays(double reference, const Verdict& clear) {
    double middle = 0.0, last = 0.0;
    for (int pair = 0; pair < clear.pairs; ++pair) {
      last = std::max(largestInOneSecond(), largestInOneSecond());
      if (!(last < clear.growth * reference)) return false;
      if (last < clear.decay * reference) return true;
      if (pair == clear.pairs / 2) middle = last;
    }
    return last < middle;
  }

  LinearPlant plant;
  Controller controller;

 private:
  static long steps(double time) { return std::lround(time / kStep); }

  long sensor_, belief_, action_, phase_;
  long now_ = 0;
};

/// The verdicts of the certificate and the time domain on loops away from the limit; enough of them stable and
/// unstable.
template <class Case, class Rests>
void expectAgreement(int cases, const Case& draw, const Rests& rests) {
  int compared = 0, unstable = 0;
  for (int number = 1; compared < cases; ++number) {
    const auto loop = draw();
    const double radius = loop.radius();
    if (std::abs(radius - 1.0) <= 0.005) continue;
    ++compared;
    unstable += radius >= 1.0;
    EXPECT_EQ(rests(loop), radius < kStabilityLimit) << "case " << number << ", radius " << radius;
  }
  EXPECT_GT(unstable, compared / 5) << "too few unstable loops to tell";
  EXPECT_LT(unstable, 4 * compared / 5) << "too few stable loops to tell";
}

struct Thesis {
  ControllerParameters controller;
  GeometryParameters geometry;
  PlantModel plant;
  double phase = 0.0;  // between sensor and action [s]

  /// Over the period of the loop, at its phase; the lateral belief goes on by itself.
  double radius() const {
    const LinearLoop loop(controller, geometry, plant);
    const LoopChange at_phase{1.0, 0.0, phase};
    return std::max({loop.spectralRadius(LoopMode::straight, at_phase), loop.spectralRadius(LoopMode::turn, at_phase),
                     std::pow(loop.beliefSpectralRadius(), std::round(controller.belief_rate * loop.period()))});
  }
};

Thesis drawThesis(Draw& draw) {
  Thesis c;
  std::tie(c.controller.belief_rate, c.controller.action_rate) = draw.rates();
  c.controller.integrator = draw.chance(0.7) ? Integrator::exact : Integrator::euler;
  c.controller.orders = static_cast<int>(draw.uniform(0.0, 6.0));
  c.controller.tau = draw.logarithmic(0.002, 0.3);
  c.controller.kappa_mu = draw.logarithmic(0.003, 3.0);
  c.controller.kappa_a = draw.logarithmic(3.0, 80.0);
  c.controller.state_variances.clear();
  c.controller.sensory_variances.clear();
  for (int i = 0; i <= c.controller.orders; ++i) {
    c.controller.state_variances.push_back(draw.logarithmic(0.5, 10.0));
    c.controller.sensory_variances.push_back(draw.logarithmic(0.5, 10.0) * std::pow(10.0, 2 * i));
  }
  c.plant.dead_time = kStep * std::round(draw.uniform(0.0, 200.0));
  c.plant.lag = draw.chance(0.1) ? 0.0 : draw.logarithmic(0.002, 0.2);
  c.plant.velocity_loop_integral = c.plant.lag > 0.0 && draw.chance(0.5) ? draw.uniform(0.0, 3.0) : 0.0;
  c.plant.gain = draw.uniform(0.8, 1.2);
  c.plant.effective_track = draw.uniform(0.4, 0.8);
  c.plant.on_box = draw.chance(0.3);
  c.plant.sensor_rate = draw.sensorRate();
  c.phase = draw.phase(c.plant.sensor_rate, c.controller.action_rate);
  return c;
}

/// Drives a plant forwards, sideways and turning, so that every mode moves. Neither limits nor a drive gate here.
bool comesToRest(const Thesis& c, const Verdict& clear) {
  SteppedLoop loop(LinearPlant(c.plant, c.geometry),
                   ActiveInferenceController(c.controller, c.geometry, {}, Divergence::allowed), c.plant.sensor_rate,
                   c.controller, c.phase);
  loop.controller.observe(Observation{});
  loop.controller.setSetPoint({0.5, 0.2, 0.4});
  const double reference = loop.largestInOneSecond();
  loop.controller.setSetPoint({});
  loop.largestInOneSecond();
  return loop.decays(reference, clear);
}

TEST(CertificateVerification, AgreesWithEveryRun) {
  Draw draw(20221);
  expectAgreement(
      300, [&] { return drawThesis(draw); },
      [](const Thesis& c) {
        return comesToRest(c, {1e-6, 1e6, 198});
      });
}

/// At every phase of the timers.
bool comesToRestAtEveryPhase(Thesis c) {
  const double longest = 1.0 / std::max(c.plant.sensor_rate, c.controller.action_rate);
  for (const double part : {0.0, 0.5, 1.0}) {
    c.phase = kStep * std::floor(part * (longest / kStep - 1.0) + 0.5);
    if (!comesToRest(c, {1e-4, 1e4, 398})) return false;
  }
  return true;
}

/// The margins are where the run changes its verdict.
TEST(CertificateVerification, MarginsHoldInTheTimeDomain) {
  Draw draw(7);
  int gains = 0, delays = 0, number = 0;
  const auto expectBetween = [&number](const Thesis& below, const Thesis& above) {
    EXPECT_TRUE(comesToRestAtEveryPhase(below)) << "case " << number;
    EXPECT_FALSE(comesToRestAtEveryPhase(above)) << "case " << number;
  };
  while (gains < 15 || delays < 15) {
    const Thesis c = drawThesis(draw);
    ++number;
    if (c.plant.lag <= 0.0) continue;  // the measurement then jumps with the phase, and no tick meets the jump
    const Certificate certificate = certify(c.controller, c.geometry, c.plant);
    if (!certificate.stable()) continue;
    // A phase between the ticks of the run may be a little worse than all of these.
    const double a_tick = kStep * std::max(c.plant.sensor_rate, c.controller.action_rate);
    Thesis below = c, above = c;
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
  Draw draw(31);
  for (int compared = 0; compared < 300;) {
    const Thesis c = drawThesis(draw);
    const LinearLoop loop(c.controller, c.geometry, c.plant);
    const double worst = loop.worstSpectralRadius(LoopMode::straight);
    if (!(std::abs(worst - 1.0) < 0.02)) continue;
    ++compared;
    for (int i = 0; i <= 40; ++i) {
      const double radius = loop.spectralRadius(LoopMode::straight, {1.0, 0.0, loop.longestPhase() * i / 40});
      EXPECT_LT(radius, worst + 1e-3) << "case " << compared << ", point " << i;
    }
  }
}

struct Predictive {
  PredictiveParameters parameters;
  PlantModel model, robot;
  double phase = 0.0;  // between sensor and action [s]

  double radius() const {
    return LinearLoop(parameters, model, robot).spectralRadius(LoopMode::straight, {1.0, 0.0, phase});
  }
};

/// A robot far enough from its model that a part of the loops is unstable.
Predictive drawPredictive(Draw& draw) {
  Predictive c;
  std::tie(c.parameters.belief_rate, c.parameters.action_rate) = draw.rates();
  c.parameters.belief_learning_rate = draw.uniform(0.2, 1.0);
  c.parameters.action_learning_rate = draw.uniform(0.3, 1.0);
  c.parameters.reference_time = draw.logarithmic(0.005, 0.2);
  c.parameters.wheel_variance = draw.logarithmic(1e-4, 1e-2);
  c.parameters.speed_process_noise = draw.logarithmic(1e-3, 1.0);
  c.parameters.disturbance_process_noise = draw.logarithmic(1e-3, 1.0);
  c.model.dead_time = kStep * std::round(draw.uniform(0.0, 150.0));
  c.model.lag = draw.logarithmic(0.005, 0.15);
  c.model.velocity_loop_integral = draw.chance(0.5) ? 0.0 : draw.uniform(1.0, 8.0);
  c.model.gain = draw.uniform(0.8, 1.2);
  c.robot = c.model;
  c.robot.dead_time = kStep * std::round(c.model.dead_time / kStep * draw.uniform(0.3, 6.0));
  c.robot.lag *= draw.logarithmic(0.5, 2.0);
  c.robot.gain *= draw.logarithmic(0.5, 4.0);
  c.robot.sensor_rate = draw.sensorRate();
  c.phase = draw.phase(c.robot.sensor_rate, c.parameters.action_rate);
  return c;
}

/// Drives a robot so little that no limit and no slip learning takes part.
bool comesToRest(const Predictive& c) {
  constexpr double kTiny = 1e-9;
  constexpr double kNearlyRest = 1e-30;  // a set point of zero would end the closed loop at standstill
  SteppedLoop loop(LinearPlant(c.robot, {}), PredictiveController(c.parameters, {}, c.model), c.robot.sensor_rate,
                   c.parameters, c.phase);
  loop.controller.observe(Observation{});
  for (int i = 0; i < 10; ++i) loop.largestInOneSecond();  // at rest the gain of the belief converges
  loop.controller.setSetPoint({kTiny, 0.0, kTiny});
  const double reference = loop.largestInOneSecond();
  loop.controller.setSetPoint({kNearlyRest, 0.0, kNearlyRest});
  loop.largestInOneSecond();
  return loop.decays(reference, {1e-4, 1e4, 59});
}

TEST(PredictiveCertificate, AgreesWithEveryRunOnALinearRobot) {
  Draw draw(2026);
  expectAgreement(
      150, [&] { return drawPredictive(draw); }, [](const Predictive& c) { return comesToRest(c); });
}

/// This loop is unstable with 0.0316 to 0.0397 s more dead time and stable again up to 0.051 s.
TEST(PredictiveCertificate, DelayMarginEndsAtTheFirstUnstableDelay) {
  PredictiveParameters parameters;
  parameters.action_learning_rate = 0.839;
  parameters.disturbance_process_noise = 0.05527;
  parameters.speed_process_noise = 0.02543;
  const PlantModel model{0.057, 0.01869, 1.0624, 0.0, 3.152}, robot{0.086389, 0.01818, 1.2165, 0.0, 3.152};
  const LinearLoop loop(parameters, model, robot);
  ASSERT_FALSE(loop.stable({1.0, 0.035}));
  ASSERT_TRUE(loop.stable({1.0, 0.045}));
  EXPECT_NEAR(certify(parameters, model, robot).delay_margin, 0.0315, 3e-4);
}

}  // namespace
}  // namespace jackal_aic
