#include "jackal_aic/aic/coloured_noise.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>

#include "jackal_aic/aic/active_inference_controller.hpp"
#include "jackal_aic/aic/free_energy.hpp"
#include "jackal_aic/certificate/certificate.hpp"
#include "jackal_aic/certificate/state_space_model.hpp"

namespace jackal_aic {
namespace {

/// mu_d_tilde of a set point that does not change.
GeneralizedBody generalizedSetPoint(const BodyVector& set_point, int orders) {
  GeneralizedBody generalized = GeneralizedBody::Zero(kBodySize, orders + 1);
  generalized.col(0) = set_point;
  return generalized;
}

/// Covariance of the i-th and j-th derivative of unit noise from its spectrum: the integral of S(w) (iw)^i conj((iw)^j)
/// with S the Fourier transform of exp(-t^2 / (4 s^2)).
double fromSpectrum(int i, int j, double s) {
  const std::complex<double> unit(0.0, 1.0);
  const double step = 0.001 / s;
  std::complex<double> sum = 0.0;
  for (double w = -12.0 / s; w <= 12.0 / s; w += step) {
    const double density = s / std::sqrt(M_PI) * std::exp(-s * s * w * w);
    sum += step * density * std::pow(unit * w, i) * std::conj(std::pow(unit * w, j));
  }
  return sum.real();
}

TEST(ColouredNoise, PrecisionIsThatOfSpmDemR) {
  // spm_DEM_R(3, 1) by hand: V = [1 0 -1/2; 0 1/2 0; -1/2 0 3/4].
  Eigen::Matrix3d expected;
  expected << 1.5, 0.0, 1.0, 0.0, 2.0, 0.0, 1.0, 0.0, 2.0;
  EXPECT_LT((noisePrecision(2, 1.0) - expected).norm(), 1e-12);
}

TEST(ColouredNoise, PrecisionInvertsTheCovarianceOfTheSpectrumAtEveryOrderAndSmoothness) {
  for (int orders = 0; orders <= kMaxOrders; ++orders) {
    for (double s : {1e-3, 0.02, 1.0, 5.0}) {
      // In the coordinates s^i x^(i), in which 1e-15 of one order is not the whole of another.
      Eigen::MatrixXd P = noisePrecision(orders, s);
      for (int i = 0; i <= orders; ++i) {
        for (int j = 0; j <= orders; ++j) P(i, j) *= std::pow(s, -(i + j));
      }
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(P).eigenvalues().minCoeff(), 0.0);
      const Eigen::MatrixXd V = P.inverse();
      for (int i = 0; i <= orders; ++i) {
        for (int j = 0; j <= orders; ++j) {
          const double size = std::max(1.0, std::abs(fromSpectrum(i, j, 1.0)));
          EXPECT_NEAR(V(i, j), fromSpectrum(i, j, 1.0), 1e-6 * size) << orders << ", " << s << ": " << i << ", " << j;
        }
      }
    }
  }
}

TEST(ColouredNoise, WithoutSmoothnessTheOrdersAreIndependent) {
  EXPECT_EQ(Eigen::MatrixXd(noisePrecision(3, 0.0)), Eigen::MatrixXd::Identity(4, 4));
}

ControllerParameters coloured(int orders) {
  ControllerParameters p;
  p.orders = orders;
  p.tau = 0.3;
  p.noise_smoothness = 0.1;
  p.state_variances = p.sensory_variances = {1.5, 2.0, 4.0, 8.0, 3.0, 5.0};
  return p;
}

TEST(ColouredNoise, FreeEnergyIsThatOfTheKroneckerProduct) {
  const ControllerParameters p = coloured(3);
  const GenerativeModel model(p, {});
  PredictionErrors errors{GeneralizedSensor::Random(kSensorSize, 4), GeneralizedBody::Random(kBodySize, 4)};
  const Eigen::MatrixXd precision = noisePrecision(3, p.noise_smoothness);
  double expected = 0.0;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      expected += 0.5 * precision(i, j) / p.sensory_variances[0] * errors.sensory.col(i).dot(errors.sensory.col(j));
      expected += 0.5 * precision(i, j) / p.state_variances[0] * errors.state.col(i).dot(errors.state.col(j));
    }
  }
  EXPECT_NEAR(freeEnergy(model, errors), expected, 1e-9 * expected);
}

TEST(ColouredNoise, BeliefDescendsThatFreeEnergy) {
  const GenerativeModel model(coloured(3), {});
  GeneralizedBody belief = GeneralizedBody::Random(kBodySize, 4);
  const GeneralizedSensor measurement = GeneralizedSensor::Random(kSensorSize, 4);
  const GeneralizedBody set_point = generalizedSetPoint({0.5, 0.0, 0.2}, 3);
  const auto energy = [&] { return freeEnergy(model, predictionErrors(model, belief, measurement, set_point)); };
  const GeneralizedBody gradient = beliefGradient(model, predictionErrors(model, belief, measurement, set_point));
  for (Eigen::Index i = 0; i < belief.size(); ++i) {
    const double centre = belief(i);
    belief(i) = centre + 1e-5;
    const double above = energy();
    belief(i) = centre - 1e-5;
    const double slope = (above - energy()) / 2e-5;
    belief(i) = centre;
    EXPECT_NEAR(gradient(i), slope, 1e-4 * std::max(1.0, std::abs(slope))) << "coordinate " << i;
  }
}

TEST(ColouredNoise, StateSpaceModelHasItsPrecision) {
  const ControllerParameters p = coloured(2);
  const StateSpaceModel model = stateSpaceModel(p);
  const Eigen::MatrixXd sensory = noisePrecision(2, p.noise_smoothness) / p.sensory_variances[0];
  EXPECT_LT((model.a.bottomLeftCorner(3, 3) - p.kappa_a * sensory).norm(), 1e-12);
  EXPECT_LT((model.a.topRightCorner(3, 3) - p.kappa_mu * sensory).norm(), 1e-12);
}

TEST(ColouredNoise, SettlesExactlyAndTheCertificateKnows) {
  // The robot is its command one period later; the certificate of that plant tells how fast the belief error decays.
  ControllerParameters p = coloured(2);
  p.tau = 0.03;
  p.noise_smoothness = 0.01;
  PlantModel plant;
  plant.dead_time = 0.0;
  plant.lag = 0.0;
  ASSERT_TRUE(certify(p, {}, plant).stable());
  ActiveInferenceController controller(p, {});
  Observation y;
  controller.observe(y);
  controller.setSetPoint({0.5, 0.0, 0.0});
  for (int k = 1; k <= 1000; ++k) {
    y.stamp = 0.02 * k;
    y.wheel_left = controller.action().left;
    y.wheel_right = controller.action().right;
    controller.observe(y);
    controller.updateBelief();
    controller.updateAction();
  }
  EXPECT_NEAR(0.098 * y.wheel_left, 0.5, 1e-3);
  EXPECT_NEAR(controller.belief()(kForward, 0), 0.5, 1e-3);
}

}  // namespace
}  // namespace jackal_aic
