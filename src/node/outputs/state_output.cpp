#include "outputs/state_output.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "outputs/odometry_output.hpp"

namespace jackal_aic {
namespace {

/// One channel of a generalised quantity over all orders.
template <class Generalized>
std::vector<double> channel(const Generalized& x, int row) {
  std::vector<double> orders(x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) orders[i] = x(row, i);
  return orders;
}

const ActiveInferenceController* thesisController(const DriveLoop& loop) {
  return dynamic_cast<const ActiveInferenceController*>(&loop.controller());
}

void takeBelief(const ActiveInferenceController& controller, LoopState& state) {
  const PredictionErrors errors = controller.errors();
  state.belief = controller.belief();
  state.state_errors = errors.state;
  state.sensory_errors = errors.sensory;
}

void takeBelief(const PredictiveController& controller, LoopState& state) {
  state.predictive = true;
  state.belief = controller.believedVelocity();
  state.sensory_errors = controller.sensoryErrors();
  state.effective_track = controller.effectiveTrack();
  state.slip_factor = controller.slipBelief().slipFactor();
  state.timing.dead_time = controller.model().dead_time;
  state.timing.lag = controller.model().lag;
  state.turn = controller.slipBelief().turn().mean();
  state.learning_frozen = controller.learningFrozen();
  state.wheels = {controller.left().speed(), controller.right().speed()};
  state.disturbances = {controller.left().disturbance(), controller.right().disturbance()};
}

/// Structure, status and driver in words: "predictive, driving, driven by this controller".
std::string summary(const ControllerState& state) {
  constexpr std::array<const char*, 2> kStructures{"thesis", "predictive"};
  constexpr std::array<const char*, 5> kStatuses{"idle", "driving", "stopped", "braking", "faulted"};
  constexpr std::array<const char*, 3> kDrivers{"not driven", "driven by this controller", "driven by another node"};
  return std::string(kStructures.at(state.structure)) + ", " + kStatuses.at(state.status) + ", " +
         kDrivers.at(state.driven_by);
}

}  // namespace

LoopState loopState(const DriveLoop& loop, const GeometryParameters& geometry, const BodyVector& measured,
                    const ros::Time& stamp) {
  LoopState state;
  state.stamp = stamp;
  state.status = loop.status();
  state.set_point = loop.setPoint();
  state.measured = measured;
  state.action = loop.action();
  state.command = loop.command();
  state.free_energy = loop.controller().freeEnergy();
  state.effective_track = geometry.effective_track;
  state.slip_factor = geometry.slip_factor;
  if (const auto* thesis = thesisController(loop)) takeBelief(*thesis, state);
  if (loop.predictive() != nullptr) takeBelief(*loop.predictive(), state);
  return state;
}

ControllerState stateMessage(const LoopState& state, const StateRemarks& remarks, const std::string& frame) {
  ControllerState message;
  message.header.stamp = state.stamp;
  message.header.frame_id = frame;
  message.structure = state.predictive ? ControllerState::PREDICTIVE : ControllerState::THESIS;
  message.status = static_cast<std::uint8_t>(state.status.decision.status);
  const bool driven = state.command != WheelCommand{} && remarks.unheard.empty();
  message.driven_by = remarks.by_another ? ControllerState::BY_ANOTHER
                      : driven           ? ControllerState::BY_US
                                         : ControllerState::BY_NOBODY;
  message.summary = summary(message);
  message.reason = remarks.reason;
  if (!remarks.unheard.empty() && message.status == ControllerState::DRIVING) {
    message.reason += (message.reason.empty() ? "" : "; ") + remarks.unheard;
  }
  message.set_point_forward = state.set_point.forward;
  message.set_point_yaw_rate = state.set_point.yaw_rate;
  message.measured_forward = state.measured(kForward);
  message.measured_yaw_rate = state.measured(kYaw);
  message.belief_forward = channel(state.belief, kForward);
  message.belief_lateral = channel(state.belief, kLateral);
  message.belief_yaw_rate = channel(state.belief, kYaw);
  message.state_error_forward = channel(state.state_errors, kForward);
  message.state_error_lateral = channel(state.state_errors, kLateral);
  message.state_error_yaw_rate = channel(state.state_errors, kYaw);
  message.sensory_error_yaw_rate = channel(state.sensory_errors, kYawRate);
  message.sensory_error_wheel_left = channel(state.sensory_errors, kWheelLeft);
  message.sensory_error_wheel_right = channel(state.sensory_errors, kWheelRight);
  message.free_energy = state.free_energy;
  message.effective_track = state.effective_track;
  message.slip_factor = state.slip_factor;
  std::copy(state.turn.data(), state.turn.data() + state.turn.size(), message.turn_coefficients.begin());
  message.dead_time = state.timing.dead_time;
  message.lag = state.timing.lag;
  message.learning_frozen = state.learning_frozen;
  message.wheel_belief_left = state.wheels.left;
  message.wheel_belief_right = state.wheels.right;
  message.disturbance_left = state.disturbances.left;
  message.disturbance_right = state.disturbances.right;
  message.action_left = state.action.left;
  message.action_right = state.action.right;
  message.command_left = state.command.left;
  message.command_right = state.command.right;
  message.rejected_set_points = state.status.rejected_set_points;
  message.rejected_measurements = state.status.rejected_measurements + remarks.rejected;
  return message;
}

SensorGeneralized sensorMessage(const GeneralizedSensor& measurement) {
  SensorGeneralized message;
  message.yaw_rate = channel(measurement, kYawRate);
  message.wheel_left = channel(measurement, kWheelLeft);
  message.wheel_right = channel(measurement, kWheelRight);
  message.acceleration_x = channel(measurement, kAccelerationX);
  message.acceleration_y = channel(measurement, kAccelerationY);
  return message;
}

geometry_msgs::TwistWithCovarianceStamped beliefMessage(const PredictiveController& controller) {
  constexpr int kSize = 6, kX = 0, kYawRow = 5;  // rows of (x, y, z, roll, pitch, yaw)
  const BodyVector belief = controller.believedVelocity();
  const Eigen::Matrix2d covariance = controller.motionCovariance();
  geometry_msgs::TwistWithCovarianceStamped message;
  message.twist.twist.linear.x = belief(kForward);
  message.twist.twist.angular.z = belief(kYaw);
  auto& matrix = message.twist.covariance;
  for (int i = 0; i < kSize; ++i) matrix[i * kSize + i] = kUnknownVariance;
  matrix[kX * kSize + kX] = covariance(0, 0);
  matrix[kX * kSize + kYawRow] = matrix[kYawRow * kSize + kX] = covariance(0, 1);
  matrix[kYawRow * kSize + kYawRow] = covariance(1, 1);
  return message;
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
  SensorGeneralized message;
  if (const auto* thesis = thesisController(loop_)) message = sensorMessage(thesis->measurement());
  if (const auto* predictive = loop_.predictive()) {
    message = sensorMessage(GeneralizedSensor(predictive->measurement().vector()));
  }
  message.header.stamp = stamp;
  message.header.frame_id = frame_;
  measurement_publisher_.publish(message);
}

void StateOutput::publish(const LoopState& state, const StateRemarks& remarks) {
  const ControllerState message = stateMessage(state, remarks, frame_);
  state_publisher_.publish(message);
  if (loop_.predictive() == nullptr) return;
  geometry_msgs::TwistWithCovarianceStamped belief = beliefMessage(*loop_.predictive());
  belief.header = message.header;
  belief_publisher_.publish(belief);
}

}  // namespace jackal_aic
