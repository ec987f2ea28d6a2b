#include "gain_trial.hpp"

#include <gtest/gtest.h>

#include "jackal_aic/config/text_file.hpp"
#include "package_files.hpp"

namespace jackal_aic {
namespace {

const std::string kPackage = JACKAL_AIC_SOURCE_DIR;

PlantFile box() { return readPlantFile(kPackage + "/config/plant_box.yaml"); }

TrialController on(const PlantFile& plant, const ControllerParameters& gains) {
  const ControllerFile file = readControllerFile(kPackage + "/config/improved.yaml");
  return {gains, file.geometry, file.limits, plant.model};
}

ControllerParameters improved() {
  return std::get<ControllerParameters>(readControllerFile(kPackage + "/config/improved.yaml").controller);
}

/// Gains that were once shipped: fast on the linear model, but a precise y'' makes limit cycles of the encoders' steps.
ControllerParameters brittle() {
  ControllerParameters gains = improved();
  gains.tau = 0.1;
  gains.kappa_mu = 0.4008;
  gains.kappa_a = 11.03;
  gains.state_variances = {0.001027, 8.013, 0.1331, 0.0031};
  gains.sensory_variances = {2.0, 1059.0, 0.001, 1e8};
  return gains;
}

std::size_t missed(const ControllerParameters& gains, const std::string& word) {
  const std::string urdf = readText(kPackage + "/sim/urdf/jackal.urdf");
  std::size_t count = 0;
  for (const Trial& trial : allTrials(box().simulation, "box", 10.0)) {
    if (trial.name.find(word) == std::string::npos) continue;
    count += !trial.bars.missed(drive(trial, on(box(), gains), urdf)).empty();
  }
  return count;
}

TEST(Trial, FindsTheLimitCycleOfCoarseEncoders) {
  EXPECT_EQ(missed(improved(), "late samples"), 0U);
  EXPECT_GE(missed(brittle(), "late samples"), 3U);
}

TEST(Trial, FiguresAreOfTheStepAndOfTheStop) {
  Trial trial{{0.5, 0.0, 0.0}, box().simulation, 0.019, {}, "", true};
  trial.plant.noise_scale = 0.0;
  const std::string urdf = readText(kPackage + "/sim/urdf/jackal.urdf");
  const sim::StopFigures late = drive(trial, on(box(), improved()), urdf);
  trial.phase = 0.0;
  const sim::StopFigures in_phase = drive(trial, on(box(), improved()), urdf);
  EXPECT_NEAR(*in_phase.settling, 0.38, 0.03);
  EXPECT_GT(late.overshoot_pct, 2.0 * in_phase.overshoot_pct);
  EXPECT_GT(late.beyond_mps, 0.0);
  EXPECT_EQ(late.beyond_radps, 0.0) << "it was not told to turn";
  EXPECT_LT(late.ripple, 1e-3) << "without noise";
}

TEST(StopBars, NameWhatIsMissed) {
  const auto with = [](double sim::StopFigures::*figure, double value) {
    sim::StopFigures figures;
    figures.*figure = value;
    return sim::StopBars{}.missed(figures);
  };
  EXPECT_EQ(sim::StopBars{}.missed({}), "");
  EXPECT_EQ(with(&sim::StopFigures::overshoot_pct, 12.5), "overshoots by 12.5 % (at most 10)");
  EXPECT_EQ(with(&sim::StopFigures::beyond_mps, 0.04), "runs back with 0.04 m/s after the stop");
  EXPECT_EQ(with(&sim::StopFigures::beyond_radps, 0.06), "turns back with 0.06 rad/s after the stop");
  EXPECT_EQ(with(&sim::StopFigures::ripple, 0.2), "its command ripples by 0.2 rad/s");
  sim::StopFigures never;
  never.settling.reset();
  EXPECT_EQ(sim::StopBars{}.missed(never), "never settles");
}

TEST(StopFigures, WorsenTakesTheWorseOfEach) {
  sim::StopFigures worst{0.5, 3.0, 0.02, 0.0, 0.01};
  worst.worsen({0.4, 5.0, 0.01, 0.03, 0.02});
  EXPECT_EQ(*worst.settling, 0.5);
  EXPECT_EQ(worst.overshoot_pct, 5.0);
  EXPECT_EQ(worst.beyond_mps, 0.02);
  EXPECT_EQ(worst.beyond_radps, 0.03);
  EXPECT_EQ(worst.ripple, 0.02);
  worst.worsen({std::nullopt, 0.0, 0.0, 0.0, 0.0});
  EXPECT_FALSE(worst.settling);
}

TEST(DrawnTrials, AreTheSameForTheSameSeedAndSpreadWhatIsSpread) {
  const auto first = drawnTrials(box().simulation, "box", 10.0, 200, 7);
  const auto again = drawnTrials(box().simulation, "box", 10.0, 200, 7);
  const auto other = drawnTrials(box().simulation, "box", 10.0, 200, 8);
  ASSERT_EQ(first.size(), 200U);
  double slowest = 0.0, fastest = 1.0, coarse = 0.0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].plant.dead_time, again[i].plant.dead_time);
    EXPECT_NEAR(first[i].plant.dead_time, 0.105, 0.0101);
    EXPECT_LT(first[i].phase, 0.02);
    slowest = std::max(slowest, first[i].plant.dead_time);
    fastest = std::min(fastest, first[i].plant.dead_time);
    coarse += first[i].plant.encoder_step == 0.1;
  }
  EXPECT_GT(slowest - fastest, 0.018);
  EXPECT_NEAR(coarse, 40.0, 20.0);
  EXPECT_NE(first[0].plant.dead_time, other[0].plant.dead_time);
}

TEST(RollingTrack, IsThatOfTheRigidBodiesAndNoneOfMotorsThatYield) {
  const std::string urdf = readText(kPackage + "/sim/urdf/jackal.urdf");
  sim::PlantParameters ground = readPlantFile(kPackage + "/config/plant.yaml").simulation;
  const ControllerFile file = readControllerFile(kPackage + "/config/improved.yaml");
  const auto track = rollingTrack(ground, urdf);
  ASSERT_TRUE(track);
  EXPECT_NEAR(*track, file.geometry.effective_track / file.geometry.slip_factor, 0.05);
  EXPECT_TRUE(rollingTrack(box().simulation, urdf));
  ground.velocity_loop_stiffness = 3.5;
  EXPECT_FALSE(rollingTrack(ground, urdf));
}

TEST(Trial, WithoutMassesIsMuchTheSame) {
  const std::string urdf = readText(kPackage + "/sim/urdf/jackal.urdf");
  const PlantFile ground = readPlantFile(kPackage + "/config/plant.yaml");
  for (const SetPoint& set_point : {SetPoint{0.5, 0.0, 0.0}, SetPoint{0.0, 0.0, 1.0}}) {
    Trial trial{set_point, ground.simulation, 0.019, {}, "", true};
    const sim::StopFigures rigid = drive(trial, on(ground, improved()), urdf);
    trial.rolling_track = rollingTrack(ground.simulation, urdf);
    const sim::StopFigures light = drive(trial, on(ground, improved()), urdf);
    EXPECT_NEAR(*light.settling, *rigid.settling, 0.05);
    EXPECT_NEAR(light.overshoot_pct, rigid.overshoot_pct, 2.0);
  }
}

}  // namespace
}  // namespace jackal_aic
