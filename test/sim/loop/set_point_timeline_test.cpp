#include "set_point_timeline.hpp"

#include <gtest/gtest.h>

namespace jackal_aic::sim {
namespace {

/// Rest, forward, faster and turning, rest.
ManoeuvreParameters driveAndTurn() { return {{1.0, 4.0, 2.0, 1.5}, {0.0, 0.5, 0.8, 0.0}, {0.0, 0.0, -0.3, 0.0}}; }

TEST(SetPointTimeline, SetPointHoldsFromTheEndOfTheOneBefore) {
  const SetPointTimeline timeline = timelineOf(driveAndTurn());
  for (const auto& [time, changes] :
       {std::pair(-1.0, 0u), std::pair(0.999, 1u), std::pair(1.0, 2u), std::pair(4.999, 2u), std::pair(5.0, 3u),
        std::pair(7.0, 4u), std::pair(100.0, 4u)}) {
    EXPECT_EQ(timeline.changesUntil(time), changes) << time;
  }
  EXPECT_DOUBLE_EQ(timeline.changes[2].time, 5.0);
  EXPECT_DOUBLE_EQ(timeline.duration, 8.5);
  EXPECT_TRUE(timeline.at(-1.0).vector().isZero(0.0));
  EXPECT_EQ(timeline.at(5.5).vector(), BodyVector(0.8, 0.0, -0.3));
}

TEST(SetPointTimeline, StepsStartFromTheSetPointBeforeAndLeaveOutTheReturnToRest) {
  const struct {
    const char* name;
    std::size_t change;
    BodyChannel channel;
    double initial, set_point;
  } rows[] = {
      {"0.5 m/s", 1, kForward, 0.0, 0.5}, {"0.8 m/s", 2, kForward, 0.5, 0.8}, {"-0.3 rad/s", 2, kYaw, 0.0, -0.3}};
  const auto steps = timelineOf(driveAndTurn()).steps();
  ASSERT_EQ(steps.size(), std::size(rows));
  for (std::size_t i = 0; i < steps.size(); ++i) {
    EXPECT_EQ(steps[i].name, rows[i].name);
    EXPECT_EQ(steps[i].change, rows[i].change);
    EXPECT_EQ(steps[i].channel, rows[i].channel);
    EXPECT_EQ(steps[i].initial, rows[i].initial);
    EXPECT_EQ(steps[i].set_point, rows[i].set_point);
  }
}

TEST(SetPointTimeline, ListsOfDifferentLengthAreRefusedByName) {
  ManoeuvreParameters parameters = driveAndTurn();
  parameters.yaw_rate.pop_back();
  try {
    timelineOf(parameters);
    FAIL() << "accepted";
  } catch (const ParameterError& error) {
    EXPECT_STREQ(error.what(), "manoeuvre.yaw_rate: has 3 values; manoeuvre.durations has 4");
  }
}

TEST(SetPointTimeline, SegmentTooShortToAssessIsRefused) {
  ParameterMap map;
  map.set("manoeuvre.durations", std::vector<double>{1.0, 0.4});
  map.set("manoeuvre.forward", std::vector<double>{0.0, 0.5});
  map.set("manoeuvre.yaw_rate", std::vector<double>{0.0, 0.0});
  EXPECT_THROW(readParameters<ManoeuvreParameters>(map, "manoeuvre"), ParameterError);
}

}  // namespace
}  // namespace jackal_aic::sim
