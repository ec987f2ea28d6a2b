#pragma once

/// @file
/// Predictive active inference controller: the generative model carries the robot's drive train and its dead time.
///
///     sense    each wheel speed against its prediction from the commands really applied          (wheel_belief.hpp)
///     believe  speed and input disturbance of each wheel, yaw rate, by the gradient of one free energy
///     learn    effective track, by the free energy of the gyro                                      (slip_belief.hpp)
///              dead time, lag, gain and acceleration limit of the drive train              (drive_train_learning.hpp)
///     act      da/dt descends 1/2 eps_a^2 / Sigma_a with eps_a = gain a + d - w*, so that the disturbance is cancelled
///              and the wheel's own dynamics become the reference dynamics                     (wheel_controller.hpp)
///
/// The set point enters through a reference model of the wheel speed, dw_ref/dt = clamp((w_d - w_ref)/tau_ref, +-
/// limit): the state dynamics f(mu) of a path that the drive train can follow (drive_train_reference.hpp). w* is the
/// input with which the drive train of the model goes from one point of that path to the next within an action period.
/// The goal is not in the belief: the reported body velocity is what the robot does, not what it should do.
///
/// A robot that is told to stand, and does, gets a command of exactly zero (standstill.hpp).

#include <Eigen/Core>

#include "jackal_aic/aic/standstill.hpp"
#include "jackal_aic/aic/velocity_controller.hpp"
#include "jackal_aic/model/geometry.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/traction_belief.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/predictive/drive_train_learning.hpp"
#include "jackal_aic/predictive/learned_model.hpp"
#include "jackal_aic/predictive/motion_uncertainty.hpp"
#include "jackal_aic/predictive/predictive_parameters.hpp"
#include "jackal_aic/predictive/slip_belief.hpp"
#include "jackal_aic/predictive/wheel_controller.hpp"
#include "jackal_aic/predictive/yaw_rate_belief.hpp"

namespace jackal_aic {

/// The controller that knows what the robot will do before it is measured.
class PredictiveController : public VelocityController {
 public:
  /// @throws ParameterError as validate().
  PredictiveController(const PredictiveParameters& parameters, const GeometryParameters& geometry,
                       const PlantModel& model);

  bool setSetPoint(const SetPoint& set_point) override;

  /// Takes a measurement, to be used in the next belief update. A channel that does not count has precision zero:
  /// without the yaw rate the belief follows the wheels with the slip learned before, without one wheel's speed that
  /// wheel is believed by the yaw rate and the other one, without both by the model alone.
  SampleVerdict observe(const Observation& observation) override;

  /// Moves the belief on by 1/belief_rate and takes the measurement that came since.
  void updateBelief() override;

  WheelCommand updateAction() override;

  /// What is really driven goes into the generative model, and the path of the reference model starts from there.
  void hold(const WheelCommand& applied) override;

  /// As hold(): the belief knows what the command will do to the robot.
  void overrule(const WheelCommand& applied) override;

  /// As the base; the robot is taken to move steadily.
  void restart() override;

  void reset() override;

  /// As the base: keeps what was learned of slip and drive train.
  void forgetMotion() override;

  /// Tells the angular acceleration and deceleration [rad/s^2] that a drive command may have; 0: no bound, or none of
  /// its own. A turn whose command could not come back in time would run on beyond its set point.
  void setTurnLimits(double acceleration, double deceleration);

  /// Takes other gains over and goes on with the present belief and action. Allocates nothing. @throws ParameterError,
  /// and changes nothing, if they are invalid or have other rates.
  void adoptGains(const PredictiveParameters& parameters);

  /// An estimate of what the robot does, not of what it should do (base_link).
  BodyVector believedVelocity() const override;

  WheelCommand action() const override { return {left_.action(), right_.action()}; }  ///< command now driven [rad/s]
  double freeEnergy() const override { return free_energy_; }                         ///< F of the last measurement
  double beliefStep() const override { return 1.0 / parameters_.belief_rate; }
  int beliefStepsPerAction() const override { return parameters_.beliefStepsPerAction(); }

