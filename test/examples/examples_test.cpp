// The programs of src/examples, as users run them.

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <string>

namespace jackal_aic {
namespace {

/// What a program prints; it has to end well.
std::string outputOf(const std::string& program) {
  FILE* pipe = popen((std::string(JACKAL_AIC_EXAMPLES) + "/" + program).c_str(), "r");
  if (pipe == nullptr) return "";
  std::string output;
  std::array<char, 256> line{};
  while (fgets(line.data(), static_cast<int>(line.size()), pipe) != nullptr) output += line.data();
  EXPECT_EQ(pclose(pipe), 0) << program;
  return output;
}

TEST(Examples, TheControllerReachesItsSetPoint) {
  const std::string output = outputOf("controller_loop");
  EXPECT_NE(output.find("0.0 s: 0.000 m/s"), std::string::npos) << output;
  EXPECT_NE(output.find("3.0 s: 0.50"), std::string::npos) << output;
}

TEST(Examples, AFailingEncoderIsNamedAndTheRobotDrivesOn) {
  const std::string output = outputOf("failing_sensor");
  EXPECT_NE(output.find("driving\n"), std::string::npos) << output;
  EXPECT_NE(output.find("driving: left encoder"), std::string::npos) << output;
}

TEST(Examples, TheTunedGainKeepsTheMarginsThatWereWanted) {
  const std::string output = outputOf("certify_and_tune");
  double gain = 0.0, gain_margin = 0.0, delay_margin = 0.0;
  const std::size_t line = output.find("kappa_a = ", output.find('\n'));
  ASSERT_NE(line, std::string::npos) << output;
  ASSERT_EQ(std::sscanf(output.c_str() + line, "kappa_a = %lf keeps a gain margin of %lf and a delay margin of %lf",
                        &gain, &gain_margin, &delay_margin),
            3)
      << output;
  EXPECT_GE(gain_margin, 2.0);
  EXPECT_GE(delay_margin, 0.05);
}

TEST(Examples, TheMecanumRobotReachesItsSetPoint) {
  const std::string output = outputOf("mecanum");
  EXPECT_NE(output.find("0.0 s: 0.000 m/s, 0.000 m/s, 0.000 rad/s"), std::string::npos) << output;
  double forward = 0.0, lateral = 0.0, turn = 0.0;
  const std::size_t last = output.find("3.0 s: ");
  ASSERT_NE(last, std::string::npos) << output;
  ASSERT_EQ(std::sscanf(output.c_str() + last, "3.0 s: %lf m/s, %lf m/s, %lf", &forward, &lateral, &turn), 3);
  EXPECT_NEAR(forward, 0.3, 0.01);
  EXPECT_NEAR(lateral, 0.2, 0.01);
  EXPECT_NEAR(turn, 0.4, 0.01);
}

}  // namespace
}  // namespace jackal_aic
