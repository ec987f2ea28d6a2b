#include "jackal_aic/predictive/predictive_controller.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <unsupported/Eigen/MatrixFunctions>

namespace jackal_aic {
namespace {

constexpr double kLimitDeviation = 0.6;  // of the motors' acceleration limit; half of it has to be ordinary
constexpr double kPathTolerance = 0.01;  // of the largest change of an input
constexpr int kHalvings = 12;            // of an interval of inputs
constexpr int kLongestReturn = 50;       // periods
constexpr double kSteadyPath = 0.02;     // rad/s; largest change of the path in an action period of a steady drive
constexpr double kSettled = 0.5;         // s; after the dead time, until nothing is left of an acceleration
constexpr double kTrackSettled = 4.0;    // slip memories; after the dead time, until the effective track is learned
constexpr double kStraight = 0.5;        // rad/s; largest difference of the wheel speeds on a straight line
constexpr double kMoving = 0.5;          // rad/s; least wheel speed of a robot that moves

bool isWhole(double ratio) { return ratio >= 1.0 - 1e-9 && std::abs(ratio - std::round(ratio)) < 1e-9 * ratio; }

WheelBeliefParameters wheelParameters(const PredictiveParameters& p) {
  return {p.wheel_variance,      p.speed_process_noise,  p.disturbance_process_noise,
          p.dead_time_deviation, p.belief_learning_rate, p.goal_weight,
          kLimitDeviation};
}

YawRateBeliefParameters yawParameters(const PredictiveParameters& p) {
  return {p.gyro_variance, p.yaw_process_noise, p.yaw_delay_deviation};
}

ForwardSpeedBeliefParameters forwardParameters(const PredictiveParameters& p) {
  return {p.accelerometer_weight, p.turning_centre};
}

PredictiveParameters validated(const PredictiveParameters& parameters) {
  validate(parameters);
  return parameters;
}

SlipLearning slipLearning(const PredictiveParameters& p) {
  return {p.gyro_variance, p.accelerometer_variance, p.slip_time_constant, p.yaw_delay_deviation, p.slip_excitation};
}

SlipBelief slipBelief(const PredictiveParameters& p, const GeometryParameters& geometry, const PlantModel& model) {
  const double track = model.effective_track > 0.0 ? model.effective_track : geometry.effective_track;
  return SlipBelief({track, geometry.slip_factor}, geometry.wheel_radius, slipLearning(p));
}

SensorVariances sensorVariances(const PredictiveParameters& p) {
  return {p.wheel_variance, p.wheel_variance, p.gyro_variance, p.accelerometer_variance};
}

void requirePositive(const char* name, double value) {
  if (value > 0.0 && std::isfinite(value)) return;
  std::ostringstream message;
  message << "slip." << name << " = " << value << ": must be positive";
  throw ParameterError(message.str());
}

void requireSameRate(const char* key, double wanted, double running) {
  if (wanted == running) return;
  std::ostringstream message;
  message << "predictive." << key << " = " << wanted << " Hz: must stay " << running << " Hz while the controller runs";
  throw ParameterError(message.str());
}

}  // namespace

int PredictiveParameters::beliefStepsPerAction() const {
  return static_cast<int>(std::lround(belief_rate / action_rate));
}

void validate(const PredictiveParameters& parameters) {
  std::ostringstream message;
  if (!isWhole(parameters.belief_rate / parameters.action_rate)) {
    message << "predictive.belief_rate = " << parameters.belief_rate
            << " Hz: must be a whole multiple of predictive.action_rate = " << parameters.action_rate << " Hz";
  } else if (!isWhole(1.0 / (parameters.belief_rate * WheelBelief::kStep))) {
    message << "predictive.belief_rate = " << parameters.belief_rate << " Hz: must divide 1000 Hz";
  } else {
    return;
  }
  throw ParameterError(message.str());
}

DriveTrainReference::DriveTrainReference(const PlantModel& model, double wheel_radius, double reference_time,
                                         double step)
    : step_(step), largest_change_(step * model.acceleration_limit / wheel_radius) {
  setReferenceTime(reference_time);
  transition_ << 0.0, 0.0, 0.0, 0.0;
  input_ << 1.0, 0.0;
  if (model.lag <= 0.0) return;
  Eigen::Matrix3d augmented = Eigen::Matrix3d::Zero();
  augmented.row(0) << -1.0 / model.lag, 1.0 / model.lag, 1.0 / model.lag;
  augmented.row(1) << -model.velocity_loop_integral, 0.0, model.velocity_loop_integral;
  const Eigen::Matrix3d exponential = (step * augmented).exp();
  transition_ = exponential.topLeftCorner<2, 2>();
  input_ = exponential.topRightCorner<2, 1>();
}

double DriveTrainReference::input(double wanted) const {
  const double change = std::clamp(pull_ * (wanted - state_(0)), -largest_change_, largest_change_);
  return (state_(0) + change - transition_.row(0).dot(state_)) / input_(0);
}

void DriveTrainReference::take(double r) {
  before_ = state_;
  r_ = r;
  state_ = transition_ * before_ + input_ * r_;
}

double DriveTrainReference::advance(double wanted) {
  take(input(wanted));
  return r_;
}

DriveTrainReference DriveTrainReference::minus(const DriveTrainReference& other) const {
  DriveTrainReference difference = *this;
  difference.state_ -= other.state_;
  difference.before_ -= other.before_;
  difference.r_ -= other.r_;
  return difference;
}

double DriveTrainReference::inTime(double wanted, double r, double largest_change) const {
  double high = std::clamp(r, r_ - largest_change, r_ + largest_change);
  if (endsInTime(wanted, high, largest_change)) return r;
  double low = r_ - std::copysign(largest_change, wanted - state_(0));
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (endsInTime(wanted, middle, largest_change) ? low : high) = middle;
  }
  return low;
}

