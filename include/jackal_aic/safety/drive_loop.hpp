#pragma once

/// @file
/// The path from a measurement to a command:
///
///     set point --> limits --------------------------------------------+
///     reading ----> age, frozen? --+                                   v
///     pair -------> which channels count? --> controller.observe()   belief steps (1 kHz) --> action step (50 Hz)
///                                  |                                                            |
///                                  +--> loss policy --> causes to stop --> drive gate <---------+
///                                  |                                          |
///     robot status ----------------+                                          v
///                                                                          command
///
/// The node, the experiments without ROS and the tests drive through this class.

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "jackal_aic/aic/active_inference_controller.hpp"
#include "jackal_aic/aic/differential_drive.hpp"
#include "jackal_aic/aic/velocity_controller.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"
#include "jackal_aic/safety/drive_gate.hpp"
#include "jackal_aic/safety/drive_input.hpp"
#include "jackal_aic/safety/input_source.hpp"
#include "jackal_aic/safety/measurement_watch.hpp"
#include "jackal_aic/safety/motor_share.hpp"
#include "jackal_aic/safety/phase_lock.hpp"
#include "jackal_aic/safety/step_schedule.hpp"

namespace jackal_aic {

/// Settings of a drive loop.
struct DriveParameters {
  /// Gains of the structure that runs: the thesis', the predictive one, or the open-loop baseline.
  std::variant<ControllerParameters, PredictiveParameters, DifferentialDriveParameters> controller;
  GeometryParameters geometry;                                ///< of the robot, as it is configured
  GateParameters gate;                                        ///< limits, deadlines and brake
  LossPolicyParameters on_loss;                               ///< reaction to lost sensors
  std::optional<FaultParameters> faults = FaultParameters{};  ///< of the fault detection, which needs a plant model;
                                                              ///< empty: none
  std::optional<PlantModel> plant_model;  ///< model of the motors: bounds the action of the thesis' structure; part of
                                          ///< the predictive structure's generative model, which requires it
  bool motors_shared = false;             ///< another source may drive, see DriveLoop::applied()
  bool open_loop_monitored =
      false;  ///< the fault detection also watches the open-loop baseline; it reports and does not stop
};

/// The controller of these settings, with the model to drive with (drivenModel()).
/// @throws ParameterError if its gains are invalid, or the predictive structure has no plant model.
std::unique_ptr<VelocityController> makeController(const DriveParameters& parameters,
                                                   Divergence divergence = Divergence::refused);

/// State of the loop, and its counts since the start.
struct DriveLoopStatus {
  GateDecision decision;                  ///< of the last action step
  Fault fault = Fault::none;              ///< found by the fault detection
  double share = 1.0;                     ///< number of a remark on the wheels or the turn [-], see text(Fault, double)
  Loss loss = Loss::none;                 ///< sensors that are missing
  faults::Suspicion suspicion;            ///< most likely about gyro, accelerometer and body; probability 0: not judged
  bool handed_over = false;               ///< another source drives the motors
  std::uint32_t rejected_set_points = 0;  ///< not finite, or absurd
  std::uint32_t scaled_set_points = 0;    ///< accepted and scaled into the limits
  SetPoint scaled_from;                   ///< the last of these, as sent
  SetPoint scaled_to;                     ///< the same as driven
  std::uint32_t rejected_measurements = 0;  ///< with stamps not later than the last, or ahead of the clock
  std::uint32_t faults_detected = 0;        ///< in sensors and drives
  std::uint32_t brakes = 0;                 ///< number of brakes
  std::uint32_t faults = 0;                 ///< number of faulted states
  std::uint32_t clock_resets = 0;           ///< number of clock jumps back
  std::uint64_t dropped_periods = 0;        ///< action periods lost by stalls
};

/// Why the robot does not drive, or drives with a fault; empty if neither. @param contender name of the other publisher
/// of commands, or the publishers of set points, if known.
std::string reason(const DriveLoopStatus& status, const std::string& contender = {});

/// Verdict on a set point.
enum class SetPointVerdict {
  accepted,    ///< scaled into the limits if it was beyond them
  not_finite,  ///< refused
  absurd       ///< refused: far beyond the limits, see isPlausible()
};

/// A sample stamped further ahead of the clock than this is refused [s]: every later sample would be too old.
inline constexpr double kFurthestAhead = 0.1;

/// Drives a robot. The caller passes the time [s] of any clock with every call. If time runs back, the loop resets the
/// motion and brakes; a latch of the gate stays. After construction only changes of gains allocate or throw.
class DriveLoop {
 public:
  /// @param controller makeController(parameters), or another one. @throws ParameterError as MeasurementWatch.
  DriveLoop(const DriveParameters& parameters, std::unique_ptr<VelocityController> controller);

  /// Restarts on a robot whose wheels turn at these speeds [rad/s], for example after another controller, and brakes
  /// from them. As after the construction, motion needs a zero set point or a pause of the set points. Keeps what was
  /// learned and the counts.
  void start(const WheelCommand& driven, double now);

  /// Releases the latch of the start, for a recording that begins in the middle of a drive.
  void release() { gate_.release(); }

  /// Desired body velocity (base_link). @param stamp time for which it was sent [s], if it has one: an old set point is
  /// late from the start (deadlines.set_point).
  SetPointVerdict setSetPoint(const SetPoint& wanted, double now, std::optional<double> stamp = std::nullopt);

  /// Takes a message of the wheels' encoders. While the IMU is silent the controller observes them alone: then true if
  /// accepted.
  bool receiveWheels(const SensorReading& reading, double now);

