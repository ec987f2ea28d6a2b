#pragma once

/// @file
/// Signals recorded at their own rates, and one table of them.

#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace jackal_aic::sim {

/// Samples of one signal by time.
class TimeSeries {
 public:
  /// Adds a sample; ignores one that is not later than the last, so that late messages keep the order.
  void add(double time, double value);

  /// The latest value at or before a time; empty before the first sample.
  std::optional<double> at(double time) const;

  /// True if nothing was added.
  bool empty() const { return time_.empty(); }

  /// Times of the samples, increasing.
  const std::vector<double>& time() const { return time_; }

  /// Values of the samples.
  const std::vector<double>& value() const { return value_; }

  /// The samples from `begin` up to and including `end`.
  TimeSeries between(double begin, double end) const;

  /// Longest time between two successive samples; 0 if there are fewer than two.
  double longestGap() const;

 private:
  std::vector<double> time_;
  std::vector<double> value_;
};

/// A signal with the name of its column.
struct Column {
  std::string name;
  const TimeSeries* series;
};

/// Writes a CSV table with one row per time, each signal with its latest value (an empty cell before its first sample).
void writeTable(std::ostream& out, const std::vector<double>& times, const std::vector<Column>& columns);

}  // namespace jackal_aic::sim
