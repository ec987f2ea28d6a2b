#include "stop_table.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "campaign.hpp"
#include "parallel.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kDrive = 5.0;        // s; half the model's limit on the ground reaches 2 m/s in 2.5 s
constexpr double kStand = 4.0;        // s
constexpr double kUnlimited = 20.0;   // limit factor
constexpr double kTrackMargin = 3.0;  // percent

const SetPoint kSetPoints[] = {{0.1, 0.0, 0.0}, {0.3, 0.0, 0.0}, {0.5, 0.0, 0.0}, {1.0, 0.0, 0.0}, {1.5, 0.0, 0.0},
                               {2.0, 0.0, 0.0}, {0.0, 0.0, 0.5}, {0.0, 0.0, 1.0}, {0.0, 0.0, 2.0}, {0.5, 0.0, 0.5},
                               {1.0, 0.0, 0.5}, {1.0, 0.0, 2.0}, {0.3, 0.0, 1.5}, {-1.0, 0.0, 1.0}};

std::string lineOf(const StopCase& c, const StopOutcome& outcome) {
  const StopFigures& figures = outcome.figures;
  const std::string settling = figures.settling ? fmt::format("{:.4g}", *figures.settling) : "";
  return fmt::format("{},{},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{},{:.4g},{:.4g},{:d}\n", c.controller, c.plant,
                     c.limit_factor, c.set_point.forward, c.set_point.yaw_rate, figures.excess_pct,
                     outcome.without_limit_pct, settling, figures.beyond_mps, figures.beyond_radps,
                     keeps(outcome, barsOf(c)));
}

StopFigures drive(const PackageFiles& files, const StopCase& c, const Overrides& overrides) {
  Overrides all{{"limits.linear_acceleration", "20"}, {"limits.angular_acceleration", "25"}};
  all.insert(all.end(), overrides.begin(), overrides.end());
  LoopSetup setup = loadSetup(files, c.controller, c.plant, all);
  setup.plant.acceleration_limit *= c.limit_factor;
  return assessStop(runSetup(setup, stopProfile(c.set_point, kDrive, kStand)).samples, c.set_point, kDrive);
}

}  // namespace

StopBars barsOf(const StopCase& c) {
  if (c.limit_factor < 1.0) return StopBars::offModel(15.0);
  StopBars bars;
  if (c.controller == "predictive") bars.overshoot_pct = 5.0;
  if (c.controller == "standard") bars.overshoot_pct = 12.0;
  return bars;
}

bool keeps(const StopOutcome& outcome, const StopBars& bars) {
  const double turning = outcome.without_limit_pct > 0.0 ? outcome.without_limit_pct + kTrackMargin : 0.0;
  return outcome.figures.excess_pct <= std::max(bars.overshoot_pct, turning) && bars.keepStop(outcome.figures);
}

std::vector<StopCase> stopCases() {
  std::vector<StopCase> cases;
  for (const char* controller : {"standard", "improved", "tuned", "predictive"}) {
    for (const char* plant : {"ground", "box"}) {
      for (const double factor : {1.0, 0.9, 0.8, 0.7, 0.5, 2.0}) {
        for (const SetPoint& set_point : kSetPoints) cases.push_back({controller, plant, factor, set_point});
      }
    }
  }
  return cases;
}

StopOutcome runCase(const PackageFiles& files, const StopCase& c, const Overrides& overrides) {
  StopOutcome outcome{drive(files, c, overrides)};
  if (c.plant == "ground" && c.set_point.yaw_rate != 0.0) {
    StopCase unlimited = c;
    unlimited.limit_factor = kUnlimited;
    outcome.without_limit_pct = drive(files, unlimited, overrides).excess_pct;
  }
  return outcome;
}

std::string nameOf(const StopCase& c) {
  return fmt::format("{} on the {}, limit x {:g}, {:g} m/s, {:g} rad/s", c.controller, c.plant, c.limit_factor,
                     c.set_point.forward, c.set_point.yaw_rate);
}

std::size_t writeStopTable(const PackageFiles& files, const std::string& directory, const Overrides& overrides,
                           unsigned jobs) {
  const auto cases = stopCases();
  const auto outcomes =
      parallelResults("stops", cases.size(), jobs, [&](std::size_t i) { return runCase(files, cases[i], overrides); });
  std::string text =
      "controller,plant,limit_factor,forward_mps,yaw_radps,excess_pct,without_limit_pct,settling_s,beyond_mps,"
      "beyond_radps,kept\n";
  std::size_t missed = 0;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    text += lineOf(cases[i], outcomes[i]);
    if (!keeps(outcomes[i], barsOf(cases[i]))) ++missed;
  }
  writeTable(directory, "stops.csv", text);
  return missed;
}

}  // namespace jackal_aic::sim
