#include "state_space_model.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

namespace jackal_aic {
namespace {

/// Gains that make every term of 4-4 a different round number.
ControllerParameters handGains(int orders) {
  ControllerParameters p;
  p.orders = orders;
  p.tau = 0.5;
  p.kappa_mu = 0.1;
  p.kappa_a = 3.0;
  p.state_variances = {0.5, 0.25, 0.2};        // Pi_mu = 2, 4, 5
  p.sensory_variances = {0.125, 0.1, 0.0625};  // Pi_y = 8, 10, 16
  return p;
}

TEST(StateSpaceModel, MatchesEquation44And46ForOneOrder) {
  const StateSpaceModel model = stateSpaceModel(handGains(1));
  Eigen::MatrixXd a(4, 4);
  // Row 1 of 4-4: -k Pi_mu/tau^2 - k Pi_y = -0.8 - 0.8; 1 - k Pi_mu/tau = 1 - 0.4.
  // Row 2: -k Pi_mu/tau = -0.4; -k Pi_mu - k Pi_mu'/tau^2 - k Pi_y' = -0.2 - 1.6 - 1.0.
  a << -1.6, 0.6, 0.8, 0.0,   //
      -0.4, -2.8, 0.0, 1.0,   //
      24.0, 0.0, -24.0, 0.0,  //
      0.0, 30.0, 0.0, -30.0;
  EXPECT_TRUE(model.a.isApprox(a, 1e-12)) << model.a;
  EXPECT_TRUE(model.b.isApprox(Eigen::Vector4d(0.8, 0.4, 0.0, 0.0), 1e-12)) << model.b;
  EXPECT_TRUE(model.c.isApprox(Eigen::RowVector4d(0.0, 0.0, 1.0, 0.0)));
}

TEST(StateSpaceModel, RestsAtTheSetPointWithoutErrors) {
  ControllerParameters p;
  p.state_variances = {1.5, 2, 4, 8, 16, 32};
  p.sensory_variances = {2, 2, 1e5, 1e5, 1e5, 1e5};
  for (p.orders = 0; p.orders <= kMaxOrders; ++p.orders) {
    const StateSpaceModel model = stateSpaceModel(p);
    ASSERT_EQ(model.a.rows(), 2 * (p.orders + 1));
    const Eigen::VectorXd rest = -model.a.fullPivLu().solve(model.b);
    Eigen::VectorXd expected = Eigen::VectorXd::Zero(model.a.rows());
    expected(0) = expected(model.size()) = 1.0;
    EXPECT_TRUE(rest.isApprox(expected, 1e-6)) << rest.transpose();
  }
}

TEST(StateSpaceSimulation, FirstEulerStepsAndErrorsByHand) {
  const StateSpaceModel model = stateSpaceModel(handGains(1));
  StateSpaceRun run;
  run.dt = 0.01;
  run.duration = 0.03;
  run.set_point = 2.0;
  const StateSpaceResponse response = simulate(model, run);
  ASSERT_EQ(response.states.cols(), 3);
  EXPECT_TRUE(response.states.col(0).isZero());
  EXPECT_TRUE(response.states.col(1).isApprox(Eigen::Vector4d(0.016, 0.008, 0.0, 0.0), 1e-12));
  // x2 = x1 + dt (A x1 + 2 B); the action moves one step after the belief.
  const Eigen::Vector4d x2(0.016 + 0.01 * (-0.0256 + 0.0048 + 1.6), 0.008 + 0.01 * (-0.0064 - 0.0224 + 0.8),
                           0.01 * 24.0 * 0.016, 0.01 * 30.0 * 0.008);
  EXPECT_TRUE(response.states.col(2).isApprox(x2, 1e-12)) << response.states.col(2).transpose();
  EXPECT_DOUBLE_EQ(response.output(2), x2(2));
  const Eigen::Vector4d x = response.states.col(2);
  EXPECT_NEAR(response.sensory_errors(0, 2), x(2) - x(0), 1e-15);
  EXPECT_NEAR(response.sensory_errors(1, 2), x(3) - x(1), 1e-15);
  EXPECT_NEAR(response.state_errors(0, 2), x(1) - (2.0 - x(0)) / 0.5, 1e-15);
  EXPECT_NEAR(response.state_errors(1, 2), x(1) / 0.5, 1e-15);
}

TEST(StateSpaceSimulation, RiseTimeOfAFirstOrderLag) {
  // kappa_a Pi_y so fast that the action follows the belief at once: y rises with the belief's eigenvalue -k
  // Pi_mu/tau^2 = -0.8, whose 10-90 % time is ln 9 / 0.8.
  ControllerParameters p = handGains(0);
  p.kappa_a = 100.0;
  StateSpaceRun run;
  run.duration = 8.0;
  const auto rise = simulate(stateSpaceModel(p), run).rise_time;
  ASSERT_TRUE(rise.has_value());
  EXPECT_NEAR(*rise, std::log(9.0) / 0.8, 0.01);
  run.duration = 0.1;
  EXPECT_FALSE(simulate(stateSpaceModel(handGains(1)), run).rise_time.has_value()) << "before 90 %";
}

}  // namespace
}  // namespace jackal_aic
