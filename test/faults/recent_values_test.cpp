#include "jackal_aic/faults/recent_values.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace jackal_aic {
namespace {

TEST(RecentValues, HaveTheRangeOfTheAgesAskedFor) {
  std::mt19937 random(3);
  for (const std::size_t oldest : {0u, 1u, 7u, 250u}) {
    RecentValues recent(oldest);
    recent.fill(0.5);
    std::vector<double> values(oldest + 1, 0.5);  // the newest last
    for (int k = 0; k < 1000; ++k) {
      values.push_back(static_cast<double>(random() % 100));
      recent.add(values.back());
      const std::size_t from = random() % (oldest + 1), to = from + random() % (oldest + 1 - from);
      const auto at = [&](std::size_t age) { return values.end() - 1 - static_cast<std::ptrdiff_t>(age); };
      const Range range = recent.range(from, to);
      ASSERT_EQ(range.low, *std::min_element(at(to), at(from) + 1)) << k;
      ASSERT_EQ(range.high, *std::max_element(at(to), at(from) + 1)) << k;
      ASSERT_EQ(recent.at(from), *at(from)) << k;
    }
  }
}

}  // namespace
}  // namespace jackal_aic
