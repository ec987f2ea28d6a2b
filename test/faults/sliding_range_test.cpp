#include "jackal_aic/faults/sliding_range.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

#include "jackal_aic/faults/recent_range.hpp"

namespace jackal_aic {
namespace {

/// What SlidingRange is to find, by looking at all values.
struct Looked {
  double low, high;
};

Looked look(const std::vector<double>& values, std::size_t youngest, std::size_t oldest) {
  const auto end = values.end() - static_cast<std::ptrdiff_t>(youngest);
  const auto begin = values.end() - static_cast<std::ptrdiff_t>(oldest) - 1;
  return {*std::min_element(begin, end), *std::max_element(begin, end)};
}

TEST(SlidingRange, IsThatOfLookingAtEveryValue) {
  std::mt19937 random(3);
  for (const auto& [youngest, oldest] : std::vector<std::pair<std::size_t, std::size_t>>{
           {0, 0}, {0, 1}, {0, 63}, {0, 64}, {0, 600}, {5, 5}, {40, 170}, {600, 600}}) {
    SlidingRange range(youngest, oldest);
    for (int k = 0; k < 777; ++k) range.add(static_cast<double>(random() % 7));  // which is forgotten
    range.fill(0.5);
    std::vector<double> values(oldest + 1, 0.5);
    for (int k = 0; k < 3000; ++k) {
      // Rises, falls, and stays; few values, so that equal ones meet.
      const double step = static_cast<double>(random() % 7) - 3.0;
      values.push_back(k / 500 % 2 == 0 ? values.back() + step : values.back() + (k % 50 == 0 ? step : 0.0));
      range.add(values.back());
      const auto [low, high] = look(values, youngest, oldest);
      ASSERT_EQ(range.low(), low) << "ages " << youngest << " to " << oldest << ", value " << k;
      ASSERT_EQ(range.high(), high) << "ages " << youngest << " to " << oldest << ", value " << k;
      ASSERT_EQ(range.at(0), values.back());
      ASSERT_EQ(range.at(oldest), values[values.size() - 1 - oldest]);
      ASSERT_EQ(range.at(youngest), values[values.size() - 1 - youngest]);
    }
  }
}

TEST(SlidingRange, OutlastsItsCounter) {
  SlidingRange range(10, 300);
  for (int k = 0; k < 200'000; ++k) {
    range.add(k);
    ASSERT_EQ(range.low(), std::max(0, k - 300)) << k;
    ASSERT_EQ(range.high(), std::max(0, k - 10)) << k;
  }
}

TEST(RecentRange, IsThatOfLookingAtEveryValue) {
  std::mt19937 random(5);
  for (const std::size_t oldest : {0u, 1u, 14u, 15u, 16u, 17u, 63u, 90u, 600u}) {
    RecentRange range(oldest);
    for (int k = 0; k < 777; ++k) range.add(static_cast<double>(random() % 7));  // which is forgotten
    range.fill(0.5);
    std::vector<double> values(oldest + 1, 0.5);
    for (int k = 0; k < 3000; ++k) {
      values.push_back(values.back() + static_cast<double>(random() % 7) - 3.0);
      range.add(values.back());
      if (random() % 3 != 0) continue;
      const auto [low, high] = range.range();
      const auto begin = values.end() - static_cast<std::ptrdiff_t>(oldest) - 1;
      ASSERT_EQ(low, *std::min_element(begin, values.end())) << "age " << oldest << ", value " << k;
      ASSERT_EQ(high, *std::max_element(begin, values.end())) << "age " << oldest << ", value " << k;
      ASSERT_EQ(range.newest(), values.back());
      ASSERT_EQ(range.oldest(), *begin);
    }
  }
}

}  // namespace
}  // namespace jackal_aic
