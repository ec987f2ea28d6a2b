#include "gain_trial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "jackal_aic/safety/drive_loop.hpp"

namespace jackal_aic {
namespace {

constexpr double kDrive = 4.0;     // s; half the limit of the ground's motors reaches 2 m/s in 2.5 s
constexpr double kStand = 3.0;     // s
constexpr double kLatest = 0.010;  // s by which a sample may come late
constexpr double kSpreadOvershoot = 1.5;

const SetPoint kSetPoints[] = {{0.1, 0.0, 0.0}, {0.3, 0.0, 0.0}, {0.5, 0.0, 0.0}, {1.0, 0.0, 0.0}, {1.5, 0.0, 0.0},
                               {2.0, 0.0, 0.0}, {0.0, 0.0, 0.5}, {0.0, 0.0, 2.0}, {0.5, 0.0, 0.5}, {1.0, 0.0, 2.0}};

std::string nameOf(const SetPoint& set_point) {
  std::string name;
  if (set_point.forward != 0.0) name += fmt::format(", {:.4g} m/s", set_point.forward);
  if (set_point.yaw_rate != 0.0) name += fmt::format(", {:.4g} rad/s", set_point.yaw_rate);
  return name;
}

/// Latest phase that a simulated robot can have.
double latestPhase(const sim::PlantParameters& plant) { return 1.0 / plant.sensor_rate - sim::JackalPlant::kStep; }

/// A robot that is not quite its model, and in which way.
struct Variant {
  std::string name;
  double extra_dead_time;  // s
  double lag, gain, limit;
  double extra_offset = 0.0;  // of the motor's command [rad/s]
};

const std::array<Variant, 8> kSpread{{{"dead time + 10 ms", 0.01, 1.0, 1.0, 1.0},
                                      {"dead time - 10 ms", -0.01, 1.0, 1.0, 1.0},
                                      {"lag x 1.4", 0.0, 1.4, 1.0, 1.0},
                                      {"lag x 0.7", 0.0, 0.7, 1.0, 1.0},
                                      {"gain x 1.05", 0.0, 1.0, 1.05, 1.0},
                                      {"gain x 0.95", 0.0, 1.0, 0.95, 1.0},
                                      {"limit x 0.5", 0.0, 1.0, 1.0, 0.5},
                                      {"limit x 2", 0.0, 1.0, 1.0, 2.0}}};

sim::PlantParameters varied(sim::PlantParameters plant, const Variant& variant) {
  plant.dead_time = std::max(0.0, plant.dead_time + variant.extra_dead_time);
  plant.motor_lag *= variant.lag;
  plant.wheel_gain *= variant.gain;
  plant.wheel_offset = std::max(0.0, plant.wheel_offset + variant.extra_offset);
  plant.acceleration_limit *= variant.limit;
  return plant;
}

sim::StopBars spreadBars(double overshoot_pct) { return sim::StopBars::offModel(kSpreadOvershoot * overshoot_pct); }

void addNominal(const sim::PlantParameters& plant, const std::string& robot, double overshoot_pct,
                std::vector<Trial>& trials) {
  sim::StopBars bars;
  bars.overshoot_pct = overshoot_pct;
  for (const double phase : {latestPhase(plant), 0.0, 0.5 * latestPhase(plant)}) {
    for (const SetPoint& set_point : kSetPoints) {
      trials.push_back(
          {set_point, plant, phase, bars, fmt::format("{}{}, phase {:.4g} s", robot, nameOf(set_point), phase), true});
    }
  }
}

void addVariant(const sim::PlantParameters& plant, const std::string& robot, double overshoot_pct,
                const Variant& variant, std::vector<Trial>& trials) {
  for (const SetPoint& set_point : {SetPoint{0.3, 0.0, 0.0}, SetPoint{1.0, 0.0, 0.0}, SetPoint{0.5, 0.0, 1.0}}) {
    trials.push_back({set_point, varied(plant, variant), latestPhase(plant), spreadBars(overshoot_pct),
                      robot + nameOf(set_point) + ", " + variant.name});
  }
}

void addCoarse(sim::PlantParameters plant, const std::string& robot, double overshoot_pct, std::vector<Trial>& trials) {
  for (const double step : {0.0065, 0.06, 0.1}) {
    plant.encoder_step = step;
    plant.encoder_noise = 0.003;
    plant.stamp_jitter = kLatest;
    for (const SetPoint& set_point : {SetPoint{0.1, 0.0, 0.0}, SetPoint{0.7, 0.0, 0.0}, SetPoint{0.3, 0.0, 0.7}}) {
      sim::StopBars bars = spreadBars(overshoot_pct);
      bars.overshoot_pct += 100.0 * 0.1 * step / std::max(set_point.forward, 0.1);  // what an encoder cannot see
      trials.push_back(
          {set_point, plant, 0.5 * latestPhase(plant), bars,
           fmt::format("{}{}, encoder steps of {:.4g} rad/s, late samples", robot, nameOf(set_point), step)});
    }
  }
}

/// What is driven until `begin` [s], and once more from then on; the profile itself if that is 0.
sim::SetPointProfile repeated(sim::SetPointProfile profile, double begin) {
  if (begin == 0.0) return profile;
  const auto first = profile.changes;
  for (auto change : first) {
    change.time += begin;
    profile.changes.push_back(change);
  }
  profile.duration += begin;
  return profile;
}

}  // namespace

std::vector<Trial> allTrials(const sim::PlantParameters& plant, const std::string& robot, double overshoot_pct) {
  std::vector<Trial> trials;
  addNominal(plant, robot, overshoot_pct, trials);
  addCoarse(plant, robot, overshoot_pct, trials);
  for (const Variant& variant : kSpread) addVariant(plant, robot, overshoot_pct, variant, trials);
  return trials;
}

std::vector<Trial> searchedTrials(const sim::PlantParameters& plant, const std::string& robot, double overshoot_pct,
                                  double speed) {
  sim::StopBars bars;
  bars.overshoot_pct = overshoot_pct;
  std::vector<Trial> trials;
  for (const double phase : {latestPhase(plant), 0.0}) {
    trials.push_back({{speed, 0.0, 0.0}, plant, phase, bars, robot, true});
  }
  trials.push_back({{0.0, 0.0, 2.0}, plant, latestPhase(plant), bars, robot, true});
  trials.push_back({{1.0, 0.0, 0.0}, varied(plant, kSpread[2]), latestPhase(plant), spreadBars(overshoot_pct), robot});
  std::vector<Trial> coarse;
  addCoarse(plant, robot, overshoot_pct, coarse);
  trials.push_back(coarse[5]);  // steps of 0.06 rad/s on an arc
  return trials;
}

std::vector<Trial> drawnTrials(const sim::PlantParameters& plant, const std::string& robot, double overshoot_pct,
                               int count, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator);
  };
  const auto one_of = [&](const auto& list) {
    return *(std::begin(list) + static_cast<long>(uniform(0.0, static_cast<double>(std::size(list)))));
  };
  constexpr double kSteps[] = {0.0, 0.0065, 0.0131, 0.06, 0.1}, kNoise[] = {0.0, 0.003, 0.03};
  std::vector<Trial> trials;
  for (int i = 0; i < count; ++i) {
    Trial trial{one_of(kSetPoints),
                varied(plant, {"", uniform(-0.01, 0.01), uniform(0.7, 1.4), uniform(0.95, 1.05),
                               std::exp2(uniform(-1.0, 1.0))}),
                uniform(0.0, latestPhase(plant)), spreadBars(overshoot_pct), ""};
    trial.plant.encoder_step = one_of(kSteps);
    trial.plant.encoder_noise = one_of(kNoise);
    trial.plant.stamp_jitter = uniform(0.0, kLatest);
    trial.plant.seed = seed + static_cast<std::uint64_t>(i);
    trial.name = fmt::format("{}{}, draw {}, encoder steps of {:.4g} rad/s", robot, nameOf(trial.set_point), i,
                             trial.plant.encoder_step);
    trials.push_back(trial);
  }
  return trials;
}

