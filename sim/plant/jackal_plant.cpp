#include "jackal_plant.hpp"

#include <cmath>

#include "jackal_aic/model/gravity.hpp"
#include "motor.hpp"
#include "ode_world.hpp"
#include "periodic.hpp"
#include "robot_model.hpp"
#include "sensors.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kRadiansPerDegree = 0.017453292519943295;

/// The payload is spread as the chassis' own mass is: it scales mass and inertia and leaves the centre of mass.
RobotModel withPayload(RobotModel model, double payload) {
  const double scale = 1.0 + payload / model.chassis.mass;
  model.chassis.mass *= scale;
  model.chassis.inertia *= scale;
  return model;
}

WorldParameters worldParameters(const PlantParameters& p) {
  return {p.support == Support::box, p.slope * kRadiansPerDegree, p.friction, p.torque_limit};
}

MotorParameters motorParameters(const PlantParameters& p, double wheel_radius) {
  return {p.wheel_gain, p.motor_lag, p.velocity_loop_integral, p.acceleration_limit / wheel_radius,
          p.speed_limit / wheel_radius};
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
  /// Everything that moves; built afresh by reset().
  struct Motion {
    Motion(const RobotModel& model, const PlantParameters& p)
        : world(withPayload(model, p.payload), worldParameters(p)),
          delay(p.dead_time, kStep),
          left(motorParameters(p, model.wheels[kFrontLeft].radius), kStep),
          right(motorParameters(p, model.wheels[kFrontRight].radius), kStep),
          encoder_filter(p.encoder_filter, kStep),
          sampling(p.sensor_rate),
          sensors(p) {}

    OdeWorld world;
    CommandDelay delay;
    MotorLoop left;
    MotorLoop right;
    EncoderFilter encoder_filter;
    Periodic sampling;
    SensorModel sensors;
    SampleQueue samples;
    bool left_blocked = false;
    bool right_blocked = false;
    std::int64_t steps = 0;
    Eigen::Vector3d force_sum = Eigen::Vector3d::Zero();  // of the specific force in imu_link since the last sample
    int force_count = 0;
    PlantTruth truth;
    std::optional<PlantMeasurement> measurement;
  };

  Implementation(RobotModel robot, const PlantParameters& p) : model(std::move(robot)), parameters(p) { reset(); }

  void reset() {
    motion = std::make_unique<Motion>(model, parameters);
    motion->truth.wheel_position.fill(0.0);
    observe();
  }

  void step() {
    Motion& m = *motion;
    m.truth.acting_command = m.delay.acting(m.steps);
    drive(m.left, m.left_blocked, m.truth.acting_command.left, kFrontLeft, kRearLeft);
    drive(m.right, m.right_blocked, m.truth.acting_command.right, kFrontRight, kRearRight);
    m.world.step(kStep);
    ++m.steps;
    for (std::size_t i = 0; i < kWheelJoints.size(); ++i) m.truth.wheel_position[i] += kStep * m.world.wheelSpeed(i);
    observe();
  }

  /// One motor drives both wheels of its side.
  void drive(MotorLoop& motor, bool blocked, double command, Wheel front, Wheel rear) {
    OdeWorld& world = motion->world;
    const double speed = 0.5 * (world.wheelSpeed(front) + world.wheelSpeed(rear));
    const double reference = blocked ? 0.0 : motor.reference(command, speed);
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
    if (m.sampling.due(m.truth.time)) takeSample(seen, chassis);
    m.measurement = m.samples.receive(m.truth.time);
  }

  void takeSample(const PlantTruth& seen, const ChassisState& chassis) {
    Motion& m = *motion;
    const PlantMeasurement sample = m.sensors.sample(seen, sensorInput(chassis));
    const double delay = m.sensors.drawDelay();
    if (!m.sensors.losesSample()) m.samples.send(sample, seen.time + delay);
    m.force_sum.setZero();
    m.force_count = 0;
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
    input.specific_force = motion->force_sum / motion->force_count;
    input.orientation = Eigen::AngleAxisd(-parameters.slope * kRadiansPerDegree, Eigen::Vector3d::UnitY()) * imu;
    return input;
  }

  RobotModel model;
  PlantParameters parameters;
  std::unique_ptr<Motion> motion;
};

JackalPlant::JackalPlant(const std::string& urdf_xml, const PlantParameters& parameters)
    : self_(std::make_unique<Implementation>(readRobotModel(urdf_xml), parameters)) {}

JackalPlant::~JackalPlant() = default;
JackalPlant::JackalPlant(JackalPlant&&) noexcept = default;
JackalPlant& JackalPlant::operator=(JackalPlant&&) noexcept = default;

bool JackalPlant::command(const WheelCommand& command) {
  if (!std::isfinite(command.left) || !std::isfinite(command.right)) return false;
  self_->motion->delay.push(self_->motion->steps, command);
  return true;
}

void JackalPlant::step() { self_->step(); }

double JackalPlant::time() const { return self_->motion->truth.time; }

const std::optional<PlantMeasurement>& JackalPlant::measurement() const { return self_->motion->measurement; }

const PlantTruth& JackalPlant::truth() const { return self_->motion->truth; }

void JackalPlant::setFriction(double friction) {
  if (!(friction >= 0.0) || !std::isfinite(friction)) {
    throw ParameterError("friction = " + describe(ParameterValue(friction)) + ": must be 0 or more");
  }
  self_->motion->world.setFriction(friction);
}

void JackalPlant::blockWheels(Side side, bool blocked) {
  (side == Side::left ? self_->motion->left_blocked : self_->motion->right_blocked) = blocked;
}

void JackalPlant::push(double forward, double left, double torque) {
  self_->motion->world.push({forward, left, 0.0}, torque);
}

void JackalPlant::lift(bool lifted) { self_->motion->world.lift(lifted); }

void JackalPlant::reset() { self_->reset(); }

}  // namespace jackal_aic::sim
