// Robots that nobody has identified, driven with what is assumed of them (config/jackal_model.yaml). The campaign over
// all of them, half an hour each, is `experiments unidentified`.

#include "unidentified.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "jackal_aic/certificate/predictive_certificate.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"

namespace jackal_aic::sim {
namespace {

std::vector<MonitoredSample> motion(double frequency, double amplitude, double decay) {
  std::vector<MonitoredSample> samples;
  for (int i = 0; i < 500; ++i) {
    const double time = 0.02 * i;
    MonitoredSample sample{};
    sample.time = time;
    sample.set_point = {0.5, 0.0, 0.0};
    sample.velocity = 0.5 - amplitude * std::exp(-decay * time) * std::cos(2.0 * M_PI * frequency * time);
    samples.push_back(sample);
  }
  return samples;
}

TEST(MostSwings, CountsWhatGoesOnAndNotWhatSettles) {
  EXPECT_EQ(mostSwings(motion(0.0, 0.5, 2.0)), 0) << "approach from one side";
  EXPECT_LE(mostSwings(motion(0.5, 0.5, 2.0)), UnidentifiedDrive::kMostSwings) << "well damped";
  EXPECT_EQ(mostSwings(motion(1.0, 0.02, 0.0)), 0) << "ripple";
  EXPECT_GT(mostSwings(motion(1.0, 0.1, 0.0)), 10) << "limit cycle";
}

TEST(MostSwings, CountsATurningPointOnceHoweverFarItGoes) {
  std::vector<MonitoredSample> samples(500);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i].time = 0.01 * static_cast<double>(i);
    const double since = samples[i].time - 2.5;  // up to 1, back to 0.5, in steps that each go further than a swing
    samples[i].velocity = since < 0.0 ? 0.0 : since < 1.0 ? since : std::max(0.5, 2.0 - since);
  }
  EXPECT_EQ(mostSwings(samples), 1);
}

TEST(DrivenModel, IsStableOnEveryRobotThatNobodyHasIdentified) {
  const PackageFiles files("");
  ParameterMap map;
  addYamlFile(files.path("config/jackal_model.yaml"), map);
  const auto assumed = readParameters<PlantModel>(map, "plant_model");
  ASSERT_FALSE(assumed.identified);
  ParameterMap preset;
  addYamlFile(files.path("config/predictive.yaml"), preset);
  const auto gains = readParameters<PredictiveParameters>(preset, "predictive");
  int robots = 0;
  for (const DriveTrainRatios& ratios : unidentifiedRobots()) {
    if (ratios.acceleration_limit != 1.0) continue;  // no part of the linear response
    ++robots;
    PlantModel robot = assumed;
    robot.dead_time *= ratios.dead_time;
    robot.lag *= ratios.lag;
    robot.gain *= ratios.gain;
    EXPECT_LT(PredictiveLinearLoop(gains, drivenModel(assumed), robot).worstSpectralRadius(), 0.98)
        << ratios.dead_time << " x dead time, " << ratios.lag << " x lag, gain " << ratios.gain;
  }
  EXPECT_GE(robots, 8);
}

class Unidentified : public testing::TestWithParam<DriveTrainRatios> {};

TEST_P(Unidentified, NeitherOscillatesNorIsCalledFaulty) {
  constexpr double kDuration = 60.0;  // s
  const UnidentifiedDrive drive = driveUnidentified(PackageFiles(""), "predictive", GetParam(), kDuration, 5);
  EXPECT_FALSE(drive.oscillates()) << drive.swings << " swings";
  EXPECT_EQ(drive.faults, 0u) << drive.first;
}

INSTANTIATE_TEST_SUITE_P(Corners, Unidentified,
                         testing::Values(DriveTrainRatios{}, DriveTrainRatios{0.5, 0.5, 1.2, 3.0},
                                         DriveTrainRatios{2.0, 2.0, 1.2, 3.0}, DriveTrainRatios{2.0, 2.0, 1.2, 0.5},
                                         DriveTrainRatios{0.5, 2.0, 0.8, 0.5}, DriveTrainRatios{2.0, 0.5, 0.8, 1.0}));

}  // namespace
}  // namespace jackal_aic::sim
