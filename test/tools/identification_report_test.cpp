#include "identification_report.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "../complaint.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "jackal_aic/model/plant_model.hpp"

namespace jackal_aic {
namespace {

/// What a report is made of, without a track.
Identification foundDriveTrain() {
  Identification result;
  result.dead_time = {0.12, 0.001, ""};
  result.lag = {0.05, 0.002, ""};
  result.gain = {0.97, 0.003, ""};
  result.acceleration_limit = {3.2, 0.0, "never reached; at least the largest acceleration seen"};
  return result;
}

/// The plant model of a report, as a parameter file has it.
ParameterMap written(const Identification& result, const std::string& bag = "drive.bag") {
  ParameterMap map;
  addYamlText(plantModelYaml(result, {bag, "", ""}), "plant_model.yaml", map);
  return map;
}

TEST(IdentificationReport, YamlSaysWhereItComesFrom) {
  Identification result = foundDriveTrain();
  result.offset = {0.5, 0.02, ""};
  result.r_squared = 0.98765;
  result.remarks = {"cut: 2.0 s of driving that the commands do not explain"};
  expectSays(
      plantModelYaml(result, {"drive.bag", "2022-05-17 14:03 UTC", "my Jackal"}),
      {"drive.bag", "2022-05-17 14:03 UTC", "my Jackal", "R^2 0.9877", "0.5000 +- 0.0200", "# cut: 2.0 s of driving"});
  expectSays(identificationTable(result), {"R^2"});
  EXPECT_FALSE(written(result, "of\nlimits: {linear_speed: 9.0}\n.bag").hasSection("limits"))
      << "its name stays in its comment";
}

TEST(IdentificationReport, AnOffsetThatMayBeNoneIsNotWritten) {
  Identification result = foundDriveTrain();
  for (const Estimate& offset :
       {Estimate{0.04, 0.05, ""}, Estimate{-0.2, 0.05, ""}, Estimate{0.2, 0.0, "the commands are of one speed only"}}) {
    result.offset = offset;
    ParameterMap map = written(result);
    const auto model = readParameters<PlantModel>(map, "plant_model");
    EXPECT_EQ(model.offset, 0.0) << offset.value;
    EXPECT_EQ(model.offset_half_width, 0.0) << offset.value;
  }
}

TEST(IdentificationReport, YamlHoldsTheEstimates) {
  Identification result = foundDriveTrain();
  result.offset = {0.48, 0.02, ""};
  result.sensor_rate = 20.0;
  result.track_left = {0.55, 0.01, ""};
  result.track_right = {0.0, 0.0, "no turn to the right"};
  ParameterMap map = written(result);
  for (const auto& [key, value] : {std::pair("dead_time", 0.12),
                                   {"lag", 0.05},
                                   {"gain", 0.97},
                                   {"acceleration_limit", 3.2},
                                   {"effective_track", 0.55},
                                   {"dead_time_half_width", 0.001},
                                   {"lag_half_width", 0.002},
                                   {"gain_half_width", 0.003},
                                   {"offset", 0.48},
                                   {"sensor_rate", 20.0},
                                   {"offset_half_width", 0.02}}) {
    EXPECT_DOUBLE_EQ(std::get<double>(*map.take(std::string("plant_model.") + key)), value) << key;
  }
  expectSays(identificationTable(result), {"no turn to the right"});
  result.gain.unknown = "the recording does not depend on it";
  EXPECT_THROW(plantModelYaml(result, {"drive.bag", "", ""}), IdentificationError);
}

}  // namespace
}  // namespace jackal_aic
