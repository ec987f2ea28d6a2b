#include "conversions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "jackal_aic/model/gravity.hpp"

namespace jackal_aic {
namespace {

/// What a Twist with a component that is not finite asks for.
constexpr SetPoint kNotFinite{std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0};

bool contains(const std::vector<std::string>& list, const std::string& name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

/// One channel of a generalised quantity over all orders.
template <class Generalized>
std::vector<double> channel(const Generalized& x, int row) {
  std::vector<double> orders(x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) orders[i] = x(row, i);
  return orders;
}

/// Attitude of the IMU against a level frame; std::nullopt if the message has none.
std::optional<Eigen::Quaterniond> attitudeOf(const sensor_msgs::Imu& message) {
  constexpr double kNone = -1.0;  // sensor_msgs/Imu: no estimate
  if (message.orientation_covariance[0] == kNone) return std::nullopt;
  const auto& q = message.orientation;
  return unitAttitude({q.w, q.x, q.y, q.z});
}

}  // namespace

bool mentionsAny(const sensor_msgs::JointState& message, const std::vector<std::string>& joints) {
  return std::any_of(message.name.begin(), message.name.end(),
                     [&](const std::string& name) { return contains(joints, name); });
}

std::optional<double> meanVelocity(const sensor_msgs::JointState& message, const std::vector<std::string>& joints) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < message.name.size(); ++i) {
    if (!contains(joints, message.name[i])) continue;
    if (i >= message.velocity.size()) return std::nullopt;
    sum += message.velocity[i];
    ++count;
  }
  if (count == 0 || !std::isfinite(sum)) return std::nullopt;
  return sum / count;
}

std::optional<double> sumOfPositions(const sensor_msgs::JointState& message, const std::vector<std::string>& joints) {
  std::optional<double> sum;
  for (std::size_t i = 0; i < std::min(message.name.size(), message.position.size()); ++i) {
    if (contains(joints, message.name[i])) sum = sum.value_or(0.0) + message.position[i];
  }
  return sum && std::isfinite(*sum) ? sum : std::nullopt;
}

std::optional<Eigen::Vector4d> planarMotion(const sensor_msgs::Imu& message, const Eigen::Quaterniond& rotation) {
  const auto& w = message.angular_velocity;
  const auto& a = message.linear_acceleration;
  const Eigen::Vector3d angular = rotation * Eigen::Vector3d(w.x, w.y, w.z);
  const Eigen::Vector3d force = rotation * Eigen::Vector3d(a.x, a.y, a.z);
  if (!angular.allFinite() || !force.allFinite()) return std::nullopt;
  Eigen::Vector2d level = force.head<2>();
  if (const auto attitude = attitudeOf(message)) level -= (rotation * gravityReaction(*attitude)).head<2>();
  return Eigen::Vector4d(angular.z(), level.x(), level.y(), force.z());
}

std::optional<SetPoint> setPoint(const geometry_msgs::Twist& message) {
  const auto& v = message.linear;
  const auto& w = message.angular;
  for (double value : {v.x, v.y, v.z, w.x, w.y, w.z}) {
    if (!std::isfinite(value)) return std::nullopt;
  }
  return SetPoint{v.x, 0.0, w.z};
}

std::optional<ReceivedSetPoint> receivedSetPoint(const topic_tools::ShapeShifter& message) {
  using ros::message_traits::md5sum;
  if (message.getMD5Sum() == md5sum<geometry_msgs::Twist>()) {
    const auto twist = message.instantiate<geometry_msgs::Twist>();
    return ReceivedSetPoint{setPoint(*twist).value_or(kNotFinite), std::nullopt, twist->linear.y};
  }
  if (message.getMD5Sum() != md5sum<geometry_msgs::TwistStamped>()) return std::nullopt;
  const auto stamped = message.instantiate<geometry_msgs::TwistStamped>();
  const ros::Time& stamp = stamped->header.stamp;
  return ReceivedSetPoint{setPoint(stamped->twist).value_or(kNotFinite),
                          stamp.isZero() ? std::nullopt : std::optional(stamp.toSec()), stamped->twist.linear.y};
}

