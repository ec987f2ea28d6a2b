// What the belief tick is compared with computes the same, and the ticks do not grow unnoticed.

#include "ticks.hpp"

#include <gtest/gtest.h>

#include <string>

#include "../../command.hpp"

namespace jackal_aic::benchmark {
namespace {

class Comparisons : public testing::TestWithParam<int> {
 protected:
  Comparisons()
      : drive_(improvedParameters(GetParam())),
        gains_(std::get<ControllerParameters>(drive_.controller)),
        model_(gains_, drive_.geometry),
        y_(GeneralizedSensor::Random(kSensorSize, GetParam() + 1)),
        mu_d_(GeneralizedBody::Zero(kBodySize, GetParam() + 1)),
        belief_(GeneralizedBody::Random(kBodySize, GetParam() + 1)) {
    mu_d_.col(0) << 0.5, 0.0, 0.2;
  }

  DriveParameters drive_;
  ControllerParameters gains_;
  GenerativeModel model_;
  GeneralizedSensor y_;
  GeneralizedBody mu_d_, belief_;
};

TEST_P(Comparisons, TheTranscriptionIsOurEulerStep) {
  const BeliefUpdate euler(model_, gains_.kappa_mu, gains_.beliefStep(), Integrator::euler);
  const Transcription transcription(gains_, drive_.geometry);
  Eigen::VectorXd mu = Eigen::Map<const Eigen::VectorXd>(belief_.data(), belief_.size());
  for (int k = 0; k < 3; ++k) {
    euler.step(belief_, y_, mu_d_);
    transcription.step(mu, Eigen::Map<const Eigen::VectorXd>(y_.data(), y_.size()),
                       Eigen::Map<const Eigen::VectorXd>(mu_d_.data(), mu_d_.size()));
  }
  const Eigen::Map<const Eigen::VectorXd> ours(belief_.data(), belief_.size());
  EXPECT_TRUE(mu.isApprox(ours, 1e-12)) << mu.transpose() << "\n" << ours.transpose();
}

TEST_P(Comparisons, TheBoundIsOurExactStepOfForwardSpeedAndYawRate) {
  const BeliefUpdate exact(model_, gains_.kappa_mu, gains_.beliefStep(), Integrator::exact);
  const auto compare = [&](auto bound) {
    bound.fill(exact, y_, mu_d_, belief_);
    for (int k = 0; k < 10; ++k) {
      exact.step(belief_, y_, mu_d_);
      bound.step();
    }
    for (int i = 0; i <= GetParam(); ++i) {
      EXPECT_NEAR(bound.forward.order(i), belief_(kForward, i), 1e-12 * (1.0 + std::abs(belief_(kForward, i))));
      EXPECT_NEAR(bound.yaw_rate.order(i), belief_(kYaw, i), 1e-12 * (1.0 + std::abs(belief_(kYaw, i))));
    }
  };
  GetParam() == 3 ? compare(LowerBound<4>()) : compare(LowerBound<6>());
}

INSTANTIATE_TEST_SUITE_P(Orders, Comparisons, testing::Values(3, 5));

TEST(Ticks, OfTheMonitorAreThoseOfAHealthyRobot) {
  MonitorCheckTick tick;
  for (int i = 0; i < 2000; ++i) tick();
  EXPECT_FALSE(tick.report().faulty()) << tick.report().reason();
  EXPECT_TRUE(tick.report().valid().all());
}

TEST(Ticks, HaveNotGrown) {
  const std::string command =
      "/usr/bin/python3 " JACKAL_AIC_SOURCE_DIR "/sim/benchmark/instructions.py " JACKAL_AIC_TICK_INSTRUCTIONS;
  const auto [said, status] = runCommand(command);
  constexpr int kNothingToCompare = 77;
  if (status == kNothingToCompare) GTEST_SKIP() << said;
  EXPECT_EQ(status, 0) << said;
}

}  // namespace
}  // namespace jackal_aic::benchmark
