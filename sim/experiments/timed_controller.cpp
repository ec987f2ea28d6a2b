#include "timed_controller.hpp"

#include <utility>

namespace jackal_aic::sim {
namespace {

constexpr double kTimeTolerance = 1e-9;  // s; far below the plant's step, far above the rounding of summed steps

}  // namespace

bool StepCounter::due(double now) {
  if (static_cast<double>(done_ + 1) > (now + kTimeTolerance) * rate_) return false;
  ++done_;
  return true;
}

LimitedController::LimitedController(std::unique_ptr<VelocityController> controller, const LimitParameters& limits,
                                     const GeometryParameters& geometry)
    : controller_(std::move(controller)),
      limiter_(limits, geometry, controller_->actionStep()),
      belief_clock_(1.0 / controller_->beliefStep()) {}

std::optional<WheelCommand> LimitedController::advance(double now) {
  std::optional<WheelCommand> command;
  while (belief_clock_.due(now)) {
    controller_->updateBelief();
    if (++belief_steps_ % controller_->beliefStepsPerAction() != 0) continue;
    command = limiter_.drive(controller_->updateAction(), set_point_);
    controller_->hold(*command);
  }
  return command;
}

LimitedPredictiveController::LimitedPredictiveController(const PredictiveSetup& setup)
    : LimitedController(std::make_unique<PredictiveController>(setup.controller, setup.geometry, setup.model),
                        setup.limits, setup.geometry) {}

std::optional<Learned> LimitedPredictiveController::learned() const {
  const auto& predictive = static_cast<const PredictiveController&>(controller());
  return Learned{predictive.slip(), predictive.variances()};
}

std::unique_ptr<TimedController> makeTimedController(const ActiveInferenceSetup& setup) {
  auto controller =
      std::make_unique<ActiveInferenceController>(setup.controller, setup.geometry, setup.model, Divergence::allowed);
  return std::make_unique<LimitedController>(std::move(controller), setup.limits, setup.geometry);
}

std::unique_ptr<TimedController> makeTimedController(const PredictiveSetup& setup) {
  return std::make_unique<LimitedPredictiveController>(setup);
}

std::optional<WheelCommand> TimedDifferentialDrive::advance(double now) {
  std::optional<WheelCommand> command;
  while (clock_.due(now)) command = drive_.update();
  return command;
}

std::unique_ptr<TimedController> makeTimedController(const DifferentialDriveParameters& parameters) {
  return std::make_unique<TimedDifferentialDrive>(parameters);
}

}  // namespace jackal_aic::sim
