#include "bounds.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "campaign.hpp"
#include "parallel.hpp"
#include "result_table.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kBand = 0.95;                             // of a step, within 5 % of its end
constexpr double kSettled = 4.0;                           // s of driving before a disturbance
constexpr double kDisturbed = 2.0;                         // s after it
constexpr double kMoments[] = {0.0, 0.005, 0.010, 0.015};  // s, of a disturbance after a sample

LoopSetup quietSetup(const PackageFiles& files, const std::string& controller, const std::string& plant) {
  return loadSetup(files, controller, plant, {{"plant.noise_scale", "0"}});
}

/// The time at which the body turns with 95 % of a yaw rate at full throttle [s].
double leastTurn(const LoopSetup& setup, double yaw_rate) {
  JackalPlant plant(setup.urdf, setup.plant);
  const double fastest = std::copysign(setup.plant.speed_limit / setup.drive.geometry.wheel_radius, yaw_rate);
  plant.command({-fastest, fastest});
  while (plant.time() < kStepDuration && plant.truth().angular_velocity.z() / yaw_rate < kBand) plant.step();
  return plant.time();
}

/// Forward error from the disturbance on [m/s]. @param start of the disturbance [s].
std::vector<double> errorsAfter(const LoopSetup& setup, const BoundedCase& bounded, double start) {
  SetPointProfile profile = stepProfile(bounded.set_point.forward, 0.0, start + kDisturbed - kRestTime);
  profile.motor_changes = {{start, bounded.gain, bounded.offset}};
  std::vector<double> errors;
  for (const Sample& sample : runSetup(setup, profile).samples) {
    if (sample.time > start - kTimeTolerance) errors.push_back(sample.velocity - sample.set_point.forward);
  }
  return errors;
}

double iae(const std::vector<double>& errors) {
  double sum = 0.0;
  for (const double error : errors) sum += JackalPlant::kStep * std::abs(error);
  return sum;
}

/// Mean over the moments of a disturbance. @param figure of the time at which it begins [s] and of the moment [s].
template <class Figure>
double meanOverMoments(const Figure& figure) {
  double sum = 0.0;
  for (const double moment : kMoments) sum += figure(kRestTime + kSettled + moment, moment);
  return sum / static_cast<double>(std::size(kMoments));
}

std::string lineOf(const PackageFiles& files, const std::string& controller, const std::string& plant,
                   const BoundedCase& bounded, const BoundedFigure& figure) {
  const std::string value = figure.value ? fmt::format("{:.4g}", *figure.value) : "";
  return fmt::format("{},{},{},{},{},{:.4g},{:.3g},{:.4g}\n", controller, plant, bounded.name,
                     bounded.disturbed() ? "iae_m" : "settling_s", value, figure.bound, figure.ofBound(),
                     barOf(files, bounded, figure.bound));
}

}  // namespace

const std::vector<BoundedCase>& boundedCases() {
  static const std::vector<BoundedCase> cases{
      {"0.1 m/s", {0.1, 0.0, 0.0}},       {"0.5 m/s", {0.5, 0.0, 0.0}},
      {"1 m/s", {1.0, 0.0, 0.0}},         {"2 m/s", {2.0, 0.0, 0.0}},
      {"0.5 rad/s", {0.0, 0.0, 0.5}},     {"1 rad/s", {0.0, 0.0, 1.0}},
      {"2 rad/s", {0.0, 0.0, 2.0}},       {"gain 0.8", {0.5, 0.0, 0.0}, 0.8},
      {"gain 1.2", {0.5, 0.0, 0.0}, 1.2}, {"load of 0.5 rad/s", {0.5, 0.0, 0.0}, 1.0, 0.5}};
  return cases;
}

double BoundedFigure::ofBound() const { return value ? *value / bound : std::numeric_limits<double>::infinity(); }

double leastSettling(const PlantParameters& plant, double change) {
  // t = dead_time + 0.95 Δv/a
  return plant.dead_time + kBand * std::abs(change) / plant.acceleration_limit;
}

double leastSettling(const LoopSetup& setup, const SetPoint& set_point) {
  if (set_point.yaw_rate == 0.0) return leastSettling(setup.plant, set_point.forward);
  if (setup.plant.support == Support::ground) return leastTurn(setup, set_point.yaw_rate);
  return leastSettling(setup.plant, 0.5 * setup.drive.geometry.effective_track * set_point.yaw_rate);
}

double leastIae(const std::vector<double>& uncorrected, double t_1, double limit) {
  const auto end = uncorrected.begin() + std::lround(t_1 / JackalPlant::kStep);
  // IAE = ∫₀^t₁ |e₀| dt + e₀(t₁)²/(2a)
  return iae({uncorrected.begin(), end}) + *end * *end / (2.0 * limit);
}

BoundedFigure runBounded(const PackageFiles& files, const std::string& controller, const std::string& plant,
                         const BoundedCase& bounded) {
  return {figureOf(quietSetup(files, controller, plant), bounded),
          boundOf(quietSetup(files, kDifferentialDrive, plant), bounded)};
}

double boundOf(const LoopSetup& open_loop, const BoundedCase& bounded) {
  if (!bounded.disturbed()) return leastSettling(open_loop, bounded.set_point);
  return meanOverMoments([&](double start, double moment) {
    const double t_1 = kActionPeriod - moment + open_loop.plant.dead_time;
    return leastIae(errorsAfter(open_loop, bounded, start), t_1, open_loop.plant.acceleration_limit);
  });
}

std::optional<double> figureOf(const LoopSetup& setup, const BoundedCase& bounded) {
  const SetPoint& target = bounded.set_point;
  if (!bounded.disturbed()) {
    return runSetup(setup, stepProfile(target.forward, target.yaw_rate, kStepDuration)).row.settling_s;
  }
  return meanOverMoments([&](double start, double) { return iae(errorsAfter(setup, bounded, start)); });
}

double barOf(const PackageFiles& files, const BoundedCase& bounded, double bound) {
  if (bounded.disturbed()) return files.bar("bounds.error_after_disturbance") * bound;
  return files.bar("bounds.settling") * bound + kActionPeriod;
}

std::size_t writeBoundsTable(const PackageFiles& files, const std::string& directory, unsigned jobs) {
  const auto& controllers = controllerNames();
  const auto& cases = boundedCases();
  const std::size_t plants = std::size(kCalibratedPlants), rows = controllers.size() * plants * cases.size();
  const auto controllerOf = [&](std::size_t i) { return controllers[i / (plants * cases.size())]; };
  const auto plantOf = [&](std::size_t i) { return kCalibratedPlants[i / cases.size() % plants]; };
  const auto figures = parallelResults("bounds", rows, jobs, [&](std::size_t i) {
    return runBounded(files, controllerOf(i), plantOf(i), cases[i % cases.size()]);
  });
  std::string table = "controller,plant,case,figure,value,bound,of_bound,bar\n";
  std::size_t missed = 0;
  for (std::size_t i = 0; i < rows; ++i) {
    const BoundedCase& bounded = cases[i % cases.size()];
    table += lineOf(files, controllerOf(i), plantOf(i), bounded, figures[i]);
    const bool kept = figures[i].value && *figures[i].value <= barOf(files, bounded, figures[i].bound);
    if (controllerOf(i) == "predictive" && !kept) ++missed;
  }
  writeTable(directory, "bounds.csv", table);
  return missed;
}

}  // namespace jackal_aic::sim
