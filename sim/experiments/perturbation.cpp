#include "perturbation.hpp"

#include <fmt/format.h>

#include <cmath>
#include <random>

namespace jackal_aic::sim {

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

void perturb(LoopSetup& setup, const DrawnPerturbation& perturbation) {
  perturbation.kind->apply(setup.plant, perturbation.value);
  if (auto* drive = std::get_if<DifferentialDriveParameters>(&setup.drive.controller))
    drive->wheel_gain = setup.plant.wheel_gain;
}

}  // namespace jackal_aic::sim
