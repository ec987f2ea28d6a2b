// A robot with four mecanum wheels: the thesis' algorithm and gains over another body, which also moves sideways.

#include <cstdio>

#include "jackal_aic/aic/active_inference.hpp"

int main() {
  using namespace jackal_aic;

  // States x_dot, y_dot, theta_dot; sensors gyro and four wheels; four wheel speeds.
  using Mecanum = LinearModel<3, 5, 4>;
  const double r = 0.076, l = 0.5;  // wheel radius; half of length and width together [m]
  Mecanum model;
  model.tau = 0.03;              // s
  model.sensory_map << 0, 0, r,  // gyro
      1, -1, -l,                 // front left
      1, 1, l,                   // front right
      1, 1, -l,                  // rear left
      1, -1, l;                  // rear right
  model.sensory_map /= r;
  const double turn = r / (4.0 * l);  // yaw rate per wheel speed
  model.forward_model << -turn, 1, 0, 0, 0, turn, 0, 1, 0, 0, -turn, 0, 0, 1, 0, turn, 0, 0, 0, 1;
  const double state_variances[] = {1.5, 2.0, 4.0, 8.0}, sensory_variances[] = {2.0, 2.0, 1e5, 1e5};  // Table C-1
  model.state_precision.resize(3, 4);
  model.sensory_precision.resize(5, 4);
  for (int i = 0; i < 4; ++i) {
    model.state_precision.col(i).setConstant(1.0 / state_variances[i]);
    model.sensory_precision.col(i).setConstant(1.0 / sensory_variances[i]);
  }
  ActiveInference<Mecanum> controller(model,
                                      {0.01, 8.0, 0.001, 0.02});  // kappa_mu, kappa_a, belief and action step [s]
  controller.setSetPoint({0.3, 0.2, 0.4});                        // m/s, m/s, rad/s

  Generalization<5> sensors(3, 0.01, 0.2);
  Eigen::Matrix<double, 3, 4> body;  // velocity of wheel speeds
  body << 1, 1, 1, 1, -1, 1, 1, -1, -1 / l, 1 / l, -1 / l, 1 / l;
  body *= r / 4.0;
  Eigen::Vector4d wheels = Eigen::Vector4d::Zero(), command = wheels;  // rad/s

  for (int ms = 0; ms <= 3000; ++ms) {
    wheels += (command - wheels) * 0.001 / 0.1;  // a lag of 0.1 s
    const Eigen::Vector3d velocity = body * wheels;
    if (ms % 20 == 0) {  // sensors at 50 Hz
      Generalization<5>::Sample y;
      y << velocity(2), wheels;
      sensors.update(0.001 * ms, y);
      controller.observe(sensors.measurement());
    }
    controller.updateBelief();                              // 1 kHz, eq. 3-11
    if (ms % 20 == 0) command = controller.updateAction();  // 50 Hz, eq. 3-13
    if (ms % 500 == 0) {
      std::printf("%.1f s: %.3f m/s, %.3f m/s, %.3f rad/s\n", 0.001 * ms, velocity(0), velocity(1), velocity(2));
    }
  }
}