  /// Covariance of the believed x_dot [m/s] and theta_dot [rad/s]: that of the wheels' speeds, the learned slip, the
  /// accelerometer and the gyro, with what is uncertain about the motion of a real robot beside
  /// (motion_uncertainty.hpp).
  Eigen::Matrix2d motionCovariance() const;

  /// Drive train as it is believed, with what was learned of it.
  const PlantModel& model() const { return model_; }

  /// Last measurement taken; zero before the first.
  const Observation& measurement() const { return observation_; }

  /// eps_y of the last measurement, before it moved the belief; 0 where the model predicts nothing (acceleration).
  const SensorVector& sensoryErrors() const { return errors_; }

  /// What is learned until now, e.g. to be kept for the next start.
  LearnedModel learned() const { return {slipBelief().state(), drive_train_.timing()}; }

  /// How the body follows the wheels, as it is believed.
  const SlipBelief& slipBelief() const { return slip_; }

  /// Goes on from what was learned before: the turn within the range of the track, dead time and lag where they are
  /// known, up to kLongestTiming. @throws ParameterError if a value is not finite, a dead
  /// time or lag negative, or another one not positive.
  void setLearned(const LearnedModel& learned);

  /// Stops (true) or resumes learning of effective track and drive train.
  void freezeLearning(bool frozen);
  bool learningFrozen() const { return frozen_; }  ///< learning was stopped

  /// Gyro or an encoder was found faulty: what it contributed to the turn of late is withdrawn.
  void withdrawTurn() { slip_.withdraw(); }

  /// A jolt of the ground shakes the robot (true): the gyro counts, and teaches no effective track until it is over.
  void setShaken(bool shaken) { shaken_ = shaken; }

  /// Whether the body follows its wheels, as it is believed.
  Traction traction() const { return traction_.traction(); }

  double effectiveTrack() const { return slipBelief().effectiveTrack(); }  ///< believed b_hat, turning in place [m]
  const WheelBelief& left() const { return left_.belief(); }               ///< belief about the left wheels
  const WheelBelief& right() const { return right_.belief(); }             ///< belief about the right wheels

 private:
  bool learnsDriveTrain() const { return parameters_.learn_drive_train && !frozen_; }
  double forwardSpeedOf(double sum_of_wheels) const;
  WheelVector changeAhead() const;
  void start();
  void learnTurn(const Observation& observation);
  void believeMissing(Observation& observation) const;
  void predict();
  void correct(const Observation& observation);
  double correctWheels(const Observation& observation);
  double correctYawRate(const Observation& observation);
  void correctForwardSpeed(const Observation& observation);
  int wheelsTold(const Observation& y) const;
  double standInVariance() const;
  void watchTurn();
  void learnDriveTrain(const Observation& observation);
  void setTiming(const DriveTrainTiming& timing);
  WheelVector inputs() const;

  PredictiveParameters parameters_;
  GeometryParameters geometry_;
  PlantModel configured_model_;
  PlantModel model_;  // as it is believed
  int inner_steps_;   // of the beliefs in a belief step
  WheelController left_;
  WheelController right_;
  YawRateBelief yaw_;
  TractionBelief traction_;
  SlipBelief slip_;
  DriveTrainLearning drive_train_;
  MotionUncertainty uncertainty_;
  SetPoint set_point_;
  Standstill standstill_;
  double turn_acceleration_ = 0.0;  // that a command may have [rad/s^2]; 0: no bound
  Observation observation_;
  bool observed_ = false;          // an observation waits for the next belief update
  bool started_ = false;           // a first observation came
  bool frozen_ = false;            // learning was stopped
  bool shaken_ = false;            // a jolt of the ground shakes the robot
  double observation_step_ = 0.0;  // from the last observation but one to the last [s]
  double free_energy_ = 0.0;
  double turning_ = 0.0;  // difference of the wheel speeds, of late [rad/s]
  SensorVector errors_ = SensorVector::Zero();
};

}  // namespace jackal_aic
