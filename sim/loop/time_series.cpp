#include "time_series.hpp"

#include <algorithm>

namespace jackal_aic::sim {

void TimeSeries::add(double time, double value) {
  if (!time_.empty() && time <= time_.back()) return;
  time_.push_back(time);
  value_.push_back(value);
}

std::optional<double> TimeSeries::at(double time) const {
  const auto later = std::upper_bound(time_.begin(), time_.end(), time);
  if (later == time_.begin()) return std::nullopt;
  return value_[static_cast<std::size_t>(later - time_.begin()) - 1];
}

TimeSeries TimeSeries::between(double begin, double end) const {
  TimeSeries part;
  for (std::size_t i = 0; i < time_.size(); ++i) {
    if (time_[i] >= begin && time_[i] <= end) part.add(time_[i], value_[i]);
  }
  return part;
}

double TimeSeries::longestGap() const {
  double longest = 0.0;
  for (std::size_t i = 1; i < time_.size(); ++i) longest = std::max(longest, time_[i] - time_[i - 1]);
  return longest;
}

void writeTable(std::ostream& out, const std::vector<double>& times, const std::vector<Column>& columns) {
  out.precision(9);
  out << "time";
  for (const auto& column : columns) out << ',' << column.name;
  out << '\n';
  for (double time : times) {
    out << time;
    for (const auto& column : columns) {
      out << ',';
      if (const auto value = column.series->at(time)) out << *value;
    }
    out << '\n';
  }
}

}  // namespace jackal_aic::sim
