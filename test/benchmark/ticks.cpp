// Times the steps of the controllers and of the fault monitor as they run on a robot that drives an arc, with the gains
// of config/ on the simulated ground.

#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>

#include "jackal_aic/faults/fault_monitor.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "loop_setup.hpp"

namespace jackal_aic {
namespace {

constexpr const char* kHelp =
    "Usage: tick_benchmark [--benchmark_filter=REGEX] [--benchmark_repetitions=N] [OPTION of Google Benchmark ...]\n"
    "Times the steps of the controllers and of the fault monitor.\n";

constexpr SetPoint kArc{0.5, 0.0, 0.2};  // m/s, rad/s

DriveParameters parametersOf(const char* controller) { return sim::loadSetup(controller, "ground", {}).drive; }

WheelCommand wheelsOf(const DriveParameters& drive) {
  return SkidSteerKinematics(drive.geometry).wheelSpeeds(kArc.forward, kArc.yaw_rate);
}

/// Samples of a robot that drives the arc with the noise of its sensors, one after the other: the same in every run.
auto samplesOf(const DriveParameters& drive, double period) {
  const WheelCommand wheels = wheelsOf(drive);
  std::array<Observation, 64> samples;
  std::mt19937 random(1);
  const auto noise = [&random](double size) { return size * (random() / 2147483648.0 - 1.0); };
  for (Observation& y : samples) {
    y = {0.0,        kArc.yaw_rate + noise(5e-3), wheels.left + noise(0.03), wheels.right + noise(0.03), noise(0.05),
         noise(0.05)};
  }
  return [samples, period, i = 0]() mutable -> const Observation& {
    Observation& sample = samples[static_cast<std::size_t>(i) % samples.size()];
    sample.stamp = 1.0 + period * ++i;
    return sample;
  };
}

/// Belief updates of a controller. @param sampled each brings a sample; else one in a thousand does.
void timeBelief(benchmark::State& state, const char* preset, bool sampled) {
  const DriveParameters drive = parametersOf(preset);
  const auto controller = makeController(drive);
  auto nextSample = samplesOf(drive, sampled ? 0.001 : 0.02);
  controller->setSetPoint(kArc);
  for (int i = 0; i < 500; ++i) {
    if (i % 20 == 0) controller->observe(nextSample());
    controller->updateBelief();
    if (i % 20 == 0) controller->hold(controller->updateAction());
  }
  int tick = 0;
  while (state.KeepRunning()) {
    if (sampled || ++tick % 1000 == 0) controller->observe(nextSample());
    controller->updateBelief();
    benchmark::ClobberMemory();
  }
}

/// The fault monitor under a command that changes every 20 ms. @param checked samples; else milliseconds between them.
void timeMonitor(benchmark::State& state, bool checked) {
  const DriveParameters drive = parametersOf("predictive");
  FaultMonitor monitor(FaultParameters{}, drive.geometry, drive.plant_model.value());
  const WheelCommand wheels = wheelsOf(drive);
  auto nextSample = samplesOf(drive, 0.02);
  int steps = 0;
  const auto advance = [&] {
    const double change = 0.05 * std::sin(0.3 * (++steps / 20 % 32));
    monitor.advance(WheelCommand{wheels.left + change, wheels.right - change}, 0.001);
  };
  for (int i = 1; i <= 1000; ++i) {
    advance();
    if (i % 20 == 0) monitor.check(nextSample());
  }
  while (state.KeepRunning()) {
    if (checked) monitor.check(nextSample());
    if (!checked) advance();
    benchmark::ClobberMemory();
  }
}

}  // namespace
}  // namespace jackal_aic

int main(int argc, char** argv) {
  using namespace jackal_aic;
  const std::string first = argc > 1 ? argv[1] : "";
  if (first == "--help" || first == "-h") return std::fputs(kHelp, stdout) < 0;
  benchmark::RegisterBenchmark("belief", timeBelief, "improved", false);
  benchmark::RegisterBenchmark("belief_sample", timeBelief, "improved", true);
  benchmark::RegisterBenchmark("predictive", timeBelief, "predictive", false);
  benchmark::RegisterBenchmark("predictive_sample", timeBelief, "predictive", true);
  benchmark::RegisterBenchmark("monitor_advance", timeMonitor, false);
  benchmark::RegisterBenchmark("monitor_check", timeMonitor, true);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
}
