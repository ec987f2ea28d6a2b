#include "kalman_filter.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

namespace jackal_aic::sim {
namespace {

Eigen::MatrixXd scalar(double value) { return Eigen::MatrixXd::Constant(1, 1, value); }

TEST(PredictionCovariance, OfARandomWalkIsTheClosedFormSolution) {
  // P = P - P^2/(P + R) + Q has the positive root Q/2 + sqrt(Q^2/4 + Q R).
  const double q = 0.3, r = 2.0;
  const double p = predictionCovariance(scalar(1.0), scalar(1.0), scalar(q), scalar(r))(0, 0);
  EXPECT_NEAR(p, 0.5 * q + std::sqrt(0.25 * q * q + q * r), 1e-12);
}

TEST(PredictionCovariance, SolvesTheRiccatiEquation) {
  Eigen::MatrixXd a(3, 3), c(2, 3), q = Eigen::MatrixXd::Identity(3, 3), r(2, 2);
  a << 0.9, 0.2, 0.0, -0.1, 1.0, 0.3, 0.0, 0.0, 1.0;
  c << 1.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  r << 0.5, 0.1, 0.1, 0.4;
  const Eigen::MatrixXd p = predictionCovariance(a, c, q, r);
  const Eigen::MatrixXd gain = p * c.transpose() * (c * p * c.transpose() + r).inverse();
  const Eigen::MatrixXd next = a * (p - gain * c * p) * a.transpose() + q;
  EXPECT_LT((next - p).norm(), 1e-10 * p.norm());
}

TEST(PredictionCovariance, RefusesWhatHasNoSteadyState) {
  EXPECT_THROW(predictionCovariance(scalar(1.1), scalar(0.0), scalar(1.0), scalar(1.0)), ParameterError);
}

/// A plant with integral action, which the filter needs.
PlantModel model() {
  PlantModel m;
  m.dead_time = 0.03;
  m.lag = 0.04;
  m.velocity_loop_integral = 2.0;
  m.acceleration_limit = 1000.0;
  m.effective_track = 0.5;
  return m;
}

/// Estimate after 2 s of the same command and measurement.
BodyVector estimate(SteadyStateKalmanFilter filter, const WheelCommand& command, const Observation& observation) {
  for (int k = 0; k < 2000; ++k) {
    filter.predict(command);
    if (k % 20 == 19) filter.correct(observation);
  }
  return filter.velocity();
}

TEST(KalmanFilter, FollowsTheMeasurementsOfASteadyDrive) {
  const GeometryParameters geometry;
  const double r = geometry.wheel_radius;
  Observation y;
  y.wheel_left = 4.0;
  y.wheel_right = 6.0;
  y.yaw_rate = r * 2.0 / 0.5;
  const BodyVector velocity = estimate({PredictiveParameters{}, geometry, model()}, {4.0, 6.0}, y);
  EXPECT_NEAR(velocity(kForward), 5.0 * r, 1e-3);
  EXPECT_NEAR(velocity(kYaw), 2.0 * r / 0.5, 1e-3);
}

TEST(KalmanFilter, ExplainsAGainErrorByTheDisturbance) {
  Observation y;
  y.wheel_left = y.wheel_right = 4.0;
  const BodyVector velocity = estimate({PredictiveParameters{}, GeometryParameters{}, model()}, {5.0, 5.0}, y);
  EXPECT_NEAR(velocity(kForward), 4.0 * GeometryParameters{}.wheel_radius, 1e-3);
}

TEST(KalmanFilter, ListensToTheGyroUnlessOnABox) {
  Observation turning;
  turning.yaw_rate = 0.2;
  PlantModel box = model();
  box.on_box = true;
  EXPECT_GT(estimate({PredictiveParameters{}, GeometryParameters{}, model()}, {}, turning)(kYaw), 0.05);
  EXPECT_NEAR(estimate({PredictiveParameters{}, GeometryParameters{}, box}, {}, turning)(kYaw), 0.0, 1e-9);
}

TEST(KalmanFilter, SeesACommandAfterTheDeadTime) {
  SteadyStateKalmanFilter filter(PredictiveParameters{}, GeometryParameters{}, model());
  for (int k = 0; k < 30; ++k) filter.predict({5.0, 5.0});
  EXPECT_EQ(filter.velocity()(kForward), 0.0);
  filter.predict({5.0, 5.0});
  EXPECT_GT(filter.velocity()(kForward), 0.0);
}

}  // namespace
}  // namespace jackal_aic::sim
