#include "manoeuvre.hpp"

#include <gtest/gtest.h>

namespace jackal_aic::sim {
namespace {

/// Rest, forward, faster and turning, rest.
ManoeuvreParameters driveAndTurn() { return {{1.0, 4.0, 2.0, 1.5}, {0.0, 0.5, 0.8, 0.0}, {0.0, 0.0, -0.3, 0.0}}; }

TEST(Manoeuvre, SegmentBeginsAtTheEndOfTheOneBefore) {
  const Manoeuvre manoeuvre(driveAndTurn());
  EXPECT_EQ(manoeuvre.segmentAt(-1.0), 0u);
  EXPECT_EQ(manoeuvre.segmentAt(0.999), 0u);
  EXPECT_EQ(manoeuvre.segmentAt(1.0), 1u);
  EXPECT_EQ(manoeuvre.segmentAt(4.999), 1u);
  EXPECT_EQ(manoeuvre.segmentAt(5.0), 2u);
  EXPECT_EQ(manoeuvre.segmentAt(7.0), 3u);
  EXPECT_EQ(manoeuvre.segmentAt(100.0), 3u);
  EXPECT_DOUBLE_EQ(manoeuvre.startOf(2), 5.0);
  EXPECT_DOUBLE_EQ(manoeuvre.duration(), 8.5);
}

TEST(Manoeuvre, SetPointsAreThoseOfTheSegments) {
  const Manoeuvre manoeuvre(driveAndTurn());
  EXPECT_EQ(manoeuvre.setPoint(2).forward, 0.8);
  EXPECT_EQ(manoeuvre.setPoint(2).lateral, 0.0);
  EXPECT_EQ(manoeuvre.setPoint(2).yaw_rate, -0.3);
}

TEST(Manoeuvre, StepsStartFromTheSetPointBeforeAndLeaveOutTheReturnToRest) {
  const auto steps = Manoeuvre(driveAndTurn()).steps();
  ASSERT_EQ(steps.size(), 3u);
  EXPECT_EQ(steps[0].name, "0.5 m/s");
  EXPECT_EQ(steps[0].segment, 1u);
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

TEST(Manoeuvre, ListsOfDifferentLengthAreRefusedByName) {
  ManoeuvreParameters parameters = driveAndTurn();
  parameters.yaw_rate.pop_back();
  try {
    Manoeuvre manoeuvre(parameters);
    FAIL() << "accepted";
  } catch (const ParameterError& error) {
    EXPECT_STREQ(error.what(), "manoeuvre.yaw_rate: has 3 values; manoeuvre.durations has 4");
  }
}

TEST(Manoeuvre, SegmentTooShortToAssessIsRefused) {
  ParameterMap map;
  map.set("manoeuvre.durations", std::vector<double>{1.0, 0.4});
  map.set("manoeuvre.forward", std::vector<double>{0.0, 0.5});
  map.set("manoeuvre.yaw_rate", std::vector<double>{0.0, 0.0});
  EXPECT_THROW(readParameters<ManoeuvreParameters>(map, "manoeuvre"), ParameterError);
}

}  // namespace
}  // namespace jackal_aic::sim
