#include "jackal_aic/gate_parameters.hpp"

#include <gtest/gtest.h>

#include <string>

namespace jackal_aic {
namespace {

std::string refusal(const std::string& key, double value) {
  ParameterMap map;
  map.set(key, value);
  try {
    readGateParameters(map);
  } catch (const ParameterError& error) {
    return error.what();
  }
  return "";
}

TEST(GateParameters, DefaultsAreThoseOfTheStockJackal) {
  ParameterMap map;
  const GateParameters parameters = readGateParameters(map);
  EXPECT_EQ(parameters.limits.linear_speed, 2.0);
  EXPECT_EQ(parameters.limits.linear_acceleration, 20.0);
  EXPECT_EQ(parameters.limits.angular_speed, 4.0);
  EXPECT_EQ(parameters.limits.angular_acceleration, 25.0);
}

TEST(GateParameters, ZeroSwitchesADeadlineOff) {
  for (const char* key : {"deadlines.set_point", "deadlines.wheels", "deadlines.imu", "deadlines.feedback",
                          "deadlines.frozen_wheels", "deadlines.frozen_imu"}) {
    EXPECT_EQ(refusal(key, 0.0), "") << key;
    EXPECT_NE(refusal(key, -0.1).find(key), std::string::npos) << key;
  }
}

TEST(GateParameters, TheBrakeMustKeepTheAccelerationLimits) {
  EXPECT_NE(refusal("brake.linear_deceleration", 21.0).find("limits.linear_acceleration = 20"), std::string::npos);
  EXPECT_NE(refusal("brake.angular_deceleration", 26.0).find("limits.angular_acceleration = 25"), std::string::npos);
  EXPECT_NE(refusal("limits.linear_acceleration", 1.0), "") << "2 m/s need 2 s";
  EXPECT_NE(refusal("brake.time", 0.15).find("brake.time = 0.15 s: must be at least"), std::string::npos) << "4 rad/s";
  EXPECT_EQ(refusal("brake.time", 0.2), "");
}

}  // namespace
}  // namespace jackal_aic
