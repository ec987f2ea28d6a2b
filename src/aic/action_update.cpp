#include "jackal_aic/aic/action_update.hpp"

#include "jackal_aic/aic/free_energy.hpp"

namespace jackal_aic {

WheelCommand ActionUpdate::step(const GenerativeModel& model, const GeneralizedSensor& sensory_error,
                                const WheelCommand& goal) {
  bound_.apply(action_);  // what was driven since the last step
  // a ← a − h κ_a K Π_y ε_y                                                     (3-13, 5-1)
  const WheelVector wanted = action_ - step_ * kappa_a_ * actionGradient(model, sensory_error);
  action_ = bound_.bound(action_, wanted, goal.vector());
  return WheelCommand::from(action_);
}

void ActionUpdate::overrule(const WheelCommand& applied) {
  bound_.apply(action_);
  hold(applied);
}

}  // namespace jackal_aic
