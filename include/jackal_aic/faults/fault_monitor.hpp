#pragma once

/// @file
/// Fault detection per channel from prediction errors, for every controller.
///
///     wheels     prediction errors against the commands really applied (wheel_monitor.hpp): an error beyond
///                Chebyshev's bound is an outlier, K outliers among N samples are a fault
///     isolation  a wheel that does not follow its command: does the gyro agree with its encoder or with the
///                prediction?
///     gyro, accelerometer, body    hypotheses, compared by their evidence (body_monitor.hpp)
///
/// The predictions carry no wish: nothing here knows the set point. (After Baioumy, Pezzato, Ferrari and Hawes,
/// "Unbiased active inference for classical control" (2021), and Pezzato, Baioumy, Hernandez Corbato, Hawes, Wisse and
/// Ferrari, "Active inference for fault tolerant control of robot manipulators with sensory faults" (2020).)
///
/// What cannot be told apart:
/// - both wheels stopped and both encoders dead, in straight driving: neither changes the yaw rate. Taken for the
///   former.
/// - a blocked wheel and a dead encoder without a gyro (lost, faulty, or robot on a box). Taken for the former.
/// - a gyro that errs and a wheel that slips with its encoder and motor in order. Taken for the former, until the
///   motion changes and shows which it was.
/// - a frozen or dead encoder of a wheel at rest; found when the wheel should move.
/// - a robot that is pushed and an encoder that turns by itself, of wheels that are to stand. Taken for the former; the
///   encoders do not count meanwhile, and the controller has to hold the command at zero.
/// - a frozen encoder of a wheel that keeps its speed, where the noise is below the encoder's resolution; found when
///   the speed should change.

#include <array>
#include <optional>

#include "jackal_aic/faults/body_monitor.hpp"
#include "jackal_aic/faults/fault.hpp"
#include "jackal_aic/faults/fault_parameters.hpp"
#include "jackal_aic/faults/turn_witness.hpp"
#include "jackal_aic/faults/wheel_monitor.hpp"
#include "jackal_aic/model/geometry.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/traction_belief.hpp"
#include "jackal_aic/model/turn_agreement.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Health of one channel.
struct ChannelHealth {
  ChannelState state = ChannelState::ok;  ///< whether it counts
  Fault fault = Fault::none;              ///< of the sensor; of wheels that are blocked, whose encoder counts
  double distance = 0.0;                  ///< of a wheel's last prediction error, in multiples of Chebyshev's bound
  double probability = 0.0;               ///< that a gyro or an accelerometer is faulty
};

/// What the monitor thinks of the robot after a sample.
struct FaultReport {
  ChannelHealth wheel_left;     ///< encoder and motors of the left wheels
  ChannelHealth wheel_right;    ///< encoder and motors of the right wheels
  ChannelHealth gyro;           ///< yaw rate
  ChannelHealth accelerometer;  ///< all axes
  bool stuck = false;           ///< the wheels turn, and the body stands all the same; no fault
  bool shaken = false;  ///< a jolt of the ground has just shaken the robot: how it turns now is no slip; no fault
  bool moved = false;   ///< wheels that are to stand turn, or the body moves on sliding tyres; no fault
  bool wheels_off_model = false;  ///< a wheel turns beyond what robot_range.hpp allows; no fault
  bool turn_off_model = false;    ///< the body turns beyond what the range of the track allows; no fault
  double wheel_share = 1.0;       ///< of the speed that the commands ask for, which the wheels reached before
                                  ///< wheels_off_model came [-]
  double turn_share = 1.0;  ///< of the yaw rate of the wheels, which the body reached before turn_off_model came [-]
  faults::Suspicion suspicion;  ///< most likely about gyro, accelerometer and body, also where no fault is reported

  /// Channels that count: neither outlier nor faulty.
  ChannelValidity valid() const;

  /// True if a channel or a drive is faulty (an outlier is no fault).
  bool faulty() const { return isFault(fault()); }

