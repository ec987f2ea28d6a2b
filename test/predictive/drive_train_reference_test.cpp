#include "jackal_aic/predictive/drive_train_reference.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/wheel_belief.hpp"

namespace jackal_aic {
namespace {

PlantModel driveTrain() {
  PlantModel model;
  model.dead_time = 0.08;
  model.lag = 0.04;
  model.acceleration_limit = 20.0;
  return model;
}

TEST(DriveTrainReference, InputMakesTheModelFollowThePath) {
  PlantModel model = driveTrain();
  model.dead_time = 0.0;
  model.velocity_loop_integral = 6.0;
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
  PlantModel model = driveTrain();
  model.lag = 0.0455;
  model.velocity_loop_integral = 8.0;
  model.acceleration_limit = 100.0;
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
  PlantModel model = driveTrain();
  model.velocity_loop_integral = 8.0;
  DriveTrainReference left(model, 0.098, 0.01, 0.02), right(model, 0.098, 0.01, 0.02);
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
