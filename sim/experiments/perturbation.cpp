#include "perturbation.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <random>

namespace jackal_aic::sim {

namespace {

/// A key of the plant and between which values it is drawn.
struct DrawnKey {
  const char* key;
  double low, high;
};

constexpr DrawnKey kReality[] = {{"wheel_offset", 0.0, 0.5},
                                 {"wheel_breakaway", 0.0, 0.8},
                                 {"wheel_radius_left", 0.095, 0.098},
                                 {"wheel_radius_right", 0.095, 0.098},
                                 {"battery_sag", 0.0, 0.2},
                                 {"battery_discharge", 0.0, 0.1},
                                 {"payload", 0.0, 8.0},
                                 {"payload_x", -0.08, 0.08},
                                 {"payload_y", -0.08, 0.08},
                                 {"payload_z", 0.0, 0.2},
                                 {"friction", 0.35, 0.9},
                                 {"slope", -5.0, 5.0},
                                 {"roughness", 0.0, 0.005},
                                 {"roughness_length", 0.5, 2.0},
                                 {"ramp", -6.0, 6.0},
                                 {"ramp_start", 0.5, 10.0},
                                 {"ramp_length", 1.0, 5.0},
                                 {"patch_friction", 0.5, 1.0},
                                 {"patch_size", 0.3, 3.0},
                                 {"kerb_distance", 0.5, 20.0},
                                 {"kerb_height", 0.0, 0.015},
                                 {"feedback_rate", 45.0, 50.0},
                                 {"feedback_repeats", 0.0, 0.05},
                                 {"measurement_loss", 0.0, 0.02},
                                 {"encoder_noise", 0.0, 0.03},
                                 {"encoder_filter", 0.0, 0.05},
                                 {"gyro_bias", 0.0, 0.005},
                                 {"vibration_x", 0.3, 2.7},
                                 {"vibration_y", 0.3, 2.7},
                                 {"vibration_z", 0.3, 1.0},
                                 {"vibration_gyro", 0.005, 0.02},
                                 {"stamp_jitter", 0.0, 0.005},
                                 {"network_delay", 0.0, 0.02}};
constexpr const char* kEncoderSteps[] = {"0.0065", "0.06", "0.1"};  // rad/s

}  // namespace

std::string Perturbation::label(double value) const {
  return fmt::format("{} {:.3g}{}{}", name, value, *unit == '\0' ? "" : " ", unit);
}

const std::vector<Perturbation>& perturbations() {
  using P = PlantParameters;
  static const std::vector<Perturbation> list{
      {"wheel gain", "", 0.8, 1.2, false, {0.8, 1.2}, [](P& p, double v) { p.wheel_gain = v; }},
      {"dead time", "s", 0.07, 0.15, false, {0.07, 0.15}, [](P& p, double v) { p.dead_time = v; }},
      {"motor lag times", "", 0.5, 2.0, true, {0.5, 2.0}, [](P& p, double v) { p.motor_lag *= v; }},
      {"payload", "kg", 0.0, 8.0, false, {8.0}, [](P& p, double v) { p.payload = v; }},
      {"friction", "", 0.25, 1.0, false, {0.25, 1.0}, [](P& p, double v) { p.friction = v; }},
      {"slope", "deg", 0.0, 5.0, false, {5.0}, [](P& p, double v) { p.slope = v; }},
      {"noise times", "", 1.0, 5.0, false, {5.0}, [](P& p, double v) { p.noise_scale = v; }},
      {"measurements lost", "", 0.0, 0.1, false, {0.1}, [](P& p, double v) { p.measurement_loss = v; }},
  };
  return list;
}

std::string PerturbationPair::label() const {
  return first.kind->label(first.value) + " + " + second.kind->label(second.value);
}

std::vector<PerturbationPair> drawPairs(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  const auto& kinds = perturbations();
  const auto draw = [&](std::size_t kind) {
    const Perturbation& p = kinds[kind];
    const auto evenly = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(generator);
    };
    return DrawnPerturbation{
        &p, p.logarithmic ? std::exp(evenly(std::log(p.low), std::log(p.high))) : evenly(p.low, p.high)};
  };
  std::vector<PerturbationPair> pairs;
  for (std::size_t i = 0; i < count; ++i) {
    const auto first = std::uniform_int_distribution<std::size_t>(0, kinds.size() - 1)(generator);
    const auto other = std::uniform_int_distribution<std::size_t>(0, kinds.size() - 2)(generator);
    const std::size_t second = other < first ? other : other + 1;
    const DrawnPerturbation one = draw(first);
    pairs.push_back({one, draw(second), seed + i});
  }
  return pairs;
}

Overrides drawReality(std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  Overrides robot;
  for (const DrawnKey& drawn : kReality) {
    const double value = std::uniform_real_distribution<double>(drawn.low, drawn.high)(generator);
    robot.emplace_back(std::string("plant.") + drawn.key, fmt::format("{:.4g}", value));
  }
  robot.emplace_back("plant.encoder_step", kEncoderSteps[generator() % std::size(kEncoderSteps)]);
  robot.emplace_back("plant.seed", fmt::format("{}", seed));
  return robot;
}

SoftMotorTurn drawSoftMotorTurn(std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  const auto evenly = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator);
  };
  SoftMotorTurn turn;
  const auto set = [&](const char* key, double value) {
    turn.robot.emplace_back(std::string("plant.") + key, fmt::format("{:.4g}", value));
  };
  turn.yaw_rate = evenly(0.3, 1.5);
  const double proportional = evenly(3.0, 4.0);
  set("velocity_loop_stiffness", proportional);
  set("velocity_loop_integral", evenly(25.0, 30.0) / proportional);
  set("torque_limit", evenly(3.0, 20.0));
  set("friction", evenly(0.3, 0.9));
  set("dead_time", evenly(0.06, 0.1));
  set("payload", evenly(0.0, 5.0));
  set("encoder_noise", generator() % 2 == 0 ? 0.003 : 0.03);
  turn.robot.emplace_back("plant.encoder_step", kEncoderSteps[generator() % std::size(kEncoderSteps)]);
  turn.robot.emplace_back("plant.seed", fmt::format("{}", seed));
  return turn;
}

void perturb(LoopSetup& setup, const DrawnPerturbation& perturbation) {
  perturbation.kind->apply(setup.plant, perturbation.value);
  if (auto* drive = std::get_if<DifferentialDriveParameters>(&setup.drive.controller))
    drive->wheel_gain = setup.plant.wheel_gain;
}

}  // namespace jackal_aic::sim
