#include "jackal_aic/safety/drive_loop.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

/// Action periods that a late timer may catch up at once: 0.1 s at 50 Hz. Beyond that the measurements are too old to
/// act on.
constexpr int kMostPeriods = 5;

/// Shortest time without any set point after a start that counts as a pause [s]: a new subscriber receives the messages
/// of a running publisher only after a while.
constexpr double kPause = 0.5;

std::int64_t nanoseconds(double time) { return std::llround(1e9 * time); }

MeasurementWatchParameters watchParameters(const DriveParameters& parameters) {
  MeasurementWatchParameters watch;
  watch.on_loss = parameters.on_loss;
  // Only the predictive structure has a model to drive on.
  if (!std::holds_alternative<PredictiveParameters>(parameters.controller)) watch.on_loss.wheels = LossAction::stop;
  watch.open_loop = std::holds_alternative<DifferentialDriveParameters>(parameters.controller);
  if (!watch.open_loop || parameters.open_loop_monitored) watch.faults = parameters.faults;
  watch.geometry = parameters.geometry;
  watch.plant_model = parameters.plant_model;
  watch.largest_wheel_speed = parameters.gate.plausibility.speed_factor * parameters.gate.limits.wheel_speed;
  watch.largest_yaw_rate = parameters.gate.plausibility.speed_factor * parameters.gate.limits.angular_speed;
  return watch;
}

/// A pair is late by the longer of its two deadlines.
double pairDeadline(const DeadlineParameters& deadlines) {
  return deadlines.wheels > 0.0 && deadlines.imu > 0.0 ? std::max(deadlines.wheels, deadlines.imu) : 0.0;
}

/// True if the wheels of any side do not follow their commands.
bool isOfTheWheels(Fault fault) {
  return fault == Fault::wheels_blocked || fault == Fault::left_wheels_blocked || fault == Fault::right_wheels_blocked;
}

}  // namespace

std::unique_ptr<VelocityController> makeController(const DriveParameters& parameters, Divergence divergence) {
  std::optional<PlantModel> model = parameters.plant_model;
  if (model) model = drivenModel(*model);
  if (const auto* gains = std::get_if<ControllerParameters>(&parameters.controller)) {
    return std::make_unique<ActiveInferenceController>(*gains, parameters.geometry, model, divergence);
  }
  if (const auto* drive = std::get_if<DifferentialDriveParameters>(&parameters.controller)) {
    return std::make_unique<DifferentialDrive>(*drive);
  }
  if (!model) throw ParameterError("plant_model.*: missing; the predictive controller needs the drive train");
  auto predictive = std::make_unique<PredictiveController>(std::get<PredictiveParameters>(parameters.controller),
                                                           parameters.geometry, *model);
  const LimitParameters& limits = parameters.gate.limits;
  predictive->setTurnLimits(limits.angular_acceleration, limits.angular_deceleration);
  return predictive;
}

std::string reason(const DriveLoopStatus& status, const std::string& contender) {
  std::string reason = text(status.decision.cause);
  const StopCause cause = status.decision.cause;
  const bool rivalry =
      cause == StopCause::contention || cause == StopCause::set_points_rival || cause == StopCause::graph_unchecked;
  if (rivalry && !contender.empty()) reason += ": " + contender;
  if (status.handed_over) reason = "another source has the motors";
  const bool named = status.fault != Fault::none && status.fault != Fault::moved;  // it has a separate cause
  const std::string fault = named ? text(status.fault, status.share) : text(status.loss);
  // Wheels that do not follow are not a sensor fault.
  if (cause == StopCause::sensor_fault && isOfTheWheels(status.fault)) reason.clear();
  if (!fault.empty()) reason += (reason.empty() ? "" : "; ") + fault;
  if (status.decision.unacknowledged) reason += " (waits for a zero set point or a pause)";
  return reason;
}

DriveLoop::DriveLoop(const DriveParameters& parameters, std::unique_ptr<VelocityController> controller)
    : parameters_(parameters),
      controller_(std::move(controller)),
      predictive_(dynamic_cast<PredictiveController*>(controller_.get())),
      kinematics_(parameters.geometry),
      measurements_(watchParameters(parameters)),
      gate_(parameters.gate, parameters.geometry, controller_->actionStep()),
      schedule_(nanoseconds(controller_->beliefStep()), controller_->beliefStepsPerAction(), kMostPeriods),
      phase_(nanoseconds(controller_->actionStep())),
      set_points_(parameters.gate.deadlines.set_point),
      wheels_(parameters.gate.deadlines.wheels, parameters.gate.deadlines.frozen_wheels),
      imu_(parameters.gate.deadlines.imu, parameters.gate.deadlines.frozen_imu),
      feedback_(parameters.gate.deadlines.feedback),
      measurement_(pairDeadline(parameters.gate.deadlines)) {}

