#include "jackal_aic/aic/belief_update.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "jackal_aic/aic/free_energy.hpp"

namespace jackal_aic {
namespace {

/// mu_d_tilde of a set point that does not change.
GeneralizedBody generalizedSetPoint(const BodyVector& set_point, int orders) {
  GeneralizedBody generalized = GeneralizedBody::Zero(kBodySize, orders + 1);
  generalized.col(0) = set_point;
  return generalized;
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
  const GeneralizedBody mu_d = generalizedSetPoint({0.0, 1.0, 0.0}, 0);
  const double rate = kappa_mu / 1.5 / (tau * tau);
  for (int k = 1; k <= 20; ++k) {
    update.step(mu, model.silence(), mu_d);
    EXPECT_NEAR(mu(kLateral, 0), 1.0 - std::exp(-rate * k * h), 1e-12);
  }
}

TEST(BeliefUpdate, EulerStepIsEquation316) {
  const GenerativeModel model(gains(2, 0.05, 0.02), {});
  GeneralizedBody mu = GeneralizedBody::Random(kBodySize, 3);
  const GeneralizedBody mu_d = generalizedSetPoint({0.5, 0.1, 0.4}, 2);
  const GeneralizedSensor y = GeneralizedSensor::Random(kSensorSize, 3);
  const GeneralizedBody expected = mu + 0.01 * beliefDerivative(model, 0.02, mu, y, mu_d);
  BeliefUpdate(model, 0.02, 0.01, Integrator::euler).step(mu, y, mu_d);
  EXPECT_TRUE(mu.isApprox(expected, 1e-14));
}

TEST(BeliefUpdate, LinksNoMotionWithAnother) {
  // The step takes each motion by itself: Phi has to be exactly zero between two of them.
  for (const double tau : {0.03, 0.001, 0.0002}) {
    for (int p = 0; p <= kMaxOrders; ++p) {
      GeometryParameters geometry;
      geometry.effective_track = 0.473;
      const GenerativeModel model(gains(p, tau, 0.1), geometry);
      for (const Integrator integrator : {Integrator::exact, Integrator::euler}) {
        Eigen::MatrixXd between = BeliefUpdate(model, 0.1, 0.001, integrator).transition();
        for (int i = 0; i < between.rows(); ++i) {
          for (int j = i % kBodySize; j < between.cols(); j += kBodySize) between(i, j) = 0.0;
        }
        EXPECT_EQ(between.cwiseAbs().maxCoeff(), 0.0) << "p " << p << ", tau " << tau;
      }
    }
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
