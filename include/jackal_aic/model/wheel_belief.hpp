#pragma once

/// @file
/// Belief about one wheel by a generative model that contains the drive train.
///
/// Hidden states: wheel speed w, correction z of the motors' velocity loop, input disturbance d (gain error, slope,
/// friction). The drive train moves them under the command u that was really applied (drive_train.hpp); dd/dt = 0.
///
///     y     = w + e + noise of variance Sigma_y,    de/dt = -e/T_e
///
/// e is the timing error of the wheel against the model. An error sigma_t of the dead time makes it as large as the
/// change of w in that time, which is the least deviation of e while the wheel accelerates. With a velocity loop softer
/// than the model's it fades afterwards; more slowly in a turn, where the integral of such a loop has to carry the
/// ground's torque. With T_e = 0, e is noise of the measurement and ends with the acceleration. If the belief then
/// arrives before the wheel, the remaining error counts as a disturbance, and the action corrects it. The wheel's speed
/// is w + e.
///
/// The part lambda_t of sigma_t that the motor needs is learned where e explains most of an innovation epsilon of
/// variance S. It follows the natural gradient of 1/2 epsilon^2/S + 1/2 ln S along ln lambda_t, with forgetting. It
/// soon shrinks for a motor like its model.
///
/// After an acceleration beyond half the model's limit, w is uncertain by up to the limit's deviation sigma_l times the
/// change of w. Otherwise a slower motor would count as a disturbance. After a change of the acting command, d is
/// uncertain by at least the gain's deviation sigma_g times the change of gain u of late, because the error of the gain
/// is another disturbance under another command.
///
/// Between measurements the belief x = (w, z, d, e) moves with the model, and its covariance P grows by the process
/// noise of w and d. A measurement changes it by the gradient of the free energy
///
///     F(x) = 1/2 (y - w - e)^2 / Sigma + 1/2 (x - x_prior)' P^-1 (x - x_prior),
///
/// preconditioned by the inverse of its curvature (the natural gradient). With learning rate 1 the step ends in the
/// minimum of F, the Kalman filter's estimate.

#include <Eigen/Core>
#include <cstddef>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/plant_model.hpp"

namespace jackal_aic {

/// Variances and time constants of a wheel's belief.
struct WheelBeliefParameters {
  double measurement_variance = 9e-4;       ///< Sigma_y of a wheel speed [(rad/s)^2]
  double speed_process_noise = 0.01;        ///< growth of the variance of w [(rad/s)^2/s]
  double disturbance_process_noise = 0.01;  ///< growth of the variance of d [(rad/s)^2/s]
  double dead_time_deviation = 0.03;        ///< sigma_t, standard deviation of the dead time [s]
  double timing_time_constant = 0.0;        ///< T_e of the timing error; 0: it is noise of y [s]
  double turning_time_constant = 0.0;       ///< T_e in a turn, if longer [s]
  double learning_rate = 1.0;               ///< kappa_mu of the natural gradient, above 0 and at most 1
  double limit_deviation = 0.0;             ///< sigma_l, relative standard deviation of the acceleration limit
  double gain_deviation = 0.0;              ///< sigma_g, relative standard deviation of the gain
  double disturbance_deviation = 0.3;       ///< initial deviation of d [rad/s]; 0: no disturbance
};

using WheelState = Eigen::Vector4d;       ///< hidden states (w, z, d, e) of a wheel [rad/s]
using WheelCovariance = Eigen::Matrix4d;  ///< their covariance [(rad/s)^2]

/// Belief about one wheel. Only the constructor allocates.
class WheelBelief {
 public:
  /// Inner step of the model [s].
  static constexpr double kStep = DriveTrain::kStep;

  /// @param model drive train; @param wheel_radius r [m]; @param longest_dead_time [s]; 0 if the caller keeps the
  /// commands under way and passes the acting one to predictActing().
  WheelBelief(const PlantModel& model, double wheel_radius, const WheelBeliefParameters& parameters,
              double longest_dead_time = CommandsUnderWay::kLongestDeadTime);

