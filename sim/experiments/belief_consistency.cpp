#include "belief_consistency.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <vector>

#include "campaign.hpp"
#include "parallel.hpp"
#include "perturbation.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kInside = 5.991;  // 95 % of a chi-squared with 2 degrees of freedom
constexpr double kStandTime = 3.0;
constexpr const char* kDrawn = "drawn";

/// A driving cycle that stops after every segment.
SetPointProfile drivesAndStops(std::uint64_t seed) {
  DrivingCycle cycle;
  cycle.seed = seed;
  cycle.segments = 6;
  cycle.shortest = 3.0;
  cycle.longest = 5.0;
  const SetPointProfile drives = cycleProfile(cycle);
  SetPointProfile profile;
  profile.assessed.reset();
  double stops = 0.0;
  for (std::size_t i = 0; i < drives.changes.size(); ++i) {
    const bool last = i + 1 == drives.changes.size();
    profile.changes.push_back({drives.changes[i].time + stops, drives.changes[i].set_point});
    profile.changes.push_back({(last ? drives.duration : drives.changes[i + 1].time) + stops, {}});
    stops += kStandTime;
  }
  profile.duration = drives.duration + stops;
  return profile;
}

DrivePhase phaseAt(const SetPointProfile& profile, double time) {
  const std::size_t changes = profile.changesUntil(time);
  if (changes > 0 && time - profile.changes[changes - 1].time < kUnsteadyTime) return DrivePhase::transient;
  return profile.at(time).vector().isZero(0.0) ? DrivePhase::standing : DrivePhase::steady;
}

PlanarMotion published(const PredictiveController& controller) {
  const BodyVector velocity = controller.believedVelocity();
  return {velocity(kForward), velocity(kYaw), controller.motionCovariance()};
}

LoopSetup consistencySetup(const PackageFiles& files, const std::string& plant, std::uint64_t seed) {
  if (plant == kDrawn) return loadSetup(files, "predictive", "real", drawReality(seed));
  return loadSetup(files, "predictive", plant, {{"plant.seed", std::to_string(seed)}});
}

}  // namespace

Eigen::Vector2d trueMotion(const LoopSetup& setup, const PlantTruth& truth) {
  if (setup.plant.support == Support::ground) return {truth.linear_velocity.x(), truth.angular_velocity.z()};
  GeometryParameters geometry = setup.drive.geometry;
  const double track = setup.drive.plant_model ? setup.drive.plant_model->effective_track : 0.0;
  if (track > 0.0) geometry.effective_track = track;
  const auto& wheel = truth.wheel_velocity;
  const BodyVector body = SkidSteerKinematics(geometry).bodyVelocity(
      {0.5 * (wheel[kFrontLeft] + wheel[kRearLeft]), 0.5 * (wheel[kFrontRight] + wheel[kRearRight])});
  return {body(kForward), body(kYaw)};
}

void ConsistencySums::add(const PlanarMotion& motion, const Eigen::Vector2d& truth) {
  const Eigen::Vector2d error = Eigen::Vector2d(motion.forward, motion.yaw_rate) - truth;
  const double nees = error.dot(motion.covariance.inverse() * error);
  total += nees;
  forward += error(0) * error(0) / motion.covariance(0, 0);
  yaw += error(1) * error(1) / motion.covariance(1, 1);
  within += nees < kInside ? 1.0 : 0.0;
  samples += 1.0;
}

void ConsistencySums::add(const ConsistencySums& other) {
  total += other.total;
  forward += other.forward;
  yaw += other.yaw;
  within += other.within;
  samples += other.samples;
}

PhaseConsistency driveConsistency(const PackageFiles& files, const std::string& plant_name, std::uint64_t seed) {
  const LoopSetup setup = consistencySetup(files, plant_name, seed);
  const SetPointProfile profile = drivesAndStops(seed);
  JackalPlant plant(setup.urdf, setup.plant);
  DriveLoop loop = makeLoop(setup.drive);
  const PredictiveController& controller = *loop.predictive();
  PhaseConsistency sums;
  const std::int64_t steps = profile.plantSteps();
  for (std::int64_t k = 0; k < steps; ++k, plant.step()) {
    const double now = plant.time();
    loop.setSetPoint(profile.at(now), now);
    if (plant.measurement()) loop.observe(plant.measurement()->observation(), now);
    if (const auto due = loop.advance(now)) plant.command(*due);
    if (now < kRestTime || k % 10 != 5) continue;  // between samples and at them
    const auto phase = static_cast<std::size_t>(phaseAt(profile, now));
    sums[phase].add(published(controller), trueMotion(setup, plant.truth()));
  }
  return sums;
}

void writeConsistencyTable(const PackageFiles& files, const std::string& directory, unsigned jobs) {
  const std::vector<std::string> plants{"box", "ground", "real", kDrawn};
  const auto drives = parallelResults("belief", plants.size() * kConsistencySeeds, jobs, [&](std::size_t i) {
    return driveConsistency(files, plants[i / kConsistencySeeds], i % kConsistencySeeds + 1);
  });
  std::string text = "plant,phase,nees,nees_forward,nees_yaw_rate,inside_95\n";
  for (std::size_t p = 0; p < plants.size(); ++p) {
    for (std::size_t phase = 0; phase < kPhaseNames.size(); ++phase) {
      ConsistencySums all;
      for (std::size_t s = 0; s < kConsistencySeeds; ++s) all.add(drives[p * kConsistencySeeds + s][phase]);
      text += fmt::format("{},{},{:.4g},{:.4g},{:.4g},{:.4g}\n", plants[p], kPhaseNames[phase], all.nees(),
                          all.forwardNees(), all.yawNees(), all.inside());
    }
  }
  writeTable(directory, "belief.csv", text);
}

}  // namespace jackal_aic::sim
