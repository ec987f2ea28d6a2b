#include "sensor_pairing.hpp"

#include "conversions.hpp"

namespace jackal_aic {
namespace {

constexpr int kQueueLength = 20;
/// Both sensors run at 50 Hz: knowing that the next message is at least this far away lets the pairing decide at once
/// instead of waiting a period for a better partner. A robot that is busy stamps some only 2 ms apart: those it does
/// not get, as there is nothing new in them.
const ros::Duration kShortestPeriod(0.010);

bool followsClosely(const ros::Time& stamp, const ros::Time& last) {
  return !last.isZero() && stamp >= last && stamp - last < kShortestPeriod;
}

}  // namespace

SensorPairing::SensorPairing(const RobotNames& names, const FixedFrames& frames, Callback callback)
    : names_(names), imu_reader_(names.base_frame, frames), callback_(std::move(callback)) {
  reset();
}

void SensorPairing::reset() {
  paired_wheels_ = paired_imu_ = ros::Time();
  accelerations_.reset();
  // A new synchronizer, because the old one keeps messages and refuses stamps from before them.
  synchronizer_.reset();
  Policy policy(kQueueLength);
  policy.setInterMessageLowerBound(0, kShortestPeriod);
  policy.setInterMessageLowerBound(1, kShortestPeriod);
  policy.setMaxIntervalDuration(ros::Duration(names_.pairing_tolerance));
  synchronizer_ = std::make_unique<message_filters::Synchronizer<Policy>>(policy);
  synchronizer_->connectInput(wheel_input_, imu_input_);
  synchronizer_->registerCallback(&SensorPairing::onPair, this);
}

std::nullopt_t SensorPairing::refuse(const std::string& reason) {
  refusal_ = reason;
  return std::nullopt;
}

std::optional<SensorReading> SensorPairing::addWheels(const sensor_msgs::JointStateConstPtr& message,
                                                      const ros::Time& now) {
  refusal_.clear();
  const bool left = mentionsAny(*message, names_.left_wheel_joints);
  const bool right = mentionsAny(*message, names_.right_wheel_joints);
  if (!left && !right) return std::nullopt;
  if (!left || !right) return refuse("joint states with the wheels of one side only");
  if (message->header.stamp.isZero()) return refuse("joint states without a stamp");
  if (message->header.stamp > now + ros::Duration(kFurthestAhead)) return refuse("joint states from the future");
  if (!meanVelocity(*message, names_.left_wheel_joints) || !meanVelocity(*message, names_.right_wheel_joints)) {
    return refuse("joint states with a wheel velocity that is missing or not finite");
  }
  if (!followsClosely(message->header.stamp, paired_wheels_)) {
    paired_wheels_ = message->header.stamp;
    wheel_input_.add(message);
  }
  return wheelReading(*message);
}

std::optional<SensorReading> SensorPairing::addImu(const sensor_msgs::ImuConstPtr& message, const ros::Time& now) {
  refusal_.clear();
  const std::optional<SensorReading> reading = imu_reader_.read(*message, now);
  if (!reading) return refuse(imu_reader_.lastRefusal());
  const Observation& y = reading->observation;
  accelerations_.add({y.acceleration_x, y.acceleration_y, y.acceleration_z.value_or(0.0)}, y.stamp);
  if (!followsClosely(message->header.stamp, paired_imu_)) {
    paired_imu_ = message->header.stamp;
    imu_input_.add(message);
  }
  return reading;
}

// Messages were checked when they came in, so that the values are there.

Observation SensorPairing::wheelsAlone(const sensor_msgs::JointState& message) const {
  Observation observation;
  observation.stamp = message.header.stamp.toSec();
  observation.wheel_left = *meanVelocity(message, names_.left_wheel_joints);
  observation.wheel_right = *meanVelocity(message, names_.right_wheel_joints);
  observation.valid.yaw_rate = observation.valid.acceleration = false;
  return observation;
}

SensorReading SensorPairing::wheelReading(const sensor_msgs::JointState& message) const {
  SensorReading reading{wheelsAlone(message), FrozenSource::Sample::Zero()};
  const auto left = sumOfPositions(message, names_.left_wheel_joints);
  const auto right = sumOfPositions(message, names_.right_wheel_joints);
  reading.sample.head<4>() << reading.observation.wheel_left, reading.observation.wheel_right, left.value_or(0.0),
      right.value_or(0.0);
  // Speeds alone repeat for as long as the wheels keep them, where they are coarser than their noise: whether they miss
  // a motion is for the fault detection to find.
  reading.may_repeat = !left || !right;
  return reading;
}

void SensorPairing::onPair(const sensor_msgs::JointStateConstPtr& wheels, const sensor_msgs::ImuConstPtr& imu) {
  const Observation encoders = wheelsAlone(*wheels);
  Observation observation = imu_reader_.observation(*imu);
  observation.stamp = encoders.stamp;
  observation.wheel_left = encoders.wheel_left;
  observation.wheel_right = encoders.wheel_right;
  observation.valid.wheel_left = observation.valid.wheel_right = true;
  const Eigen::Vector3d acceleration = accelerations_.take(observation.stamp);
  observation.acceleration_x = acceleration.x();
  observation.acceleration_y = acceleration.y();
  if (observation.acceleration_z) observation.acceleration_z = acceleration.z();
  callback_(observation, wheels->header.stamp);
}

}  // namespace jackal_aic
