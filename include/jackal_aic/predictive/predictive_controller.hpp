#pragma once

/// @file
/// Predictive active inference controller: the generative model carries the robot's drive train and its dead time.
///
///     sense    each wheel speed against its prediction from the commands really applied          (wheel_belief.hpp)
///     believe  speed and input disturbance of each wheel, effective track, by the gradient of one free energy
///     act      da/dt descends 1/2 eps_a^2 / Sigma_a with eps_a = gain a + d - w*, so that the disturbance is cancelled
///              and the wheel's own dynamics become the reference dynamics
///
/// The set point enters through a reference model of the wheel speed, dw_ref/dt = clamp((w_d - w_ref)/tau_ref, +-
/// limit): the state dynamics f(mu) of a path that the drive train can follow. w* is the input with which the drive
/// train of the model goes from one point of that path to the next within an action period. The goal is not in the
/// belief: the reported body velocity is what the robot does, not what it should do.
///
/// A robot that is told to stand, and does, gets a command of exactly zero (standstill.hpp).
///
/// How the body follows the wheels, effective track and slip, is believed too (slip_belief.hpp).

#include <Eigen/Core>
#include <cmath>

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/aic/standstill.hpp"
#include "jackal_aic/aic/velocity_controller.hpp"
#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/model/wheel_belief.hpp"
#include "jackal_aic/predictive/forward_speed_belief.hpp"
#include "jackal_aic/predictive/precision_learning.hpp"
#include "jackal_aic/predictive/slip_belief.hpp"
#include "jackal_aic/predictive/yaw_rate_belief.hpp"

namespace jackal_aic {

/// Parameters of the predictive controller. YAML prefix `predictive`; the drive train is a PlantModel, prefix
/// `plant_model`.
struct PredictiveParameters {
  double belief_rate = 1000.0;        ///< rate of the belief update [Hz], a whole multiple of action_rate
  double action_rate = 50.0;          ///< rate of the action update [Hz]
  double belief_learning_rate = 1.0;  ///< kappa_mu, learning rate of the belief (natural gradient), 0..1
  double action_learning_rate = 1.0;  ///< kappa_a, learning rate of the action (natural gradient), 0..1
  double goal_weight = 0.0;           ///< gamma, weight of the goal in the belief, 0..1; above 0 the belief is biased
  double sensory_action = 0.0;        ///< kappa_y, learning rate of the action along the sensory prediction error
  double reference_time = 0.01;       ///< tau_ref, time constant of the reference model [s]
  double wheel_variance = 9e-4;       ///< Sigma_y of a wheel speed [(rad/s)^2]
  double gyro_variance = 2.5e-5;      ///< Sigma_g of the yaw rate [(rad/s)^2]
  double speed_process_noise = 0.01;  ///< of a wheel's speed [(rad/s)^2/s]
  double yaw_process_noise = 1e-4;    ///< of the yaw rate beside what the wheels ask for [(rad/s)^2/s]
  double disturbance_process_noise = 0.01;  ///< of a wheel's input disturbance [(rad/s)^2/s]
  double dead_time_deviation = 0.03;        ///< standard deviation of the dead time [s]
  double accelerometer_variance = 2.5e-3;   ///< of the forward acceleration [(m/s^2)^2]
  bool learn_precision = false;             ///< learn the variance of each channel while driving steadily
  double precision_time_constant = 10.0;    ///< time over which the precisions are averaged [s]
  bool learn_track = true;                  ///< learn the effective track
  bool learn_slip_factor = false;           ///< learn the slip alpha from the accelerometer
  double slip_time_constant = 0.5;          ///< time over which the effective track is averaged while turning [s]
  double yaw_delay_deviation = 0.05;  ///< sigma_y, standard deviation of the delay of the yaw behind the wheels [s]
  double slip_excitation = 0.5;       ///< least difference of the wheel speeds to learn from [rad/s]
  double accelerometer_weight = 0.0;  ///< of the accelerometer in the believed forward speed, 0: the wheels alone
  double turning_centre = 0.0;        ///< l, how far the centre of turning lies ahead of the IMU [m]