bool DriveTrainReference::endsInTime(double wanted, double r, double largest_change) const {
  const double direction = std::copysign(1.0, wanted - state_(0));
  Eigen::Vector2d state = transition_ * state_ + input_ * r;
  for (int k = 0; k < kLongestReturn; ++k) {
    const double lead = direction * (r + state(1) - wanted);
    if (lead <= 0.0) return true;
    if (direction * (state(0) - wanted) > kPathTolerance * largest_change) return false;
    r -= direction * std::min(lead, largest_change);
    state = transition_ * state + input_ * r;
  }
  return true;
}

void DriveTrainReference::follow(double r) {
  before_ = state_;
  r_ = r;
  // Beyond the acceleration limit only as much of the input takes part as the limit lets through. Nothing jumps there:
  // two wheels that differ by a hair, one on either side of the limit, must not part.
  const double without = transition_.row(0).dot(before_) - before_(0);
  const double lowest = (-largest_change_ - without) / input_(0), highest = (largest_change_ - without) / input_(0);
  state_ = transition_ * before_ + input_ * std::clamp(r_, lowest, highest);
}

void DriveTrainReference::amend(double more) {
  state_ = before_;
  follow(r_ + more);
}

void DriveTrainReference::reset(double speed) {
  state_ << speed, 0.0;
  before_ = state_;
  r_ = speed;
}

PredictiveController::PredictiveController(const PredictiveParameters& parameters, const GeometryParameters& geometry,
                                           const PlantModel& model)
    : parameters_(validated(parameters)),
      geometry_(geometry),
      model_(model),
      inner_steps_(static_cast<int>(std::lround(1.0 / (parameters.belief_rate * WheelBelief::kStep)))),
      left_(model, geometry.wheel_radius, wheelParameters(parameters)),
      right_(left_),
      yaw_(yawParameters(parameters)),
      forward_(forwardParameters(parameters)),
      slip_(slipBelief(parameters, geometry, model)),
      precisions_(sensorVariances(parameters), parameters.precision_time_constant),
      reference_left_(model, geometry.wheel_radius, parameters.reference_time, 1.0 / parameters.action_rate),
      reference_right_(reference_left_) {}

bool PredictiveController::setSetPoint(const SetPoint& set_point) {
  if (!set_point.vector().allFinite()) return false;
  set_point_ = set_point;
  return true;
}

SampleVerdict PredictiveController::observe(const Observation& observation) {
  if (!observation.finite()) return SampleVerdict::not_finite;
  if (started_ && observation.stamp <= observation_.stamp) return SampleVerdict::stale;
  const bool first = !started_;
  if (started_) learn(observation);
  observation_step_ = started_ ? observation.stamp - observation_.stamp : 0.0;
  observation_ = withBelieved(observation);
  observed_ = started_ = true;
  if (!first) return SampleVerdict::accepted;
  // What drove the robot so far is not known: it is taken for steady.
  left_.reset(observation_.wheel_left);
  right_.reset(observation_.wheel_right);
  restart();
  return SampleVerdict::restarted;
}