void DriveLoop::start(const WheelCommand& driven, double now) {
  notify(now, StartInput{driven});
  reset(now);
  clock_jumped_ = false;
  gate_.reset();
  gate_.follow(driven);
  controller_->overrule(driven);
  status_.decision = {};
  now_ = now;
}

SetPointVerdict DriveLoop::setSetPoint(const SetPoint& wanted, double now, std::optional<double> stamp) {
  notify(now, SetPointInput{wanted, stamp});
  catchUp(now);
  const bool finite = wanted.vector().allFinite();
  if (!finite || !isPlausible(wanted, parameters_.gate.limits)) {
    ++status_.rejected_set_points;
    return finite ? SetPointVerdict::absurd : SetPointVerdict::not_finite;
  }
  set_points_.receive(stamp.value_or(now), now);
  set_point_ = gate_.reachable(wanted);
  if (set_point_.forward != wanted.forward || set_point_.yaw_rate != wanted.yaw_rate) {
    ++status_.scaled_set_points;
    status_.scaled_from = wanted;
    status_.scaled_to = set_point_;
  }
  controller_->setSetPoint(set_point_);
  return SetPointVerdict::accepted;
}

bool DriveLoop::receiveWheels(const SensorReading& reading, double now) {
  notify(now, WheelsInput{reading});
  catchUp(now);
  const Observation& y = reading.observation;
  if (refuseStamp(y.stamp, now)) return false;
  receive(wheels_, y.stamp, now);
  measured_(kForward) = kinematics_.bodyVelocity({y.wheel_left, y.wheel_right})(kForward);
  // Encoders at rest may repeat, on the move they may not.
  const WheelVector command = appliedCommand(now).vector();
  const bool turns = std::max(std::abs(y.wheel_left), std::abs(y.wheel_right)) >= thresholds::kMoving;
  const bool has_to_turn = command.cwiseAbs().maxCoeff() > WheelMonitor::kStiction;
  wheels_.compare(reading.sample, reading.may_repeat || !(turns || has_to_turn), now);
  if (parameters_.motors_shared) motors_.apply(now, {y.wheel_left, y.wheel_right}, AppliedSource::wheels);
  return measurements_.started() && health(now).imu.silent() && takeObservation(y, now);
}

bool DriveLoop::receiveImu(const SensorReading& reading, double now) {
  notify(now, ImuInput{reading});
  noteTime(now);
  if (refuseStamp(reading.observation.stamp, now)) return false;
  receive(imu_, reading.observation.stamp, now);
  measured_(kYaw) = reading.observation.yaw_rate;
  imu_.compare(reading.sample, false, now);
  return measurements_.started() && health(now).wheels.silent() && takeObservation(reading.observation, now);
}

void DriveLoop::receiveFeedback(double stamp, double now) {
  notify(now, FeedbackInput{stamp});
  feedback_.receive(stamp, now);
}

bool DriveLoop::observe(const Observation& observation, double now) {
  notify(now, ObservationInput{observation});
  return !refuseStamp(observation.stamp, now) && takeObservation(observation, now);
}

bool DriveLoop::refuseStamp(double stamp, double now) {
  if (!(stamp > now + kFurthestAhead)) return false;
  ++status_.rejected_measurements;
  return true;
}

void DriveLoop::receive(InputSource& source, double stamp, double now) {
  source.receive(stamp, now);
  const bool both = std::min(wheels_.arrival(), imu_.arrival()) > measurement_.arrival();
  if (both && unpaired_since_ == HUGE_VAL) unpaired_since_ = now;
}

