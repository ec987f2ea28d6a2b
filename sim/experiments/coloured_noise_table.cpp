#include "coloured_noise_table.hpp"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "belief_consistency.hpp"
#include "campaign.hpp"
#include "coloured_filter.hpp"
#include "loop_setup.hpp"
#include "parallel.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kDriveDuration = 120.0;  // s of a drive
constexpr double kLearning = 60.0;        // s, of which nothing counts
constexpr double kTrueTrack = 0.547;      // m, of the simulated robot, turning in place
constexpr double kMemory = 10.0;          // s, of all that is learned: that of the shipped precisions
constexpr double kExpectedTime = 0.01;    // s, smoothness and correlation time with which learning begins
constexpr double kSampleStep = 0.02;      // s, of the sensors

constexpr AddedNoise kAddedNoises[] = {{"white", true, 0.0, 0.06, 0.01},        {"s = 0.02 s", true, 0.02, 0.06, 0.01},
                                       {"s = 0.05 s", true, 0.05, 0.06, 0.01},  {"s = 0.1 s", true, 0.1, 0.06, 0.01},
                                       {"T = 0.02 s", false, 0.02, 0.06, 0.01}, {"T = 0.1 s", false, 0.1, 0.06, 0.01},
                                       {"white", true, 0.0, 0.2, 0.02},         {"s = 0.02 s", true, 0.02, 0.2, 0.02},
                                       {"s = 0.05 s", true, 0.05, 0.2, 0.02},   {"s = 0.1 s", true, 0.1, 0.2, 0.02},
                                       {"T = 0.02 s", false, 0.02, 0.2, 0.02},  {"T = 0.1 s", false, 0.1, 0.2, 0.02}};

constexpr const char* kPlants[] = {"box", "ground", "real"};
constexpr std::size_t kSeeds = 4;

/// Noise of deviation 1 at any time: a sum of many waves, of which the frequencies are drawn from the spectrum.
class Waves {
 public:
  Waves(const AddedNoise& colour, std::mt19937_64& generator) : white_(colour.time <= 0.0), generator_(generator()) {
    // exp(-t^2/(4 s^2)) has a Gaussian spectrum of deviation 1/(sqrt(2) s), exp(-|t|/T) that of Cauchy with width 1/T
    std::normal_distribution<double> gauss(0.0, white_ ? 1.0 : 1.0 / (std::sqrt(2.0) * colour.time));
    std::cauchy_distribution<double> cauchy(0.0, white_ ? 1.0 : 1.0 / colour.time);
    std::uniform_real_distribution<double> phase(0.0, 2.0 * std::acos(-1.0));
    for (Eigen::Index i = 0; i < kWaves; ++i) {
      frequency_(i) = colour.smooth ? gauss(generator) : cauchy(generator);
      phase_(i) = phase(generator);
    }
  }

  double at(double time) {
    if (white_) return normal_(generator_);
    return std::sqrt(2.0 / kWaves) * (frequency_ * time + phase_).cos().sum();
  }

 private:
  static constexpr Eigen::Index kWaves = 256;
  bool white_;
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  Eigen::Array<double, kWaves, 1> frequency_, phase_;
};

/// A drive: the truth, what was commanded, and what the sensors said.
struct Drive {
  struct Moment {
    Eigen::Vector2d truth;
    WheelCommand command;
    std::optional<Observation> observation;
  };
  LoopSetup setup;
  std::vector<Moment> moments;  // every millisecond
};

Drive record(const PackageFiles& files, const std::string& plant_name, std::uint64_t seed) {
  Drive drive{loadSetup(files, "predictive", plant_name, {{"plant.seed", std::to_string(seed)}}), {}};
  DrivingCycle cycle;
  cycle.seed = seed;
  cycle.segments = 60;
  cycle.shortest = 3.0;
  cycle.longest = 6.0;
  const SetPointProfile profile = cycleProfile(cycle);
  JackalPlant plant(drive.setup.urdf, drive.setup.plant);
  DriveLoop loop = makeLoop(drive.setup.drive);
  for (; plant.time() < kDriveDuration; plant.step()) {
    const double now = plant.time();
    Drive::Moment moment;
    loop.setSetPoint(profile.at(now), now);
    if (plant.measurement()) {
      moment.observation = plant.measurement()->observation();
      loop.observe(*moment.observation, now);
    }
    if (const auto due = loop.advance(now)) plant.command(*due);
    moment.command = loop.command();
    moment.truth = trueMotion(drive.setup, plant.truth());
    drive.moments.push_back(moment);
  }
  return drive;
}

