// One joint of an arm, its position and velocity measured, as Pezzato, Ferrari and Hernandez Corbato (2020) control
// seven.

#include <cstdio>

#include "jackal_aic/aic/active_inference.hpp"

int main() {
  using namespace jackal_aic;

  // One state, one sensor, one torque, orders 0..2: y_tilde is (position, velocity, nothing).
  using Joint = LinearModel<1, 1, 1, 2>;
  Joint model;
  model.tau = 1.0;                     // s
  model.sensory_map << 1.0;            // R
  model.forward_model << 1.0;          // K
  model.state_precision.resize(1, 3);  // of the prediction errors of position and velocity
  model.state_precision << 1.0 / 5.0, 1.0 / 10.0, 0.0;
  model.sensory_precision.resize(1, 3);  // of position and velocity; no acceleration is measured
  model.sensory_precision << 1.0, 1.0, 0.0;
  model.action_orders = 1;  // both sensors drive the torque

  InferenceGains gains{};
  gains.kappa_mu = 11.67;
  gains.kappa_a = 700.0;
  gains.belief_step = gains.action_step = 0.001;  // s
  gains.integrator = Integrator::euler;
  ActiveInference<Joint> controller(model, gains);
  controller.setSetPoint(Joint::State(0.5));  // rad

  const double inertia = 0.5, friction = 5.0;           // kg m^2, N m s
  double position = 0.0, velocity = 0.0, torque = 0.0;  // rad, rad/s, N m
  Joint::Measurement y = model.silence();

  for (int ms = 0; ms <= 6000; ++ms) {
    y(0) = position;
    y(1) = velocity;
    controller.observe(y);
    if (ms % 500 == 0) {
      const Joint::Belief& mu = controller.belief();
      std::printf("%.1f s: %.6f rad, believed %.6f rad, %.6f rad/s, %.6f rad/s^2\n", 0.001 * ms, position, mu(0), mu(1),
                  mu(2));
    }
    torque = controller.updateAction()(0);  // eq. 3-13
    controller.updateBelief();              // eq. 3-11
    velocity += 0.001 * (torque - friction * velocity) / inertia;
    position += 0.001 * velocity;
  }
}
