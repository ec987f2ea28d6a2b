// The ticks under Google Benchmark.

#include <benchmark/benchmark.h>

#include <cstdio>
#include <exception>
#include <string>

#include "ticks.hpp"

namespace {

constexpr const char* kHelp =
    "Usage: tick_benchmark [OPTION of Google Benchmark ...]\n"
    "Times the ticks of the controllers and of the fault monitor, and beside them the belief tick by hand (_bound) "
    "and\n"
    "transcribed from the thesis (_transcription). Options of use: --benchmark_filter=REGEX, --benchmark_min_time=S,\n"
    "--benchmark_repetitions=N, --benchmark_format=console|json.\n";

}  // namespace

int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    if (argv[i] == std::string("--help") || argv[i] == std::string("-h")) return std::fputs(kHelp, stdout) < 0;
  }
  try {
    jackal_aic::benchmark::forEachTick([](const char* name, auto make) {
      benchmark::RegisterBenchmark(name, [make](benchmark::State& state) {
        auto tick = make();
        for (auto unused : state) {
          static_cast<void>(unused);
          tick();
          benchmark::DoNotOptimize(&tick);
          benchmark::ClobberMemory();
        }
      });
    });
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tick_benchmark: %s\n", error.what());
    return 1;
  }
}