std::vector<Trial> boxTrials(const PlantFile& plant, const std::string& robot, double overshoot_pct) {
  const PlantModel& model = plant.model;
  const auto times = [](double corner, double value) { return value > 0.0 ? corner / value : 1.0; };
  std::vector<Trial> trials;
  for (const PlantModel& corner : confidenceBox(model)) {
    const Variant variant{
        fmt::format("dead time {:.3g} s, lag {:.3g} s, gain {:.3g}", corner.dead_time, corner.lag, corner.gain) +
            (corner.offset > 0.0 ? fmt::format(", offset {:.3g} rad/s", corner.offset) : ""),
        corner.dead_time - model.dead_time,
        times(corner.lag, model.lag),
        times(corner.gain, model.gain),
        1.0,
        corner.offset / corner.gain - model.offset / model.gain};
    const bool is_model =
        variant.extra_dead_time == 0.0 && variant.lag == 1.0 && variant.gain == 1.0 && variant.extra_offset == 0.0;
    if (!is_model) addVariant(plant.simulation, robot, overshoot_pct, variant, trials);
  }
  return trials;
}

std::optional<double> rollingTrack(const sim::PlantParameters& parameters, const std::string& urdf) {
  constexpr double kLeft = 3.0, kRight = 7.0, kSettled = 2.0, kMeasured = 3.0;  // rad/s, s
  if (parameters.velocity_loop_stiffness > 0.0) return std::nullopt;
  sim::JackalPlant plant(urdf, parameters);
  plant.command({kLeft, kRight});
  double rolled = 0.0, turned = 0.0;
  while (plant.time() < kMeasured) {
    plant.step();
    if (plant.time() < kSettled) continue;
    rolled += plant.truth().linear_velocity.x();
    turned += plant.truth().angular_velocity.z();
  }
  // T = r (w_R - w_L)/theta', r = 2 v/(w_R + w_L); on a box nothing turns by any
  return turned > 0.0 ? 2.0 * rolled / (kLeft + kRight) * (kRight - kLeft) / turned : 1.0;
}

