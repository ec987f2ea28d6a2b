// The covariance of the published belief is that of its errors: standing, steady and in transients, on every plant.

#include <gtest/gtest.h>

#include <string>

#include "belief_consistency.hpp"

namespace jackal_aic::sim {
namespace {

const PackageFiles kFiles{JACKAL_AIC_SOURCE_DIR};
// Beyond the seeds of the table, by which the constants of the covariance were chosen.
constexpr std::uint64_t kFirstSeed = kConsistencySeeds + 1, kSeeds = 4;

class Consistency : public testing::TestWithParam<const char*> {};

TEST_P(Consistency, ErrorsAreWithinTheir95PercentBounds) {
  PhaseConsistency sums;
  for (std::uint64_t seed = kFirstSeed; seed < kFirstSeed + kSeeds; ++seed) {
    const PhaseConsistency drive = driveConsistency(kFiles, GetParam(), seed);
    for (std::size_t phase = 0; phase < sums.size(); ++phase) sums[phase].add(drive[phase]);
  }
  for (std::size_t phase = 0; phase < sums.size(); ++phase) {
    const ConsistencySums& s = sums[phase];
    std::printf("%s, %s: NEES %.3g (forward %.3g, yaw rate %.3g), %.1f %% inside\n", GetParam(), kPhaseNames[phase],
                s.nees(), s.forwardNees(), s.yawNees(), 100.0 * s.inside());
    EXPECT_GT(s.samples, 1000.0) << kPhaseNames[phase];
    EXPECT_GE(s.inside(), 0.95) << kPhaseNames[phase] << ": of the time within the 95 % bounds";
    EXPECT_LE(s.nees(), 2.5) << kPhaseNames[phase] << ": 2 if the covariance is right, more if it is too small";
    EXPECT_GE(s.nees(), 0.5) << kPhaseNames[phase] << ": and not much too large";
  }
}

INSTANTIATE_TEST_SUITE_P(Plants, Consistency, testing::Values("box", "ground", "real"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace jackal_aic::sim
