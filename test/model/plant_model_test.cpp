#include "jackal_aic/model/plant_model.hpp"

#include <gtest/gtest.h>

namespace jackal_aic {
namespace {

TEST(PlantModel, HasNoEffectiveTrackOrOneThatARobotMayHave) {
  const auto read = [](double track) {
    ParameterMap map;
    map.set("plant_model.dead_time", 0.1);
    map.set("plant_model.lag", 0.02);
    map.set("plant_model.effective_track", track);
    return readPlantModel(map).effective_track;
  };
  for (const double track : {0.0, 0.05, 0.55, 5.0}) EXPECT_EQ(read(track), track);
  for (const double track : {1e-300, 0.001, 0.0499, 5.1, -0.1}) EXPECT_THROW(read(track), ParameterError) << track;
}

TEST(ConfidenceBox, HasACornerForEveryEndOfTheIntervals) {
  PlantModel model;
  EXPECT_EQ(confidenceBox(model).size(), 1U) << "no interval is stated";
  model.dead_time_half_width = 0.01;
  model.gain_half_width = 0.05;
  const std::vector<PlantModel> corners = confidenceBox(model);
  ASSERT_EQ(corners.size(), 4U);
  int early = 0, weak = 0;
  for (const PlantModel& corner : corners) {
    EXPECT_NEAR(std::abs(corner.dead_time - model.dead_time), 0.01, 1e-12);
    EXPECT_NEAR(std::abs(corner.gain - model.gain), 0.05, 1e-12);
    EXPECT_EQ(corner.lag, model.lag);
    early += corner.dead_time < model.dead_time;
    weak += corner.gain < model.gain;
  }
  EXPECT_EQ(early, 2);
  EXPECT_EQ(weak, 2);
}

TEST(ConfidenceBox, StaysWithinWhatAModelMayBe) {
  PlantModel model;
  model.dead_time_half_width = model.lag_half_width = model.offset_half_width = 0.5;
  model.gain_half_width = 2.0;
  model.offset = 0.3;
  for (const PlantModel& corner : confidenceBox(model)) {
    EXPECT_GE(corner.dead_time, 0.0);
    EXPECT_GE(corner.lag, 0.0);
    EXPECT_GE(corner.gain, 0.1);
    EXPECT_GE(corner.offset, 0.0);
  }
}

}  // namespace
}  // namespace jackal_aic