  /// Belief updates per action update.
  int beliefStepsPerAction() const;
};

/// Lists the fields of PredictiveParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, PredictiveParameters& p) {
  v.field("belief_rate", p.belief_rate, {1.0, 1000.0}, "Hz", Presence::required);
  v.field("action_rate", p.action_rate, {1.0, 1000.0}, "Hz", Presence::required);
  v.field("belief_learning_rate", p.belief_learning_rate, {1e-6, 1.0}, "", Presence::optional);
  v.field("action_learning_rate", p.action_learning_rate, {0.0, 1.0}, "", Presence::optional);
  v.field("goal_weight", p.goal_weight, {0.0, 1.0}, "", Presence::optional);
  v.field("sensory_action", p.sensory_action, {0.0, 1e4}, "", Presence::optional);
  v.field("reference_time", p.reference_time, {1e-4, 10.0}, "s", Presence::optional);
  v.field("wheel_variance", p.wheel_variance, {1e-9, 1e3}, "(rad/s)^2", Presence::required);
  v.field("gyro_variance", p.gyro_variance, {1e-12, 1e3}, "(rad/s)^2", Presence::required);
  v.field("speed_process_noise", p.speed_process_noise, {0.0, 1e3}, "(rad/s)^2/s", Presence::required);
  v.field("disturbance_process_noise", p.disturbance_process_noise, {0.0, 1e3}, "(rad/s)^2/s", Presence::required);
  v.field("yaw_process_noise", p.yaw_process_noise, {0.0, 1e3}, "(rad/s)^2/s", Presence::optional);
  v.field("dead_time_deviation", p.dead_time_deviation, {0.0, 1.0}, "s", Presence::required);
  v.field("accelerometer_variance", p.accelerometer_variance, {1e-12, 1e3}, "(m/s^2)^2", Presence::optional);
  v.field("learn_precision", p.learn_precision, Presence::optional);
  v.field("precision_time_constant", p.precision_time_constant, {0.1, 1e4}, "s", Presence::optional);
  v.field("learn_track", p.learn_track, Presence::optional);
  v.field("learn_slip_factor", p.learn_slip_factor, Presence::optional);
  v.field("slip_time_constant", p.slip_time_constant, {0.02, 1000.0}, "s", Presence::optional);
  v.field("yaw_delay_deviation", p.yaw_delay_deviation, {0.0, 1.0}, "s", Presence::optional);
  v.field("slip_excitation", p.slip_excitation, {0.05, 100.0}, "rad/s", Presence::optional);
  v.field("accelerometer_weight", p.accelerometer_weight, {0.0, 0.999}, "", Presence::optional);
  v.field("turning_centre", p.turning_centre, {-1.0, 1.0}, "m", Presence::optional);
}

/// @throws ParameterError if belief_rate is no whole multiple of action_rate, or belief_rate does not divide 1 kHz.
void validate(const PredictiveParameters& parameters);

/// A path that the drive train of the model can follow: its speed and the correction of its velocity loop on the way.
class DriveTrainReference {
 public:
  /// @param model drive train; @param wheel_radius r [m]; @param reference_time tau_ref [s]; @param step action period
  /// [s].
  DriveTrainReference(const PlantModel& model, double wheel_radius, double reference_time, double step);

  /// Goes on by one action period towards a wheel speed [rad/s]; returns the input r [rad/s] that makes the model do
  /// so.
  double advance(double wanted);

  /// The input r [rad/s] with which advance() would go on.
  double input(double wanted) const;

  /// Goes on by one action period with this input [rad/s], within the acceleration limit.
  void take(double r);

  /// The path of the difference of two wheels, of which the drive train is the same.
  DriveTrainReference minus(const DriveTrainReference& other) const;

  /// The input nearest to r [rad/s] from which the path ends at a wheel speed [rad/s] without running beyond it. An
  /// input that makes a wheel accelerate leads it by its lag and has to come back in time. @param largest_change of an
  /// input in a period [rad/s]. Where r is not to be changed it is returned to the bit.
  double inTime(double wanted, double r, double largest_change) const;

  /// Goes on by one action period as the model does under an input r [rad/s].
  void follow(double r);

  /// Takes the last period back and goes through it anew with this much more input [rad/s].
  void amend(double more);

  /// Starts at this wheel speed [rad/s].
  void reset(double speed);

  /// Goes on with another time constant tau_ref [s].
  void setReferenceTime(double reference_time) { pull_ = -std::expm1(-step_ / reference_time); }

  /// Wheel speed on the path now [rad/s].
  double speed() const { return state_(0); }

 private:
  bool endsInTime(double wanted, double r, double largest_change) const;

