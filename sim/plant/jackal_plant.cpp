#include "jackal_plant.hpp"

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/acceleration_pairing.hpp"
#include "jackal_aic/model/gravity.hpp"
#include "motor.hpp"
#include "ode_world.hpp"
#include "periodic.hpp"
#include "robot_model.hpp"
#include "sensors.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kLowestVoltage = 0.5;  // share of the full one; below, a battery switches itself off

/// The payload is distributed as the chassis' mass: at the chassis' centre of mass it scales mass and inertia.
RigidBody loaded(const RigidBody& chassis, const PlantParameters& p) {
  const Eigen::Vector3d offset(p.payload_x, p.payload_y, p.payload_z);
  const double scale = p.payload / chassis.mass;
  if (!offset.isZero(0.0)) return chassis + RigidBody{p.payload, chassis.centre + offset, scale * chassis.inertia};
  return {chassis.mass * (1.0 + scale), chassis.centre, chassis.inertia * (1.0 + scale)};
}

/// The robot of the URDF with the load and tyres of the parameters.
RobotModel changed(RobotModel model, const PlantParameters& p) {
  model.chassis = loaded(model.chassis, p);
  for (const Wheel wheel : {kFrontLeft, kFrontRight, kRearLeft, kRearRight}) {
    const double radius = wheel == kFrontLeft || wheel == kRearLeft ? p.wheel_radius_left : p.wheel_radius_right;
    if (radius > 0.0) model.wheels[wheel].radius = radius;
  }
  return model;
}

}  // namespace

Observation PlantMeasurement::observation() const {
  Observation observation;
  observation.stamp = stamp;
  observation.yaw_rate = angular_velocity.z();
  observation.wheel_left = 0.5 * (wheel_velocity[kFrontLeft] + wheel_velocity[kRearLeft]);
  observation.wheel_right = 0.5 * (wheel_velocity[kFrontRight] + wheel_velocity[kRearRight]);
  const Eigen::Vector3d motion = linear_acceleration - gravityReaction(orientation);
  observation.acceleration_x = motion.x();
  observation.acceleration_y = motion.y();
  observation.acceleration_z = linear_acceleration.z();
  observation.level = true;
  return observation;
}

struct JackalPlant::Implementation {
  Implementation(const RobotModel& robot, const PlantParameters& p)
      : model(changed(robot, p)),
        parameters(p),
        world(model, p),
        delay(p.dead_time, kStep),
        left(p, model.wheels[kFrontLeft].radius, kStep),
        right(p, model.wheels[kFrontRight].radius, kStep),
        encoder_lag(p.encoder_filter > 0.0 ? std::exp(-kStep / p.encoder_filter) : 0.0),
        sampling(p.sensor_rate),
        imu_sampling(p.imu_rate),
        feedback_sampling(p.feedback_rate),
        sensors(p, {model.wheels[kFrontLeft].radius, model.wheels[kFrontRight].radius}) {
    truth.wheel_position.fill(0.0);
    observe();
  }

  void step() {
    truth.acting_command = delay.acting(steps);
    world.push({push.x(), push.y(), 0.0}, push.z());
    world.lift(lifted);
    supply = voltage();
    drive(left, left_blocked, truth.acting_command.left, kFrontLeft, kRearLeft);
    drive(right, right_blocked, truth.acting_command.right, kFrontRight, kRearRight);
    world.step();
    ++steps;
    for (std::size_t i = 0; i < kWheelJoints.size(); ++i) truth.wheel_position[i] += kStep * world.wheelSpeed(i);
    observe();
  }

  /// Share of its full voltage that the battery gives: less with the time and with the load of the last step.
  double voltage() const {
    const PlantParameters& p = parameters;
    if (p.battery_sag == 0.0 && p.battery_discharge == 0.0) return 1.0;
    double torque = 0.0;
    for (std::size_t i = 0; i < kWheelJoints.size(); ++i) torque += std::abs(world.wheelTorque(i));
    const double load = torque / (p.torque_limit * static_cast<double>(kWheelJoints.size()));
    return std::max(kLowestVoltage, 1.0 - p.battery_sag * load - p.battery_discharge * truth.time / 3600.0);
  }

  /// One motor drives both wheels of its side.
  void drive(MotorLoop& motor, bool blocked, double command, Wheel front, Wheel rear) {
    const double speed = 0.5 * (world.wheelSpeed(front) + world.wheelSpeed(rear));
    const double reference = blocked ? 0.0 : motor.reference(command, speed, supply);
    world.setWheelReference(front, reference);
    world.setWheelReference(rear, reference);
  }

