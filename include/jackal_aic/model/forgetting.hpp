#pragma once

/// @file
/// Exponential forgetting: the implicit Euler step of dm/dt = (value - m)/T. It is stable for a step of any length, and
/// within (step/T)^2/2 of exp(-step/T) for a step much shorter than the memory.

namespace jackal_aic {

/// Part that remains after a step: T/(T + step). @param step [s]; @param memory T [s], positive.
constexpr double keptAfter(double step, double memory) { return memory / (memory + step); }

/// Moves a mean over a memory T towards a value of one step: m <- m + step/(step + T) (value - m). @param step [s];
/// @param memory T [s].
constexpr void average(double& mean, double value, double step, double memory) {
  mean += step / (step + memory) * (value - mean);
}

}  // namespace jackal_aic