  /// Moves the belief by one inner step during which the command u [rad/s] is applied.
  void predict(double command) { predictActing(commands_.step(dead_zone_.effective(command))); }

  /// As predict(), with the effective command v [rad/s] that acts now.
  void predictActing(double command);

  /// Takes a present measurement [rad/s]. Returns F after the step. @param added_variance of this measurement, in
  /// addition to the encoder's [(rad/s)^2].
  double correct(double measurement, double added_variance = 0.0);

  double speed() const { return x_(0) + x_(3); }                                 ///< w + e [rad/s]
  double speedVariance() const { return P_(0, 0) + 2.0 * P_(0, 3) + P_(3, 3); }  ///< of it
  double disturbance() const { return x_(2); }                                   ///< d [rad/s]
  double acceleration() const { return rate_; }     ///< dw/dt of the last inner step [rad/s^2]
  double measurement() const { return measured_; }  ///< y, the last one [rad/s]
  double predicted() const { return predicted_; }   ///< w + e before it [rad/s]

  /// Gain of the next measurement on (w, z, d) if the wheel does not accelerate.
  Eigen::Vector3d gain() const;

  /// Map of (w, z, d) over an inner step below the acceleration limit.
  const Eigen::Matrix3d& transition() const { return drive_train_.transition(); }
  const Eigen::Vector3d& input() const { return drive_train_.input(); }  ///< change per rad/s of effective command

  /// Dead time in inner steps.
  std::size_t delay() const { return commands_.delay(); }

  /// Covariance P of (w, z, d).
  Eigen::Matrix3d covariance() const { return P_.topLeftCorner<3, 3>(); }

  /// Adopts another dead time, lag, gain and acceleration limit; the commands under way stay.
  void setDriveTrain(const PlantModel& model, double wheel_radius);

  /// Adopts other variances and time constants.
  void setParameters(const WheelBeliefParameters& parameters);

  const WheelBeliefParameters& parameters() const { return parameters_; }  ///< in force

  /// Share of the turn: 0 on a straight line, 1 in a turn, with its T_e.
  void setTurning(double share);

  /// Sets the speed as measured [rad/s] and the other states to their priors; the commands under way stay.
  void restart(double speed);

  /// As restart(), with the command of this steady speed under way.
  void reset(double speed);

 private:
  bool stalled() const;
  void widenTiming();
  void resetTiming();
  void learnTiming(double surprise, double part);
  double timingDecay() const;

  DriveTrain drive_train_;
  DeadZone dead_zone_;
  CommandsUnderWay commands_;  // effective ones
  WheelBeliefParameters parameters_;
  WheelState x_ = WheelState::Zero();
  WheelCovariance P_ = WheelCovariance::Zero();
  /// Response of a wheel to a ramp at the limit, with forgetting.
  struct Ramp {
    double moved = 0.0;     // sum of measured times expected changes [(rad/s)^2]
    double expected = 0.0;  // sum of squares of expected changes [(rad/s)^2]
    double time = 0.0;      // since the ramp began [s]

    void add(double change, double expected_change, double step);
  };
  Ramp ramp_;
  double timing_decay_ = 0.0;      // of e in an inner step
  double lagging_ = 0.0;           // part of a change that w a time sigma_t ago makes in an inner step
  double lagged_ = 0.0;            // w a time sigma_t ago [rad/s]
  double quiet_ = 0.0;             // largest change of w that is noise [rad/s]
  double timing_share_ = 1.0;      // lambda_t
  double timing_curvature_ = 0.0;  // of F along ln lambda_t
  double corrected_ = 0.0;         // w + e after the last measurement [rad/s]
  double measured_ = 0.0;
  double predicted_ = 0.0;
  std::size_t steps_ = 0;          // inner steps since the last measurement
  std::size_t limited_steps_ = 0;  // inner steps in a row at the acceleration limit
  double limit_doubt_ = 0.0;       // standard deviation of w that the limit caused since the last measurement [rad/s]
  double rate_ = 0.0;
  double known_command_ = 0.0;  // mean acting command of late [rad/s]
  double turning_ = 0.0;        // share of a turn in T_e
};

}  // namespace jackal_aic
