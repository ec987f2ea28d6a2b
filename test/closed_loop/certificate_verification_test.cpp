// The certificate against the time domain: the controller itself on a linear plant and on the ODE plant on its box.

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <boost/multiprecision/eigen.hpp>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>

#include "jackal_aic/aic/active_inference_controller.hpp"
#include "jackal_aic/aic/spectral_radius.hpp"
#include "jackal_aic/certificate/certificate.hpp"
#include "jackal_plant.hpp"
#include "linear_plant.hpp"
#include "stepped_loop.hpp"

namespace jackal_aic {
namespace {

constexpr double kStep = sim::JackalPlant::kStep;

/// A random closed loop.
struct Case {
  ControllerParameters controller;
  GeometryParameters geometry;
  PlantModel plant;
  double phase = 0.0;  // between sensor and action [s]
};

/// Draws cases whose rates divide 1 kHz and whose dead times are whole milliseconds, as the simulated plants need.
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
    const auto [belief_rate, action_rate] = oneOf(kRates);
    c.controller.belief_rate = belief_rate;
    c.controller.action_rate = action_rate;
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
    const auto longest = std::lround(1.0 / std::max(c.plant.sensor_rate, action_rate) / kStep);
    c.phase = kStep * static_cast<double>(std::uniform_int_distribution<long>(0, longest - 1)(phase_random_));
    return c;
  }

 private:
  static constexpr std::array<std::pair<double, double>, 7> kRates{
      {{1000, 50}, {1000, 100}, {50, 50}, {100, 100}, {250, 50}, {500, 25}, {200, 20}}};
  static constexpr std::array<double, 4> kSensorRates{50, 100, 25, 20};

  std::mt19937_64 random_, phase_random_;
};

std::string describeCase(const Case& c) {
  std::ostringstream out;
  out << "belief " << c.controller.belief_rate << " Hz, action " << c.controller.action_rate << " Hz, sensor "
      << c.plant.sensor_rate << " Hz, integrator " << static_cast<int>(c.controller.integrator) << ", p "
      << c.controller.orders << ", tau " << c.controller.tau << ", kappa_mu " << c.controller.kappa_mu << ", kappa_a "
      << c.controller.kappa_a << ", dead time " << c.plant.dead_time << ", lag " << c.plant.lag << ", integral "
      << c.plant.velocity_loop_integral << ", on box " << c.plant.on_box << ", phase " << c.phase;
  return out.str();
}

/// The plant model without a physics engine.
class LinearModel : public LinearPlant {
 public:
  explicit LinearModel(const Case& c) : LinearPlant(c.plant, c.geometry) {}
};

/// The simulated robot on its box, without noise, its limits out of reach.
class OdePlant {
 public:
  explicit OdePlant(const Case& c) : plant_(urdf(), parameters(c.plant)) {}

  void command(const WheelCommand& command) { plant_.command(command); }
  void step() {
    plant_.step();
    if (plant_.measurement()) observation_ = plant_.measurement()->observation();
  }
  Observation observation() const { return observation_; }

 private:
  static const std::string& urdf() {
    static const std::string text = [] {
      std::ifstream file(std::string(JACKAL_AIC_SOURCE_DIR) + "/sim/urdf/jackal.urdf");
      std::ostringstream out;
      out << file.rdbuf();
      return out.str();
    }();
    return text;
  }

  static sim::PlantParameters parameters(const PlantModel& model) {
    sim::PlantParameters p;
    p.support = sim::Support::box;
    p.dead_time = model.dead_time;
    p.motor_lag = model.lag;
    p.wheel_gain = model.gain;
    p.velocity_loop_integral = model.velocity_loop_integral;
    p.acceleration_limit = p.torque_limit = 1e9;
    p.speed_limit = 1e9;
    p.sensor_rate = model.sensor_rate;
    p.noise_scale = 0.0;
    return p;
  }

  sim::JackalPlant plant_;
  Observation observation_;
};

