#include "outputs/state_output.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "outputs/commands.hpp"
#include "outputs/odometry_output.hpp"

namespace jackal_aic {
namespace {

/// One channel of a generalised quantity over all orders; does not allocate if the list has this length already.
template <class Generalized>
void takeChannel(const Generalized& x, int row, std::vector<double>& orders) {
  orders.resize(static_cast<std::size_t>(x.cols()));
  for (Eigen::Index i = 0; i < x.cols(); ++i) orders[static_cast<std::size_t>(i)] = x(row, i);
}

template <class Belief, class Errors>
void takeBelief(const Belief& belief, const Errors& errors, ControllerState& message) {
  takeChannel(belief, kForward, message.belief_forward);
  takeChannel(belief, kLateral, message.belief_lateral);
  takeChannel(belief, kYaw, message.belief_yaw_rate);
  takeChannel(errors, kYawRate, message.sensory_error_yaw_rate);
  takeChannel(errors, kWheelLeft, message.sensory_error_wheel_left);
  takeChannel(errors, kWheelRight, message.sensory_error_wheel_right);
}

const ActiveInferenceController* thesisController(const DriveLoop& loop) {
  return dynamic_cast<const ActiveInferenceController*>(&loop.controller());
}

void take(const ActiveInferenceController& controller, ControllerState& message) {
  const PredictionErrors errors = controller.errors();
  takeBelief(controller.belief(), errors.sensory, message);
  takeChannel(errors.state, kForward, message.state_error_forward);
  takeChannel(errors.state, kLateral, message.state_error_lateral);
  takeChannel(errors.state, kYaw, message.state_error_yaw_rate);
}

void take(const PredictiveController& controller, ControllerState& message) {
  message.structure = ControllerState::PREDICTIVE;
  takeBelief(controller.believedVelocity(), controller.sensoryErrors(), message);
  message.effective_track = controller.effectiveTrack();
  message.slip_factor = controller.turn().slipFactor();
  const Eigen::Vector4d turn = controller.turn().mean();
  std::copy(turn.data(), turn.data() + turn.size(), message.turn_coefficients.begin());
  message.dead_time = controller.model().dead_time;
  message.lag = controller.model().lag;
  message.learning_frozen = controller.learningFrozen();
  message.wheel_belief_left = controller.left().speed();
  message.wheel_belief_right = controller.right().speed();
  message.disturbance_left = controller.left().disturbance();
  message.disturbance_right = controller.right().disturbance();
}

/// Structure, status and driver in words: "predictive, driving, driven by this controller".
std::string summary(const ControllerState& state) {
  constexpr std::array<const char*, 2> kStructures{"thesis", "predictive"};
  constexpr std::array<const char*, 3> kDrivers{"not driven", "driven by this controller", "driven by another node"};
  const char* status = text(static_cast<DriveStatus>(state.status));
  return std::string(kStructures.at(state.structure)) + ", " + status + ", " + kDrivers.at(state.driven_by);
}

}  // namespace

void fillState(const DriveLoop& loop, const ros::Time& stamp, ControllerState& message) {
  const DriveLoopStatus& status = loop.status();
  message.header.stamp = stamp;
  message.structure = ControllerState::THESIS;
  message.status = static_cast<std::uint8_t>(status.decision.status);
  message.set_point_forward = loop.setPoint().forward;
  message.set_point_yaw_rate = loop.setPoint().yaw_rate;
  message.measured_forward = loop.measuredVelocity()(kForward);
  message.measured_yaw_rate = loop.measuredVelocity()(kYaw);
  message.free_energy = loop.controller().freeEnergy();
  message.effective_track = loop.geometry().effective_track;
  message.slip_factor = loop.geometry().slip_factor;
  message.action_left = loop.action().left;
  message.action_right = loop.action().right;
  message.command_left = loop.command().left;
  message.command_right = loop.command().right;
  message.rejected_set_points = status.rejected_set_points;
  message.rejected_measurements = status.rejected_measurements;
  if (const auto* thesis = thesisController(loop)) take(*thesis, message);
  if (loop.predictive() != nullptr) take(*loop.predictive(), message);
}

void addRemarks(const DriveLoopStatus& status, const Surroundings& around, const std::string& frame,
                ControllerState& message) {
  const bool driven = (message.command_left != 0.0 || message.command_right != 0.0) && around.no_subscriber.empty();
  message.header.frame_id = frame;
  message.driven_by = around.contended || status.handed_over ? ControllerState::BY_ANOTHER
                      : driven                               ? ControllerState::BY_US
                                                             : ControllerState::BY_NOBODY;
  message.summary = summary(message);
  message.reason = reason(status, around.contender);
  if (!around.no_subscriber.empty() && message.status == ControllerState::DRIVING) {
    message.reason += (message.reason.empty() ? "" : "; ") + around.no_subscriber;
  }
  message.rejected_measurements += around.rejected;
  message.hypothesis = status.suspicion.probability > 0.0 ? faults::text(status.suspicion.hypothesis) : "";
  message.hypothesis_probability = status.suspicion.probability;
}

StateOutput::StateOutput(ros::NodeHandle& node, const NodeParameters& parameters, const DriveLoop& loop)
    : frame_(parameters.robot.base_frame),
      loop_(loop),
      measurement_publisher_(node.advertise<SensorGeneralized>("sensor_generalized", 10)),
      state_publisher_(node.advertise<ControllerState>("jackal_AIC/state", 10)) {
  if (loop.predictive() == nullptr) return;
  belief_publisher_ = node.advertise<geometry_msgs::TwistWithCovarianceStamped>("jackal_AIC/belief", 10);
}

void StateOutput::publishMeasurement(const ros::Time& stamp) {
  GeneralizedSensor y;  // the baseline has none
  if (const auto* thesis = thesisController(loop_)) y = thesis->measurement();
  if (const auto* predictive = loop_.predictive()) y = predictive->measurement().vector();
  SensorGeneralized message;
  message.header.stamp = stamp;
  message.header.frame_id = frame_;
  takeChannel(y, kYawRate, message.yaw_rate);
  takeChannel(y, kWheelLeft, message.wheel_left);
  takeChannel(y, kWheelRight, message.wheel_right);
  takeChannel(y, kAccelerationX, message.acceleration_x);
  takeChannel(y, kAccelerationY, message.acceleration_y);
  measurement_publisher_.publish(message);
}

void StateOutput::publish(const ros::Time& stamp, const DriveLoopStatus& status, const Surroundings& around) {
  ControllerState message;
  fillState(loop_, stamp, message);
  addRemarks(status, around, frame_, message);
  state_publisher_.publish(message);
  const PredictiveController* controller = loop_.predictive();
  if (controller == nullptr) return;
  geometry_msgs::TwistWithCovarianceStamped belief;
  belief.header = message.header;
  belief.twist.twist = twistMessage(controller->believedVelocity());
  fillMotionCovariance(controller->motionCovariance(), kUnknownVariance, belief.twist.covariance);
  belief_publisher_.publish(belief);
}

}  // namespace jackal_aic
