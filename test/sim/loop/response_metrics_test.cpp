#include "response_metrics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

namespace jackal_aic::sim {
namespace {

struct Series {
  std::vector<double> time;
  std::vector<double> value;
};

/// Samples of f(time since the step) every millisecond; the step is at 1 s.
Series sampled(const std::function<double(double)>& f, double initial, double duration = 4.0) {
  Series series;
  for (int k = 0; k <= std::lround((1.0 + duration) * 1000.0); ++k) {
    const double t = 0.001 * k;
    series.time.push_back(t);
    series.value.push_back(t < 1.0 ? initial : f(t - 1.0));
  }
  return series;
}

ResponseMetrics metricsOf(const Series& s, double initial, double set_point) {
  return stepResponseMetrics(s.time, s.value, 1.0, initial, set_point);
}

TEST(ResponseMetrics, FirstOrderLagMatchesItsClosedForm) {
  const double tau = 0.2;
  const auto lag = [&](double t) { return 0.5 * (1.0 - std::exp(-t / tau)); };
  const ResponseMetrics m = metricsOf(sampled(lag, 0.0), 0.0, 0.5);
  ASSERT_TRUE(m.bounded && m.settling && m.rise);
  EXPECT_NEAR(*m.settling, tau * std::log(20.0), 1e-3);
  EXPECT_NEAR(*m.rise, tau * std::log(9.0), 1e-3);
  EXPECT_DOUBLE_EQ(m.overshoot_pct, 0.0);
  EXPECT_NEAR(m.steady_error_pct, 0.0, 1e-3);
}

TEST(ResponseMetrics, RingingSettlesAtTheLastEntryIntoTheBand) {
  const double decay = 2.0, frequency = 8.0;
  const auto ringing = [&](double t) { return 1.0 - std::exp(-decay * t) * std::cos(frequency * t); };
  const Series s = sampled(ringing, 0.0, 6.0);
  double last_outside = 0.0;
  for (std::size_t k = 0; k < s.time.size(); ++k) {
    if (s.time[k] >= 1.0 && std::abs(s.value[k] - 1.0) > 0.05) last_outside = s.time[k] - 1.0;
  }
  const ResponseMetrics m = metricsOf(s, 0.0, 1.0);
  EXPECT_NEAR(m.settling.value(), last_outside, 2e-3);
  EXPECT_GT(*m.settling, 1.0);  // long after the first crossing
  const double peak = (M_PI - std::atan(decay / frequency)) / frequency;
  EXPECT_NEAR(m.overshoot_pct, 100.0 * (ringing(peak) - 1.0), 1e-2);
}

TEST(ResponseMetrics, BandIsAroundTheFinalValueNotTheSetPoint) {
  const auto low = [](double t) { return 0.8 * (1.0 - std::exp(-t / 0.1)); };
  const ResponseMetrics m = metricsOf(sampled(low, 0.0), 0.0, 1.0);
  EXPECT_NEAR(m.settling.value(), 0.1 * std::log(20.0), 1e-3);
  EXPECT_FALSE(m.rise.has_value());  // never reaches 90 % of the set point
  EXPECT_NEAR(m.steady_error_pct, -20.0, 1e-3);
}

TEST(ResponseMetrics, StandingRobotNeverSettles) {
  for (const double reached : {0.0, 0.01}) {
    const ResponseMetrics m = metricsOf(sampled([&](double) { return reached; }, 0.0), 0.0, 1.0);
    EXPECT_FALSE(m.settling) << reached;
    EXPECT_NEAR(m.steady_error_pct, 100.0 * (reached - 1.0), 1e-6);
  }
}

TEST(ResponseMetrics, DivergenceHasNoNumbers) {
  const auto growing = [](double t) { return 0.1 * std::exp(3.0 * t); };
  const auto broken = [](double t) { return t > 2.0 ? std::numeric_limits<double>::quiet_NaN() : t; };
  for (const auto& response : {std::function<double(double)>(growing), std::function<double(double)>(broken)}) {
    const ResponseMetrics m = metricsOf(sampled(response, 0.0), 0.0, 1.0);
    EXPECT_FALSE(m.bounded);
    EXPECT_FALSE(m.settling.has_value());
    EXPECT_FALSE(m.rise.has_value());
  }
}

TEST(ResponseMetrics, RefusesSeriesItCannotAssess) {
  EXPECT_THROW(stepResponseMetrics({0.0, 1.0}, {0.0}, 0.0, 0.0, 1.0), std::invalid_argument);
  EXPECT_THROW(stepResponseMetrics({0.0, 0.4}, {0.0, 1.0}, 0.0, 0.0, 1.0), std::invalid_argument);
  EXPECT_THROW(stepResponseMetrics({0.0, 1.0}, {0.0, 1.0}, 0.0, 1.0, 1.0), std::invalid_argument);
}

}  // namespace
}  // namespace jackal_aic::sim
