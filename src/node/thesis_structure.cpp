#include "thesis_structure.hpp"

#include "conversions.hpp"

namespace jackal_aic {

ThesisStructure::ThesisStructure(const GeometryParameters& geometry, const DriveLoop& loop)
    : geometry_(geometry), controller_(dynamic_cast<const ActiveInferenceController&>(loop.controller())) {}

ControllerState ThesisStructure::state() const {
  ControllerState message = stateMessage(controller_);
  message.effective_track = geometry_.effective_track;
  message.slip_factor = geometry_.slip_factor;
  return message;
}

SensorGeneralized ThesisStructure::measurement() const { return sensorMessage(controller_.measurement()); }

}  // namespace jackal_aic
