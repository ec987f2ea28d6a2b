// A period of the drive loop does not allocate, with any preset and with the fault detection on.

#include <gtest/gtest.h>

#include <utility>

#include "../counted_allocations.hpp"
#include "injected_faults.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "jackal_plant.hpp"
#include "loop_setup.hpp"

namespace jackal_aic::sim {
namespace {

class Allocations : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
#if !JACKAL_AIC_COUNTS
    GTEST_SKIP() << "the sanitizers allocate";
#endif
  }
};

TEST_P(Allocations, NoneInMeasurementsSetPointsBeliefsAndActions) {
  LoopSetup setup = loadSetup(GetParam(), "ground", {});
  setup.drive.faults = FaultParameters{};
  setup.drive.open_loop_monitored = true;
  auto controller = makeController(setup.drive);
  setup.drive.plant_model = monitorModel("ground");  // of the fault detection; the open loop has none
  JackalPlant plant(setup.urdf, setup.plant);
  DriveLoop loop(setup.drive, std::move(controller));
  FaultInjector faults({{FaultKind::freeze, FaultChannel::left, 0.0, 3.0, 1.0},
                        {FaultKind::bias, FaultChannel::gyro, 0.3, 6.0, 1.0},
                        {FaultKind::not_a_number, FaultChannel::right, 0.0, 8.0, 0.1}},
                       {});
  int commands = 0, faulty = 0;
  const int before = allocations;
  for (int k = 0; k < 10000; ++k, plant.step()) {
    const double now = plant.time();
    std::optional<Observation> y;
    if (plant.measurement()) y = faults.falsified(*plant.measurement()).observation();
    const bool stands = k < 100 || (k >= 5000 && k < 5500);
    counting = true;
    loop.setSetPoint(stands ? SetPoint{} : SetPoint{0.5, 0.0, k < 2000 ? 0.0 : 0.4}, now);
    loop.report({}, now);
    if (y) loop.observe(*y, now);
    loop.updateBelief(now);
    const auto command = loop.advance(now);
    faulty += isFault(loop.status().fault);
    counting = false;
    if (!command) continue;
    ++commands;
    plant.command(*command);
  }
  EXPECT_EQ(allocations, before);
  EXPECT_GT(commands, 490);
  EXPECT_GT(faulty, 0) << "a fault was there to be found";
}

INSTANTIATE_TEST_SUITE_P(Presets, Allocations,
                         testing::Values("diff_drive", "standard", "improved", "tuned", "predictive"),
                         [](const auto& info) { return info.param; });

TEST(MonitorAllocations, NoneInResetsAndTheCounterCounts) {
#if !JACKAL_AIC_COUNTS
  GTEST_SKIP() << "the sanitizers allocate";
#endif
  FaultMonitor monitor({}, {}, {});
  PredictiveController controller({}, {}, {});
  Observation y;
  const int before = allocations;
  counting = true;
  for (int k = 1; k <= 100; ++k) {
    monitor.advance(WheelCommand{1.0, 1.0}, 0.02);
    y.stamp = 0.02 * k;
    monitor.check(y);
    controller.observe(y);
    controller.updateBelief();
    if (k == 50) monitor.restart();
    if (k % 20 == 0) monitor.forgetEncoders(), controller.resetMotion();
    if (k % 30 == 0) monitor.reset(), controller.reset();
  }
  EXPECT_EQ(allocations, before);
  delete new volatile int(1);
  counting = false;
  EXPECT_EQ(allocations, before + 1);
}

}  // namespace
}  // namespace jackal_aic::sim
