#include "jackal_aic/action_update.hpp"

#include "jackal_aic/free_energy.hpp"

namespace jackal_aic {

WheelCommand ActionUpdate::step(const GenerativeModel& model, const GeneralizedSensor& sensory_error) {
  // a ← a − h κ_a K Π_y ε_y                                                     (3-13, 5-1)
  action_ -= step_ * kappa_a_ * actionGradient(model, sensory_error);
  return WheelCommand::from(action_);
}

}  // namespace jackal_aic
