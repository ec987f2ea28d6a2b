#include "jackal_aic/aic/free_energy.hpp"

#include <gtest/gtest.h>

#include <random>

#include "jackal_aic/aic/generalized_motion.hpp"

namespace jackal_aic {
namespace {

/// A model with all variances different, a random belief, measurement and set point, for orders p.
struct Scene {
  explicit Scene(int p)
      : controller(gains(p)),
        model(controller, geometry),
        random(7),
        belief(draw<GeneralizedBody>(kBodySize, p)),
        set_point(draw<GeneralizedBody>(kBodySize, p)),
        measurement(draw<GeneralizedSensor>(kSensorSize, p)) {}

  static ControllerParameters gains(int p) {
    ControllerParameters controller;
    controller.orders = p;
    controller.tau = 0.3;
    controller.state_variances = {1.5, 2.0, 4.0, 8.0, 3.0, 5.0};
    controller.sensory_variances = {0.7, 2.0, 9.0, 1.1, 6.0, 2.5};
    return controller;
  }

  template <class Matrix>
  Matrix draw(int rows, int p) {
    return Matrix::NullaryExpr(rows, p + 1, [this] { return normal(random); });
  }

  double energy() const { return freeEnergy(model, predictionErrors(model, belief, measurement, set_point)); }

  GeometryParameters geometry;
  ControllerParameters controller;
  GenerativeModel model;
  std::mt19937 random;
  std::normal_distribution<double> normal;
  GeneralizedBody belief, set_point;
  GeneralizedSensor measurement;
};

class FreeEnergyOfOrder : public testing::TestWithParam<int> {};

TEST_P(FreeEnergyOfOrder, BeliefGradientIsTheDerivativeOfF) {
  Scene scene(GetParam());
  const GeneralizedBody gradient =
      beliefGradient(scene.model, predictionErrors(scene.model, scene.belief, scene.measurement, scene.set_point));
  for (Eigen::Index i = 0; i < scene.belief.size(); ++i) {
    const double centre = scene.belief(i);
    scene.belief(i) = centre + 1e-5;
    const double above = scene.energy();
    scene.belief(i) = centre - 1e-5;
    const double slope = (above - scene.energy()) / 2e-5;
    scene.belief(i) = centre;
    EXPECT_NEAR(gradient(i), slope, 1e-5 * std::max(1.0, std::abs(slope))) << "coordinate " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Orders, FreeEnergyOfOrder, testing::Range(0, kMaxOrders + 1));

TEST(FreeEnergy, ErrorsAreThoseOfThePaper) {
  Scene scene(2);
  const PredictionErrors errors = predictionErrors(scene.model, scene.belief, scene.measurement, scene.set_point);
  const double tau = scene.controller.tau;
  // (3-7): eps_mu = mu' - (mu_d - mu)/tau, eps_mu' = mu'' - (mu_d' - mu')/tau, mu''' = 0
  for (int i = 0; i < 3; ++i) {
    BodyVector next = BodyVector::Zero();
    if (i < 2) next = scene.belief.col(i + 1);
    const BodyVector expected = next - (scene.set_point.col(i) - scene.belief.col(i)) / tau;
    EXPECT_TRUE(errors.state.col(i).isApprox(expected, 1e-12)) << "order " << i;
    // (3-6)
    const SensorVector sensory = scene.measurement.col(i) - scene.model.sensory_map * scene.belief.col(i);
    EXPECT_TRUE(errors.sensory.col(i).isApprox(sensory, 1e-12)) << "order " << i;
  }
}

}  // namespace
}  // namespace jackal_aic