  Eigen::Matrix2d transition_;  // of (w, z) over an action period
  Eigen::Vector2d input_;       // of r held over it
  double step_;                 // action period [s]
  double largest_change_;       // of w over it [rad/s]
  double pull_;                 // part of the way to the wanted speed
  Eigen::Vector2d state_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d before_ = Eigen::Vector2d::Zero();  // state before the last period
  double r_ = 0.0;                                    // input of the last period
};

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

  /// As the base: keeps the slip.
  void forgetMotion() override;

  /// Tells the angular acceleration and deceleration [rad/s^2] that a drive command may have; 0: no bound, or none of
  /// its own. A turn whose command could not come back in time would run on beyond its set point.
  void setTurnLimits(double acceleration, double deceleration);

  /// Takes other gains over and goes on with the present belief and action. Allocates nothing. @throws ParameterError,
  /// and changes nothing, if they are invalid or have other rates.
  void adoptGains(const PredictiveParameters& parameters);

  /// An estimate of what the robot does, not of what it should do (base_link).
  BodyVector believedVelocity() const override;

  WheelCommand action() const override { return applied_; }    ///< command now driven [rad/s]
  double freeEnergy() const override { return free_energy_; }  ///< F of the last measurement
  double beliefStep() const override { return 1.0 / parameters_.belief_rate; }
  int beliefStepsPerAction() const override { return parameters_.beliefStepsPerAction(); }

  /// Covariance of the believed x_dot [m/s] and theta_dot [rad/s], from those of the wheels' speeds and, where they
  /// take part, of the learned slip and of the accelerometer.
  Eigen::Matrix2d velocityCovariance() const;

  /// Last measurement taken; zero before the first.
  const Observation& measurement() const { return observation_; }

  /// eps_y of the last measurement, before it moved the belief; 0 where the model predicts nothing (acceleration).
  const SensorVector& sensoryErrors() const { return errors_; }

  /// Believed effective track and slip, e.g. to be kept for the next start.
  SlipState slip() const { return slip_.state(); }

  /// Goes on from another effective track and slip, within a factor of 2 of the configured ones. @throws ParameterError
  /// if a value is not positive and finite.
  void setSlip(const SlipState& state);

  /// Variance of each channel as configured or learned.
  SensorVariances variances() const { return precisions_.variances(); }

  /// Stops (true) or resumes learning of effective track and slip.
  void freezeLearning(bool frozen) { learning_frozen_ = frozen; }
  bool learningFrozen() const { return learning_frozen_; }  ///< learning of effective track and slip was stopped

  double effectiveTrack() const { return slip_.state().effective_track; }  ///< believed b_hat [m]
  const WheelBelief& left() const { return left_; }                        ///< belief about the left wheels
  const WheelBelief& right() const { return right_; }                      ///< belief about the right wheels

 private:
  SkidSteerKinematics kinematics() const;
  WheelVector inputs() const;
  double act(double r, DriveTrainReference& reference, const WheelBelief& wheel, double measured, double action) const;
  void predict();
  void correct(const Observation& observation);
  double correctWheels(const Observation& observation);
  double standInVariance() const;
  void correctForwardSpeed(const Observation& observation);
  double forwardSpeedOfWheels() const;
  double yawPerWheelSpeed() const;
  Observation withBelieved(Observation observation) const;
  void learn(const Observation& observation);
  WheelDifference wheelDifference(const Observation& observation) const;
  void learnPrecisions(const Observation& observation, double step);
  void watchPath();
  bool steady() const;

  PredictiveParameters parameters_;
  GeometryParameters geometry_;
  PlantModel model_;
  int inner_steps_;
  WheelBelief left_;
  WheelBelief right_;
  YawRateBelief yaw_;
  ForwardSpeedBelief forward_;
  SlipBelief slip_;
  SensorPrecisions precisions_;
  SetPoint set_point_;
  WheelCommand applied_;
  Standstill standstill_;
  double turn_acceleration_ = 0.0;  // that a command may have [rad/s^2]; 0: no bound
  WheelCommand wanted_;             // wheel speeds of the set point [rad/s]
  DriveTrainReference reference_left_;
  DriveTrainReference reference_right_;
  Observation observation_;
  bool observed_ = false;                   // an observation waits for the next belief update
  bool started_ = false;                    // a first observation came
  double observation_step_ = 0.0;           // from the last observation but one to the last [s]
  WheelVector path_ = WheelVector::Zero();  // where the reference models were at the last action [rad/s]
  double steady_time_ = 0.0;                // since they last moved [s]
  bool learning_frozen_ = false;
  double free_energy_ = 0.0;
  SensorVector errors_ = SensorVector::Zero();
};

}  // namespace jackal_aic
