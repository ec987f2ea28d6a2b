// The thesis controller is the special case of the predictive one in which the goal replaces the command in the belief,
// the model has no dead time and no disturbance, and the action descends the sensory prediction error instead of the
// expected one. For p = 0 both give the same beliefs and actions, in each degree of freedom alone (chapter 4): the
// thesis' belief is preconditioned in body coordinates, the predictive one's by its curvature.

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "jackal_aic/aic/active_inference_controller.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/wheel_belief.hpp"
#include "jackal_aic/predictive/wheel_controller.hpp"
#include "linear_plant.hpp"

namespace jackal_aic {
namespace {

enum class Motion { forward, turn };

/// The predictive controller's parts as the thesis controller in one degree of freedom.
struct Reduction {
  PlantModel model;              // without dead time
  WheelBeliefParameters belief;  // without a disturbance
  double action_learning_rate;   // along the sensory prediction error
};

Reduction reduce(const ControllerParameters& p, const GeometryParameters& g, Motion motion) {
  const double h = p.beliefStep(), variance = p.sensory_variances[0], r = g.wheel_radius, b = g.effective_track;
  // A step of the thesis' belief (3-11, p = 0): mu <- phi mu + (1 - phi - c) mu_d + c mu_y, mu_y the measured motion.
  const double pull = p.kappa_mu / (p.state_variances[0] * p.tau * p.tau);
  const double information = motion == Motion::forward ? 2.0 / (r * r) : 1.0 + 0.5 * b * b / (r * r);  // of R' R
  const double sense = p.kappa_mu / variance * information;
  const double phi = p.integrator == Integrator::exact ? std::exp(-h * (pull + sense)) : 1.0 - h * (pull + sense);
  const double c = sense / (pull + sense) * (1.0 - phi);
  const double kept = phi / (1.0 - c);  // of the way to the goal that the belief does not go by itself in a step
  Reduction reduction;
  reduction.model.dead_time = 0.0;
  reduction.model.lag = -h / std::log(kept);
  reduction.model.acceleration_limit = 1000.0;
  WheelBeliefParameters& q = reduction.belief;
  q.measurement_variance = variance;
  q.disturbance_process_noise = q.disturbance_deviation = q.dead_time_deviation = 0.0;
  // The fluctuation whose Kalman gain is c: P = c Sigma / (1 - c) before and c Sigma after a measurement.
  double growth = 0.0;
  for (double t = 0.0; t < h - 1e-9; t += WheelBelief::kStep) growth += std::exp(-2.0 * t / reduction.model.lag);
  q.speed_process_noise = c * variance * (1.0 / (1.0 - c) - kept * kept) / (growth * WheelBelief::kStep);
  const double ratio = r / b;  // of K Pi_y eps_y
  reduction.action_learning_rate = p.kappa_a * (motion == Motion::forward ? 1.0 : 1.0 + 2.0 * ratio * ratio);
  return reduction;
}

/// One wheel of the predictive controller with the goal in the place of the command in its belief, and an action that
/// descends the sensory prediction error as if it acted at once.
class GoalDrivenWheel {
 public:
  GoalDrivenWheel(const Reduction& reduction, const GeometryParameters& geometry, double period)
      : belief_(reduction.model, geometry.wheel_radius, reduction.belief),
        rate_(reduction.action_learning_rate * period / reduction.belief.measurement_variance),
        steps_(std::lround(period / WheelBelief::kStep)) {}

  /// A period that ends with a measurement y [rad/s].
  void step(double goal, double y) {
    // dw/dt = (w_d + z - w)/lag
    for (long i = 0; i < steps_; ++i) belief_.predict(goal);
    belief_.correct(y);
    // a <- a - h kappa_y eps_y/Sigma_y with dy/da = 1
    action_ -= rate_ * (y - belief_.speed());
  }

  double speed() const { return belief_.speed(); }
  double action() const { return action_; }

 private:
  WheelBelief belief_;
  double rate_;
  long steps_;
  double action_ = 0.0;
};

class ReducesToTheThesis : public testing::TestWithParam<std::tuple<double, Integrator, Motion>> {};

TEST_P(ReducesToTheThesis, BeliefAndActionAreTheSame) {
  const auto [rate, integrator, motion] = GetParam();
  const GeometryParameters geometry;
  ControllerParameters p;
  p.orders = 0;
  p.belief_rate = p.action_rate = rate;
  p.integrator = integrator;
  const Reduction reduction = reduce(p, geometry, motion);
  ActiveInferenceController ours(p, geometry);
  GoalDrivenWheel left(reduction, geometry, p.beliefStep()), right(left);
  const PlantModel robot{0.06, 0.05, 0.9};
  LinearPlant with_ours(robot, geometry), with_predictive(robot, geometry);
  const SkidSteerKinematics kinematics(geometry);
  const int ticks = static_cast<int>(std::lround(1000.0 / rate));
  double largest = 0.0;
  for (int k = 1; k <= 8000; ++k) {
    with_ours.step();
    with_predictive.step();
    if (k % ticks != 0) continue;
    // At first at rest, until the belief's covariance has converged.
    SetPoint wanted;
    if (k > 4000) (motion == Motion::forward ? wanted.forward : wanted.yaw_rate) = k < 6000 ? 0.5 : -0.2;
    ours.setSetPoint(wanted);
    const WheelCommand goal = kinematics.wheelSpeeds(wanted.forward, wanted.yaw_rate);
    ours.observe(with_ours.observation());
    ours.updateBelief();
    with_ours.command(ours.updateAction());
    left.step(goal.left, with_predictive.observation().wheel_left);
    right.step(goal.right, with_predictive.observation().wheel_right);
    with_predictive.command({left.action(), right.action()});
    const BodyVector believed = kinematics.bodyVelocity({left.speed(), right.speed()});
    ASSERT_NEAR(believed(kForward), ours.belief()(kForward, 0), 1e-9) << k << " ms";
    ASSERT_NEAR(believed(kYaw), ours.belief()(kYaw, 0), 1e-9) << k << " ms";
    ASSERT_NEAR(left.action(), ours.action().left, 1e-9) << k << " ms";
    ASSERT_NEAR(right.action(), ours.action().right, 1e-9) << k << " ms";
    largest = std::max(largest, std::abs(ours.action().right));
  }
  EXPECT_GT(largest, 0.5) << "nothing was driven";
}

INSTANTIATE_TEST_SUITE_P(RatesIntegratorsMotions, ReducesToTheThesis,
                         testing::Combine(testing::Values(50.0, 200.0, 1000.0),
                                          testing::Values(Integrator::exact, Integrator::euler),
                                          testing::Values(Motion::forward, Motion::turn)));

}  // namespace
}  // namespace jackal_aic
