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

/// Runs the belief and action steps of a controller that are due: the belief first, the action after every n-th of
/// them, held at what the gate lets through.
template <class Controller>
std::optional<WheelCommand> runDueSteps(Controller& controller, const DriveGate& gate, StepCounter& belief_clock,
                                        int belief_steps_per_action, int& belief_steps, double now) {
  std::optional<WheelCommand> command;
  while (belief_clock.due(now)) {
    controller.updateBelief();
    if (++belief_steps % belief_steps_per_action != 0) continue;
    command = gate.limit(controller.updateAction());
    controller.hold(*command);
  }
  return command;
}

ActiveInferenceVelocityController::ActiveInferenceVelocityController(const ActiveInferenceSetup& setup)
    : controller_(setup.controller, setup.geometry, Divergence::allowed),
      gate_(setup.limits, DeadlineParameters{}, setup.geometry),
      belief_clock_(setup.controller.belief_rate),
      belief_steps_per_action_(setup.controller.beliefStepsPerAction()) {}

std::optional<WheelCommand> ActiveInferenceVelocityController::advance(double now) {
  return runDueSteps(controller_, gate_, belief_clock_, belief_steps_per_action_, belief_steps_, now);
}

PredictiveVelocityController::PredictiveVelocityController(const PredictiveSetup& setup)
    : controller_(setup.controller, setup.geometry, setup.model),
      gate_(setup.limits, DeadlineParameters{}, setup.geometry),
      belief_clock_(setup.controller.belief_rate),
      belief_steps_per_action_(setup.controller.beliefStepsPerAction()) {}

std::optional<WheelCommand> PredictiveVelocityController::advance(double now) {
  return runDueSteps(controller_, gate_, belief_clock_, belief_steps_per_action_, belief_steps_, now);
}

std::optional<WheelCommand> DifferentialDriveVelocityController::advance(double now) {
  std::optional<WheelCommand> command;
  while (clock_.due(now)) command = drive_.update();
  return command;
}

}  // namespace jackal_aic::sim
