// The thesis' controller on wheels that follow their commands with a lag: the loop has three calls.

#include <cstdio>

#include "jackal_aic/aic/active_inference_controller.hpp"

int main() {
  using namespace jackal_aic;

  ControllerParameters gains;  // Table C-1
  gains.belief_rate = 1000.0;  // Hz
  const GeometryParameters geometry;
  ActiveInferenceController controller(gains, geometry);
  controller.setSetPoint({0.5, 0.0, 0.0});  // m/s

  const double lag = 0.1;  // s
  const SkidSteerKinematics kinematics(geometry);
  WheelVector wheels = WheelVector::Zero();  // rad/s
  WheelCommand command;

  for (int ms = 0; ms <= 3000; ++ms) {
    const double now = 0.001 * ms;
    wheels += (command.vector() - wheels) * 0.001 / lag;
    if (ms % 20 == 0) {  // sensors at 50 Hz
      Observation y;
      y.stamp = now;
      y.wheel_left = wheels(0);
      y.wheel_right = wheels(1);
      controller.observe(y);  // generalised measurement
    }
    controller.updateBelief();                              // 1 kHz, eq. 3-11
    if (ms % 20 == 0) command = controller.updateAction();  // 50 Hz, eq. 3-13
    if (ms % 500 == 0) {
      const double speed = kinematics.bodyVelocity({wheels(0), wheels(1)})(kForward);
      std::printf("%.1f s: %.3f m/s, believed %.3f m/s, F = %.3g\n", now, speed,
                  controller.believedVelocity()(kForward), controller.freeEnergy());
    }
  }
}
