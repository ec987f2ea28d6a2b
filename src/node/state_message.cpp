#include "state_message.hpp"

#include <array>
#include <cstdint>

namespace jackal_aic {

LoopState loopState(const DriveLoop& loop, const BodyVector& measured, const ros::Time& stamp) {
  return {stamp, loop.status(), loop.setPoint(), measured, loop.action(), loop.command()};
}

void fillState(const LoopState& state, const std::string& reason, const std::string& frame, ControllerState& message) {
  message.header.stamp = state.stamp;
  message.header.frame_id = frame;
  message.status = static_cast<std::uint8_t>(state.status.decision.status);
  message.driven_by = state.command == WheelCommand{} ? ControllerState::BY_NOBODY : ControllerState::BY_US;
  message.reason = reason;
  message.set_point_forward = state.set_point.forward;
  message.set_point_yaw_rate = state.set_point.yaw_rate;
  message.measured_forward = state.measured(kForward);
  message.measured_yaw_rate = state.measured(kYaw);
  message.action_left = state.action.left;
  message.action_right = state.action.right;
  message.command_left = state.command.left;
  message.command_right = state.command.right;
  message.rejected_set_points = state.status.rejected_set_points;
  message.rejected_measurements = state.status.rejected_measurements;
}

std::string summary(const ControllerState& state) {
  constexpr std::array<const char*, 2> kStructures{"thesis", "predictive"};
  constexpr std::array<const char*, 5> kStatuses{"idle", "driving", "stopped", "braking", "faulted"};
  constexpr std::array<const char*, 3> kDrivers{"not driven", "driven by this controller", "driven by another node"};
  return std::string(kStructures.at(state.structure)) + ", " + kStatuses.at(state.status) + ", " +
         kDrivers.at(state.driven_by);
}

}  // namespace jackal_aic
