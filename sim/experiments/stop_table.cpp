#include "stop_table.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "campaign.hpp"
#include "parallel.hpp"
#include "progress_bar.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kDrive = 5.0;  // s; half the model's limit on the ground reaches 2 m/s in 2.5 s
constexpr double kStand = 4.0;  // s
constexpr double kStop = kRestTime + kDrive - 0.5 * JackalPlant::kStep;
constexpr double kUnlimited = 20.0;      // limit factor
constexpr double kTrackMargin = 3.0;     // percent
constexpr double kSettledWithin = 0.05;  // of the set point

const SetPoint kSetPoints[] = {{0.1, 0.0, 0.0}, {0.3, 0.0, 0.0}, {0.5, 0.0, 0.0}, {1.0, 0.0, 0.0}, {1.5, 0.0, 0.0},
                               {2.0, 0.0, 0.0}, {0.0, 0.0, 0.5}, {0.0, 0.0, 1.0}, {0.0, 0.0, 2.0}, {0.5, 0.0, 0.5},
                               {1.0, 0.0, 0.5}, {1.0, 0.0, 2.0}, {0.3, 0.0, 1.5}, {-1.0, 0.0, 1.0}};

SetPointProfile profileOf(const StopCase& c) {
  SetPointProfile profile;
  profile.changes = {{kRestTime, c.set_point}, {kRestTime + kDrive, SetPoint{}}};
  profile.duration = kRestTime + kDrive + kStand;
  profile.assessed.reset();
  return profile;
}

/// A channel of a sample, in the direction of its set point.
double along(double value, double set_point) { return std::copysign(1.0, set_point) * value; }

/// Largest excursion beyond the set point before the stop, in percent of it.
double overshoot(const std::vector<Sample>& samples, double set_point, double Sample::*channel) {
  double largest = 0.0;
  for (const Sample& s : samples) {
    if (s.time < kStop) largest = std::max(largest, along(s.*channel, set_point) - std::abs(set_point));
  }
  return 100.0 * largest / std::abs(set_point);
}

/// Largest value beyond zero after the stop.
double beyondZero(const std::vector<Sample>& samples, double set_point, double Sample::*channel) {
  double largest = 0.0;
  for (const Sample& s : samples) {
    if (s.time > kStop) largest = std::max(largest, -along(s.*channel, set_point));
  }
  return largest;
}

/// Time after the step from which the channel stays near its set point until the stop.
std::optional<double> settling(const std::vector<Sample>& samples, double set_point, double Sample::*channel) {
  double last = kRestTime;
  for (const Sample& s : samples) {
    if (s.time >= kStop) break;
    if (std::abs(s.*channel - set_point) > kSettledWithin * std::abs(set_point)) last = s.time;
  }
  if (last > kStop - 0.5) return std::nullopt;
  return last - kRestTime;
}

std::string lineOf(const StopCase& c, const StopFigures& figures) {
  std::ostringstream line;
  line.precision(4);
  line << c.controller << ',' << c.plant << ',' << c.limit_factor << ',' << c.set_point.forward << ','
       << c.set_point.yaw_rate << ',' << figures.overshoot_pct << ',' << figures.without_limit_pct << ',';
  if (figures.settling) line << *figures.settling;
  line << ',' << figures.beyond_mps << ',' << figures.beyond_radps << ',' << keeps(figures, barsOf(c)) << '\n';
  return line.str();
}

StopFigures drive(const PackageFiles& files, const StopCase& c, const Overrides& overrides) {
  Overrides all{{"limits.linear_acceleration", "20"}, {"limits.angular_acceleration", "25"}};
  all.insert(all.end(), overrides.begin(), overrides.end());
  LoopSetup setup = loadSetup(files, c.controller, c.plant, all);
  setup.plant.acceleration_limit *= c.limit_factor;
  const auto samples = runSetup(setup, profileOf(c)).samples;
  StopFigures figures;
  figures.settling = 0.0;
  const auto add = [&](double set_point, double Sample::*channel, double& beyond) {
    if (set_point == 0.0) return;
    figures.overshoot_pct = std::max(figures.overshoot_pct, overshoot(samples, set_point, channel));
    const std::optional<double> settled = settling(samples, set_point, channel);
    figures.settling = figures.settling && settled ? std::max(figures.settling, settled) : std::nullopt;
    beyond = beyondZero(samples, set_point, channel);
  };
  add(c.set_point.forward, &Sample::velocity, figures.beyond_mps);
  add(c.set_point.yaw_rate, &Sample::yaw_rate, figures.beyond_radps);
  return figures;
}

}  // namespace

StopBars barsOf(const StopCase& c) {
  if (c.limit_factor < 1.0) return {15.0, 0.10, 0.15};
  if (c.controller == "predictive") return {5.0, 0.03, 0.05};
  return {c.controller == "standard" ? 12.0 : 10.0, 0.03, 0.05};
}

bool keeps(const StopFigures& figures, const StopBars& bars) {
  const double turning = figures.without_limit_pct > 0.0 ? figures.without_limit_pct + kTrackMargin : 0.0;
  const double overshoot = std::max(bars.overshoot_pct, turning);
  return figures.overshoot_pct <= overshoot && figures.beyond_mps <= bars.beyond_mps &&
         figures.beyond_radps <= bars.beyond_radps;
}

std::vector<StopCase> stopCases() {
  std::vector<StopCase> cases;
  for (const char* controller : {"standard", "improved", "tuned", "predictive"}) {
    for (const char* plant : {"ground", "box"}) {
      for (const double factor : {1.0, 0.5, 2.0}) {
        for (const SetPoint& set_point : kSetPoints) cases.push_back({controller, plant, factor, set_point});
      }
    }
  }
  return cases;
}

StopFigures runCase(const PackageFiles& files, const StopCase& c, const Overrides& overrides) {
  StopFigures figures = drive(files, c, overrides);
  if (c.plant == "ground" && c.set_point.yaw_rate != 0.0) {
    StopCase unlimited = c;
    unlimited.limit_factor = kUnlimited;
    figures.without_limit_pct = drive(files, unlimited, overrides).overshoot_pct;
  }
  return figures;
}

std::string nameOf(const StopCase& c) {
  std::ostringstream name;
  name << c.controller << " on the " << c.plant << ", limit x " << c.limit_factor << ", " << c.set_point.forward
       << " m/s, " << c.set_point.yaw_rate << " rad/s";
  return name.str();
}

std::size_t writeStopTable(const PackageFiles& files, const std::string& directory, const Overrides& overrides,
                           unsigned jobs) {
  const auto cases = stopCases();
  std::vector<StopFigures> figures(cases.size());
  ProgressBar bar("stops", cases.size(), true);
  parallelFor(
      cases.size(), jobs, [&](std::size_t i) { figures[i] = runCase(files, cases[i], overrides); },
      [&](std::size_t done) { bar.show(done, ""); });
  std::string text =
      "controller,plant,limit_factor,forward_mps,yaw_radps,overshoot_pct,without_limit_pct,settling_s,beyond_mps,"
      "beyond_radps,kept\n";
  std::size_t missed = 0;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    text += lineOf(cases[i], figures[i]);
    if (!keeps(figures[i], barsOf(cases[i]))) ++missed;
  }
  writeText((std::filesystem::path(directory) / "stops.csv").string(), text);
  return missed;
}

}  // namespace jackal_aic::sim