bool DriveLoop::takeObservation(const Observation& observation, double now) {
  catchUp(now);
  const ChannelValidity& valid = observation.valid;
  // A pair is as old as the later of its sources came: the other may have sent newer ones since.
  const auto came = [&](InputSource& source) {
    if (!source.received() || observation.stamp >= source.stamp()) receive(source, observation.stamp, now);
  };
  if (valid.wheel_left || valid.wheel_right) came(wheels_);
  if (valid.yaw_rate || valid.acceleration) came(imu_);

  Observation judged = observation;
  measurements_.judge(judged, health(now), now);
  counted_ = judged.valid;
  const FaultReport* faults = measurements_.report();
  if (predictive_ != nullptr && faults != nullptr) {
    predictive_->setShaken(faults->shaken);
    if (faults->turnSensorFaulty()) predictive_->withdrawTurn();
  }
  const SampleVerdict verdict = controller_->observe(judged);
  if (!taken(verdict) && verdict != SampleVerdict::incomplete) {
    // A sample that came alone and in a pair is late once, which is normal.
    const bool partners = observed_alone_ == valid.all();
    if (!partners || !(observation.stamp <= measurement_.stamp())) ++status_.rejected_measurements;
    return false;
  }
  measurement_.receive(observation.stamp, now);
  unpaired_since_ = HUGE_VAL;
  phase_.arrived(nanoseconds(now));
  observed_alone_ = !valid.all();
  if (verdict == SampleVerdict::incomplete) return false;  // received but not accepted; measurements_ has the reason
  if (measurements_.recoversFromStall(now)) {
    // Restarts the belief from the measurement, because no model knows the motors' motion in a stall.
    controller_->restart();
    controller_->overrule(gate_.command());
  }
  return true;
}

void DriveLoop::report(const RobotStatus& status, double now) {
  notify(now, StatusInput{status});
  noteTime(now);
  robot_ = status;
}

void DriveLoop::applied(const WheelCommand& command, AppliedSource source, double now) {
  notify(now, AppliedInput{command, source});
  catchUp(now);
  if (parameters_.motors_shared) motors_.apply(now, command, source);
}

void DriveLoop::setLearned(const LearnedModel& learned, double now) {
  notify(now, LearnedInput{learned});
  catchUp(now);
  if (predictive_ != nullptr) predictive_->setLearned(learned);
}

void DriveLoop::freezeLearning(bool frozen, double now) {
  notify(now, LearningInput{frozen});
  catchUp(now);
  if (predictive_ != nullptr) predictive_->freezeLearning(frozen);
}

void DriveLoop::adoptGains(const ControllerParameters& gains, double now) {
  notify(now, GainsInput{gains});
  catchUp(now);
  auto* thesis = dynamic_cast<ActiveInferenceController*>(controller_.get());
  if (thesis == nullptr) throw ParameterError("controller.*: another structure runs");
  thesis->adoptGains(gains, parameters_.geometry);
}

void DriveLoop::adoptGains(const PredictiveParameters& gains, double now) {
  notify(now, GainsInput{gains});
  catchUp(now);
  if (predictive_ == nullptr) throw ParameterError("predictive.*: another structure runs");
  predictive_->adoptGains(gains);
}

std::optional<WheelCommand> DriveLoop::take(const DriveInput& input) {
  struct {
    DriveLoop& loop;
    double now;
    using Command = std::optional<WheelCommand>;

    Command operator()(const BeliefInput&) { return loop.updateBelief(now), std::nullopt; }
    Command operator()(const ActionInput& i) { return i.due ? loop.advance(now, *i.due) : loop.advance(now); }
    Command operator()(const SetPointInput& i) { return loop.setSetPoint(i.wanted, now, i.stamp), std::nullopt; }
    Command operator()(const WheelsInput& i) { return loop.receiveWheels(i.reading, now), std::nullopt; }
    Command operator()(const ImuInput& i) { return loop.receiveImu(i.reading, now), std::nullopt; }
    Command operator()(const ObservationInput& i) { return loop.observe(i.observation, now), std::nullopt; }
    Command operator()(const FeedbackInput& i) { return loop.receiveFeedback(i.stamp, now), std::nullopt; }
    Command operator()(const StatusInput& i) { return loop.report(i.status, now), std::nullopt; }
    Command operator()(const AppliedInput& i) { return loop.applied(i.command, i.source, now), std::nullopt; }
    Command operator()(const LearnedInput& i) { return loop.setLearned(i.learned, now), std::nullopt; }
    Command operator()(const LearningInput& i) { return loop.freezeLearning(i.frozen, now), std::nullopt; }
    Command operator()(const GainsInput& i) {
      std::visit([this](const auto& gains) { loop.adoptGains(gains, now); }, i.gains);
      return std::nullopt;
    }
    Command operator()(const StartInput& i) { return loop.start(i.driven, now), std::nullopt; }
  } call{*this, input.now};
  return std::visit(call, input.what);
}