std::optional<WheelCommand> wheelCommand(const jackal_msgs::Drive& message) {
  if (message.mode != jackal_msgs::Drive::MODE_VELOCITY) return WheelCommand{};
  const WheelCommand command{message.drivers[jackal_msgs::Drive::LEFT], message.drivers[jackal_msgs::Drive::RIGHT]};
  return command.vector().allFinite() ? std::optional<WheelCommand>(command) : std::nullopt;
}

void takeStatus(const jackal_msgs::Status& message, RobotStatus& status) {
  const bool stopped = message.driver_external_stop_present && message.driver_external_stop_stopped;
  status.robot_stopped = stopped || !message.drivers_active;
}

void takeFeedback(const jackal_msgs::Feedback& message, RobotStatus& status) {
  status.motors_off = message.commanded_mode == jackal_msgs::Drive::MODE_VELOCITY &&
                      message.actual_mode != jackal_msgs::Drive::MODE_VELOCITY;
  status.driver_fault = message.drivers[0].driver_fault || message.drivers[1].driver_fault;
}

jackal_msgs::Drive driveMessage(const WheelCommand& command) {
  jackal_msgs::Drive message;
  message.mode = jackal_msgs::Drive::MODE_VELOCITY;
  message.drivers[jackal_msgs::Drive::LEFT] = static_cast<float>(command.left);
  message.drivers[jackal_msgs::Drive::RIGHT] = static_cast<float>(command.right);
  return message;
}

geometry_msgs::Twist twistMessage(const BodyVector& velocity) {
  geometry_msgs::Twist message;
  message.linear.x = velocity(kForward);
  message.angular.z = velocity(kYaw);
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

ControllerState stateMessage(const ActiveInferenceController& controller) {
  const PredictionErrors errors = controller.errors();
  ControllerState message;
  message.structure = ControllerState::THESIS;
  message.belief_forward = channel(controller.belief(), kForward);
  message.belief_lateral = channel(controller.belief(), kLateral);
  message.belief_yaw_rate = channel(controller.belief(), kYaw);
  message.state_error_forward = channel(errors.state, kForward);
  message.state_error_lateral = channel(errors.state, kLateral);
  message.state_error_yaw_rate = channel(errors.state, kYaw);
  message.sensory_error_yaw_rate = channel(errors.sensory, kYawRate);
  message.sensory_error_wheel_left = channel(errors.sensory, kWheelLeft);
  message.sensory_error_wheel_right = channel(errors.sensory, kWheelRight);
  message.free_energy = controller.freeEnergy();
  return message;
}

ControllerState stateMessage(const PredictiveController& controller) {
  const BodyVector belief = controller.believedVelocity();
  const SensorVector& errors = controller.sensoryErrors();
  ControllerState message;
  message.structure = ControllerState::PREDICTIVE;
  message.belief_forward = {belief(kForward)};
  message.belief_lateral = {belief(kLateral)};
  message.belief_yaw_rate = {belief(kYaw)};
  message.sensory_error_yaw_rate = {errors(kYawRate)};
  message.sensory_error_wheel_left = {errors(kWheelLeft)};
  message.sensory_error_wheel_right = {errors(kWheelRight)};
  message.free_energy = controller.freeEnergy();
  message.effective_track = controller.effectiveTrack();
  message.slip_factor = controller.slipBelief().slipFactor();
  message.dead_time = controller.model().dead_time;
  message.lag = controller.model().lag;
  const Eigen::Vector4d& turn = controller.slipBelief().turn().mean();
  std::copy(turn.data(), turn.data() + turn.size(), message.turn_coefficients.begin());
  message.learning_frozen = controller.learningFrozen();
  message.wheel_belief_left = controller.left().speed();
  message.wheel_belief_right = controller.right().speed();
  message.disturbance_left = controller.left().disturbance();
  message.disturbance_right = controller.right().disturbance();
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

}  // namespace jackal_aic
