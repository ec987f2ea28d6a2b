// Times the steps of the controllers and of the fault monitor as they run on a robot that drives an arc, with the gains
// of config/ on the simulated ground.

#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "jackal_aic/faults/fault_monitor.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "loop_setup.hpp"

namespace jackal_aic {
namespace {

constexpr const char* kHelp =
    "Usage: tick_benchmark [OPTION of Google Benchmark ...]\n"
    "Times the steps of the controllers and of the fault monitor. Options of use: --benchmark_filter=REGEX,\n"
    "--benchmark_min_time=S, --benchmark_repetitions=N, --benchmark_format=console|json, --benchmark_out=FILE.\n";

constexpr SetPoint kArc{0.5, 0.0, 0.2};  // m/s, rad/s
constexpr double kSamplePeriod = 0.02;   // s

using Tick = std::function<void()>;

DriveParameters parametersOf(const char* controller) { return sim::loadSetup(controller, "ground", {}).drive; }

/// Samples of a robot that drives the arc with the noise of its sensors: the same in every run.
class Samples {
 public:
  Samples(const GeometryParameters& geometry, double period) : period_(period) {
    const WheelCommand wheels = SkidSteerKinematics(geometry).wheelSpeeds(kArc.forward, kArc.yaw_rate);
    std::mt19937 random(1);
    const auto noise = [&random](double size) { return size * (random() / 2147483648.0 - 1.0); };
    for (Observation& y : samples_) {
      y.yaw_rate = kArc.yaw_rate + noise(5e-3);
      y.wheel_left = wheels.left + noise(0.03);
      y.wheel_right = wheels.right + noise(0.03);
      y.acceleration_x = noise(0.05);
      y.acceleration_y = noise(0.05);
    }
  }

  const Observation& next() {
    Observation& sample = samples_[index_++ % samples_.size()];
    sample.stamp = stamp_ += period_;
    return sample;
  }

 private:
  std::array<Observation, 64> samples_;
  double period_;
  double stamp_ = 1.0;
  std::size_t index_ = 0;
};

/// Belief update of a controller. @param sampled each brings a sample; else one in a thousand does.
Tick beliefTick(const char* preset, bool sampled) {
  const DriveParameters drive = parametersOf(preset);
  const std::shared_ptr<VelocityController> controller = makeController(drive);
  Samples samples(drive.geometry, sampled ? 0.001 : kSamplePeriod);
  controller->setSetPoint(kArc);
  for (int i = 0; i < 500; ++i) {
    if (i % 20 == 0) controller->observe(samples.next());
    controller->updateBelief();
    if (i % 20 == 0) controller->hold(controller->updateAction());
  }
  return [controller, samples, sampled, tick = 0]() mutable {
    if (sampled || ++tick % 1000 == 0) controller->observe(samples.next());
    controller->updateBelief();
  };
}

/// The fault monitor under a command that changes every 20 ms.
struct MonitoredArc {
  DriveParameters drive = parametersOf("predictive");
  FaultMonitor monitor{FaultParameters{}, drive.geometry, drive.plant_model.value()};
  WheelCommand wheels = SkidSteerKinematics(drive.geometry).wheelSpeeds(kArc.forward, kArc.yaw_rate);
  Samples samples{drive.geometry, kSamplePeriod};
  std::array<WheelCommand, 32> commands;
  std::size_t steps = 0;

  MonitoredArc() {
    for (std::size_t i = 0; i < commands.size(); ++i) {
      const double change = 0.05 * std::sin(0.3 * static_cast<double>(i));
      commands[i] = {wheels.left + change, wheels.right - change};
    }
    for (int i = 0; i < 50; ++i) {
      for (int k = 0; k < 20; ++k) advance();
      check();
    }
  }
  void advance() { monitor.advance(commands[++steps / 20 % commands.size()], 0.001); }
  void check() { monitor.check(samples.next()); }
};

Tick monitorTick(int milliseconds, bool checked) {
  return [arc = std::make_shared<MonitoredArc>(), milliseconds, checked] {
    for (int k = 0; k < milliseconds; ++k) arc->advance();
    if (checked) arc->check();
  };
}

const std::vector<std::pair<std::string, std::function<Tick()>>>& ticks() {
  static const std::vector<std::pair<std::string, std::function<Tick()>>> list{
      {"belief", [] { return beliefTick("improved", false); }},
      {"belief_sample", [] { return beliefTick("improved", true); }},
      {"predictive", [] { return beliefTick("predictive", false); }},
      {"predictive_sample", [] { return beliefTick("predictive", true); }},
      {"monitor_advance", [] { return monitorTick(1, false); }},
      {"monitor_check", [] { return monitorTick(0, true); }},
      {"monitor_period", [] { return monitorTick(20, true); }}};
  return list;
}

int run(int argc, char** argv) {
  const std::string first = argc > 1 ? argv[1] : "";
  if (first == "--help" || first == "-h") return std::fputs(kHelp, stdout) < 0;
  for (const auto& [name, make] : ticks()) {
    benchmark::RegisterBenchmark(name.c_str(), [make = make](benchmark::State& state) {
      const Tick tick = make();
      for (auto unused : state) {
        static_cast<void>(unused);
        tick();
        benchmark::ClobberMemory();
      }
    });
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace
}  // namespace jackal_aic

int main(int argc, char** argv) {
  try {
    return jackal_aic::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tick_benchmark: %s\n", error.what());
    return 1;
  }
}
