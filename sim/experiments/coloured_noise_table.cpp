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

constexpr double kDuration = 120.0;     // s of a drive
constexpr double kLearning = 60.0;      // s, of which nothing counts
constexpr double kTrueTrack = 0.547;    // m, of the simulated robot, turning in place
constexpr double kMemory = 10.0;        // s, of all that is learned: that of the shipped precisions
constexpr double kExpectedTime = 0.01;  // s, smoothness and correlation time with which learning begins

/// Noise beside that of the sensors.
struct Colour {
  const char* name;
  bool smooth;  ///< of Gaussian autocorrelation, else of first order
  double time;  ///< s or T [s]; 0: white
};

constexpr Colour kColours[] = {{"white", true, 0.0},          {"s = 0.02 s", true, 0.02},
                               {"s = 0.05 s", true, 0.05},    {"s = 0.1 s", true, 0.1},
                               {"T = 0.02 s", false, 0.02},   {"T = 0.1 s", false, 0.1}};

/// Standard deviations of it.
struct Level {
  double wheel;  ///< [rad/s]
  double gyro;   ///< [rad/s]
};

constexpr Level kLevels[] = {{0.06, 0.01}, {0.2, 0.02}};

constexpr const char* kPlants[] = {"box", "ground", "real"};

/// Noise of deviation 1 at any time: a sum of many waves, of which the frequencies are drawn from the spectrum.
class Waves {
 public:
  Waves(const Colour& colour, std::mt19937_64& generator) : white_(colour.time <= 0.0), generator_(generator()) {
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
  for (; plant.time() < kDuration; plant.step()) {
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
std::vector<Drive::Moment> disturbed(const Drive& drive, const Colour& colour, const Level& level, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  Waves left(colour, generator), right(colour, generator), gyro(colour, generator);
  std::vector<Drive::Moment> moments = drive.moments;
  for (Drive::Moment& moment : moments) {
    if (!moment.observation) continue;
    Observation& y = *moment.observation;
    y.wheel_left += level.wheel * left.at(y.stamp);
    y.wheel_right += level.wheel * right.at(y.stamp);
    y.yaw_rate += level.gyro * gyro.at(y.stamp);
  }
  return moments;
}

/// What an estimator makes of a drive.
struct Outcome {
  Eigen::Vector2d squares = Eigen::Vector2d::Zero();  // sum of squared errors
  double count = 0.0;
  Eigen::Vector2d wheel_noise = Eigen::Vector2d::Zero(), gyro_noise = Eigen::Vector2d::Zero();  // learned

  void add(double time, const BodyVector& believed, const Eigen::Vector2d& truth) {
    if (time < kLearning) return;
    squares += (Eigen::Vector2d(believed(kForward), believed(kYaw)) - truth).cwiseAbs2();
    count += 1.0;
  }
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
  outcome.wheel_noise(0) = std::sqrt(learned.wheel_left);
  outcome.gyro_noise(0) = std::sqrt(learned.gyro);
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
  outcome.wheel_noise = filter.wheelNoise().learned();
  outcome.gyro_noise = filter.gyroNoise().learned();
  return outcome;
}

struct Estimator {
  const char* name;
  std::function<Outcome(const Drive&, const std::vector<Drive::Moment>&, const Colour&, const Level&)> run;
};

template <class MakeNoise>
Estimator filterWith(const char* name, const MakeNoise& make) {
  return {name, [make](const Drive& drive, const std::vector<Drive::Moment>& moments, const Colour& colour,
                       const Level& level) {
            const auto& trust = std::get<PredictiveParameters>(drive.setup.drive.controller);
            return byFilter(drive, moments, [&](bool wheel) -> std::unique_ptr<NoiseModel> {
              const double added = wheel ? level.wheel : level.gyro;
              return make(wheel ? trust.wheel_variance : trust.gyro_variance, added * added, colour);
            });
          }};
}

std::vector<Estimator> estimators() {
  using Made = std::unique_ptr<NoiseModel>;
  return {
      {"predictive, as shipped",
       [](const Drive& d, const std::vector<Drive::Moment>& m, const Colour&, const Level&) {
         return byController(d, m, false);
       }},
      {"predictive, precision learned",
       [](const Drive& d, const std::vector<Drive::Moment>& m, const Colour&, const Level&) {
         return byController(d, m, true);
       }},
      filterWith("s = 0, variance known",
                 [](double white, double added, const Colour&) -> Made {
                   return std::make_unique<KnownNoise<SmoothNoise>>(SmoothNoise{white, added, 0.0});
                 }),
      filterWith("colour and variance known",
                 [](double white, double added, const Colour& colour) -> Made {
                   if (colour.smooth) {
                     return std::make_unique<KnownNoise<SmoothNoise>>(SmoothNoise{white, added, colour.time});
                   }
                   return std::make_unique<KnownNoise<ExponentialNoise>>(ExponentialNoise{white, added, colour.time});
                 }),
      filterWith("s and variance learned",
                 [](double white, double, const Colour&) -> Made {
                   return std::make_unique<LearnedSmoothNoise>(SmoothNoise{white, white, kExpectedTime}, kMemory);
                 }),
      filterWith("innovations whitened", [](double white, double, const Colour&) -> Made {
        return std::make_unique<WhitenedNoise>(ExponentialNoise{white, white, kExpectedTime}, kMemory, 0.02);
      })};
}

}  // namespace

void writeColouredNoiseTable(const PackageFiles& files, const std::string& directory, unsigned jobs) {
  constexpr std::size_t kPlantCount = std::size(kPlants), kColourCount = std::size(kColours);
  constexpr auto kSeeds = static_cast<double>(kColouredNoiseSeeds);
  const auto drives = parallelResults("drives", kPlantCount * kColouredNoiseSeeds, jobs, [&](std::size_t i) {
    return record(files, kPlants[i / kColouredNoiseSeeds], i % kColouredNoiseSeeds + 1);
  });
  const std::vector<Estimator> all = estimators();
  struct Case {
    std::size_t plant, level, colour;
  };
  std::vector<Case> cases;
  for (std::size_t plant = 0; plant < kPlantCount; ++plant) {
    for (std::size_t level = 0; level < std::size(kLevels); ++level) {
      for (std::size_t colour = 0; colour < kColourCount; ++colour) cases.push_back({plant, level, colour});
    }
  }
  const auto rows = parallelResults("estimators", cases.size(), jobs, [&](std::size_t i) {
    const Colour& colour = kColours[cases[i].colour];
    const Level& level = kLevels[cases[i].level];
    std::vector<Outcome> sums(all.size());
    for (std::size_t seed = 0; seed < kColouredNoiseSeeds; ++seed) {
      const Drive& drive = drives[cases[i].plant * kColouredNoiseSeeds + seed];
      const auto moments = disturbed(drive, colour, level, seed + 1);
      for (std::size_t e = 0; e < all.size(); ++e) {
        const Outcome outcome = all[e].run(drive, moments, colour, level);
        sums[e].squares += outcome.squares;
        sums[e].count += outcome.count;
        sums[e].wheel_noise += outcome.wheel_noise.array().max(1e-9).log().matrix() / kSeeds;
        sums[e].gyro_noise += outcome.gyro_noise.array().max(1e-9).log().matrix() / kSeeds;
      }
    }
    std::string text;
    for (std::size_t e = 0; e < all.size(); ++e) {
      const Eigen::Vector2d error = (sums[e].squares / sums[e].count).cwiseSqrt();
      const Eigen::Vector2d wheel = sums[e].wheel_noise.array().exp(), gyro = sums[e].gyro_noise.array().exp();
      text += fmt::format("{},{},{},{},\"{}\",{:.4g},{:.4g},{:.3g},{:.3g},{:.3g},{:.3g}\n", kPlants[cases[i].plant],
                          colour.name, level.wheel, level.gyro, all[e].name, 1e3 * error(0), 1e3 * error(1),
                          wheel(0), wheel(1), gyro(0), gyro(1));
    }
    return text;
  });
  std::string text =
      "plant,noise,wheel_deviation_radps,gyro_deviation_radps,estimator,forward_rms_mmps,yaw_rms_mradps,"
      "learned_wheel_deviation_radps,learned_wheel_time_s,learned_gyro_deviation_radps,learned_gyro_time_s\n";
  for (const std::string& row : rows) text += row;
  writeTable(directory, "coloured_noise.csv", text);
}

}  // namespace jackal_aic::sim