/// What a run does after its set point went back to zero.
enum class Verdict { stable, unstable };

/// Drives a plant for a second, forwards, sideways and turning, so that every mode moves, then asks for rest and
/// watches whether the loop finds it. Neither limits nor a drive gate here.
template <class Plant>
class TimeDomain {
 public:
  /// @param decay, growth relative to the largest excursion in the first second at which the verdict is clear;
  /// @param longest run [s].
  TimeDomain(const Case& c, double decay, double growth, double longest)
      : loop_(Plant(c), ActiveInferenceController(c.controller, c.geometry, {}, Divergence::allowed),
              {c.plant.sensor_rate, c.controller.belief_rate, c.controller.action_rate, c.phase}),
        decay_(decay),
        growth_(growth),
        seconds_(static_cast<int>(longest)) {}

  Verdict verdict() {
    loop_.controller.observe(Observation{});
    loop_.controller.setSetPoint({0.5, 0.2, 0.4});
    const double reference = excursionInOneSecond();
    loop_.controller.setSetPoint({});
    excursionInOneSecond();
    double middle = 0.0, last = 0.0;
    for (int second = 2; second < seconds_; ++second) {
      last = std::max(excursionInOneSecond(), excursionInOneSecond());  // slow beats need more than one second
      if (!(last < growth_ * reference)) return Verdict::unstable;
      if (last < decay_ * reference) return Verdict::stable;
      if (second == seconds_ / 2) middle = last;
    }
    return last < middle ? Verdict::stable : Verdict::unstable;
  }

 private:
  double excursionInOneSecond() {
    double largest = 0.0;
    for (int i = 0; i < std::lround(1.0 / kStep); ++i) {
      loop_.step();
      const Observation y = loop_.plant.observation();
      const GeneralizedBody& belief = loop_.controller.belief();
      largest =
          std::max({largest, std::abs(y.wheel_left), std::abs(y.wheel_right), belief.col(0).cwiseAbs().maxCoeff()});
      if (!std::isfinite(y.wheel_left) || !belief.allFinite()) return HUGE_VAL;
    }
    return largest;
  }

  SteppedLoop<Plant, ActiveInferenceController> loop_;
  double decay_, growth_;
  int seconds_;
};

template <class Plant>
Verdict timeDomainVerdict(const Case& c, double decay, double growth, double longest) {
  return TimeDomain<Plant>(c, decay, growth, longest).verdict();
}

/// Radius of the loop of a case over its period, at its phase; the lateral belief goes on by itself.
double radiusOf(const Case& c) {
  const LinearLoop loop(c.controller, c.geometry, c.plant);
  const LoopChange at_phase{1.0, 0.0, c.phase};
  return std::max({loop.spectralRadius(LoopMode::straight, at_phase), loop.spectralRadius(LoopMode::turn, at_phase),
                   std::pow(loop.beliefSpectralRadius(), std::round(c.controller.belief_rate * loop.period()))});
}

Verdict certifiedVerdict(const Case& c) { return radiusOf(c) < kStabilityLimit ? Verdict::stable : Verdict::unstable; }

bool withinHalfAPercentOfOne(double radius) { return std::abs(radius - 1.0) <= 0.005; }

TEST(CertificateVerification, AgreesWithEveryRunOnALinearPlant) {
  CaseGenerator generator(20221);
  int compared = 0, unstable = 0;
  while (compared < 600) {
    const Case c = generator.draw();
    const double radius = radiusOf(c);
    if (withinHalfAPercentOfOne(radius)) continue;
    ++compared;
    unstable += radius >= 1.0;
    EXPECT_EQ(timeDomainVerdict<LinearModel>(c, 1e-6, 1e6, 200.0), certifiedVerdict(c))
        << "radius " << radius << ": " << describeCase(c);
  }
  EXPECT_GT(unstable, compared / 5) << "too few unstable sets to tell";
  EXPECT_LT(unstable, 4 * compared / 5) << "too few stable sets to tell";
}

