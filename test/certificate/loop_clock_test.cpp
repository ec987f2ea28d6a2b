#include "jackal_aic/certificate/loop_clock.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace jackal_aic {
namespace {

constexpr std::int64_t kMillisecond = 1000000;

/// 50 Hz action, 25 Hz sensor, 100 Hz belief with inner steps of 5 ms: a period of 40 ms.
constexpr LoopClock kClock{20 * kMillisecond, 2, 1, 4, 8};

TEST(LoopClock, SensorComesFirstAndActionLastAtEqualTimes) {
  const auto events = kClock.events(0, 0);
  ASSERT_EQ(events.size(), 2u + 1u + 4u + 8u);
  EXPECT_TRUE(std::is_sorted(events.begin(), events.end()));
  const std::size_t last = events.size() - 4;
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(events[last + i].first, 40 * kMillisecond);
  EXPECT_EQ(events[last].second, LoopEvent::sensor);
  EXPECT_EQ(events[last + 1].second, LoopEvent::predict);
  EXPECT_EQ(events[last + 2].second, LoopEvent::belief);
  EXPECT_EQ(events[last + 3].second, LoopEvent::action);
}

TEST(LoopClock, PhaseAdvancesSamplesAndDeadTimeDelaysCommands) {
  std::vector<std::int64_t> samples, commands;
  for (const auto& [time, event] : kClock.events(7 * kMillisecond, 3 * kMillisecond)) {
    if (event == LoopEvent::sensor) samples.push_back(time);
    if (event == LoopEvent::command_arrives) commands.push_back(time);
  }
  EXPECT_EQ(samples, std::vector<std::int64_t>{37 * kMillisecond});
  EXPECT_EQ(commands, (std::vector<std::int64_t>{7 * kMillisecond, 27 * kMillisecond}));
}

}  // namespace
}  // namespace jackal_aic