  /// Takes a message of the IMU. While the wheels are silent the controller observes it alone: then true if accepted.
  bool receiveImu(const SensorReading& reading, double now);

  /// Takes feedback of the motors. @param stamp of it [s].
  void receiveFeedback(double stamp, double now);

  /// Takes a pair of both with its valid channels. Sources that were not received separately count as received with it.
  /// True if the controller accepted it.
  bool observe(const Observation& observation, double now);

  /// Sets the status of the robot from now on; to be called when it changes, and after time ran back.
  void report(const RobotStatus& status, double now);

  /// With shared motors: a command reached them, as measured or assumed.
  void applied(const WheelCommand& command, AppliedSource source, double now);

  /// Runs the belief steps that are due, up to the next action step. Need not be called: each call that uses
  /// or changes the beliefs runs the steps that are due first, so the numbers are identical.
  void updateBelief(double now);

  /// Runs every step that is due. Returns the command if an action step was: the wheel speeds to drive from now on. The
  /// first call starts the first action period.
  std::optional<WheelCommand> advance(double now);

  /// The same for a timer that may fire late. @param due time for which it was set, not later than now: the steps keep
  /// to that.
  std::optional<WheelCommand> advance(double now, double due);

  /// Next due time of a timer that called advance(now, due) [s], so that the action follows right after a measurement:
  /// PhaseLock::next(). A proposal; other timers may be used.
  double nextDue(double due, double now);

  /// Sets what was learned before, if the controller learns; else no effect. @throws ParameterError as
  /// PredictiveController::setLearned().
  void setLearned(const LearnedModel& learned, double now);

  /// Stops (true) or resumes learning, if the controller learns.
  void freezeLearning(bool frozen, double now);

  /// Adopts other gains while it drives. @throws ParameterError as the controller's adoptGains(), or for gains of
  /// another structure.
  void adoptGains(const ControllerParameters& gains, double now);
  void adoptGains(const PredictiveParameters& gains, double now);  ///< the same

  /// Repeats a recorded call. Returns the result of advance(), else nothing.
  std::optional<WheelCommand> take(const DriveInput& input);

  /// Passes every later call to a listener before it takes effect, in order. The listener is called at the rate of the
  /// belief, and must not call the loop.
  void listen(std::function<void(const DriveInput&)> listener) { listener_ = std::move(listener); }

  DriveLoopStatus status() const;                                              ///< of now
  const VelocityController& controller() const { return *controller_; }        ///< the controller
  const PredictiveController* predictive() const { return predictive_; }       ///< if predictive, else nullptr
  const SetPoint& setPoint() const { return set_point_; }                      ///< in force
  const GeometryParameters& geometry() const { return parameters_.geometry; }  ///< as configured

  /// Body velocity by the last wheel speeds, and by the last gyro sample, since the start; NaN without one.
  const BodyVector& measuredVelocity() const { return measured_; }

  const WheelCommand& action() const { return action_; }    ///< of the last action step, before the limits [rad/s]
  WheelCommand command() const { return gate_.command(); }  ///< of the last action step [rad/s]
  const FaultReport* faultReport() const { return measurements_.report(); }  ///< empty without fault detection
  ChannelValidity counted() const { return counted_; }  ///< channels of the last measurement that counted
  const ImuAtRest& imuAtRest() const { return measurements_.imuAtRest(); }  ///< calibration of the IMU

 private:
  static inline const BodyVector kNotMeasured = BodyVector::Constant(std::numeric_limits<double>::quiet_NaN());

  template <class Input>
  void notify(double now, const Input& input) const {
    if (listener_) listener_({now, input});
  }
  bool takeObservation(const Observation& observation, double now);
  bool refuseStamp(double stamp, double now);
  void receive(InputSource& source, double stamp, double now);
  void noteTime(double now);
  void catchUp(double now);
  void restart(double now);
  void reset(double now);
  SensorHealth health(double now) const;
  WheelCommand appliedCommand(double now);

  std::optional<WheelCommand> advanceTo(double now, std::int64_t boundary);
  int actionPeriodsDue(double now, std::int64_t boundary);
  int mostActions(double now) const;
  void runBelief(std::int64_t until);
  void beliefStep();
  void act(double now);
  GateInputs gateInputs(double now);
  void decide(const GateInputs& inputs);
  void drive(double now);
  void brake(double now);

  DriveParameters parameters_;
  std::unique_ptr<VelocityController> controller_;
  PredictiveController* predictive_;  // the same if it is predictive; else nullptr
  SkidSteerKinematics kinematics_;
  MeasurementWatch measurements_;
  DriveGate gate_;
  StepSchedule schedule_;
  PhaseLock phase_;
  MotorShare motors_;
  InputSource set_points_;
  InputSource wheels_;
  InputSource imu_;
  InputSource feedback_;
  InputSource measurement_;  // taken by the controller

  std::function<void(const DriveInput&)> listener_;
  double now_ = -HUGE_VAL;  // of the last call [s]
  SetPoint set_point_;
  double set_point_pause_ = 0.0;  // time of action steps since the start without any set point [s]
  BodyVector measured_ = kNotMeasured;
  double unpaired_since_ = HUGE_VAL;  // start of the time in which both sources send without a pair [s]
  ChannelValidity counted_;           // of the last measurement
  bool observed_alone_ = false;       // it was of one source, while the other was silent
  RobotStatus robot_;
  bool clock_jumped_ = false;       // the clock jumped back, and the robot has not come to rest since
  double last_action_ = -HUGE_VAL;  // time of the last action step [s]
  WheelCommand action_;
  DriveLoopStatus status_;  // but for what status() adds
};

}  // namespace jackal_aic