  void observe() {
    const ChassisState chassis = world.chassis();
    updateTruth(chassis);
    PlantTruth seen = truth;
    // A low-pass, exact for constant speeds: dw_f/dt = (w - w_f) / T.
    for (std::size_t i = 0; i < filtered.size(); ++i) {
      seen.wheel_velocity[i] = filtered[i] =
          seen.wheel_velocity[i] + encoder_lag * (filtered[i] - seen.wheel_velocity[i]);
    }
    force_sum += specificForce(chassis);
    ++force_count;
    const bool own_feedback = parameters.feedback_rate > 0.0, own_imu = parameters.imu_rate > 0.0;
    if (own_feedback && feedback_sampling.due(truth.time)) {
      feedback = sensors.wheels(seen, sensorInput(chassis));
    }
    if (own_imu) {
      if (imu_sampling.due(truth.time)) takeImuSample(seen, chassis);
      imu_measurement = imu_samples.receive(truth.time);
      if (imu_measurement) {
        imu = *imu_measurement;
        accelerations.add(imu.linear_acceleration, imu.stamp);
      }
    }
    if (sampling.due(truth.time)) takeSample(seen, chassis);
    measurement = samples.receive(truth.time);
    if (!own_imu) {
      imu_measurement = measurement;
    } else if (measurement) {
      const double stamp = measurement->stamp;
      // Paired as the receiver of both pairs them.
      static_cast<ImuMeasurement&>(*measurement) = imu;
      measurement->stamp = stamp;
      measurement->linear_acceleration = accelerations.take(stamp);
    }
  }

  /// Travel of the next message to its reader; the first sample arrives at once.
  double travel() { return parameters.network_delay > 0.0 && steps > 0 ? sensors.drawTravel() : 0.0; }

  void takeImuSample(const PlantTruth& seen, const ChassisState& chassis) {
    const ImuMeasurement sample = sensors.imu(seen, sensorInput(chassis));
    const double late = sensors.drawDelay(SampleMessage::imu);
    if (!sensors.losesSample(SampleMessage::imu)) imu_samples.send(sample, seen.time + late, travel());
    restartMean();
  }

  void restartMean() {
    force_sum.setZero();
    force_count = 0;
  }

  void takeSample(const PlantTruth& seen, const ChassisState& chassis) {
    const bool own_imu = parameters.imu_rate > 0.0, own_feedback = parameters.feedback_rate > 0.0;
    PlantMeasurement sample;
    if (!own_feedback) static_cast<WheelFeedback&>(sample) = sensors.wheels(seen, sensorInput(chassis));
    if (!own_imu) static_cast<ImuMeasurement&>(sample) = sensors.imu(seen, sensorInput(chassis));
    const bool repeats = sensors.repeatsFeedback();
    if (own_feedback && !repeats) published = feedback;
    if (!own_feedback && !repeats) published = sample;
    static_cast<WheelFeedback&>(sample) = published;
    const double late = sensors.drawDelay();
    if (!sensors.losesSample()) samples.send(sample, seen.time + late, travel());
    if (!own_imu) restartMean();
  }

  void updateTruth(const ChassisState& chassis) {
    const Eigen::Vector3d arm = chassis.orientation * -model.chassis.centre;
    const Eigen::Quaterniond to_base = chassis.orientation.conjugate();
    truth.time = static_cast<double>(steps) * kStep;
    truth.position = chassis.position + arm;
    truth.orientation = chassis.orientation;
    truth.linear_velocity = to_base * (chassis.velocity + chassis.angular_velocity.cross(arm));
    truth.angular_velocity = to_base * chassis.angular_velocity;
    for (std::size_t i = 0; i < kWheelJoints.size(); ++i) truth.wheel_velocity[i] = world.wheelSpeed(i);
  }

  Eigen::Quaterniond imuOrientation(const ChassisState& chassis) const {
    return chassis.orientation * Eigen::Quaterniond(model.imu.linear());
  }

  Eigen::Vector3d specificForce(const ChassisState& chassis) const {
    const Eigen::Vector3d arm = chassis.orientation * (model.imu.translation() - model.chassis.centre);
    const Eigen::Vector3d& w = chassis.angular_velocity;
    const Eigen::Vector3d acceleration =
        chassis.acceleration + chassis.angular_acceleration.cross(arm) + w.cross(w.cross(arm));
    return imuOrientation(chassis).conjugate() * (acceleration - world.gravity());
  }

