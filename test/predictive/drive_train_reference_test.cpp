#include "jackal_aic/predictive/drive_train_reference.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/wheel_belief.hpp"

namespace jackal_aic {
namespace {

/// Without a dead time. @param integral of the velocity loop [1/s].
PlantModel driveTrain(double lag, double integral, double acceleration_limit) {
  return {0.0, lag, 1.0, 0.0, integral, acceleration_limit};
}

TEST(DriveTrainReference, InputMakesTheModelFollowThePath) {
  const PlantModel model = driveTrain(0.04, 6.0, 20.0);
  DriveTrainReference reference(model, 0.098, 0.05, 0.02);
  WheelBelief wheel(model, 0.098, {});
  double path = 0.0;
  for (int k = 0; k < 100; ++k) {
    const double r = reference.advance(5.0);
    path += -std::expm1(-0.02 / 0.05) * (5.0 - path);
    for (int i = 0; i < 20; ++i) wheel.predict(r);
    EXPECT_NEAR(wheel.speed(), path, 0.01) << "period " << k;
  }
}

TEST(DriveTrainReference, InputOfLimitedChangeEndsInTime) {
  const PlantModel model = driveTrain(0.0455, 8.0, 100.0);
  for (const double largest_change : {1.4, 3.0}) {
    for (const bool in_time : {false, true}) {
      DriveTrainReference path(model, 0.098, 0.01, 0.02);
      double before = 0.0, fastest = 0.0;
      int settled = 0;
      for (int k = 0; k < 60; ++k) {
        const double wanted = path.input(6.0);
        const double r = in_time ? path.inTime(6.0, wanted, largest_change) : wanted;
        before += std::clamp(r - before, -largest_change, largest_change);
        path.take(before);
        fastest = std::max(fastest, path.speed());
        if (std::abs(path.speed() - 6.0) > 0.3) settled = k + 1;
      }
      EXPECT_EQ(fastest > 6.1, !in_time) << largest_change << ", " << fastest;
      if (in_time) {
        EXPECT_LT(0.02 * settled, 0.02 * 6.0 / largest_change + 0.15) << largest_change;
      }
    }
  }
}

TEST(DriveTrainReference, NearlyEqualWheelsStayTogetherAtTheLimit) {
  DriveTrainReference left(driveTrain(0.04, 8.0, 20.0), 0.098, 0.01, 0.02), right(left);
  right.reset(1e-3);
  for (int k = 0; k < 5; ++k) {
    // A gate lets through all but a hair of what one wheel asks for at the limit.
    left.advance(20.0);
    right.advance(20.0);
    left.amend(1e-6);
    right.amend(-1e-6);
  }
  EXPECT_NEAR(left.advance(20.0), right.advance(20.0), 0.05);
}

}  // namespace
}  // namespace jackal_aic