Observation PredictiveController::withBelieved(Observation y) const {
  if (!y.valid.wheel_left) y.wheel_left = left_.speed();
  if (!y.valid.wheel_right) y.wheel_right = right_.speed();
  if (!y.valid.yaw_rate) y.yaw_rate = yaw_.yawRate();
  if (!y.valid.acceleration) y.acceleration_x = y.acceleration_y = 0.0;
  return y;
}

void PredictiveController::learn(const Observation& y) {
  if (learning_frozen_ || model_.on_box) return;  // on a box neither gyro nor accelerometer notices the wheels
  if (!y.valid.wheel_left || !y.valid.wheel_right) return;
  const double step = y.stamp - observation_.stamp;
  if (parameters_.learn_track && y.valid.yaw_rate) {
    slip_.learnTrack(y.yaw_rate, wheelDifference(y), step);
  }
  if (!y.valid.acceleration) return;
  slip_.observeAcceleration(y.acceleration_x, y.wheel_left, y.wheel_right, step);
  if (parameters_.learn_slip_factor) slip_.learnAlpha();
}

WheelDifference PredictiveController::wheelDifference(const Observation& y) const {
  const double believed = right_.speed() - left_.speed();
  return {believed, right_.covariance()(0, 0) + left_.covariance()(0, 0), right_.acceleration() - left_.acceleration(),
          y.wheel_right - y.wheel_left - believed};
}

void PredictiveController::setSlip(const SlipState& state) {
  requirePositive("effective_track", state.effective_track);
  requirePositive("slip_factor", state.slip_factor);
  slip_.setState(state);
}

void PredictiveController::updateBelief() {
  if (!started_) return;
  wanted_ = kinematics().wheelSpeeds(set_point_.forward, set_point_.yaw_rate);
  for (int i = 0; i < inner_steps_; ++i) predict();
  if (!observed_) return;
  correct(observation_);
  observed_ = false;
  if (parameters_.learn_precision && observation_.valid.all() && steady())
    learnPrecisions(observation_, observation_step_);
}

void PredictiveController::predict() {
  left_.predict(applied_.left, wanted_.left);
  right_.predict(applied_.right, wanted_.right);
  yaw_.predict(yawPerWheelSpeed() * (right_.acceleration() - left_.acceleration()), WheelBelief::kStep);
}

void PredictiveController::correct(const Observation& y) {
  errors_(kYawRate) = y.yaw_rate - yaw_.yawRate();
  free_energy_ = correctWheels(y);
  if (!model_.on_box && y.valid.yaw_rate) {
    free_energy_ += yaw_.correct(y.yaw_rate);
  } else {
    const double slope = yawPerWheelSpeed();  // without a gyro, or on a box, the wheels' turn is all there is
    yaw_.follow(slope * (right_.speed() - left_.speed()),
                slope * slope * (left_.covariance()(0, 0) + right_.covariance()(0, 0)));
  }
  if (!model_.on_box) correctForwardSpeed(y);
}

double PredictiveController::correctWheels(const Observation& y) {
  // A channel of precision zero leaves its belief to the model; where the yaw rate tells of the wheel, it stands in.
  errors_(kWheelLeft) = y.valid.wheel_left ? y.wheel_left - left_.speed() : 0.0;
  errors_(kWheelRight) = y.valid.wheel_right ? y.wheel_right - right_.speed() : 0.0;
  const bool yaw_tells = y.valid.yaw_rate && !model_.on_box;
  const double difference = y.yaw_rate / yawPerWheelSpeed();
  double free_energy = 0.0;
  if (y.valid.wheel_left) {
    free_energy += left_.correct(y.wheel_left);
  } else if (y.valid.wheel_right && yaw_tells) {
    free_energy += left_.correct(y.wheel_right - difference, standInVariance());
  }
  if (y.valid.wheel_right) {
    free_energy += right_.correct(y.wheel_right);
  } else if (y.valid.wheel_left && yaw_tells) {
    free_energy += right_.correct(y.wheel_left + difference, standInVariance());
  }
  return free_energy;
}

double PredictiveController::standInVariance() const {
  // omega_L = omega_R - theta_dot / slope, where theta_dot comes late by the yaw's delay
  const double slope = yawPerWheelSpeed();
  const double late = parameters_.yaw_delay_deviation * (right_.acceleration() - left_.acceleration());
  return precisions_.variances().gyro / (slope * slope) + late * late;
}

