#include "terrain.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace jackal_aic::sim {
namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr int kWaves = 16;               // enough for heights that are Gaussian, few enough for 1 kHz
constexpr double kWavelengths = 2.0;     // longest and shortest wave as multiples of the middle one
constexpr double kLevelRadius = 1.0;     // m around the start over which the heights fade in
constexpr double kRampTransition = 0.5;  // m over which a ramp reaches its inclination, without an edge

/// Integral of a slope that grows from 0 to 1 over kRampTransition, and that slope.
double ramped(double x, double& slope) {
  slope = std::clamp(x / kRampTransition, 0.0, 1.0);
  return x < kRampTransition ? 0.5 * slope * std::max(x, 0.0) : x - 0.5 * kRampTransition;
}

/// A number in [0, 1) of a cell, by the finaliser of SplitMix64.
double hashed(std::uint64_t seed, std::int64_t column, std::int64_t row) {
  std::uint64_t z = seed + 0x9e3779b97f4a7c15 * static_cast<std::uint64_t>(column) +
                    0xc2b2ae3d27d4eb4f * static_cast<std::uint64_t>(row);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  z ^= z >> 31;
  return static_cast<double>(z >> 11) * 0x1p-53;
}

}  // namespace

Terrain::Terrain(const PlantParameters& parameters)
    : parameters_(parameters), ramp_(std::tan(parameters.ramp * kRadiansPerDegree)) {
  if (parameters.roughness <= 0.0) return;
  std::mt19937_64 generator(parameters.seed);
  const auto draw = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator);
  };
  for (int i = 0; i < kWaves; ++i) {
    const double octave = draw(-1.0, 1.0), direction = draw(0.0, kTwoPi), phase = draw(0.0, kTwoPi);
    const double number = kTwoPi / (parameters.roughness_length * std::pow(kWavelengths, octave));
    waves_.push_back({number * std::cos(direction), number * std::sin(direction), phase,
                      parameters.roughness * std::sqrt(2.0 / kWaves)});
  }
}

Surface Terrain::surface(double x, double y) const {
  const PlantParameters& p = parameters_;
  double height = 0.0, slope_x = 0.0, slope_y = 0.0;
  for (const Wave& wave : waves_) {
    const double angle = wave.x * x + wave.y * y + wave.phase;
    const double cosine = wave.amplitude * std::cos(angle);
    height += wave.amplitude * std::sin(angle);
    slope_x += wave.x * cosine;
    slope_y += wave.y * cosine;
  }
  if (!waves_.empty()) {
    const double left = std::exp(-(x * x + y * y) / (kLevelRadius * kLevelRadius));
    const double steepness = 2.0 * left / (kLevelRadius * kLevelRadius);
    slope_x = (1.0 - left) * slope_x + steepness * x * height;
    slope_y = (1.0 - left) * slope_y + steepness * y * height;
    height *= 1.0 - left;
  }
  if (ramp_ != 0.0) {
    double begin = 0.0, end = 0.0;
    const double rise = ramped(x - p.ramp_start, begin) - ramped(x - p.ramp_start - p.ramp_length, end);
    height += ramp_ * rise;
    slope_x += ramp_ * (begin - end);
  }
  if (slope_x == 0.0 && slope_y == 0.0) return {height, Eigen::Vector3d::UnitZ()};
  return {height, Eigen::Vector3d(-slope_x, -slope_y, 1.0).normalized()};
}

double Terrain::frictionShare(double x, double y) const {
  const PlantParameters& p = parameters_;
  if (p.patch_friction == 1.0) return 1.0;
  const auto cell = [&](double v) { return static_cast<std::int64_t>(std::floor(v / p.patch_size)); };
  return p.patch_friction + (1.0 - p.patch_friction) * hashed(p.seed, cell(x), cell(y));
}

std::optional<TouchPoint> Terrain::kerb(const Eigen::Vector3d& hub, double radius) const {
  const PlantParameters& p = parameters_;
  if (p.kerb_distance <= 0.0 || p.kerb_height <= 0.0 || hub.x() + radius < p.kerb_distance) return std::nullopt;
  const Surface ground = surface(std::max(p.kerb_distance, hub.x()), hub.y());
  const double top = ground.height + p.kerb_height;
  if (hub.x() >= p.kerb_distance && hub.z() > top) {
    return TouchPoint{hub - radius * ground.normal, ground.normal, radius - (hub.z() - top) * ground.normal.z()};
  }
  // Part of the kerb nearest to the hub: its face or its edge.
  const Eigen::Vector3d nearest(std::max(p.kerb_distance, hub.x()), hub.y(), std::min(top, hub.z()));
  const Eigen::Vector3d away = hub - nearest;
  const double distance = away.norm();
  if (distance == 0.0) return std::nullopt;  // the hub is inside the kerb, which is impossible
  return TouchPoint{nearest, away / distance, radius - distance};
}

}  // namespace jackal_aic::sim
