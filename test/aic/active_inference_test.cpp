#include "jackal_aic/aic/active_inference.hpp"

#include <gtest/gtest.h>

namespace jackal_aic {
namespace {

/// Two states that a sensor sees together, of any number of orders.
template <class Model>
Model linked(int orders) {
  Model model;
  model.tau = 0.2;
  model.sensory_map.resize(3, 2);
  model.sensory_map << 1.0, 0.5, 0.0, 2.0, -1.0, 1.0;
  model.forward_model.resize(1, 3);
  model.forward_model << 1.0, 0.0, -0.5;
  model.state_precision.resize(2, orders + 1);
  model.sensory_precision.resize(3, orders + 1);
  for (int i = 0; i <= orders; ++i) {
    model.state_precision.col(i) << 1.0 / (1 + i), 2.0;
    model.sensory_precision.col(i) << 0.5, 1.0 / (1 + i), 0.1;
  }
  model.action_orders = orders;
  return model;
}

using Fixed = LinearModel<2, 3, 1>;
using Dynamic = LinearModel<Eigen::Dynamic, Eigen::Dynamic, Eigen::Dynamic>;

/// The linked model with a random belief, set point and measurement.
struct Scene {
  explicit Scene(int p)
      : model(linked<Fixed>(p)),
        mu(Fixed::Belief::Random(2, p + 1)),
        mu_d(Fixed::Belief::Random(2, p + 1)),
        y(Fixed::Measurement::Random(3, p + 1)) {}

  PredictionErrors<Fixed> errors() const { return predictionErrors(model, mu, y, mu_d); }

  Fixed model;
  Fixed::Belief mu, mu_d;
  Fixed::Measurement y;
};

TEST(ActiveInference, StepsStatesThatAreLinkedByTheWholeMap) {
  for (int p = 0; p <= kMaxOrders; ++p) {
    for (const Integrator integrator : {Integrator::exact, Integrator::euler}) {
      auto [model, mu, mu_d, y] = Scene(p);
      const BeliefUpdate update(model, 0.3, 0.01, integrator);
      const Fixed::Belief b = beliefDerivative(model, 0.3, model.still(), y, mu_d);
      const Eigen::Map<const Eigen::VectorXd> state(mu.data(), mu.size()), input(b.data(), b.size());
      const Eigen::VectorXd expected = update.transition() * state + update.inputTransition() * input;
      update.step(mu, y, mu_d);
      EXPECT_TRUE(expected.isApprox(state, 1e-13)) << "p " << p;
    }
  }
}

TEST(ActiveInference, IsTheSameOfSizesThatTheCompilerDoesNotKnow) {
  const InferenceGains gains{0.3, 4.0, 0.01, 0.02};
  ActiveInference<Fixed> fixed(linked<Fixed>(2), gains);
  ActiveInference<Dynamic> dynamic(linked<Dynamic>(2), gains);
  const Eigen::Vector2d goal(0.4, -0.3);
  fixed.setSetPoint(goal);
  dynamic.setSetPoint(goal);
  for (int k = 0; k < 20; ++k) {
    const Fixed::Measurement y = Fixed::Measurement::Random(3, 3);
    fixed.observe(y);
    dynamic.observe(y);
    if (k == 0) fixed.restartBelief();
    if (k == 0) dynamic.restartBelief();
    fixed.updateBelief();
    dynamic.updateBelief();
    EXPECT_NEAR(fixed.updateAction()(0), dynamic.updateAction()(0), 1e-12);
    EXPECT_TRUE(fixed.belief().isApprox(dynamic.belief(), 1e-12));
  }
  EXPECT_NEAR(freeEnergy(fixed.model(), fixed.errors()), freeEnergy(dynamic.model(), dynamic.errors()), 1e-9);
}

TEST(ActiveInference, ErrorsAreThoseOfThePaper) {
  const Scene scene(2);
  const PredictionErrors<Fixed> errors = scene.errors();
  // (3-7): eps_mu = mu' - (mu_d - mu)/tau, eps_mu' = mu'' - (mu_d' - mu')/tau, mu''' = 0
  for (int i = 0; i < 3; ++i) {
    Eigen::Vector2d next = Eigen::Vector2d::Zero();
    if (i < 2) next = scene.mu.col(i + 1);
    EXPECT_TRUE(errors.state.col(i).isApprox(next - (scene.mu_d.col(i) - scene.mu.col(i)) / 0.2, 1e-12)) << i;
    EXPECT_TRUE(errors.sensory.col(i).isApprox(scene.y.col(i) - scene.model.sensory_map * scene.mu.col(i), 1e-12)) << i;
  }
}

TEST(ActiveInference, BeliefGradientIsTheDerivativeOfTheFreeEnergy) {
  for (int p = 0; p <= kMaxOrders; ++p) {
    Scene scene(p);
    const Fixed::Belief gradient = beliefGradient(scene.model, scene.errors());
    for (Eigen::Index i = 0; i < scene.mu.size(); ++i) {
      const double centre = scene.mu(i);
      const auto energyAt = [&](double value) {
        scene.mu(i) = value;
        return freeEnergy(scene.model, scene.errors());
      };
      EXPECT_NEAR(gradient(i), (energyAt(centre + 1e-5) - energyAt(centre - 1e-5)) / 2e-5, 1e-5) << p << ", " << i;
      scene.mu(i) = centre;
    }
  }
}

TEST(ActiveInference, TheActionDescendsTheFreeEnergyOfItsOrders) {
  // eps_y falls by K' da in each of these orders (3-14, 3-15).
  auto model = linked<Fixed>(2);
  const Fixed::Measurement error = Fixed::Measurement::Random(3, 3);
  const auto energy = [&](double a) {
    double sum = 0.0;
    for (int i = 0; i <= model.action_orders; ++i) {
      const Eigen::Vector3d moved = error.col(i) + a * model.forward_model.transpose();
      sum += 0.5 * moved.dot(model.sensory_precision.col(i).cwiseProduct(moved));
    }
    return sum;
  };
  for (model.action_orders = 0; model.action_orders <= 2; ++model.action_orders) {
    EXPECT_NEAR(actionGradient(model, error)(0), (energy(1e-5) - energy(-1e-5)) / 2e-5, 1e-8);
  }
}

}  // namespace
}  // namespace jackal_aic
