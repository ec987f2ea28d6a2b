#include "latest.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

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

/// A value that is torn would have parts that differ.
struct Pair {
  long first = 0, second = 0;
};

TEST(Latest, NeverTearsAValueAndNeverGoesBack) {
  constexpr long kValues = 200000;
  Latest<Pair> latest;
  std::thread writer([&] {
    for (long i = 1; i <= kValues; ++i) latest.write({i, i});
  });
  long last = 0, reads = 0;
  while (last < kValues) {
    const Pair* value = latest.read();
    if (!value) continue;
    ++reads;
    ASSERT_EQ(value->first, value->second);
    ASSERT_GT(value->first, last);
    last = value->first;
  }
  writer.join();
  EXPECT_GT(reads, 0);
}

}  // namespace
}  // namespace jackal_aic
