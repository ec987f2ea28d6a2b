#pragma once

/// @file
/// What the property tests have in common: how many inputs, and what is random.

#include <cstdint>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>

#include "../repository.hpp"

namespace jackal_aic::test {

/// Share of the inputs of all property tests together, JACKAL_AIC_FUZZ_INPUTS (default 20000): a million is
///     JACKAL_AIC_FUZZ_INPUTS=1000000 ./scripts/test --only fuzz
inline int fuzzInputs(double share) {
  const char* text = std::getenv("JACKAL_AIC_FUZZ_INPUTS");
  const double all = text != nullptr ? std::atof(text) : 20000.0;
  return static_cast<int>(share * all) + 1;
}

/// Seeded source of everything random. Spelled out where the standard leaves the numbers to the library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  std::size_t below(std::size_t size) { return size == 0 ? 0 : static_cast<std::size_t>(engine_() % size); }
  bool chance(double probability) { return static_cast<double>(engine_() >> 11) * 0x1p-53 < probability; }
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }

  /// Mostly a number of everyday size, else one that arithmetic may stumble over.
  double number() {
    constexpr double kOdd[] = {0.0,
                               -0.0,
                               1e-320,
                               std::numeric_limits<double>::min(),
                               1e15,
                               -1e38,
                               1e300,
                               -1e308,
                               std::numeric_limits<double>::max(),
                               std::numeric_limits<double>::infinity(),
                               -std::numeric_limits<double>::infinity(),
                               std::numeric_limits<double>::quiet_NaN()};
    if (chance(0.7)) return between(-5.0, 5.0);
    return kOdd[below(sizeof kOdd / sizeof *kOdd)];
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace jackal_aic::test
