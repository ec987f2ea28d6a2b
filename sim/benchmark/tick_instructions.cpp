// A tick for a tool that counts instructions: everything outside repeated() is set-up.

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "ticks.hpp"

namespace {

constexpr const char* kHelp =
    "Usage: tick_instructions --list | TICK COUNT\n"
    "Runs a tick COUNT times (1 to 10000000), in a function whose name begins with \"repeated\", where callgrind "
    "counts:\n"
    "  valgrind --tool=callgrind --toggle-collect='*repeated*' tick_instructions belief_p3 1000\n"
    "--list prints the names of the ticks and the compiler.\n";

/// Runs a tick `count` times.
template <class Tick>
__attribute__((noinline)) void repeated(Tick& tick, long count) {
  for (long i = 0; i < count; ++i) {
    tick();
    asm volatile("" : : "r"(&tick) : "memory");
  }
}

int refuse(const std::string& text) {
  std::fprintf(stderr, "tick_instructions: %s (see --help)\n", text.c_str());
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  using jackal_aic::benchmark::forEachTick;
  const std::string wanted = argc > 1 ? argv[1] : "";
  if (wanted == "--help" || wanted == "-h") return std::fputs(kHelp, stdout) < 0;
  if (wanted == "--list" && argc == 2) {
    std::printf("compiler %s\n", JACKAL_AIC_COMPILER);
    forEachTick([](const char* name, auto) { std::printf("%s\n", name); });
    return 0;
  }
  if (argc != 3) return refuse("needs the name of a tick and a count");
  char* end = nullptr;
  const long count = std::strtol(argv[2], &end, 10);
  if (*end != '\0' || count < 1 || count > 10'000'000) {
    return refuse(std::string("count ") + argv[2] + ": must be a whole number from 1 to 10000000");
  }
  bool found = false;
  try {
    forEachTick([&](const char* name, auto make) {
      if (name != wanted) return;
      found = true;
      auto tick = make();
      repeated(tick, count);
    });
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tick_instructions: %s\n", error.what());
    return 1;
  }
  return found ? 0 : refuse("tick " + wanted + ": there is none of this name");
}
