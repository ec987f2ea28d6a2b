#include "inputs/sensors.hpp"

#include <geometry_msgs/TransformStamped.h>
#include <tf2/exceptions.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "jackal_aic/config/text.hpp"
#include "jackal_aic/model/gravity.hpp"
#include "parameters/ros_parameters.hpp"

namespace jackal_aic {
namespace {

/// Both sensors run at 50 Hz: knowing that the next message is at least this far away lets the pairing decide at once
/// instead of waiting a period for a better partner. A busy robot stamps some messages only 2 ms apart; they contain no
/// new data and are not paired.
const ros::Duration kShortestPeriod(0.010);

bool followsClosely(const ros::Time& stamp, const ros::Time& last) {
  return !last.isZero() && stamp >= last && stamp - last < kShortestPeriod;
}

bool contains(const std::vector<std::string>& list, const std::string& name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

/// Why a stamp is unusable; empty if it is usable.
std::string refusalOf(const std::string& what, const ros::Time& stamp, const ros::Time& now) {
  if (stamp.isZero()) return what + " without a stamp";
  return stamp > now + ros::Duration(kFurthestAhead) ? what + " from the future" : "";
}

/// Mean of those of the joints that a message lists. std::nullopt if it lists none of them, or a value is missing, or
/// the mean is not finite. @param values of the message.
std::optional<double> meanOf(const sensor_msgs::JointState& message, const std::vector<double>& values,
                             const std::vector<std::string>& joints) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < message.name.size(); ++i) {
    if (!contains(joints, message.name[i])) continue;
    if (i >= values.size()) return std::nullopt;
    sum += values[i];
    ++count;
  }
  return count > 0 && std::isfinite(sum) ? std::optional<double>(sum / count) : std::nullopt;
}

}  // namespace

bool mentionsAny(const sensor_msgs::JointState& message, const std::vector<std::string>& joints) {
  return std::any_of(message.name.begin(), message.name.end(),
                     [&](const std::string& name) { return contains(joints, name); });
}

std::optional<Observation> wheelObservation(const sensor_msgs::JointState& message, const RobotNames& names) {
  const auto left = meanOf(message, message.velocity, names.left_wheel_joints);
  const auto right = meanOf(message, message.velocity, names.right_wheel_joints);
  if (!left || !right) return std::nullopt;
  Observation observation;
  observation.stamp = message.header.stamp.toSec();
  observation.wheel_left = *left;
  observation.wheel_right = *right;
  observation.valid.yaw_rate = observation.valid.acceleration = false;
  return observation;
}

std::optional<Observation> imuObservation(const sensor_msgs::Imu& message, const Eigen::Quaterniond& rotation) {
  const auto& w = message.angular_velocity;
  const auto& a = message.linear_acceleration;
  const Eigen::Vector3d angular = rotation * Eigen::Vector3d(w.x, w.y, w.z);
  const Eigen::Vector3d force = rotation * Eigen::Vector3d(a.x, a.y, a.z);
  if (!angular.allFinite() || !force.allFinite()) return std::nullopt;
  Eigen::Vector2d level = force.head<2>();
  // sensor_msgs/Imu: a first covariance of -1 says that there is no attitude.
  const auto& q = message.orientation;
  const auto attitude = message.orientation_covariance[0] == -1.0 ? std::nullopt : unitAttitude({q.w, q.x, q.y, q.z});
  if (attitude) level -= (rotation * gravityReaction(*attitude)).head<2>();
  Observation observation{message.header.stamp.toSec(), angular.z(), 0.0, 0.0, level.x(), level.y()};
  observation.acceleration_z = force.z();
  observation.level = attitude.has_value();
  observation.valid.wheel_left = observation.valid.wheel_right = false;
  // REP 145: a first covariance of -1 says that the sensor is absent.
  observation.valid.yaw_rate = message.angular_velocity_covariance[0] >= 0.0;
  observation.valid.acceleration = message.linear_acceleration_covariance[0] >= 0.0;
  return observation;
}

Observation paired(const Observation& wheels, Observation imu) {
  imu.stamp = wheels.stamp;
  imu.wheel_left = wheels.wheel_left;
  imu.wheel_right = wheels.wheel_right;
  imu.valid.wheel_left = imu.valid.wheel_right = true;
  return imu;
}

std::optional<Eigen::Quaterniond> rotationInto(const std::string& base, const std::string& frame,
                                               const tf2::BufferCore& frames) {
  const std::string to = prefixedFrame("", base), from = prefixedFrame("", frame);
  if (to == from) return Eigen::Quaterniond::Identity();
  try {
    const auto q = frames.lookupTransform(to, from, ros::Time(0)).transform.rotation;
    return Eigen::Quaterniond(q.w, q.x, q.y, q.z);
  } catch (const tf2::TransformException&) {
    return std::nullopt;
  }
}