sim::StopFigures drive(const Trial& trial, const TrialController& controller, const std::string& urdf) {
  sim::JackalPlant plant = trial.rolling_track ? sim::JackalPlant::rolling(urdf, trial.plant, *trial.rolling_track)
                                               : sim::JackalPlant(urdf, trial.plant);
  DriveParameters parameters = sim::uninterrupted();
  std::visit([&](const auto& gains) { parameters.controller = gains; }, controller.controller);
  parameters.geometry = controller.geometry;
  parameters.gate.limits = controller.limits;
  parameters.plant_model = controller.model;
  DriveLoop loop(parameters, makeController(parameters));
  const sim::SetPointProfile once = sim::stopProfile(trial.set_point, kDrive, kStand);
  // How much an arc slips is learned in the first one, whatever the gains, and remembered.
  const bool is_arc = trial.set_point.forward != 0.0 && trial.set_point.yaw_rate != 0.0;
  const bool learns = std::holds_alternative<PredictiveParameters>(controller.controller);
  const double begin = is_arc && learns ? once.duration : 0.0;
  auto samples =
      sim::runClosedLoop(plant, loop, repeated(once, begin), trial.plant.support, controller.geometry, {trial.phase});
  const auto before = [begin](const sim::Sample& s) { return s.time < begin; };
  samples.erase(samples.begin(), std::find_if_not(samples.begin(), samples.end(), before));
  for (sim::Sample& sample : samples) sample.time -= begin;
  return sim::assessStop(samples, trial.set_point, kDrive);
}

}  // namespace jackal_aic
