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
  for (const Wheel left : {kFrontLeft, kRearLeft}) {
    if (p.wheel_radius_left > 0.0) model.wheels[left].radius = p.wheel_radius_left;
  }
  for (const Wheel right : {kFrontRight, kRearRight}) {
    if (p.wheel_radius_right > 0.0) model.wheels[right].radius = p.wheel_radius_right;
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
  return observation;
}

struct JackalPlant::Implementation {
  /// State of the simulation; rebuilt by reset().
  struct Motion {
    Motion(const RobotModel& model, const PlantParameters& p)
        : world(model, p),
          delay(p.dead_time, kStep),
          left(p, model.wheels[kFrontLeft].radius, kStep),
          right(p, model.wheels[kFrontRight].radius, kStep),
          encoder_filter(p.encoder_filter, kStep),
          sampling(p.sensor_rate),
          imu_sampling(p.imu_rate),
          feedback_sampling(p.feedback_rate),
          sensors(p, {model.wheels[kFrontLeft].radius, model.wheels[kFrontRight].radius}) {}

    OdeWorld world;
    CommandDelay delay;
    MotorLoop left;
    MotorLoop right;
    EncoderFilter encoder_filter;
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

  Implementation(const RobotModel& robot, const PlantParameters& p) : model(changed(robot, p)), parameters(p) {
    reset();
  }

  void reset() {
    motion = std::make_unique<Motion>(model, parameters);
    motion->truth.wheel_position.fill(0.0);
    observe();
  }

  void step() {
    Motion& m = *motion;
    m.truth.acting_command = m.delay.acting(m.steps);
    m.world.push({m.push.x(), m.push.y(), 0.0}, m.push.z());
    m.world.lift(m.lifted);
    supply = voltage();
    drive(m.left, m.left_blocked, m.truth.acting_command.left, kFrontLeft, kRearLeft);
    drive(m.right, m.right_blocked, m.truth.acting_command.right, kFrontRight, kRearRight);
    m.world.step(kStep);
    ++m.steps;
    for (std::size_t i = 0; i < kWheelJoints.size(); ++i) m.truth.wheel_position[i] += kStep * m.world.wheelSpeed(i);
    observe();
  }

  /// Share of its full voltage that the battery gives: less with the time and with the load of the last step.
  double voltage() const {
    const PlantParameters& p = parameters;
    if (p.battery_sag == 0.0 && p.battery_discharge == 0.0) return 1.0;
    double torque = 0.0;
    for (std::size_t i = 0; i < kWheelJoints.size(); ++i) torque += std::abs(motion->world.wheelTorque(i));
    const double load = torque / (p.torque_limit * static_cast<double>(kWheelJoints.size()));
    return std::max(kLowestVoltage, 1.0 - p.battery_sag * load - p.battery_discharge * motion->truth.time / 3600.0);
  }

  /// One motor drives both wheels of its side.
  void drive(MotorLoop& motor, bool blocked, double command, Wheel front, Wheel rear) {
    OdeWorld& world = motion->world;
    const double speed = 0.5 * (world.wheelSpeed(front) + world.wheelSpeed(rear));
    const double reference = blocked ? 0.0 : motor.reference(command, speed, supply);
    world.setWheelReference(front, reference);
    world.setWheelReference(rear, reference);
  }

  void observe() {
    Motion& m = *motion;
    const ChassisState chassis = m.world.chassis();
    updateTruth(chassis);
    PlantTruth seen = m.truth;
    seen.wheel_velocity = m.encoder_filter.update(m.truth.wheel_velocity);
    m.force_sum += specificForce(chassis);
    ++m.force_count;
    const bool own_feedback = parameters.feedback_rate > 0.0, own_imu = parameters.imu_rate > 0.0;
    if (own_feedback && m.feedback_sampling.due(m.truth.time)) {
      m.feedback = m.sensors.wheels(seen, sensorInput(chassis));
    }
    if (own_imu) {
      if (m.imu_sampling.due(m.truth.time)) takeImuSample(seen, chassis);
      m.imu_measurement = m.imu_samples.receive(m.truth.time);
      if (m.imu_measurement) {
        m.imu = *m.imu_measurement;
        m.accelerations.add(m.imu.linear_acceleration, m.imu.stamp);
      }
    }
    if (m.sampling.due(m.truth.time)) takeSample(seen, chassis);
    m.measurement = m.samples.receive(m.truth.time);
    if (!own_imu) {
      m.imu_measurement = m.measurement;
    } else if (m.measurement) {
      const double stamp = m.measurement->stamp;
      // Paired as the receiver of both pairs them.
      static_cast<ImuMeasurement&>(*m.measurement) = m.imu;
      m.measurement->stamp = stamp;
      m.measurement->linear_acceleration = m.accelerations.take(stamp);
    }
  }

  /// Travel of the next message to its reader; the first sample arrives at once.
  double travel() const {
    return parameters.network_delay > 0.0 && motion->steps > 0 ? motion->sensors.drawTravel() : 0.0;
  }

  void takeImuSample(const PlantTruth& seen, const ChassisState& chassis) {
    Motion& m = *motion;
    const ImuMeasurement sample = m.sensors.imu(seen, sensorInput(chassis));
    const double delay = m.sensors.drawDelay(SampleMessage::imu);
    if (!m.sensors.losesSample(SampleMessage::imu)) m.imu_samples.send(sample, seen.time + delay, travel());
    restartMean();
  }

  void restartMean() {
    motion->force_sum.setZero();
    motion->force_count = 0;
  }

