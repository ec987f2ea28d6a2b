#include "set_point_timeline.hpp"

#include <gtest/gtest.h>

namespace jackal_aic::sim {
namespace {

/// Rest, forward, faster and turning, rest.
ManoeuvreParameters driveAndTurn() { return {{1.0, 4.0, 2.0, 1.5}, {0.0, 0.5, 0.8, 0.0}, {0.0, 0.0, -0.3, 0.0}}; }

TEST(SetPointTimeline, ASetPointHoldsFromTheEndOfTheOneBefore) {
  const SetPointTimeline timeline = timelineOf(driveAndTurn());
  EXPECT_EQ(timeline.changesUntil(-1.0), 0u);
  EXPECT_EQ(timeline.changesUntil(0.999), 1u);
  EXPECT_EQ(timeline.changesUntil(1.0), 2u);
  EXPECT_EQ(timeline.changesUntil(4.999), 2u);
  EXPECT_EQ(timeline.changesUntil(5.0), 3u);
  EXPECT_EQ(timeline.changesUntil(7.0), 4u);
  EXPECT_EQ(timeline.changesUntil(100.0), 4u);
  EXPECT_DOUBLE_EQ(timeline.changes[2].time, 5.0);
  EXPECT_DOUBLE_EQ(timeline.duration, 8.5);
}

TEST(SetPointTimeline, SetPointsAreThoseOfTheSegmentsAndRestBeforeThem) {
  const SetPointTimeline timeline = timelineOf(driveAndTurn());
  EXPECT_TRUE(timeline.at(-1.0).vector().isZero(0.0));
  EXPECT_EQ(timeline.at(5.5).forward, 0.8);
  EXPECT_EQ(timeline.at(5.5).lateral, 0.0);
  EXPECT_EQ(timeline.at(5.5).yaw_rate, -0.3);
}

TEST(SetPointTimeline, StepsStartFromTheSetPointBeforeAndLeaveOutTheReturnToRest) {
  const auto steps = timelineOf(driveAndTurn()).steps();
  ASSERT_EQ(steps.size(), 3u);
  EXPECT_EQ(steps[0].name, "0.5 m/s");
  EXPECT_EQ(steps[0].change, 1u);
  EXPECT_EQ(steps[0].channel, kForward);
  EXPECT_EQ(steps[0].initial, 0.0);
  EXPECT_EQ(steps[0].set_point, 0.5);
  EXPECT_EQ(steps[1].channel, kForward);
  EXPECT_EQ(steps[1].initial, 0.5);
  EXPECT_EQ(steps[1].set_point, 0.8);
  EXPECT_EQ(steps[2].name, "-0.3 rad/s");
  EXPECT_EQ(steps[2].channel, kYaw);
  EXPECT_EQ(steps[2].initial, 0.0);
  EXPECT_EQ(steps[2].set_point, -0.3);
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
