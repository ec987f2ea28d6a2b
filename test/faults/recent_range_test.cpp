#include "jackal_aic/faults/recent_range.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace jackal_aic {
namespace {

TEST(RecentRange, IsThatOfLookingAtEveryValue) {
  std::mt19937 random(5);
  for (const std::size_t oldest : {0u, 1u, 14u, 15u, 16u, 17u, 63u, 90u, 600u}) {
    RecentRange range(oldest);
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

TEST(RecentRange, FillingForgets) {
  RecentRange range(40);
  for (int k = 0; k < 25; ++k) range.add(k);
  range.fill(7.0);
  EXPECT_EQ(range.range().low, 7.0);
  EXPECT_EQ(range.range().high, 7.0);
  for (int k = 0; k < 40; ++k) range.add(9.0);
  EXPECT_EQ(range.range().low, 7.0);
  range.add(9.0);
  EXPECT_EQ(range.range().low, 9.0);
}

}  // namespace
}  // namespace jackal_aic