  void takeSample(const PlantTruth& seen, const ChassisState& chassis) {
    Motion& m = *motion;
    const bool own_imu = parameters.imu_rate > 0.0, own_feedback = parameters.feedback_rate > 0.0;
    PlantMeasurement sample;
    if (!own_feedback) static_cast<WheelFeedback&>(sample) = m.sensors.wheels(seen, sensorInput(chassis));
    if (!own_imu) static_cast<ImuMeasurement&>(sample) = m.sensors.imu(seen, sensorInput(chassis));
    const bool repeats = m.sensors.repeatsFeedback();
    if (own_feedback && !repeats) m.published = m.feedback;
    if (!own_feedback && !repeats) m.published = sample;
    static_cast<WheelFeedback&>(sample) = m.published;
    const double delay = m.sensors.drawDelay();
    if (!m.sensors.losesSample()) m.samples.send(sample, seen.time + delay, travel());
    if (!own_imu) restartMean();
  }

  void updateTruth(const ChassisState& chassis) {
    PlantTruth& truth = motion->truth;
    const Eigen::Vector3d arm = chassis.orientation * -model.chassis.centre;
    const Eigen::Quaterniond to_base = chassis.orientation.conjugate();
    truth.time = static_cast<double>(motion->steps) * kStep;
    truth.position = chassis.position + arm;
    truth.orientation = chassis.orientation;
    truth.linear_velocity = to_base * (chassis.velocity + chassis.angular_velocity.cross(arm));
    truth.angular_velocity = to_base * chassis.angular_velocity;
    for (std::size_t i = 0; i < kWheelJoints.size(); ++i) truth.wheel_velocity[i] = motion->world.wheelSpeed(i);
  }

  Eigen::Quaterniond imuOrientation(const ChassisState& chassis) const {
    return chassis.orientation * Eigen::Quaterniond(model.imu.linear());
  }

  Eigen::Vector3d specificForce(const ChassisState& chassis) const {
    const Eigen::Vector3d arm = chassis.orientation * (model.imu.translation() - model.chassis.centre);
    const Eigen::Vector3d& w = chassis.angular_velocity;
    const Eigen::Vector3d acceleration =
        chassis.acceleration + chassis.angular_acceleration.cross(arm) + w.cross(w.cross(arm));
    return imuOrientation(chassis).conjugate() * (acceleration - motion->world.gravity());
  }

  SensorInput sensorInput(const ChassisState& chassis) const {
    const Eigen::Quaterniond imu = imuOrientation(chassis);
    SensorInput input;
    for (std::size_t i = 0; i < kWheelJoints.size(); ++i) input.wheel_effort[i] = motion->world.wheelTorque(i);
    input.angular_velocity = imu.conjugate() * chassis.angular_velocity;
    input.specific_force = motion->force_sum / std::max(1, motion->force_count);
    input.orientation = Eigen::AngleAxisd(-parameters.slope * kRadiansPerDegree, Eigen::Vector3d::UnitY()) * imu;
    return input;
  }

  RobotModel model;
  PlantParameters parameters;
  double supply = 1.0;  // share of the full voltage in the present step
  std::unique_ptr<Motion> motion;
};

JackalPlant::JackalPlant(const std::string& urdf_xml, const PlantParameters& parameters)
    : self_(std::make_unique<Implementation>(readRobotModel(urdf_xml), parameters)) {}

JackalPlant::~JackalPlant() = default;
JackalPlant::JackalPlant(JackalPlant&&) noexcept = default;
JackalPlant& JackalPlant::operator=(JackalPlant&&) noexcept = default;

bool JackalPlant::command(const WheelCommand& command) {
  if (!std::isfinite(command.left) || !std::isfinite(command.right)) return false;
  Implementation::Motion& m = *self_->motion;
  const double travel = self_->parameters.network_delay > 0.0 ? m.sensors.drawTravel() : 0.0;
  m.delay.push(m.steps, command, std::llround(travel / kStep));
  return true;
}

void JackalPlant::step() { self_->step(); }

double JackalPlant::time() const { return self_->motion->truth.time; }

const std::optional<PlantMeasurement>& JackalPlant::measurement() const { return self_->motion->measurement; }

const std::optional<ImuMeasurement>& JackalPlant::imuMeasurement() const { return self_->motion->imu_measurement; }

const PlantTruth& JackalPlant::truth() const { return self_->motion->truth; }

void JackalPlant::setFriction(double friction) {
  if (!(friction >= 0.0) || !std::isfinite(friction)) {
    throw ParameterError("friction = " + describe(ParameterValue(friction)) + ": must be 0 or more");
  }
  self_->motion->world.setFriction(friction);
}

void JackalPlant::changeMotors(double gain, double offset) {
  if (!(gain > 0.0) || !(offset >= 0.0) || !std::isfinite(gain) || !std::isfinite(offset)) {
    throw ParameterError("wheel_gain = " + describe(ParameterValue(gain)) +
                         ", wheel_offset = " + describe(ParameterValue(offset)) + ": must be above 0, 0 or more");
  }
  self_->motion->left.change(gain, offset);
  self_->motion->right.change(gain, offset);
}

void JackalPlant::blockWheels(Side side, bool blocked) {
  (side == Side::left ? self_->motion->left_blocked : self_->motion->right_blocked) = blocked;
}

void JackalPlant::push(double forward, double left, double torque) { self_->motion->push = {forward, left, torque}; }

void JackalPlant::lift(bool lifted) { self_->motion->lifted = lifted; }

void JackalPlant::reset() { self_->reset(); }

}  // namespace jackal_aic::sim