TEST(CertificateVerification, AgreesWithTheSimulatedRobotOnItsBox) {
  CaseGenerator generator(4711);
  int compared = 0, agreed = 0, unstable = 0;
  while (compared < 500) {
    Case c = generator.draw();
    c.plant.on_box = true;
    c.phase = 0.0;  // the simulated robot samples by a clock of its own
    const double radius = radiusOf(c);
    if (withinHalfAPercentOfOne(radius)) continue;
    ++compared;
    unstable += radius >= 1.0;
    const bool agree = timeDomainVerdict<OdePlant>(c, 1e-2, 1e2, 30.0) == certifiedVerdict(c);
    agreed += agree;
    if (!agree) std::cout << "disagrees, radius " << radius << ": " << describeCase(c) << "\n";
  }
  EXPECT_GE(agreed, std::ceil(0.98 * compared));
  EXPECT_GT(unstable, compared / 5);
  EXPECT_LT(unstable, 4 * compared / 5);
  RecordProperty("agreed", agreed);
}

/// Unstable if a run is at any phase of the timers.
Verdict verdictOverPhase(Case c) {
  const double longest = 1.0 / std::max(c.plant.sensor_rate, c.controller.action_rate);
  for (const double part : {0.0, 0.5, 1.0}) {
    c.phase = kStep * std::floor(part * (longest / kStep - 1.0) + 0.5);
    if (timeDomainVerdict<LinearModel>(c, 1e-4, 1e4, 400.0) == Verdict::unstable) return Verdict::unstable;
  }
  return Verdict::stable;
}

/// With 34 digits, so that even a map far from normal leaves twenty of them.
double exactRadius(const Eigen::MatrixXd& map) {
  using Real = boost::multiprecision::cpp_bin_float_quad;
  using Map = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  const Eigen::EigenSolver<Map> solver(map.cast<Real>().eval(), false);
  Real largest = 0;
  for (Eigen::Index i = 0; i < solver.eigenvalues().size(); ++i) {  // Eigen 3.3 knows no begin()
    const std::complex<Real> value = solver.eigenvalues()[i];
    largest = std::max<Real>(largest, value.real() * value.real() + value.imag() * value.imag());
  }
  return static_cast<double>(sqrt(largest));
}

TEST(CertificateVerification, RadiusIsRightWithinItsUncertaintyOnThreeThousandSets) {
  CaseGenerator generator(20221);
  int sharp = 0;
  for (int i = 0; i < 3000; ++i) {
    const Case c = generator.draw();
    const LoopMode mode = i % 2 == 0 ? LoopMode::straight : LoopMode::turn;
    const Eigen::MatrixXd map = LinearLoop(c.controller, c.geometry, c.plant).periodMap(mode);
    if (!map.allFinite()) continue;
    const SpectralRadius radius = spectralRadiusOf(map);
    EXPECT_EQ(spectralRadiusBeside(kStabilityLimit, map) < kStabilityLimit, radius.upper() < kStabilityLimit)
        << i << ", radius " << radius.value << ": " << describeCase(c);
    const double exact = exactRadius(map);
    if (!std::isfinite(exact)) continue;
    EXPECT_LE(std::abs(radius.value - exact), radius.uncertainty)
        << i << ", radius " << exact << ": " << describeCase(c);
    EXPECT_LE(radius.uncertainty, 1e-6 * std::max(1.0, exact)) << i << ", radius " << exact << ": " << describeCase(c);
    sharp += radius.uncertainty <= 1e-9 * std::max(1.0, exact);
  }
  EXPECT_GE(sharp, 2980);
}

