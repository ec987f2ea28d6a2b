// What the thesis found, on the calibrated plants with their noise.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "calibration.hpp"
#include "experiment_table.hpp"

namespace jackal_aic::sim {
namespace {

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

const ThesisTables& thesis() {
  static const ThesisTables tables(files().path("sim/thesis/tables.yaml"));
  return tables;
}

/// Ours for every row of a table, with the integrator that compares with the thesis.
const std::vector<Residual>& table(const std::string& name) {
  static std::map<std::string, std::vector<Residual>> cache;
  auto& rows = cache[name];
  if (!rows.empty()) return rows;
  for (const ThesisStep& step : thesis().steps(name)) {
    const Integrator integrator = comparableIntegrator(files(), step);
    const ResultRow row = runThesisStep(files(), step, integrator).row;
    rows.push_back({step, integrator, row.settling_s, row.rise_s});
  }
  return rows;
}

const Residual& row(const std::string& name, const std::string& row, const std::string& column) {
  for (const Residual& residual : table(name)) {
    if (residual.thesis.row == row && residual.thesis.column == column) return residual;
  }
  throw std::out_of_range(name + " " + row + " " + column);
}

double error(const std::vector<std::string>& names) {
  std::vector<Residual> all;
  for (const auto& name : names) all.insert(all.end(), table(name).begin(), table(name).end());
  return meanError(all);
}

TEST(Calibration, TablesOnTheBox) {
  EXPECT_LE(error({"5-1", "5-2", "5-4", "5-5", "5-6", "5-9"}), files().bar("thesis_fit.box"));
}

TEST(Calibration, TablesOnTheGround) { EXPECT_LE(error({"3-1a", "3-1b"}), files().bar("thesis_fit.ground")); }

TEST(Calibration, AllTables) {
  EXPECT_LE(error({"3-1a", "3-1b", "5-1", "5-2", "5-4", "5-5", "5-6", "5-9"}), files().bar("thesis_fit.all"));
}

TEST(ThesisTrends, SettlingAndRiseFallWithTau) {
  for (const char* column : {"f = 50Hz", "f = 1kHz"}) {
    EXPECT_LT(row("5-4", "0.01", column).settling.value(), row("5-4", "0.03", column).settling.value()) << column;
    EXPECT_LT(row("5-4", "0.01", column).rise.value(), row("5-4", "0.03", column).rise.value()) << column;
  }
  EXPECT_LT(row("5-4", "0.001", "f = 1kHz").settling.value(), row("5-4", "0.01", "f = 1kHz").settling.value());
  EXPECT_LT(row("5-4", "0.001", "f = 1kHz").rise.value(), row("5-4", "0.01", "f = 1kHz").rise.value());
}

TEST(ThesisTrends, SettlingAndRiseFallWithKappaMu) {
  for (const char* column : {"f = 50Hz", "f = 1kHz"}) {
    for (const char* larger : {"0.1", "0.5"}) {
      EXPECT_LT(row("5-5", larger, column).settling.value(), row("5-5", "0.01", column).settling.value()) << column;
      EXPECT_LT(row("5-5", larger, column).rise.value(), row("5-5", "0.01", column).rise.value()) << column;
    }
  }
}

TEST(ThesisTrends, SettlingFallsInEveryStepOfKappaMuAtOneKilohertz) {
  const auto settling = [](const char* kappa_mu) { return row("5-5", kappa_mu, "f = 1kHz").settling.value(); };
  EXPECT_LT(settling("0.1"), settling("0.01"));
  EXPECT_LT(settling("0.5"), settling("0.1"));
  EXPECT_LT(settling("1"), settling("0.5"));
  EXPECT_LE(settling("1"), files().bar("thesis_trends.kappa_mu_1_over_0_01") * settling("0.01"));
}

TEST(ThesisTrends, RingsWithKappaA15And20) {
  for (const char* column : {"f = 50Hz", "f = 1kHz"}) {
    const double calm = row("5-6", "10", column).settling.value();
    EXPECT_LT(calm, row("5-6", "8", column).settling.value()) << column;
    EXPECT_GT(row("5-6", "15", column).settling.value(), 1.3 * calm) << column;
    EXPECT_GT(row("5-6", "20", column).settling.value(), 2.0 * calm) << column;
    EXPECT_LT(row("5-6", "20", column).rise.value(), row("5-6", "10", column).rise.value()) << column;
  }
}

TEST(ThesisTrends, FrequencyAloneChangesSettlingByLessThan15Percent) {
  for (const char* name : {"5-1", "5-2"}) {
    for (const char* step : {"0.3", "0.5", "1"}) {
      std::vector<double> settling;
      for (const char* column : {"f = 50Hz", "f = 100Hz", "f = 1kHz"}) {
        settling.push_back(row(name, step, column).settling.value());
      }
      const auto [least, most] = std::minmax_element(settling.begin(), settling.end());
      EXPECT_LT(*most / *least, 1.15) << name << " " << step;
    }
  }
}

TEST(ThesisTrends, ImprovedBeatsStandard) {
  const double ratio = row("5-9", "0.5", "Improved").settling.value() / row("5-9", "0.5", "Standard").settling.value();
  EXPECT_GE(ratio, files().bar("thesis_trends.least_improved_over_standard"));
  EXPECT_LE(ratio, files().bar("thesis_trends.most_improved_over_standard"));
  EXPECT_LT(row("5-9", "0.5", "Improved").rise.value(), 0.7 * row("5-9", "0.5", "Standard").rise.value());
}

/// Largest velocity in the assessed half-wave and until the robot's delay has passed, over the set point.
double shareReached(const std::string& controller, const ThesisSquare& square) {
  const SetPointProfile profile = squareProfile({square.minimum, square.maximum, 1.2, 3});
  const RunResult run = runSetup(loadPrintedSetup(files(), controller, "box", {}), profile);
  EXPECT_TRUE(run.row.bounded);
  double fastest = 0.0;
  for (const Sample& sample : run.samples) {
    if (sample.time >= profile.assessed_from && sample.time < profile.assessed_until + 0.3) {
      fastest = std::max(fastest, sample.velocity);
    }
  }
  return fastest / square.maximum;
}

TEST(ThesisTrends, SquareWavesStandardFailsImprovedReachesTheSetPoint) {
  ASSERT_FALSE(thesis().squares("5-10").empty());
  for (const ThesisSquare& square : thesis().squares("5-10")) {
    EXPECT_LT(shareReached("standard", square), 0.97) << square.row;
    EXPECT_GT(shareReached("improved", square), 0.99) << square.row;
  }
}

TEST(ThesisTrends, EulersUnstableCasesDivergeAndExactRunsThem) {
  for (const char* name : {"5-4", "5-5"}) {
    int unstable = 0;
    for (const ThesisStep& step : thesis().steps(name)) {
      if (!step.unstable) continue;
      ++unstable;
      const ResultRow euler = runThesisStep(files(), step, Integrator::euler).row;
      EXPECT_FALSE(euler.bounded) << name << " " << step.row;
      EXPECT_FALSE(euler.settling_s || euler.rise_s || euler.overshoot_pct) << name << " " << step.row;
      EXPECT_TRUE(runThesisStep(files(), step, Integrator::exact).row.settling_s.has_value())
          << name << " " << step.row;
    }
    EXPECT_EQ(unstable, 1) << name;
  }
}

TEST(ThesisTrends, EulerIsComparedOnlyWhereItConverges) {
  int exact = 0;
  for (const char* name : {"5-1", "5-2", "5-4", "5-5", "5-6", "5-9"}) {
    for (const Residual& residual : table(name)) {
      if (residual.integrator == Integrator::exact) ++exact;
      EXPECT_TRUE(residual.settling.has_value()) << name << " " << residual.thesis.row << " " << residual.thesis.column;
    }
  }
  // tau = 0.001 at both rates, kappa_mu = 0.5 and 1 at 50 Hz, and the improved controller.
  EXPECT_EQ(exact, 5);
}

}  // namespace
}  // namespace jackal_aic::sim
