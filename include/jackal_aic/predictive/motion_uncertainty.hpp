#pragma once

/// @file
/// What is uncertain about the believed motion of the body beside the beliefs' own covariances, which know the noise
/// that is configured and a robot that is its model.
///
/// Innovations tell how large the errors of a belief really are: at its minimum the free energy of a measurement is
/// half the innovation squared by its variance, nu^2/(2 S), so that the mean of 2 F would be 1. The variance P of a
/// belief is multiplied by phi, for the wheels and for the gyro: the mean of 2 F over a second, or that over a tenth of
/// a second by chi where it is more than noise makes it, and not below a least one.
///
/// What innovations do not show, or show too late, is added:
///
///   - (rho x_dot)^2: the encoders do not tell the radius of the tyres, which is known to a part rho;
///   - phi^2 1/2 (s_L^2 + s_R^2), s_L and s_R the slip of each side of a body that follows its wheels with a lag T
///     (body_slip.hpp). Sensors that are late have the same effect, and phi is large of them;
///   - the square of what the motion changes in a time t, the part of the dead time that was learned and not told:
///   whether
///     it lies before the motors or behind the encoders, which then tell what the body did a time t ago, nobody knows,
///     and a model that has it leaves no innovation;
///   - (phi^2 - 1) (k (s_R - s_L)/b_hat)^2 of the yaw rate likewise. The gyro tells how the body turns in, unless it is
///     late;
///   - (c theta_dot)^2: a robot that turns about a centre that lies c beside its middle moves while the mean of its
///     wheels stands. The centre wanders where the ground differs under the wheels, and so does how far they turn the
///     body: c^2 = c_0^2 + (l q)^2, and of the yaw rate (m q theta_dot)^2. q^2 is the mean of the squares of
///     theta_dot/f - 1 in turns, f the yaw rate that the wheels usually bring about; differences of which no ground is
///     free count as none.
///
/// On the box nothing slips, and a velocity is what wheels of the configured radius would give.
///
/// The constants are chosen so that the error is within its 95 % bounds 95 % of the time on the simulated robots.
/// Nothing of this moves a belief or a command.

#include "jackal_aic/model/body_slip.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Uncertainty of the believed motion. Does not allocate.
class MotionUncertainty {
 public:
  static constexpr double kMemory = 1.0;             ///< of the innovations [s]
  static constexpr double kShortMemory = 0.1;        ///< of a burst of them [s]
  static constexpr double kBurst = 1.2;              ///< chi
  static constexpr double kLeastFactor = 0.3;        ///< of phi
  static constexpr double kLargestFactor = 100.0;    ///< likewise
  static constexpr double kRadiusDeviation = 0.015;  ///< rho
  static constexpr double kSlipTime = 0.03;          ///< T [s]
  static constexpr double kTurnIn = 10.0;            ///< k
  static constexpr double kCentreDeviation = 0.045;  ///< c_0 [m]
  static constexpr double kCentrePerTurn = 1.5;      ///< l [m]
  static constexpr double kYawPerTurn = 0.6;         ///< m
  static constexpr double kUsualTurn = 0.15;         ///< |theta_dot/f - 1| of which no ground is free
  static constexpr double kTurnMemory = 15.0;        ///< of q [s of turning]

  /// @param wheel_radius r [m]; @param track b_hat [m]; @param on_box the wheels turn free.
  MotionUncertainty(double wheel_radius, double track, bool on_box)
      : wheel_radius_(wheel_radius), track_(track), on_box_(on_box) {}

  /// Goes on by a step [s] in which the wheels accelerate [rad/s^2].
  void predict(double left_acceleration, double right_acceleration, double step);

  /// The wheels' speeds were measured. @param free_energy F of each, mean; @param step since the last measurement [s].
  void learnWheels(double free_energy, double step) { wheels_.learn(free_energy, step); }

  /// The yaw rate was measured. @param free_energy F of it; @param step since the last measurement [s].
  void learnGyro(double free_energy, double step) { gyro_.learn(free_energy, step); }

  /// The body turned at a yaw rate [rad/s]. @param usual f [rad/s]; @param step since the last measurement [s].
  void learnTurn(double yaw_rate, double usual, double step);

  /// Variance of x_dot [(m/s)^2]. @param believed P, by the wheels; @param velocity of the body (base_link); @param
  /// ahead what the speed changes in a time t [m/s].
  double forwardVariance(double believed, const BodyVector& velocity, double ahead = 0.0) const;

  /// Variance of theta_dot [(rad/s)^2]. @param believed P; @param velocity of the body (base_link); @param ahead what
  /// the yaw rate changes in a time t [rad/s].
  double yawVariance(double believed, const BodyVector& velocity, double ahead = 0.0) const;

  /// Forgets the motion; what was learned of the ground stays.
  void forgetMotion();

 private:
  /// Means of 2 F of a belief.
  struct Innovations {
    void learn(double free_energy, double step);
    double factor() const;  // phi

    double mean = 1.0;
    double lately = 1.0;
  };

  double wheel_radius_;
  double track_;
  bool on_box_;
  BodySlip slip_{kSlipTime};
  Innovations wheels_, gyro_;
  double turn_ = 0.0;  // q^2
};

}  // namespace jackal_aic