/// In double precision and without scaling the states this loop's radius came out above 1 from 0.04 s more dead time
/// on, where the loop is stable far beyond.
TEST(CertificateVerification, MarginsOfAMapFarFromNormalHoldInTheTimeDomain) {
  CaseGenerator generator(7);
  Case c = generator.draw();
  for (int i = 0; i < 37; ++i) c = generator.draw();
  const Certificate certificate = certify(c.controller, c.geometry, c.plant);
  EXPECT_GT(certificate.delay_margin, 0.25) << describeCase(c);
  EXPECT_EQ(certificate.straight.gain_reduction, 0.0) << "nor does a smaller gain make it unstable";
  for (const double more : {0.041, 0.051, 0.97 * certificate.delay_margin, 1.03 * certificate.delay_margin}) {
    Case slower = c;
    slower.plant.dead_time += more;
    EXPECT_EQ(verdictOverPhase(slower), more < certificate.delay_margin ? Verdict::stable : Verdict::unstable) << more;
  }
}

/// Not only at the margins: no unstable gain and no unstable delay lies within them.
TEST(CertificateVerification, EverythingWithinTheMarginsIsStable) {
  CaseGenerator generator(8);
  int compared = 0;
  while (compared < 60) {
    const Case c = generator.draw();
    if (c.plant.lag <= 0.0)
      continue;  // what is measured then jumps with the phase, between the phases that are looked at
    const LinearLoop loop(c.controller, c.geometry, c.plant);
    if (!loop.stable()) continue;
    ++compared;
    const ModeCertificate turn = certify(c.controller, c.geometry, c.plant).turn;
    const double lowest = std::max(turn.gain_reduction, 1e-3);
    for (int i = 0; i <= 40; ++i) {
      const double gain = lowest * std::pow(turn.gain_margin / lowest, i / 40.0);
      EXPECT_TRUE(loop.stable(LoopMode::turn, {gain, 0.0})) << gain << ": " << describeCase(c);
    }
    for (int i = 0; i <= 12; ++i) {
      const double extra = turn.delay_margin * i / 12;
      EXPECT_TRUE(loop.stable(LoopMode::turn, {1.0, extra})) << extra << ": " << describeCase(c);
    }
  }
}

/// The margins are where the run changes its verdict.
TEST(CertificateVerification, MarginsHoldInTheTimeDomain) {
  CaseGenerator generator(7);
  int gains = 0, delays = 0;
  while (gains < 15 || delays < 15) {
    Case c = generator.draw();
    if (c.plant.lag <= 0.0) continue;  // what is measured then jumps with the phase, and no tick meets the jump
    const Certificate certificate = certify(c.controller, c.geometry, c.plant);
    if (!certificate.stable()) continue;
    // A phase between the ticks of the run may be a little worse than all of these.
    const double a_tick = kStep * std::max(c.plant.sensor_rate, c.controller.action_rate);
    if (gains < 15 && certificate.gain_margin < 100.0) {
      ++gains;
      Case below = c, above = c;
      below.controller.kappa_a *= 0.97 * certificate.gain_margin;
      above.controller.kappa_a *= (1.03 + 0.5 * a_tick) * certificate.gain_margin;
      EXPECT_EQ(verdictOverPhase(below), Verdict::stable) << describeCase(c);
      EXPECT_EQ(verdictOverPhase(above), Verdict::unstable) << describeCase(c);
    }
    if (delays < 15 && certificate.delay_margin < 0.9 * kLargestDelayMargin && certificate.delay_margin > 0.04) {
      ++delays;
      Case below = c, above = c;
      below.plant.dead_time += 0.97 * certificate.delay_margin - kStep;
      above.plant.dead_time += 1.03 * certificate.delay_margin + 2 * kStep;
      EXPECT_EQ(verdictOverPhase(below), Verdict::stable) << describeCase(c);
      EXPECT_EQ(verdictOverPhase(above), Verdict::unstable) << describeCase(c);
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
      EXPECT_LT(radius, worst + 1e-3) << describeCase(c) << ", point " << i;
    }
  }
}

}  // namespace
}  // namespace jackal_aic