std::optional<SensorReading> ImuReader::read(const sensor_msgs::Imu& message, const ros::Time& now) {
  refusal_ = refusalOf("IMU data", message.header.stamp, now);
  const auto rotation = rotationInto(base_frame_, message.header.frame_id, frames_);
  if (refusal_.empty() && !rotation) {
    refusal_ = "IMU data in frame " + jackal_aic::quoted(message.header.frame_id) + ", which tf does not relate to " +
               jackal_aic::quoted(base_frame_);
  }
  const auto observation = rotation ? imuObservation(message, *rotation) : std::nullopt;
  if (refusal_.empty() && !observation) refusal_ = "IMU data that is not finite";
  if (!refusal_.empty()) return std::nullopt;
  rotation_ = *rotation;
  SensorReading reading{*observation, InputSource::Sample::Zero()};
  const auto& w = message.angular_velocity;
  const auto& a = message.linear_acceleration;
  reading.sample.head<6>() << w.x, w.y, w.z, a.x, a.y, a.z;
  return reading;
}

SensorPairing::SensorPairing(const RobotNames& names, const tf2::BufferCore& frames, Callback callback)
    : names_(names), imu_reader_(names.base_frame, frames), callback_(std::move(callback)) {
  reset();
}

void SensorPairing::reset() {
  paired_wheels_ = paired_imu_ = ros::Time();
  accelerations_.reset();
  // A new synchronizer, because the old one keeps messages and refuses stamps from before them.
  synchronizer_.reset();
  Policy policy(20);
  policy.setInterMessageLowerBound(0, kShortestPeriod);
  policy.setInterMessageLowerBound(1, kShortestPeriod);
  policy.setMaxIntervalDuration(ros::Duration(names_.pairing_tolerance));
  synchronizer_ = std::make_unique<message_filters::Synchronizer<Policy>>(policy);
  synchronizer_->connectInput(wheel_input_, imu_input_);
  synchronizer_->registerCallback(&SensorPairing::onPair, this);
}

std::optional<SensorReading> SensorPairing::addWheels(const sensor_msgs::JointStateConstPtr& message,
                                                      const ros::Time& now) {
  refusal_.clear();
  const bool left_side = mentionsAny(*message, names_.left_wheel_joints);
  const bool right_side = mentionsAny(*message, names_.right_wheel_joints);
  if (!left_side && !right_side) return std::nullopt;
  refusal_ = left_side && right_side ? refusalOf("joint states", message->header.stamp, now)
                                     : "joint states with the wheels of one side only";
  const auto observation = wheelObservation(*message, names_);
  if (refusal_.empty() && !observation) refusal_ = "joint states with a wheel velocity that is missing or not finite";
  if (!refusal_.empty()) return std::nullopt;
  if (!followsClosely(message->header.stamp, paired_wheels_)) {
    paired_wheels_ = message->header.stamp;
    wheel_input_.add(message);
  }
  SensorReading reading{*observation, InputSource::Sample::Zero()};
  const auto left = meanOf(*message, message->position, names_.left_wheel_joints);
  const auto right = meanOf(*message, message->position, names_.right_wheel_joints);
  reading.sample.head<4>() << reading.observation.wheel_left, reading.observation.wheel_right, left.value_or(0.0),
      right.value_or(0.0);
  // Speeds that are coarser than their noise repeat at constant speed, so the fault detection decides whether they are
  // frozen.
  reading.may_repeat = !left || !right;
  return reading;
}

std::optional<SensorReading> SensorPairing::addImu(const sensor_msgs::ImuConstPtr& message, const ros::Time& now) {
  const std::optional<SensorReading> reading = imu_reader_.read(*message, now);
  refusal_ = imu_reader_.lastRefusal();
  if (!reading) return std::nullopt;
  const Observation& y = reading->observation;
  accelerations_.add({y.acceleration_x, y.acceleration_y, y.acceleration_z.value_or(0.0)}, y.stamp);
  if (!followsClosely(message->header.stamp, paired_imu_)) {
    paired_imu_ = message->header.stamp;
    imu_input_.add(message);
  }
  return reading;
}

// Messages were checked on arrival, so the values exist.
void SensorPairing::onPair(const sensor_msgs::JointStateConstPtr& wheels, const sensor_msgs::ImuConstPtr& imu) {
  Observation observation = paired(*wheelObservation(*wheels, names_), *imuObservation(*imu, imu_reader_.rotation()));
  const Eigen::Vector3d acceleration = accelerations_.take(observation.stamp);
  observation.acceleration_x = acceleration.x();
  observation.acceleration_y = acceleration.y();
  if (observation.acceleration_z) observation.acceleration_z = acceleration.z();
  callback_(observation, wheels->header.stamp);
}

}  // namespace jackal_aic