void PredictiveController::correctForwardSpeed(const Observation& y) {
  if (!y.valid.acceleration) return forward_.reset(forwardSpeedOfWheels());
  // As it comes: the offset learned while the wheels rest is that of a robot that may still slide on locked wheels.
  forward_.correct(forwardSpeedOfWheels(), y.acceleration_x, precisions_.variances().accelerometer, yaw_.yawRate(),
                   observation_step_);
}

double PredictiveController::forwardSpeedOfWheels() const {
  return 0.5 * geometry_.wheel_radius * slip_.state().slip_factor * (left_.speed() + right_.speed());
}

double PredictiveController::yawPerWheelSpeed() const {
  return geometry_.wheel_radius * slip_.state().slip_factor / slip_.state().effective_track;
}

void PredictiveController::learnPrecisions(const Observation& y, double step) {
  const double radius = geometry_.wheel_radius * slip_.state().slip_factor;
  const double slope = model_.on_box ? 0.0 : yawPerWheelSpeed();
  const double rolling = model_.on_box ? 0.0 : radius;
  precisions_.learnWheels(left_, right_, step);
  if (steady_time_ > kTrackSettled * parameters_.slip_time_constant + model_.dead_time) {
    precisions_.learnGyro(y.yaw_rate - slope * (right_.speed() - left_.speed()), left_, right_, slope,
                          slip_.trackGain(), step);
  }
  if (std::abs(right_.speed() - left_.speed()) < kStraight) {
    const double predicted = 0.5 * rolling * (left_.predictedChange() + right_.predictedChange()) / step;
    precisions_.learnAccelerometer(y.acceleration_x - slip_.accelerometerOffset() - predicted, left_, right_, rolling,
                                   step);
  }
  const SensorVariances learned = precisions_.variances();
  left_.setMeasurementVariance(learned.wheel_left);
  right_.setMeasurementVariance(learned.wheel_right);
  yaw_.setGyroVariance(learned.gyro);
  slip_.setVariances(learned.gyro, learned.accelerometer);
}

bool PredictiveController::steady() const {
  return steady_time_ > kSettled + model_.dead_time && observation_step_ > 0.0 &&
         std::max(std::abs(left_.speed()), std::abs(right_.speed())) > kMoving;
}

void PredictiveController::watchPath() {
  const WheelVector path(reference_left_.speed(), reference_right_.speed());
  steady_time_ += 1.0 / parameters_.action_rate;
  if ((path - path_).cwiseAbs().maxCoeff() > kSteadyPath) steady_time_ = 0.0;
  path_ = path;
}

WheelVector PredictiveController::inputs() const {
  WheelVector r(reference_left_.input(wanted_.left), reference_right_.input(wanted_.right));
  if (turn_acceleration_ <= 0.0) return r;
  const double turn = r(1) - r(0);
  const double yaw_per_difference = geometry_.wheel_radius * geometry_.slip_factor / geometry_.effective_track;
  const double largest_change = model_.gain * turn_acceleration_ / (parameters_.action_rate * yaw_per_difference);
  const double in_time =
      reference_right_.minus(reference_left_).inTime(wanted_.right - wanted_.left, turn, largest_change);
  return r + 0.5 * (in_time - turn) * WheelVector(-1.0, 1.0);
}

double PredictiveController::act(double r, DriveTrainReference& reference, const WheelBelief& wheel, double measured,
                                 double action) const {
  // a ← a − κ_a (∂²F/∂a²)⁻¹ ∂F/∂a with F = ½ ε_a²/Σ_a, ε_a = g a + d − w*,   and   − h κ_y ε_y/Σ_y with ∂y/∂a = 1
  reference.take(r);
  const double error = model_.gain * action + wheel.disturbance() - r;
  const double sensory = (measured - wheel.speed()) / (parameters_.wheel_variance * parameters_.action_rate);
  return action - parameters_.action_learning_rate * error / model_.gain - parameters_.sensory_action * sensory;
}

