#include "state_output.hpp"

namespace jackal_aic {

StateOutput::StateOutput(ros::NodeHandle& node, const NodeParameters& parameters, const DriveLoop& loop)
    : frame_(parameters.robot.base_frame),
      structure_(makeStructure(node, parameters, loop)),
      measurement_publisher_(node.advertise<SensorGeneralized>("sensor_generalized", 10)),
      state_publisher_(node.advertise<ControllerState>("jackal_AIC/state", 10)) {}

void StateOutput::publishMeasurement(const ros::Time& stamp) {
  SensorGeneralized message = structure_->measurement();
  message.header.stamp = stamp;
  message.header.frame_id = frame_;
  measurement_publisher_.publish(message);
}

void StateOutput::publish(const LoopState& state, const std::string& reason, bool by_another,
                          const std::string& unheard, std::uint32_t rejected) {
  ControllerState message = structure_->state();
  fillState(state, reason, frame_, message);
  if (!unheard.empty()) {
    message.driven_by = ControllerState::BY_NOBODY;
    if (message.status == ControllerState::DRIVING) message.reason += (reason.empty() ? "" : "; ") + unheard;
  }
  if (by_another) message.driven_by = ControllerState::BY_ANOTHER;
  message.summary = summary(message);
  message.rejected_measurements += rejected;
  state_publisher_.publish(message);
  structure_->publish(message.header);
}

}  // namespace jackal_aic