/// What the sensors say with other noise on top.
std::vector<Drive::Moment> disturbed(const Drive& drive, const AddedNoise& noise, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  Waves left(noise, generator), right(noise, generator), gyro(noise, generator);
  std::vector<Drive::Moment> moments = drive.moments;
  for (Drive::Moment& moment : moments) {
    if (!moment.observation) continue;
    Observation& y = *moment.observation;
    y.wheel_left += noise.wheel * left.at(y.stamp);
    y.wheel_right += noise.wheel * right.at(y.stamp);
    y.yaw_rate += noise.gyro * gyro.at(y.stamp);
  }
  return moments;
}

/// What an estimator makes of a drive.
struct Outcome {
  Eigen::Vector2d squares = Eigen::Vector2d::Zero();  // sum of squared errors
  double count = 0.0;
  Eigen::Vector2d wheel_noise = Eigen::Vector2d::Zero(), gyro_noise = Eigen::Vector2d::Zero();  // learned, logarithms

  void add(double time, const BodyVector& believed, const Eigen::Vector2d& truth) {
    if (time < kLearning) return;
    squares += (Eigen::Vector2d(believed(kForward), believed(kYaw)) - truth).cwiseAbs2();
    count += 1.0;
  }

  void learned(const Eigen::Vector2d& wheel, const Eigen::Vector2d& gyro) {
    wheel_noise = wheel.array().max(kNothing).log();
    gyro_noise = gyro.array().max(kNothing).log();
  }

  void add(const Outcome& other) {
    squares += other.squares;
    count += other.count;
    wheel_noise += other.wheel_noise;
    gyro_noise += other.gyro_noise;
  }

  static constexpr double kNothing = 1e-9;
};

Outcome byController(const Drive& drive, const std::vector<Drive::Moment>& moments, bool learn_precision) {
  auto parameters = std::get<PredictiveParameters>(drive.setup.drive.controller);
  parameters.learn_precision = learn_precision;
  PredictiveController controller(parameters, drive.setup.drive.geometry, *drive.setup.drive.plant_model);
  Outcome outcome;
  for (std::size_t k = 0; k < moments.size(); ++k) {
    if (moments[k].observation) controller.observe(*moments[k].observation);
    controller.updateBelief();
    controller.updateAction();
    controller.overrule(moments[k].command);
    outcome.add(JackalPlant::kStep * static_cast<double>(k), controller.believedVelocity(), moments[k].truth);
  }
  const SensorVariances learned = controller.variances();
  outcome.learned({std::sqrt(learned.wheel_left), 0.0}, {std::sqrt(learned.gyro), 0.0});
  return outcome;
}

Outcome byFilter(const Drive& drive, const std::vector<Drive::Moment>& moments, const NoiseModelFactory& noise) {
  PlantModel model = *drive.setup.drive.plant_model;
  if (!model.on_box) model.effective_track = kTrueTrack;
  ColouredNoiseFilter filter(std::get<PredictiveParameters>(drive.setup.drive.controller), drive.setup.drive.geometry,
                             model, noise);
  Outcome outcome;
  WheelCommand applied;
  for (std::size_t k = 0; k < moments.size(); ++k) {
    if (k > 0) filter.predict(applied);
    if (moments[k].observation) filter.correct(*moments[k].observation);
    applied = moments[k].command;
    outcome.add(JackalPlant::kStep * static_cast<double>(k), filter.velocity(), moments[k].truth);
  }
  outcome.learned(filter.wheelNoise().learned(), filter.gyroNoise().learned());
  return outcome;
}

struct NamedEstimator {
  const char* name;
  std::function<Outcome(const Drive&, const std::vector<Drive::Moment>&, const AddedNoise&)> run;
};

/// @param make the model of a channel's noise from its white part, the variance added to it and the noise.
template <class MakeNoise>
NamedEstimator filterWith(const char* name, const MakeNoise& make) {
  return {name, [make](const Drive& drive, const std::vector<Drive::Moment>& moments, const AddedNoise& noise) {
            const auto& trust = std::get<PredictiveParameters>(drive.setup.drive.controller);
            return byFilter(drive, moments, [&](bool wheel) -> std::unique_ptr<NoiseModel> {
              const double added = wheel ? noise.wheel : noise.gyro;
              return make(wheel ? trust.wheel_variance : trust.gyro_variance, added * added, noise);
            });
          }};
}

