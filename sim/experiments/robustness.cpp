#include "robustness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "campaign.hpp"
#include "parallel.hpp"
#include "result_table.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kForwardStep = 0.5;  // m/s

/// Tells a controller the mean radius of the robot's tyres.
void tellRadius(LoopSetup& setup) {
  const double radius = 0.5 * (setup.plant.wheel_radius_left + setup.plant.wheel_radius_right);
  setup.drive.geometry.wheel_radius = radius;
  if (auto* open_loop = std::get_if<DifferentialDriveParameters>(&setup.drive.controller)) {
    open_loop->wheel_radius = radius;
  }
}

ResultRow step(const PackageFiles& files, const std::string& controller, const Overrides& robot) {
  const SetPointProfile profile = stepProfile(kForwardStep, 0.0, kStepDuration);
  LoopSetup setup = loadSetup(files, controller, "real", robot);
  tellRadius(setup);
  RunResult result = runSetup(setup, profile);
  if (result.row.bounded) describeErrors(result.samples, profile, result.row);
  return result.row;
}

std::string text(const std::optional<double>& value) { return value ? fmt::format("{:.3f}", *value) : ""; }

}  // namespace

RobustnessBars robustnessBars(const PackageFiles& files) {
  return {files.bar("robustness.settling_factor"), files.bar("robustness.settling_margin"),
          files.bar("robustness.steady_error"), files.bar("robustness.belief_error")};
}

bool RobustnessRun::settles(const RobustnessBars& bars) const {
  if (!open_loop) return true;
  return settling && *settling <= bars.settling_factor * *open_loop + bars.settling_margin;
}

RobustnessRun runRobustness(const PackageFiles& files, const std::string& controller, std::uint64_t seed) {
  const Overrides robot = drawReality(seed);
  const ResultRow row = step(files, controller, robot);
  RobustnessRun run;
  run.bounded = row.bounded;
  run.settling = row.settling_s;
  run.open_loop = controller == kDifferentialDrive ? row.settling_s : step(files, kDifferentialDrive, robot).settling_s;
  run.steady_error_pct = row.steady_error_pct.value_or(HUGE_VAL);
  run.belief_pct = row.belief_bias_pct;
  return run;
}

RobustnessSummary summarise(const std::vector<RobustnessRun>& runs, const RobustnessBars& bars) {
  RobustnessSummary sum;
  sum.runs = runs.size();
  for (const RobustnessRun& run : runs) {
    if (!run.bounded) {
      ++sum.unstable;
      continue;
    }
    if (run.settles(bars)) ++sum.settled;
    if (std::abs(run.steady_error_pct) <= bars.steady_error) ++sum.exact;
    if (std::abs(run.belief_pct.value_or(0.0)) <= bars.belief_error) ++sum.believed;
  }
  return sum;
}

std::optional<double> turnOvershoot(const PackageFiles& files, const std::string& controller, std::uint64_t seed) {
  const SoftMotorTurn turn = drawSoftMotorTurn(seed);
  const LoopSetup setup = loadSetup(files, controller, "ground", turn.robot);
  const ResultRow row = runSetup(setup, stepProfile(0.0, turn.yaw_rate, kStepDuration)).row;
  return row.bounded ? std::optional(row.overshoot_pct) : std::nullopt;
}

namespace {

void writeDrawnRobots(const PackageFiles& files, std::size_t draws, std::uint64_t seed, const std::string& directory,
                      unsigned jobs) {
  const auto& controllers = controllerNames();
  const RobustnessBars bars = robustnessBars(files);
  const auto runs = parallelResults("robustness", controllers.size() * draws, jobs, [&](std::size_t i) {
    return runRobustness(files, controllers[i / draws], seed + i % draws);
  });
  std::string table = "controller,seed,bounded,settling_s,open_loop_settling_s,steady_error_pct,belief_bias_pct\n";
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const RobustnessRun& run = runs[i];
    table += fmt::format("{},{},{},{},{},{:.3f},{}\n", controllers[i / draws], seed + i % draws, run.bounded ? 1 : 0,
                         text(run.settling), text(run.open_loop), run.steady_error_pct, text(run.belief_pct));
  }
  writeTable(directory, "robustness.csv", table);
  for (std::size_t c = 0; c < controllers.size(); ++c) {
    const auto first = runs.begin() + static_cast<std::ptrdiff_t>(c * draws);
    const RobustnessSummary sum = summarise({first, first + static_cast<std::ptrdiff_t>(draws)}, bars);
    fmt::print(
        "{}: {} of {} unstable; settled in {:g} x open loop + {:g} s: {}; steady-state error within {:g} %: {}; "
        "belief within {:g} %: {}\n",
        controllers[c], sum.unstable, sum.runs, bars.settling_factor, bars.settling_margin, sum.settled,
        bars.steady_error, sum.exact, bars.belief_error, sum.believed);
  }
}

void writeSoftMotors(const PackageFiles& files, std::size_t draws, std::uint64_t seed, const std::string& directory,
                     unsigned jobs) {
  const auto& controllers = controllerNames();
  const double bar = files.bar("robustness.soft_motor_overshoot");
  const auto runs = parallelResults("soft motors", controllers.size() * draws, jobs, [&](std::size_t i) {
    return turnOvershoot(files, controllers[i / draws], seed + i % draws);
  });
  std::string table = "controller,seed,yaw_rate_radps,overshoot_pct\n";
  for (std::size_t c = 0; c < controllers.size(); ++c) {
    std::vector<double> sorted;
    for (std::size_t i = 0; i < draws; ++i) {
      const std::optional<double>& overshoot = runs[c * draws + i];
      table += fmt::format("{},{},{:.3f},{}\n", controllers[c], seed + i, drawSoftMotorTurn(seed + i).yaw_rate,
                           text(overshoot));
      sorted.push_back(overshoot.value_or(HUGE_VAL));
    }
    std::sort(sorted.begin(), sorted.end());
    const auto kept = std::upper_bound(sorted.begin(), sorted.end(), bar) - sorted.begin();
    fmt::print("{} with soft motors: overshoot in turns within {:g} %: {} of {}; median {:.1f} %, largest {:.1f} %\n",
               controllers[c], bar, kept, draws, sorted[draws / 2], sorted.back());
  }
  writeTable(directory, "soft_motors.csv", table);
}

}  // namespace

void writeRobustnessTable(const PackageFiles& files, std::size_t draws, std::uint64_t seed,
                          const std::string& directory, unsigned jobs) {
  if (draws == 0) throw ParameterError("draws = 0: must be 1 or more");
  writeDrawnRobots(files, draws, seed, directory, jobs);
  writeSoftMotors(files, draws, seed, directory, jobs);
}

}  // namespace jackal_aic::sim
