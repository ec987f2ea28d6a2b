// The drive loop on a robot whose left encoder fails: it is excluded, reported, and the robot drives on.

#include <cstdio>

#include "jackal_aic/safety/drive_loop.hpp"

int main() {
  using namespace jackal_aic;

  DriveParameters parameters;
  parameters.controller = PredictiveParameters{};
  parameters.plant_model = PlantModel{};  // identified drive train; here the assumed one of a Jackal
  parameters.on_loss.one_wheel = LossAction::drive;
  DriveLoop loop(parameters, makeController(parameters));

  WheelVector wheels = WheelVector::Zero();  // rad/s
  WheelCommand command;
  std::string reported;

  for (int ms = 0; ms <= 6000; ++ms) {
    const double now = 0.001 * ms;
    wheels += (command.vector() - wheels) * 0.001 / 0.1;                        // a lag of 0.1 s
    if (ms % 100 == 0) loop.setSetPoint({ms == 0 ? 0.0 : 0.5, 0.0, 0.0}, now);  // zero first releases the latch
    if (ms % 20 == 0) {
      const double noise = 0.01 * (ms / 20 % 5 - 2);
      Observation y;
      y.stamp = now;
      y.wheel_left = ms < 3000 ? wheels(0) + noise : 0.0;
      y.wheel_right = wheels(1) - noise;
      y.yaw_rate = 0.098 * (wheels(1) - wheels(0)) / parameters.geometry.effective_track + 0.1 * noise;
      loop.observe(y, now);
    }
    if (const auto due = loop.advance(now)) command = *due;

    const DriveLoopStatus status = loop.status();
    const char* state = status.decision.status == DriveStatus::driving ? "driving" : "not driving";
    const std::string now_reported = state + (reason(status).empty() ? "" : ": " + reason(status));
    if (now_reported == reported) continue;
    reported = now_reported;
    std::printf("%.2f s, %.2f m/s, %s\n", now, 0.098 * wheels.mean(), reported.c_str());
  }
}
