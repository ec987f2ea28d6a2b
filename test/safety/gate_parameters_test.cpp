#include "jackal_aic/safety/gate_parameters.hpp"

#include <gtest/gtest.h>

#include <string>

#include "../complaint.hpp"

namespace jackal_aic {
namespace {

std::string refusal(const std::string& key, double value) {
  ParameterMap map;
  map.set(key, value);
  return complaint([&] { readGateParameters(map); });
}

TEST(GateParameters, ZeroDisablesADeadline) {
  for (const char* key : {"deadlines.set_point", "deadlines.wheels", "deadlines.imu", "deadlines.feedback",
                          "deadlines.frozen_wheels", "deadlines.frozen_imu"}) {
    EXPECT_EQ(refusal(key, 0.0), "") << key;
    EXPECT_NE(refusal(key, -0.1).find(key), std::string::npos) << key;
  }
}

TEST(GateParameters, BrakeKeepsAGivenDecelerationAndIsElseFree) {
  EXPECT_EQ(refusal("limits.linear_acceleration", 1.0), "");
  EXPECT_EQ(refusal("limits.angular_acceleration", 1.0), "");
  EXPECT_EQ(refusal("brake.linear_deceleration", 21.0), "");
  EXPECT_EQ(refusal("limits.linear_deceleration", 3.0), "");
  EXPECT_NE(refusal("limits.linear_deceleration", 2.5)
                .find("brake.linear_deceleration = 3: must be at most limits.linear_deceleration = 2.5"),
            std::string::npos);
  EXPECT_NE(refusal("limits.angular_deceleration", 5.0).find("limits.angular_deceleration = 5"), std::string::npos);
  ParameterMap map;
  map.set("limits.linear_deceleration", 4.0);
  map.set("brake.time", 0.15);
  EXPECT_THROW(readGateParameters(map), ParameterError) << "2 m/s need 0.5 s";
}

}  // namespace
}  // namespace jackal_aic
