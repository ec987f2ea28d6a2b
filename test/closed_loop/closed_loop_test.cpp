#include "closed_loop.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "drives.hpp"
#include "loop_setup.hpp"
#include "step_response.hpp"

namespace jackal_aic::sim {
namespace {

RunResult step(const std::string& controller, const std::string& plant, double forward, double yaw_rate = 0.0,
               const Overrides& overrides = {}) {
  return runSetup(loadSetup(files(), controller, plant, overrides), stepProfile(forward, yaw_rate, 4.0));
}

/// Commands the stamp of the last measurement, at 50 Hz.
class StampController : public VelocityController {
 public:
  bool setSetPoint(const SetPoint&) override { return true; }
  SampleVerdict observe(const Observation& observation) override {
    stamp_ = observation.stamp;
    return SampleVerdict::accepted;
  }
  void updateBelief() override {}
  WheelCommand updateAction() override { return action(); }
  void hold(const WheelCommand&) override {}
  void overrule(const WheelCommand&) override {}
  void restart() override {}
  void reset() override {}
  bool hasBelief() const override { return false; }
  BodyVector believedVelocity() const override { return BodyVector::Zero(); }
  WheelCommand action() const override { return {stamp_, stamp_}; }
  double freeEnergy() const override { return 0.0; }
  double beliefStep() const override { return 0.001; }
  int beliefStepsPerAction() const override { return 20; }

 private:
  double stamp_ = 0.0;
};

TEST(ClosedLoop, PhaseIsTheAgeOfAMeasurementAtAnAction) {
  for (const double phase : {0.0, 0.001, 0.013, 0.019}) {
    const LoopSetup setup =
        loadSetup(files(), "improved", "box", {{"loop.phase", std::to_string(phase)}, {"plant.encoder_noise", "0"}});
    JackalPlant plant(setup.urdf, setup.plant);
    DriveLoop drive(setup.drive, std::make_unique<StampController>());
    const auto samples =
        runClosedLoop(plant, drive, stepProfile(0.5, 0.0, 1.0), setup.plant.support, setup.drive.geometry, setup.loop);
    for (std::size_t i = 20; i < samples.size(); i += 20) {
      // The clock of the plant, by which it stamps, is ahead by the phase.
      ASSERT_NEAR(samples[i].time + phase - samples[i].command.left, phase, 1e-9) << i;
    }
  }
  const RunResult in_phase = step("diff_drive", "box", 0.5);
  const RunResult late = step("diff_drive", "box", 0.5, 0.0, {{"loop.phase", "0.013"}});
  EXPECT_NEAR(*late.metrics.settling, *in_phase.metrics.settling, 1e-6) << "the open loop does not measure";
  EXPECT_GT(step("improved", "box", 0.5, 0.0, {{"loop.phase", "0.019"}}).metrics.overshoot_pct,
            2.0 * step("improved", "box", 0.5).metrics.overshoot_pct);
}

TEST(ClosedLoop, LimitsHoldTheActionWithoutWindUp) {
  const Overrides slow{{"limits.linear_speed", "0.3"}};
  AssessedProfile wave;
  wave.changes = {{0.5, {0.1, 0.0, 0.0}}, {2.5, {0.6, 0.0, 0.0}}, {4.5, {0.1, 0.0, 0.0}}};
  wave.duration = 6.5;
  wave.assessed.reset();
  const RunResult run = runSetup(loadSetup(files(), "improved", "ground", slow), wave);
  double fastest = 0.0, after_fall = 0.0;
  for (const Sample& sample : run.samples) {
    fastest = std::max(fastest, sample.velocity);
    if (std::abs(sample.time - (kRestTime + 4.0 + 1.5)) < 5e-4) after_fall = sample.velocity;  // 1.5 s after the fall
  }
  EXPECT_NEAR(fastest, 0.3, 0.01);
  EXPECT_NEAR(after_fall, 0.1, 0.01);  // a wound-up action would still be above
}

TEST(ClosedLoop, CommandReachesItsAccelerationUnderAJerkLimit) {
  for (const char* controller : {"predictive", "improved"}) {
    const RunResult run =
        step(controller, "ground", 1.0, 0.0, {{"limits.linear_acceleration", "1"}, {"limits.linear_jerk", "5"}});
    const auto there = std::find_if(run.samples.begin(), run.samples.end(),
                                    [](const Sample& sample) { return sample.velocity >= 0.95; });
    ASSERT_NE(there, run.samples.end()) << controller;
    // 0.95 s at 1 m/s^2, half the 0.2 s in which the acceleration rises, the dead time, a period each of sensor and
    // action.
    EXPECT_LT(there->time - kRestTime, 0.95 + 0.1 + 0.08 + 0.04) << controller;
    EXPECT_LT(run.metrics.overshoot_pct, 1.0) << controller;
  }
}

}  // namespace
}  // namespace jackal_aic::sim