std::unique_ptr<NoiseModel> knownNoise(double white, double added, const AddedNoise& noise) {
  if (noise.smooth) return std::make_unique<KnownNoise<SmoothNoise>>(SmoothNoise{white, added, noise.time});
  return std::make_unique<KnownNoise<ExponentialNoise>>(ExponentialNoise{white, added, noise.time});
}

/// By Estimator.
std::vector<NamedEstimator> estimators() {
  using Moments = std::vector<Drive::Moment>;
  using Made = std::unique_ptr<NoiseModel>;
  return {{"predictive as shipped",
           [](const Drive& d, const Moments& m, const auto&) { return byController(d, m, false); }},
          {"predictive with learned precision",
           [](const Drive& d, const Moments& m, const auto&) { return byController(d, m, true); }},
          filterWith("variance known and s = 0",
                     [](double white, double added, const auto&) -> Made {
                       return std::make_unique<KnownNoise<SmoothNoise>>(SmoothNoise{white, added, 0.0});
                     }),
          filterWith("noise known", knownNoise),
          filterWith("variance and s learned",
                     [](double white, double, const auto&) -> Made {
                       return std::make_unique<LearnedSmoothNoise>(SmoothNoise{white, white, kExpectedTime}, kMemory);
                     }),
          filterWith("innovations whitened", [](double white, double, const auto&) -> Made {
            return std::make_unique<WhitenedNoise>(ExponentialNoise{white, white, kExpectedTime}, kMemory, kSampleStep);
          })};
}

/// @param drives the first of some; @param count their number.
std::vector<EstimatorFigures> estimate(const Drive* drives, std::size_t count, const AddedNoise& noise) {
  const std::vector<NamedEstimator> all = estimators();
  std::vector<Outcome> sums(all.size());
  for (std::size_t i = 0; i < count; ++i) {
    const auto moments = disturbed(drives[i], noise, i + 1);
    for (std::size_t e = 0; e < all.size(); ++e) sums[e].add(all[e].run(drives[i], moments, noise));
  }
  std::vector<EstimatorFigures> figures;
  for (std::size_t e = 0; e < all.size(); ++e) {
    const Eigen::Vector2d error = (sums[e].squares / sums[e].count).cwiseSqrt();
    const auto mean = [count](const Eigen::Vector2d& logarithms) {
      return Eigen::Vector2d((logarithms / static_cast<double>(count)).array().exp());
    };
    figures.push_back({all[e].name, error(0), error(1), mean(sums[e].wheel_noise), mean(sums[e].gyro_noise)});
  }
  return figures;
}

}  // namespace

std::vector<EstimatorFigures> estimateUnderNoise(const PackageFiles& files, const std::string& plant,
                                                 const AddedNoise& noise, std::size_t seeds) {
  std::vector<Drive> drives;
  for (std::size_t seed = 1; seed <= seeds; ++seed) drives.push_back(record(files, plant, seed));
  return estimate(drives.data(), drives.size(), noise);
}

void writeColouredNoiseTable(const PackageFiles& files, const std::string& directory, unsigned jobs) {
  constexpr std::size_t kNoiseCount = std::size(kAddedNoises);
  const auto drives = parallelResults("drives", std::size(kPlants) * kSeeds, jobs, [&](std::size_t i) {
    return record(files, kPlants[i / kSeeds], i % kSeeds + 1);
  });
  const auto figures = parallelResults("noises", std::size(kPlants) * kNoiseCount, jobs, [&](std::size_t i) {
    return estimate(&drives[i / kNoiseCount * kSeeds], kSeeds, kAddedNoises[i % kNoiseCount]);
  });
  std::string text =
      "plant,noise,wheel_deviation_radps,gyro_deviation_radps,estimator,forward_rms_mmps,yaw_rms_mradps,"
      "learned_wheel_deviation_radps,learned_wheel_time_s,learned_gyro_deviation_radps,learned_gyro_time_s\n";
  for (std::size_t i = 0; i < figures.size(); ++i) {
    const AddedNoise& noise = kAddedNoises[i % kNoiseCount];
    for (const EstimatorFigures& f : figures[i]) {
      text += fmt::format("{},{},{},{},{},{:.4g},{:.4g},{:.3g},{:.3g},{:.3g},{:.3g}\n", kPlants[i / kNoiseCount],
                          noise.name, noise.wheel, noise.gyro, f.name, 1e3 * f.forward, 1e3 * f.yaw_rate,
                          f.wheel_noise(0), f.wheel_noise(1), f.gyro_noise(0), f.gyro_noise(1));
    }
  }
  writeTable(directory, "coloured_noise.csv", text);
}

}  // namespace jackal_aic::sim