WheelCommand PredictiveController::updateAction() {
  if (!started_) return applied_;
  watchPath();
  wanted_ = kinematics().wheelSpeeds(set_point_.forward, set_point_.yaw_rate);
  const WheelVector r = inputs();
  applied_ = {act(r(0), reference_left_, left_, observation_.wheel_left, applied_.left),
              act(r(1), reference_right_, right_, observation_.wheel_right, applied_.right)};
  const bool told_to_stand = set_point_.forward == 0.0 && set_point_.yaw_rate == 0.0;
  if (standstill_.stands(told_to_stand, applied_, left_.speed(), right_.speed(), 1.0 / parameters_.action_rate)) {
    applied_ = {};
    reference_left_.reset(0.0);
    reference_right_.reset(0.0);
  }
  return applied_;
}

void PredictiveController::hold(const WheelCommand& applied) {
  if (applied == applied_) return;
  reference_left_.amend(model_.gain * (applied.left - applied_.left));
  reference_right_.amend(model_.gain * (applied.right - applied_.right));
  applied_ = applied;
}

void PredictiveController::overrule(const WheelCommand& applied) {
  reference_left_.follow(model_.gain * applied.left + left_.disturbance());
  reference_right_.follow(model_.gain * applied.right + right_.disturbance());
  applied_ = applied;
}

void PredictiveController::setTurnLimits(double acceleration, double deceleration) {
  turn_acceleration_ = deceleration > 0.0 ? std::min(acceleration, deceleration) : acceleration;
}

void PredictiveController::adoptGains(const PredictiveParameters& parameters) {
  validate(parameters);
  requireSameRate("belief_rate", parameters.belief_rate, parameters_.belief_rate);
  requireSameRate("action_rate", parameters.action_rate, parameters_.action_rate);
  parameters_ = parameters;
  for (WheelBelief* wheel : {&left_, &right_}) wheel->setParameters(wheelParameters(parameters));
  for (DriveTrainReference* path : {&reference_left_, &reference_right_}) {
    path->setReferenceTime(parameters.reference_time);
  }
  yaw_.setParameters(yawParameters(parameters));
  forward_.setParameters(forwardParameters(parameters));
  slip_.setLearning(slipLearning(parameters));
  precisions_ = SensorPrecisions(sensorVariances(parameters), parameters.precision_time_constant);
}

void PredictiveController::restart() {
  applied_ = {};
  steady_time_ = 0.0;
  reference_left_.reset(observation_.wheel_left);
  reference_right_.reset(observation_.wheel_right);
  left_.seed(observation_.wheel_left);
  right_.seed(observation_.wheel_right);
  yaw_.reset(model_.on_box ? yawPerWheelSpeed() * (observation_.wheel_right - observation_.wheel_left)
                           : observation_.yaw_rate);
  forward_.reset(forwardSpeedOfWheels());
}

void PredictiveController::reset() {
  observation_ = {};
  observed_ = started_ = false;
  set_point_ = {};
  standstill_ = {};
  slip_ = slipBelief(parameters_, geometry_, model_);
  precisions_ = SensorPrecisions(sensorVariances(parameters_), parameters_.precision_time_constant);
  for (WheelBelief* wheel : {&left_, &right_}) wheel->setMeasurementVariance(parameters_.wheel_variance);
  free_energy_ = 0.0;
  errors_.setZero();
  restart();
}

void PredictiveController::forgetMotion() {
  const SlipState learned = slip();
  reset();
  setSlip(learned);
}

SkidSteerKinematics PredictiveController::kinematics() const {
  GeometryParameters believed = geometry_;
  believed.effective_track = slip_.state().effective_track;
  believed.slip_factor = slip_.state().slip_factor;
  return SkidSteerKinematics(believed);
}

BodyVector PredictiveController::believedVelocity() const {
  BodyVector velocity = kinematics().bodyVelocity({left_.speed(), right_.speed()});
  velocity(kForward) += forward_.difference();
  velocity(kYaw) = yaw_.yawRate();
  return velocity;
}

Eigen::Matrix2d PredictiveController::velocityCovariance() const {
  // x_dot = r alpha (w_L + w_R)/2; the yaw rate is a belief of its own, which the wheels only move.
  const double r = geometry_.wheel_radius;
  const double per_wheel = 0.5 * r * slip_.state().slip_factor;
  const double mean = 0.5 * (left_.speed() + right_.speed());
  double forward = per_wheel * per_wheel * (left_.covariance()(0, 0) + right_.covariance()(0, 0));
  if (parameters_.learn_slip_factor) forward += r * r * mean * mean * slip_.alphaVariance();
  forward += forward_.variance();
  return Eigen::Vector2d(forward, yaw_.variance()).asDiagonal();
}

}  // namespace jackal_aic
