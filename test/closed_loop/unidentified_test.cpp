// Robots that were not identified, driven with the assumed model (config/jackal_model.yaml). The campaign over all of
// them, half an hour each, is `experiments unidentified`.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "closed_loop.hpp"
#include "drives.hpp"
#include "jackal_aic/certificate/certificate.hpp"
#include "loop_setup.hpp"
#include "plant_conversion.hpp"
#include "step_response.hpp"

namespace jackal_aic::sim {
namespace {

TEST(AssumedModel, IsStableOnEveryRobotWithinTheRange) {
  const PlantModel assumed = assumedModel();
  ASSERT_FALSE(assumed.identified);
  ParameterMap preset = files().configuration("predictive");
  const auto gains = readParameters<PredictiveParameters>(preset, "predictive");
  for (const double dead_time : {0.5, 1.0, 2.0}) {
    for (const double lag : {0.5, 1.0, 2.0}) {
      for (const double gain : {0.8, 1.0, 1.2}) {
        PlantModel robot = assumed;
        robot.dead_time *= dead_time;
        robot.lag *= lag;
        robot.gain *= gain;
        EXPECT_LT(LinearLoop(gains, drivenModel(assumed), robot).worstSpectralRadius(LoopMode::straight).upper(), 0.98)
            << dead_time << " x dead time, " << lag << " x lag, gain " << gain;
      }
    }
  }
}

/// A robot that was driven along a profile.
struct Driven {
  ResponseMetrics response;
  double limit;  ///< of the acceleration that the controller asks for in the end [m/s^2]
};

Driven drive(const PlantModel& known, const PlantParameters& robot, const AssessedProfile& profile,
             const Overrides& overrides) {
  LoopSetup setup = loadSetup(files(), "predictive", "ground", overrides);
  setup.drive.plant_model = known;
  setup.plant = robot;
  JackalPlant plant(setup.urdf, setup.plant);
  DriveLoop loop = makeLoop(setup);
  const auto samples = runClosedLoop(plant, loop, profile, Support::ground, setup.drive.geometry);
  return {assess(samples, profile), loop.predictive()->model().acceleration_limit};
}

/// Motors with a lower gain than assumed are not at their limit: a belief that takes them for such leaves one wheel
/// below its goal until it notices, before the other.
TEST(Unidentified, WheelsReachTheirGoalTogether) {
  const struct {
    SetPoint set_point;
    double fastest_wheel;  // of the goal [m/s]
  } rows[] = {{{1.5, 0.0, 0.0}, 1.5}, {{1.0, 0.0, -1.0}, 1.22}, {{0.5, 0.0, 0.5}, 0.61}};
  const double asked = drivenModel(assumedModel()).acceleration_limit;
  for (const double gain : {0.9, 1.0}) {
    for (const auto& row : rows) {
      for (const std::uint64_t seed : {1, 2, 3}) {
        SCOPED_TRACE(testing::Message() << "gain " << gain << ", " << row.fastest_wheel << " m/s, seed " << seed);
        PlantParameters robot = loadSetup(files(), "predictive", "ground", {}).plant;
        robot.wheel_gain *= gain;
        robot.seed = seed;
        AssessedProfile profile;
        profile.changes = {{1.0, row.set_point}};
        profile.assessed_from = 1.0;
        profile.assessed_until = profile.duration = 6.0;
        const ResponseMetrics response = drive(assumedModel(), robot, profile, {}).response;
        ASSERT_TRUE(response.settling);
        EXPECT_LT(*response.settling, row.fastest_wheel / asked + 0.65);
      }
    }
  }
}

/// The wheels follow half of the assumed acceleration limit, so more is tried in the same acceleration. Motors that are
/// weaker than the next attempt do not wind up.
TEST(Unidentified, AcceleratesMoreInTheFirstAcceleration) {
  const struct {
    double limit;    // of the motors / assumed
    double settles;  // at most [s]
  } rows[] = {{0.55, 1.75}, {1.0, 1.0}, {2.5, 0.85}};
  for (const auto& row : rows) {
    SCOPED_TRACE(row.limit);
    PlantParameters robot = loadSetup(files(), "predictive", "ground", {}).plant;
    robot.acceleration_limit *= row.limit;
    AssessedProfile profile;
    profile.changes = {{1.0, {1.0, 0.0, 0.0}}};
    profile.assessed_from = 1.0;
    profile.assessed_until = profile.duration = 6.0;
    const ResponseMetrics response = drive(assumedModel(), robot, profile, {}).response;
    ASSERT_TRUE(response.settling);
    EXPECT_LT(*response.settling, row.settles);
    EXPECT_LT(response.overshoot_pct, 5.0);
  }
}

}  // namespace
}  // namespace jackal_aic::sim