  SensorInput sensorInput(const ChassisState& chassis) const {
    const Eigen::Quaterniond frame = imuOrientation(chassis);
    SensorInput input;
    for (std::size_t i = 0; i < kWheelJoints.size(); ++i) input.wheel_effort[i] = world.wheelTorque(i);
    input.angular_velocity = frame.conjugate() * chassis.angular_velocity;
    input.specific_force = force_sum / std::max(1, force_count);
    input.orientation = Eigen::AngleAxisd(-parameters.slope * kRadiansPerDegree, Eigen::Vector3d::UnitY()) * frame;
    return input;
  }

  RobotModel model;
  PlantParameters parameters;
  double supply = 1.0;  // share of the full voltage in the present step
  OdeWorld world;
  CommandDelay delay;
  MotorLoop left;
  MotorLoop right;
  double encoder_lag;                // exp(-step/T): part of the difference that a step leaves
  std::array<double, 4> filtered{};  // wheel speeds as the encoders see them [rad/s]
  Periodic sampling;
  Periodic imu_sampling;
  Periodic feedback_sampling;
  SensorModel sensors;
  SampleQueue<PlantMeasurement> samples;
  SampleQueue<ImuMeasurement> imu_samples;
  ImuMeasurement imu;  // the newest arrived one, with its own rate
  AccelerationPairing accelerations;
  WheelFeedback feedback;                          // the newest, with its own rate
  WheelFeedback published;                         // that of the last sample
  Eigen::Vector3d push = Eigen::Vector3d::Zero();  // along, across [N] and about the vertical [N m]
  bool lifted = false;
  bool left_blocked = false;
  bool right_blocked = false;
  std::int64_t steps = 0;
  Eigen::Vector3d force_sum = Eigen::Vector3d::Zero();  // of the specific force in imu_link since the last sample
  int force_count = 0;
  PlantTruth truth;
  std::optional<PlantMeasurement> measurement;
  std::optional<ImuMeasurement> imu_measurement;
};

JackalPlant::JackalPlant(const std::string& urdf_xml, const PlantParameters& parameters)
    : self_(std::make_unique<Implementation>(readRobotModel(urdf_xml), parameters)) {}

JackalPlant::~JackalPlant() = default;
JackalPlant::JackalPlant(JackalPlant&&) noexcept = default;
JackalPlant& JackalPlant::operator=(JackalPlant&&) noexcept = default;

bool JackalPlant::command(const WheelCommand& command) {
  if (!std::isfinite(command.left) || !std::isfinite(command.right)) return false;
  const double travel = self_->parameters.network_delay > 0.0 ? self_->sensors.drawTravel() : 0.0;
  self_->delay.push(self_->steps, command, std::llround(travel / kStep));
  return true;
}

void JackalPlant::step() { self_->step(); }

double JackalPlant::time() const { return self_->truth.time; }

const std::optional<PlantMeasurement>& JackalPlant::measurement() const { return self_->measurement; }

const std::optional<ImuMeasurement>& JackalPlant::imuMeasurement() const { return self_->imu_measurement; }

const PlantTruth& JackalPlant::truth() const { return self_->truth; }

void JackalPlant::setFriction(double friction) {
  if (!(friction >= 0.0) || !std::isfinite(friction)) {
    throw ParameterError("friction = " + describe(ParameterValue(friction)) + ": must be 0 or more");
  }
  self_->world.setFriction(friction);
}

void JackalPlant::changeMotors(double gain, double offset) {
  if (!(gain > 0.0) || !(offset >= 0.0) || !std::isfinite(gain) || !std::isfinite(offset)) {
    throw ParameterError("wheel_gain = " + describe(ParameterValue(gain)) +
                         ", wheel_offset = " + describe(ParameterValue(offset)) + ": must be above 0, 0 or more");
  }
  self_->left.change(gain, offset);
  self_->right.change(gain, offset);
}

void JackalPlant::blockWheels(Side side, bool blocked) {
  (side == Side::left ? self_->left_blocked : self_->right_blocked) = blocked;
}

void JackalPlant::push(double forward, double left, double torque) { self_->push = {forward, left, torque}; }

void JackalPlant::lift(bool lifted) { self_->lifted = lifted; }

}  // namespace jackal_aic::sim