  /// True if the wheels of a side do not follow their command (blocked, or without power).
  bool blocked() const;

  /// True if the gyro or an encoder is faulty, so that the slip learned last is in doubt.
  bool turnSensorFaulty() const;

  /// The gravest fault, else that the robot is moved, else that it is stuck.
  Fault fault() const;

  /// The same in a few words.
  const char* reason() const { return text(fault()); }
};

/// Watches the samples of the robot's sensors. The caller keeps the time: advance() for every period in which a command
/// is applied, check() for every sample. Nothing here allocates or throws after construction.
class FaultMonitor {
 public:
  FaultMonitor(const FaultParameters& parameters, const GeometryParameters& geometry, const PlantModel& model);

  /// Advances the time under a command. @param applied the applied command, zero while stopped; empty if unknown: then
  /// the prediction follows the measurement, and only a frozen encoder is found; @param duration [s]; remainders of
  /// DriveTrain::kStep accumulate.
  void advance(const std::optional<WheelCommand>& applied, double duration);

  /// Judges a sample. A sample that is not finite or not later than the last is ignored. Invalid channels keep their
  /// verdict.
  const FaultReport& check(const Observation& observation);

  /// Verdict of the last check().
  const FaultReport& report() const { return report_; }

  /// Starts again with the next sample. Clears motion and faults; keeps noise, slip and bias.
  void restart();

  /// Clears noise, resolution and model error of the encoders, for another robot. To be called after restart().
  void forgetEncoders();

  /// Clears everything but the parameters.
  void reset();

 private:
  /// Evidence of the yaw rate while a wheel is suspect: mean squared errors against the measured and the predicted
  /// wheels, over kEvidenceMemory.
  struct Evidence {
    double against_measured = 0.0;
    double against_predicted = 0.0;
    double time = 0.0;  // since the first suspect sample [s]
  };

  /// The wheels of a side at a sample.
  struct Side {
    WheelMonitor& wheel;
    ChannelHealth& verdict;
    double& followed;  // of followed_command_
    const WheelFaults& faults;
    double measured;  // [rad/s]
    bool valid;
  };

  std::array<Side, 2> sides(const Observation& observation);
  void predict(const WheelCommand& command);
  void start(const Observation& observation);
  void checkWheels(const Observation& observation, double step);
  void weighEvidence(const Observation& observation, double step);
  void conclude(const Side& side, double step) const;
  bool concludeMoved();
  void hearWitnesses(const Observation& observation, double step);
  static void blameEncoder(const Side& side);
  void compareWithModel(const Observation& observation, double step);
  bool wheelsTurn() const;
  void checkBody(const Observation& observation, double step);
  void checkTraction(const Observation& observation, double step);
  bool yawTells(const Observation& observation) const;
  double forwardSpeed() const;

  FaultParameters parameters_;
  GeometryParameters geometry_;
  PlantModel model_;
  double rolling_radius_;  // r alpha [m]
  WheelMonitor left_;
  WheelMonitor right_;
  faults::BodyMonitor body_;
  TurnWitness witness_;
  TurnAgreement turn_;                              // of the body with the measured wheels
  double off_model_ = 0.0;                          // time for which a wheel turns beyond what its commands allow [s]
  double off_measured_ = 0.0, off_expected_ = 0.0;  // angles of such wheels in that time [rad]
  TractionBelief traction_{0.0};
  double left_over_ = 0.0;  // time of a step that has not been predicted yet, in steps
  FaultReport report_;
  Evidence evidence_;
  bool yaw_tells_ = false;
  bool was_to_stand_ = false;   // when no wheel was suspect last
  bool wheels_turned_ = false;  // from outside
  double stamp_ = 0.0;
  bool started_ = false;
  bool followed_ = false;          // since the last sample the commands were not known
  WheelCommand followed_command_;  // with which they do what they were measured to do meanwhile [rad/s]
  double known_ = 0.0;             // time since a restart for which the commands are known [s]
};

}  // namespace jackal_aic
