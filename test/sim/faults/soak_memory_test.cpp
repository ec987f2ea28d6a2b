#include "soak_memory.hpp"

#include <gtest/gtest.h>

namespace jackal_aic::sim {
namespace {

TEST(SoakMemory, GrowsFromTheEndOfTheWarmUp) {
  SoakMemory memory(100.0);
  EXPECT_EQ(memory.growth(), 0.0);
  memory.add(3.0, 20.0);
  memory.add(9.0, 17.0);
  memory.add(11.0, 16.0);
  EXPECT_EQ(memory.growth(), 0.0) << "the peak was of the warm-up";
  memory.add(50.0, 17.5);
  memory.add(99.0, 17.25);
  EXPECT_EQ(memory.growth(), 0.5);
}

TEST(SoakMemory, BeginsWithTheFirstLookWhereThatComesAfterTheWarmUp) {
  SoakMemory memory(60.0);
  memory.add(8.0, 17.0);
  EXPECT_EQ(memory.growth(), 0.0);
  memory.add(16.0, 17.5);
  EXPECT_EQ(memory.growth(), 0.5);
}

}  // namespace
}  // namespace jackal_aic::sim