void DriveLoop::updateBelief(double now) {
  notify(now, BeliefInput{});
  noteTime(now);
  runBelief(nanoseconds(now));
}

/// An input that changes the beliefs needs beliefs about the present.
void DriveLoop::catchUp(double now) {
  noteTime(now);
  runBelief(nanoseconds(now) - 1);
}

void DriveLoop::runBelief(std::int64_t until) {
  for (int due = schedule_.beliefStepsDue(until); due > 0; --due) beliefStep();
}

std::optional<WheelCommand> DriveLoop::advance(double now) {
  notify(now, ActionInput{});
  noteTime(now);
  const std::int64_t rounded = nanoseconds(now + thresholds::kRounding);
  return advanceTo(now, schedule_.started() ? schedule_.lastBoundary(rounded) : nanoseconds(now));
}

std::optional<WheelCommand> DriveLoop::advance(double now, double due) {
  notify(now, ActionInput{due});
  noteTime(now);
  return advanceTo(now, nanoseconds(std::min(due, now)));
}

std::optional<WheelCommand> DriveLoop::advanceTo(double now, std::int64_t boundary) {
  int periods = actionPeriodsDue(now, boundary);
  if (periods == 0) {
    runBelief(nanoseconds(now));
    return std::nullopt;
  }
  // Beliefs catch up. The command changes only with the elapsed time, because its acceleration limits hold for the
  // motors.
  const int actions = mostActions(now);
  for (; periods > 0; --periods) {
    while (schedule_.beliefStepsLeft() > 0) beliefStep();
    if (periods <= actions) act(now);
    schedule_.actionStepDone(boundary);
  }
  last_action_ = now;
  if (parameters_.motors_shared) motors_.send(now, gate_.command());
  return gate_.command();
}

double DriveLoop::nextDue(double due, double now) {
  return 1e-9 * static_cast<double>(phase_.next(nanoseconds(due), nanoseconds(now)));
}

int DriveLoop::actionPeriodsDue(double now, std::int64_t boundary) {
  // A simulated clock begins with its first message, after the timer was set; this jump is not a stall.
  const std::int64_t period = nanoseconds(controller_->actionStep());
  if (!schedule_.started()) schedule_.start(std::max(boundary, nanoseconds(now) - period));
  const std::uint64_t dropped = schedule_.droppedPeriods();
  const int periods = schedule_.actionPeriodsDue(boundary);
  if (schedule_.droppedPeriods() != dropped) measurements_.restartAfterStall(now);
  return periods;
}

int DriveLoop::mostActions(double now) const {
  const double since_last = (now - last_action_) / controller_->actionStep();
  // A longer time was a stall, or a jump of the clock without a motion.
  if (since_last > kMostPeriods + 0.75) return 1;
  return static_cast<int>(std::clamp(since_last + 0.25, 1.0, 1.0 * kMostPeriods));
}

void DriveLoop::beliefStep() {
  // The step's own time, whenever it is run.
  const double due = 1e-9 * static_cast<double>(schedule_.nextBeliefStep());
  // If only the wheels show what reached the motors, no drive train explains the wheels.
  measurements_.advance(motors_.fromWheelsAlone() ? std::nullopt : std::optional(appliedCommand(due)),
                        controller_->beliefStep());
  controller_->updateBelief();
  schedule_.beliefStepDone();
}

void DriveLoop::act(double now) {
  clock_jumped_ = clock_jumped_ && gate_.command() != WheelCommand{};
  decide(gateInputs(now));
  if (status_.decision.status == DriveStatus::driving) {
    drive(now);
  } else {
    brake(now);
  }
}

