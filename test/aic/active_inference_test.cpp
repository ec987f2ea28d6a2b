#include "jackal_aic/aic/active_inference.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "jackal_aic/aic/belief_update.hpp"
#include "jackal_aic/aic/free_energy.hpp"

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
      const Fixed::Belief euler = mu + 0.01 * beliefDerivative(model, 0.3, mu, y, mu_d);  // (3-16)
      update.step(mu, y, mu_d);
      EXPECT_TRUE(expected.isApprox(state, 1e-13)) << "p " << p;
      EXPECT_EQ(mu.isApprox(euler, 1e-13), integrator == Integrator::euler) << "p " << p;
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

ControllerParameters gains(int p, double tau, double kappa_mu) {
  ControllerParameters controller;
  controller.orders = p;
  controller.tau = tau;
  controller.kappa_mu = kappa_mu;
  controller.state_variances = {1.5, 2.0, 4.0, 8.0, 16.0, 32.0};
  controller.sensory_variances = {2.0, 2.0, 1e5, 1e5, 1e5, 1e5};
  return controller;
}

TEST(BeliefUpdate, ExactEqualsTheAnalyticSolutionForOrderZero) {
  // p = 0, lateral speed: nothing is measured, so mu' = -kappa_mu Pi_mu / tau^2 (mu - mu_d).
  const double tau = 0.1, kappa_mu = 0.2, h = 0.05;
  const GenerativeModel model(gains(0, tau, kappa_mu), {});
  const BeliefUpdate update(model, kappa_mu, h, Integrator::exact);
  GeneralizedBody mu = model.still();
  const GeneralizedBody mu_d = BodyVector(0.0, 1.0, 0.0);
  const double rate = kappa_mu / 1.5 / (tau * tau);
  for (int k = 1; k <= 20; ++k) {
    update.step(mu, model.silence(), mu_d);
    EXPECT_NEAR(mu(kLateral, 0), 1.0 - std::exp(-rate * k * h), 1e-12);
  }
}

TEST(BeliefUpdate, IsDissipativeAndStableForEveryGainOfTheThesis) {
  for (double tau : {0.03, 0.01, 0.005, 0.001, 0.0002}) {
    for (double kappa_mu : {0.01, 0.05, 0.1, 1.0, 3.0}) {
      SCOPED_TRACE(testing::Message() << "tau " << tau << ", kappa_mu " << kappa_mu);
      const GenerativeModel model(gains(3, tau, kappa_mu), {});
      for (const double h : {0.02, 0.001}) {
        EXPECT_LT(BeliefUpdate(model, kappa_mu, h, Integrator::exact).spectralRadius(), 1.0);
      }
      // d/dt 1/2 |mu_tilde|^2 = mu_tilde' 1/2 (A + A') mu_tilde < 0: a belief decays from any state.
      const Eigen::MatrixXd a = BeliefUpdate(model, kappa_mu, 0.001, Integrator::exact).dynamics();
      const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> power(0.5 * (a + a.transpose()));
      EXPECT_LT(power.eigenvalues().maxCoeff(), 0.0);
    }
  }
}

TEST(BeliefUpdate, SpectralRadiusOfEuler) {
  // tau, kappa_mu, rate, h kappa_mu Pi_mu/tau^2, spectral radius
  const double rows[][5] = {{0.03, 0.01, 50, 0.15, 0.971}, {0.01, 0.01, 50, 1.33, 0.750}, {0.005, 0.01, 50, 5.3, 4.35},
                            {0.001, 0.01, 50, 133, 132},   {0.001, 0.01, 1000, 6.7, 5.7}, {0.001, 0.1, 1000, 67, 66},
                            {0.0002, 0.01, 1000, 167, 166}};
  for (const auto& row : rows) {
    const GenerativeModel model(gains(3, row[0], row[1]), {});
    const BeliefUpdate update(model, row[1], 1.0 / row[2], Integrator::euler);
    EXPECT_NEAR(update.eulerNumber(), row[3], 0.02 * row[3]) << "tau " << row[0] << " at " << row[2] << " Hz";
    EXPECT_NEAR(update.spectralRadius(), row[4], 0.02 * row[4]) << "tau " << row[0] << " at " << row[2] << " Hz";
  }
}

}  // namespace
}  // namespace jackal_aic
