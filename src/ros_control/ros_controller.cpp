#include "ros_controller.hpp"

#include <ros/console.h>

#include <algorithm>
#include <cmath>
#include <pluginlib/class_list_macros.hpp>

#include "jackal_aic/model/gravity.hpp"
#include "jackal_aic/model/thresholds.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"
#include "jackal_aic/safety/loop_odometry.hpp"
#include "parameters/ros_parameters.hpp"

namespace jackal_aic {
namespace {

/// Time by which an update may come early without missing its action step [s].
constexpr double kEarly = 0.002;

/// Part of the sensors' period in which the wheels are sampled once.
constexpr double kShortestPeriod = 0.75;
/// Part of the sensors' period after which unchanged wheel speeds are sampled, and largest age of an IMU sample that is
/// paired with the wheels.
constexpr double kLongestPeriod = 1.5;

void setCommand(std::vector<hardware_interface::JointHandle>& joints, double command) {
  for (auto& joint : joints) joint.setCommand(command);
}

double meanVelocity(const std::vector<hardware_interface::JointHandle>& joints) {
  double sum = 0.0;
  for (const auto& joint : joints) sum += joint.getVelocity();
  return sum / static_cast<double>(joints.size());
}

double sumOfPositions(const std::vector<hardware_interface::JointHandle>& joints) {
  double sum = 0.0;
  for (const auto& joint : joints) sum += joint.getPosition();
  return sum;
}

bool readsMotion(const hardware_interface::ImuSensorHandle& imu) {
  return imu.getAngularVelocity() && imu.getLinearAcceleration();
}

}  // namespace

bool RosController::Wheels::finite() const {
  return std::isfinite(left) && std::isfinite(right) && std::isfinite(left_position) && std::isfinite(right_position);
}

bool RosController::Wheels::operator!=(const Wheels& other) const {
  return left != other.left || right != other.right || left_position != other.left_position ||
         right_position != other.right_position;
}

bool RosController::initRequest(hardware_interface::RobotHW* robot_hw, ros::NodeHandle& root_nh,
                                ros::NodeHandle& controller_nh, ClaimedResources& claimed_resources) {
  if (auto* imus = robot_hw->get<hardware_interface::ImuSensorInterface>()) {
    const auto names = imus->getNames();
    if (!names.empty()) imu_handle_ = imus->getHandle(names.front());
  }
  return Controller::initRequest(robot_hw, root_nh, controller_nh, claimed_resources);
}

bool RosController::init(hardware_interface::VelocityJointInterface* hw, ros::NodeHandle& root_nh,
                         ros::NodeHandle& controller_nh) {
  name_ = controller_nh.getNamespace();
  name_ = name_.substr(name_.find_last_of('/') + 1);
  try {
    parameters_ = readRosControlParameters(readRosParameters(controller_nh), [&] { return robotDescription(root_nh); });
    const std::string prefix = tfPrefix(controller_nh);
    parameters_.drive.robot.base_frame = prefixedFrame(prefix, parameters_.drive.robot.base_frame);
    parameters_.odom_frame_id = prefixedFrame(prefix, parameters_.odom_frame_id);
    loop_.emplace(parameters_.drive, makeController(parameters_.drive));
    odometry_.emplace(makeOdometry(parameters_.drive, *loop_));
    changes_.emplace(*loop_);
    live_parameters_.emplace(controller_nh, parameters_.drive, *changes_);
  } catch (const ParameterError& error) {
    ROS_ERROR_NAMED(name_, "%s: %s", name_.c_str(), error.what());
    return false;
  }
  for (const std::string& key : parameters_.unused) ROS_WARN_NAMED(name_, "%s: not used", key.c_str());
  ROS_INFO_NAMED(name_, "%s", describeRobot(parameters_.drive).c_str());
  for (const auto& joint : parameters_.drive.robot.left_wheel_joints) left_joints_.push_back(hw->getHandle(joint));
  for (const auto& joint : parameters_.drive.robot.right_wheel_joints) right_joints_.push_back(hw->getHandle(joint));
  live_ = parameters_.live;
  subscribe(root_nh, controller_nh);
  fillState(*loop_, {}, update_.state);
  publisher_.emplace(root_nh, controller_nh, parameters_, update_);
  serveChanges(controller_nh);
  return true;
}

void RosController::subscribe(ros::NodeHandle& robot, ros::NodeHandle& controller) {
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  const std::string& base_frame = parameters_.drive.robot.base_frame;
  const bool by_handle = imu_handle_ && readsMotion(*imu_handle_) &&
                         prefixedFrame(tfPrefix(controller), imu_handle_->getFrameId()) == base_frame;
  if (!by_handle) {
    imu_handle_.reset();
    frame_listener_.emplace(frames_, robot, false);
    imu_reader_.emplace(base_frame, frames_);
    imu_subscriber_ = robot.subscribe(parameters_.imu_topic, 10, &RosController::onImu, this, no_delay);
  }
  robot_.emplace(
      robot,
      [this](const ros::Time& stamp) {
        const std::lock_guard<std::mutex> lock(callbacks_);
        feedback_stamps_.write(stamp.toSec());
      },
      [this](const RobotStatus& status) {
        const std::lock_guard<std::mutex> lock(callbacks_);
        robot_states_.write(status);
      });
  command_source_.emplace(controller, "cmd_vel", 1, [this](const SetPointInput& command) { onCommand(command); });
  others_.emplace(std::vector<std::string>{}, robot_->emergencyStop(), *command_source_);
  others_->watch(robot, true);
}

void RosController::serveChanges(ros::NodeHandle& controller) {
  live_server_.emplace(controller, "", parameters_.live, [this](const auto& wanted) { adoptLive(wanted); });
  drive_services_ = serveDriving(controller, *changes_);
}

void RosController::adoptLive(const LiveParameters& wanted) {
  if (!loop_->predictive() && wanted.wheel_separation_multiplier != parameters_.live.wheel_separation_multiplier) {
    throw ParameterError(
        "wheel_separation_multiplier: load the controller again to change it; only the predictive structure changes it "
        "while it runs");
  }
  const std::lock_guard<std::mutex> lock(callbacks_);
  settings_.write(wanted);
}

void RosController::onCommand(const SetPointInput& command) {
  if (!isRunning()) {
    ROS_ERROR_THROTTLE_NAMED(1.0, name_, "Can't accept new commands. Controller is not running.");
    return;
  }
  if (!command.wanted.vector().allFinite()) {
    ROS_WARN_THROTTLE_NAMED(1.0, name_, "Received NaN in velocity command. Ignoring.");
    return;
  }
  SetPointInput input = command;
  std::uint32_t publishers = 0;
  for (const ros::Subscriber& subscriber : command_source_->subscribers()) publishers += subscriber.getNumPublishers();
  if (!parameters_.allow_multiple_cmd_vel_publishers && publishers > 1) {
    ROS_ERROR_THROTTLE_NAMED(1.0, name_, "Detected %u publishers. Only 1 publisher is allowed. Going to brake.",
                             publishers);
    input = {};
  }
  const std::lock_guard<std::mutex> lock(callbacks_);
  commands_.write(input);
}

void RosController::onImu(const sensor_msgs::Imu& message) {
  const std::lock_guard<std::mutex> lock(callbacks_);
  const auto reading = imu_reader_->read(message, ros::Time::now());
  if (reading) {
    imu_readings_.write(*reading);
  } else {
    ROS_WARN_THROTTLE_NAMED(1.0, name_, "Rejected %s", imu_reader_->lastRefusal().c_str());
  }
}

void RosController::starting(const ros::Time& time) {
  const Wheels turning = wheels();
  const bool moving =
      turning.finite() && std::max(std::abs(turning.left), std::abs(turning.right)) > thresholds::kMoving;
  const WheelCommand driven = moving ? WheelCommand{turning.left, turning.right} : WheelCommand{};
  now_ = last_publication_ = wheels_taken_ = time.toSec();
  loop_->start(driven, now_);
  odometry_->resetMotion();
  first_update_ = true;
  commands_.read();  // discards earlier ones
  drive(driven);
}

void RosController::stopping(const ros::Time&) { drive({}); }

void RosController::update(const ros::Time& time, const ros::Duration& period) {
  const double now = time.toSec();
  if (now < now_) followClockBack(now);
  takeSettings(now);
  takeMessages(now);
  const WheelCommand applied = loop_->command();  // until now
  const std::optional<Observation> measured = takeMeasurement(now, period.toSec());
  // The steps of an action are due slightly before their update, so that an early update runs them.
  const auto action = first_update_ ? loop_->advance(now, now - kEarly) : loop_->advance(now);
  // A fault that stops the robot is reported with the stop.
  if (action) update_.status = loop_->status();
  first_update_ = false;
  drive(loop_->command());
  changes_->send(*loop_);
  advanceOdometry(applied, std::max(0.0, now - now_));
  if (measured) odometry_->observe(asCounted(*measured, *loop_));
  now_ = now;
  publish(time);
}

/// The loop detects this itself.
void RosController::followClockBack(double now) {
  odometry_->resetMotion();
  imu_.reset();
  now_ = last_publication_ = now;
}

void RosController::takeSettings(double now) {
  if (const LiveParameters* wanted = settings_.read()) takeLive(*wanted, now);
  if (changes_->apply(*loop_, now)) {
    odometry_->resetMotion();
    first_update_ = true;
  }
}

void RosController::takeLive(const LiveParameters& wanted, double now) {
  if (loop_->predictive() && wanted.wheel_separation_multiplier != live_.wheel_separation_multiplier) {
    LearnedModel learned = loop_->predictive()->learned();
    learned.slip = {parameters_.wheel_separation * wanted.wheel_separation_multiplier, learned.slip.slip_factor};
    loop_->setLearned(learned, now);
  }
  live_ = wanted;
}

void RosController::takeMessages(double now) {
  if (const RobotStatus* status = robot_states_.read()) status_ = *status;
  status_.disabled = !changes_->enabled();
  status_.graph_checked = others_->checked();
  status_.set_points_connected = others_->setPointsConnected();
  loop_->report(status_, now);
  if (const double* stamp = feedback_stamps_.read()) loop_->receiveFeedback(*stamp, now);
  if (const SetPointInput* command = commands_.read()) loop_->setSetPoint(command->wanted, now, command->stamp);
}

RosController::Wheels RosController::wheels() const {
  const double left = live_.left_wheel_radius_multiplier, right = live_.right_wheel_radius_multiplier;
  return {left * meanVelocity(left_joints_), right * meanVelocity(right_joints_), left * sumOfPositions(left_joints_),
          right * sumOfPositions(right_joints_)};
}

void RosController::drive(const WheelCommand& command) {
  setCommand(left_joints_, command.left / live_.left_wheel_radius_multiplier);
  setCommand(right_joints_, command.right / live_.right_wheel_radius_multiplier);
}

std::optional<Observation> RosController::takeMeasurement(double now, double period) {
  const SensorReading* reading = imu_handle_ ? nullptr : imu_readings_.read();
  if (reading) {
    imu_ = reading->observation;
    loop_->receiveImu(*reading, now);
  }
  const Wheels read = wheels();
  const bool changed = read != read_, live = changed && changed_;
  read_ = read;
  changed_ = changed;
  if (!read.finite() || !wheelsAreDue(now, period, live, reading != nullptr)) return std::nullopt;
  if (imu_handle_) {
    const SensorReading of_robot = imuOfRobot(now);
    imu_ = of_robot.observation;
    loop_->receiveImu(of_robot, now);
  }
  return observe(read, now);
}

SensorReading RosController::imuOfRobot(double now) const {
  const double *w = imu_handle_->getAngularVelocity(), *a = imu_handle_->getLinearAcceleration();
  SensorReading reading;
  Observation& y = reading.observation;
  y.stamp = now;
  y.yaw_rate = w[2];
  Eigen::Vector3d force(a[0], a[1], a[2]);
  y.acceleration_z = force.z();
  if (const double* q = imu_handle_->getOrientation()) {
    const auto attitude = unitAttitude({q[3], q[0], q[1], q[2]});
    if (attitude) force -= gravityReaction(*attitude);
    y.level = attitude.has_value();
  }
  y.acceleration_x = force.x();
  y.acceleration_y = force.y();
  y.valid.wheel_left = y.valid.wheel_right = false;
  reading.sample.head<6>() << w[0], w[1], w[2], a[0], a[1], a[2];
  return reading;
}

double RosController::sensorPeriod() const {
  const std::optional<PlantModel>& model = parameters_.drive.plant_model;
  return model ? 1.0 / model->sensor_rate : loop_->controller().actionStep();
}

/// @param live the wheels change with every update; @param imu_came since the last update.
bool RosController::wheelsAreDue(double now, double period, bool live, bool imu_came) const {
  const double sensor_period = sensorPeriod();
  const double since = now - wheels_taken_;
  if (since < 0.0) return true;  // the clock jumped back
  if (since < kShortestPeriod * sensor_period) return false;
  if (period > 0.5 * sensor_period) return true;
  // A loop that is faster than the sensors reads repeated samples, and uses renewed ones only.
  if (!live) return read_ != last_wheels_ || since >= kLongestPeriod * sensor_period;
  // Wheels that change with every update are read with each IMU sample, so that both have one time and none counts
  // twice.
  const bool imu_comes = !imu_handle_ && imu_ && now - imu_->stamp <= kLongestPeriod * sensor_period;
  return imu_comes ? imu_came : since + 0.5 * period >= sensor_period;
}

Observation RosController::observe(const Wheels& wheels, double now) {
  last_wheels_ = wheels;
  wheels_taken_ = now;
  SensorReading reading;
  Observation& y = reading.observation;
  y.stamp = now;
  y.wheel_left = wheels.left;
  y.wheel_right = wheels.right;
  y.valid.yaw_rate = y.valid.acceleration = false;
  reading.sample.head<4>() << wheels.left, wheels.right, wheels.left_position, wheels.right_position;
  loop_->receiveWheels(reading, now);
  if (imu_ && std::abs(now - imu_->stamp) <= kLongestPeriod * sensorPeriod()) {
    y = paired(y, *imu_);
    loop_->observe(y, now);
  }
  return y;
}

void RosController::advanceOdometry(const WheelCommand& applied, double duration) {
  odometry_->advance(applied, duration);
  const BodyVector command = SkidSteerKinematics(parameters_.drive.geometry).bodyVelocity(loop_->command());
  commanded_motion_ = {command(kForward), command(kYaw), odometry_->motion().covariance};
  commanded_.advance(commanded_motion_, duration);
}

void RosController::publish(const ros::Time& time) {
  const double now = time.toSec(), period = 1.0 / live_.publish_rate;
  publisher_->post(CommandUpdate{time, {commanded_motion_.forward, 0.0, commanded_motion_.yaw_rate}});
  if (!(last_publication_ + period < now)) return;
  last_publication_ = std::max(last_publication_ + period, now - period);
  OdometryUpdate& update = update_;
  const bool open_loop = parameters_.open_loop;
  update.pose = open_loop ? commanded_.pose() : odometry_->pose();
  update.pose_covariance = open_loop ? commanded_.covariance() : odometry_->poseCovariance();
  update.motion = open_loop ? commanded_motion_ : odometry_->motion();
  update.transform = live_.enable_odom_tf;
  fillState(*loop_, time, update.state);
  publisher_->post(update);
}

}  // namespace jackal_aic

PLUGINLIB_EXPORT_CLASS(jackal_aic::RosController, controller_interface::ControllerBase)
