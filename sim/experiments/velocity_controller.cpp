#include "velocity_controller.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kTimeTolerance = 1e-9;  // s; far below the plant's step, far above the rounding of summed steps

}  // namespace

bool StepCounter::due(double now) {
  if (static_cast<double>(done_ + 1) > (now + kTimeTolerance) * rate_) return false;
  ++done_;
  return true;
}

ActiveInferenceVelocityController::ActiveInferenceVelocityController(const ActiveInferenceSetup& setup)
    : controller_(setup.controller, setup.geometry, Divergence::allowed),
      gate_(setup.limits, DeadlineParameters{}, setup.geometry),
      belief_clock_(setup.controller.belief_rate),
      belief_steps_per_action_(setup.controller.beliefStepsPerAction()) {}

std::optional<WheelCommand> ActiveInferenceVelocityController::advance(double now) {
  std::optional<WheelCommand> command;
  while (belief_clock_.due(now)) {
    controller_.updateBelief();
    if (++belief_steps_ % belief_steps_per_action_ != 0) continue;
    command = gate_.limit(controller_.updateAction());
    controller_.hold(*command);
  }
  return command;
}

std::optional<WheelCommand> DifferentialDriveVelocityController::advance(double now) {
  std::optional<WheelCommand> command;
  while (clock_.due(now)) command = drive_.update();
  return command;
}

}  // namespace jackal_aic::sim
