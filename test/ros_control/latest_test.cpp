#include "latest.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <utility>

namespace jackal_aic {
namespace {

TEST(Latest, GivesEachValueOnceAndTheNewestOnly) {
  Latest<int> latest;
  EXPECT_EQ(latest.read(), nullptr);
  latest.write(1);
  latest.write(2);
  ASSERT_NE(latest.read(), nullptr);
  EXPECT_EQ(latest.read(), nullptr);
  latest.write(3);
  const int* value = latest.read();
  ASSERT_NE(value, nullptr);
  latest.write(4);
  latest.write(5);
  EXPECT_EQ(*value, 3) << "stays until the next read";
  EXPECT_EQ(*latest.read(), 5);
}

TEST(Latest, NeverTearsAValueAndNeverGoesBack) {
  constexpr long kValues = 200000;
  Latest<std::pair<long, long>> latest;
  std::thread writer([&] {
    for (long i = 1; i <= kValues; ++i) latest.write({i, i});
  });
  for (long last = 0; last < kValues;) {
    const auto* value = latest.read();
    if (!value) continue;
    ASSERT_EQ(value->first, value->second);
    ASSERT_GT(value->first, last);
    last = value->first;
  }
  writer.join();
}

}  // namespace
}  // namespace jackal_aic
