#pragma once

/// @file
/// Predictive active inference controller: the generative model contains the robot's drive train and its dead time.
///
///     sense    each wheel speed against its prediction from the commands really applied          (wheel_belief.hpp)
///     believe  speed and input disturbance of each wheel, yaw rate, by the gradient of one free energy
///     learn    effective track, by the free energy of the gyro                                             (turn.hpp)
///              dead time, lag, gain and acceleration limit of the drive train              (drive_train_learning.hpp)
///     act      da/dt descends 1/2 eps_a^2 / Sigma_a with eps_a = gain a + d - w*, so that the disturbance is cancelled
///              and the wheel's own dynamics become the reference dynamics                     (wheel_controller.hpp)
///
/// The set point enters through the state dynamics f(mu) of a path that the drive train can follow
/// (drive_train_reference.hpp); w* is the input that follows it. The goal is not in the belief, so the reported body
/// velocity is an unbiased estimate. A robot at rest with a zero set point gets a command of zero (standstill.hpp).

#include <Eigen/Core>

#include "jackal_aic/aic/standstill.hpp"
#include "jackal_aic/aic/velocity_controller.hpp"
#include "jackal_aic/model/geometry.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/side_balance.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/traction_belief.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/predictive/drive_train_learning.hpp"
#include "jackal_aic/predictive/learned_model.hpp"
#include "jackal_aic/predictive/motion_uncertainty.hpp"
#include "jackal_aic/predictive/predictive_parameters.hpp"
#include "jackal_aic/predictive/turn.hpp"
#include "jackal_aic/predictive/wheel_controller.hpp"
#include "jackal_aic/predictive/yaw_rate_belief.hpp"

namespace jackal_aic {

/// The predictive controller.
class PredictiveController : public VelocityController {
 public:
  /// @throws ParameterError as validate().
  PredictiveController(const PredictiveParameters& parameters, const GeometryParameters& geometry,
                       const PlantModel& model);

  bool setSetPoint(const SetPoint& set_point) override;

  /// Takes a measurement for the next belief update. An invalid channel has precision zero. Without the yaw rate the
  /// belief follows the wheels with the learned slip. Without one wheel it uses the yaw rate and the other wheel,
  /// without both the model.
  SampleVerdict observe(const Observation& observation) override;

  /// Advances the belief by 1/belief_rate and takes the new measurement.
  void updateBelief() override;

  WheelCommand updateAction() override;

  /// The really driven command goes into the generative model, and the reference model's path starts from it.
  void hold(const WheelCommand& applied) override;

  /// As hold(): the belief includes the effect of the command.
  void overrule(const WheelCommand& applied) override;

  /// As the base; assumes steady motion.
  void restart() override;

  void reset() override;

  /// As the base: keeps what was learned about slip and drive train.
  void resetMotion() override;

  /// Sets the limits of angular acceleration and deceleration of the command [rad/s^2]; 0: no bound, or no separate
  /// one. A turn whose command could not return in time would overshoot.
  void setTurnLimits(double acceleration, double deceleration);

  /// Adopts other gains and keeps belief and action. Allocates nothing. @throws ParameterError, and changes nothing, if
  /// they are invalid or have other rates.
  void adoptGains(const PredictiveParameters& parameters);

  /// Unbiased estimate of the body velocity (base_link).
  BodyVector believedVelocity() const override;

  WheelCommand action() const override { return {left_.action(), right_.action()}; }  ///< command now driven [rad/s]
  double freeEnergy() const override { return free_energy_; }                         ///< F of the last measurement
  double beliefStep() const override { return 1.0 / parameters_.belief_rate; }
  int beliefStepsPerAction() const override { return parameters_.beliefStepsPerAction(); }

  /// Covariance of the believed x_dot [m/s] and theta_dot [rad/s]: that of the wheels' speeds, the learned slip, the
  /// accelerometer and the gyro, plus the uncertainty of a real robot's motion (motion_uncertainty.hpp).
  Eigen::Matrix2d motionCovariance() const;

  /// Believed drive train, with its learned parameters.
  const PlantModel& model() const { return model_; }

  /// Last measurement taken; zero before the first.
  const Observation& measurement() const { return observation_; }

  /// eps_y of the last measurement, before it moved the belief; 0 for the acceleration, which the model does not
  /// predict.
  const SensorVector& sensoryErrors() const { return errors_; }

  /// The learned model, to be kept for the next start.
  LearnedModel learned() const { return {turn_.state(), drive_train_.timing()}; }

  /// Belief about the turn of the body with the wheels.
  const Turn& turn() const { return turn_; }

  /// Sets what was learned before: the turn within the range of the track, and known dead time and lag. @throws
  /// ParameterError if a value is not finite, track or slip factor is not positive, or the timing is out of its range.
  void setLearned(const LearnedModel& learned);

  /// Stops (true) or resumes learning of effective track and drive train.
  void freezeLearning(bool frozen);
  bool learningFrozen() const { return frozen_; }  ///< learning was stopped

  /// The gyro or an encoder is faulty: withdraws its recent part of the learned turn.
  void withdrawTurn() { turn_.withdraw(); }

  /// Commands did not reach the motors, or an encoder is excluded: withdraws the learned gain of the drive train.
  void withdrawGain();

  /// A jolt of the ground shakes the robot (true): the gyro counts, but the effective track is not learned until it is
  /// over.
  void setShaken(bool shaken) { shaken_ = shaken; }

  /// Belief about whether the body follows its wheels.
  Traction traction() const { return traction_.traction(); }

  double effectiveTrack() const { return turn_.effectiveTrack(); }  ///< believed b_hat, turning in place [m]
  const WheelBelief& left() const { return left_.belief(); }        ///< belief about the left wheels
  const WheelBelief& right() const { return right_.belief(); }      ///< belief about the right wheels

 private:
  WheelVector wheels() const { return {left().speed(), right().speed()}; }
  bool learnsDriveTrain() const { return parameters_.learn_drive_train && !frozen_; }
  double forwardSpeedOf(double sum_of_wheels) const;
  WheelVector changeAhead() const;
  void learnTurn(const Observation& observation);
  void believeMissing(Observation& observation) const;
  void predict();
  void correct(const Observation& observation);
  double correctWheels(const Observation& observation);
  double correctYawRate(const Observation& observation);
  void correctForwardSpeed(const Observation& observation);
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
  SideBalance sides_;
  YawRateBelief yaw_;
  TractionBelief traction_;
  Turn turn_;
  DriveTrainLearning drive_train_;
  MotionUncertainty uncertainty_;
  SetPoint set_point_;
  Standstill standstill_;
  double turn_acceleration_ = 0.0;  // that a command may have [rad/s^2]; 0: no bound
  Observation observation_;
  bool observed_ = false;             // an observation waits for the next belief update
  bool started_ = false;              // a first observation came
  bool frozen_ = false;               // learning was stopped
  bool shaken_ = false;               // a jolt of the ground shakes the robot
  double observation_step_ = 0.0;     // between the last two observations [s]
  double innovation_variance_ = 0.0;  // of the difference of the wheel speeds, lately [(rad/s)^2]
  double free_energy_ = 0.0;
  double turning_ = 0.0;  // recent difference of the wheel speeds [rad/s]
  SensorVector errors_ = SensorVector::Zero();
};

}  // namespace jackal_aic