GateInputs DriveLoop::gateInputs(double now) {
  GateInputs inputs;
  StopCauses& causes = inputs.causes;
  const bool missing = !set_points_.received(), late = set_points_.late(now);
  const bool stands = late || set_point_.vector().isZero(0.0);
  // A missing set point may still be on its way until its publishers are connected.
  set_point_pause_ = missing && robot_.graph_checked && robot_.set_points_connected
                         ? set_point_pause_ + controller_->actionStep()
                         : 0.0;
  inputs.set_point_at_rest =
      missing ? set_point_pause_ > std::max(kPause, parameters_.gate.deadlines.set_point) : stands;
  // The motors cannot be predicted under another node's commands, or without ours.
  if (robot_.contended || robot_.no_subscriber) {
    measurements_.reset();
    if (predictive_ != nullptr) predictive_->withdrawGain();
  }
  const bool has_to_stand = stands && gate_.command() == WheelCommand{};
  causes.add(measurements_.causes(health(now), now, has_to_stand));
  const bool plausible = isPlausible(controller_->believedVelocity(), controller_->freeEnergy(), parameters_.gate);
  causes.add(StopCause::feedback_late, feedback_.late(now))
      .add(StopCause::set_point_late, late)
      .add(StopCause::set_point_missing, missing)
      .add(StopCause::belief_diverged, !plausible)
      .add(StopCause::clock_jump, clock_jumped_)
      .add(StopCause::set_points_rival, robot_.rivals)
      .add(StopCause::graph_unchecked, !robot_.graph_checked)
      .add(StopCause::motors_off, robot_.motors_off)
      .add(StopCause::robot_stopped, robot_.robot_stopped)
      .add(StopCause::emergency_stop, robot_.emergency_stop)
      .add(StopCause::disabled, robot_.disabled)
      .add(StopCause::shutdown, robot_.ending)
      .add(StopCause::contention, robot_.contended)
      .add(StopCause::driver_fault, robot_.driver_fault);
  return inputs;
}

void DriveLoop::decide(const GateInputs& inputs) {
  const DriveStatus before = status_.decision.status;
  status_.decision = gate_.decide(inputs);
  const DriveStatus status = status_.decision.status;
  if (status == before) return;
  if (status == DriveStatus::braking) ++status_.brakes;
  if (status == DriveStatus::faulted) ++status_.faults;
  if (before == DriveStatus::faulted) measurements_.reset();
}

void DriveLoop::drive(double now) {
  const std::optional<WheelCommand> others = motors_.another(now);
  // The other's first commands seemed to be ours.
  if (others && !status_.handed_over && predictive_ != nullptr) predictive_->withdrawGain();
  // Motors that rest because the commands have no subscriber are no hand-over.
  status_.handed_over = others && !robot_.no_subscriber;
  if (others) {
    controller_->overrule(*others);
    action_ = motors_.offer(kinematics_.wheelSpeeds(set_point_.forward, set_point_.yaw_rate));
    gate_.follow(*others);
    gate_.drive(action_);
  } else {
    action_ = controller_->updateAction();
    controller_->hold(gate_.drive(action_));
  }
}

void DriveLoop::brake(double now) {
  if (status_.decision.cause == StopCause::belief_diverged && !status_.decision.unacknowledged) {
    controller_->reset();
    controller_->setSetPoint(set_point_);
  }
  action_ = {};
  status_.handed_over = false;
  gate_.brake();
  controller_->overrule(appliedCommand(now));
}

SensorHealth DriveLoop::health(double now) const {
  SensorHealth health{wheels_.health(now), imu_.health(now)};
  // Unpaired sources keep sending without a pair; a slow or silent source only delays the pairs.
  const bool both_send = std::min(wheels_.arrival(), imu_.arrival()) - unpaired_since_ > 0.5 * measurement_.deadline();
  health.unpaired = !measurement_.received() || (measurement_.late(now) && both_send);
  return health;
}

WheelCommand DriveLoop::appliedCommand(double now) { return motors_.applied(now).value_or(gate_.command()); }

void DriveLoop::noteTime(double now) {
  if (now < now_) restart(now);
  now_ = now;
}

void DriveLoop::restart(double now) {
  ++status_.clock_resets;
  reset(now);
  measurements_.resetSensors();  // a simulation that restarts may have another robot
  clock_jumped_ = true;
}

void DriveLoop::reset(double now) {
  controller_->resetMotion();
  measurements_.restart(now);
  schedule_.stop();
  phase_.reset();
  motors_.reset();
  set_point_ = {};
  measured_ = kNotMeasured;
  for (InputSource* source : {&set_points_, &wheels_, &imu_, &feedback_, &measurement_}) source->reset();
  set_point_pause_ = 0.0;
  unpaired_since_ = HUGE_VAL;
  action_ = {};
}

DriveLoopStatus DriveLoop::status() const {
  DriveLoopStatus status = status_;
  status.fault = measurements_.fault();
  status.share = measurements_.share();
  status.loss = measurements_.loss();
  if (const FaultReport* faults = measurements_.report()) status.suspicion = faults->suspicion;
  status.faults_detected = measurements_.detected();
  status.dropped_periods = schedule_.droppedPeriods();
  return status;
}

}  // namespace jackal_aic
