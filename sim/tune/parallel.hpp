#pragma once

/// @file
/// Independent tasks on all cores.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "progress_bar.hpp"

namespace jackal_aic::sim {

/// Calls task(0) .. task(count - 1), each once, on up to `jobs` threads (0: one per core). Tasks must not depend on
/// each other.
/// @param progress called after every finished task with the number finished so far, never by two threads at once; may
/// be
///        empty. @throws the exception of the failed task with the lowest index, after the running ones have ended.
void parallelFor(std::size_t count, unsigned jobs, const std::function<void(std::size_t)>& task,
                 const std::function<void(std::size_t)>& progress = {});

/// Results of task(0) .. task(count - 1), in this order, by parallelFor() under a progress bar.
template <class Task>
auto parallelResults(const std::string& label, std::size_t count, unsigned jobs, const Task& task) {
  std::vector<decltype(task(std::size_t{0}))> results(count);
  ProgressBar bar(label, count, true);
  parallelFor(
      count, jobs, [&](std::size_t i) { results[i] = task(i); }, [&](std::size_t finished) { bar.show(finished); });
  return results;
}

}  // namespace jackal_aic::sim
