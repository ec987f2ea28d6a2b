#pragma once

/// @file
/// Learning of the drive train's dead time delta and lag T from the motion of the wheels under their commands.
///
/// Commands and measurements of the last seconds are kept. When a change of the commands has settled, or has lasted for
/// long, the motion of the wheels is compared with that of a drive train of parameters theta (drive_train_fit.hpp). It
/// is compared for every dead time of a grid. With n measurements the free energy is
///
///     F(delta, theta) = n/(2 n_0) ln sum_k epsilon_k^2 + 1/2 (theta - theta_1)' Pi_0 (theta - theta_1)
///                       + 1/2 (delta - delta_0)^2 / sigma_delta^2 + earlier changes,
///
/// where the residual's variance is estimated with it. n_0 measurements count as one, because the residuals are not
/// white noise. theta_1 is what was learned before, with the configured lag. The search for the minimum starts with the
/// present lag and with others, because at the acceleration limit the gradient near a short lag does not show a longer
/// one. It continues by Gauss-Newton steps from the best, over a few hundred inner steps with two measurements in each.
/// An earlier change has 0.7 of the weight of the next, as a parabola around theta. A change that the model does not
/// explain is ignored. A turn does not count for lag and gain, because there the integral of the motor's velocity loop
/// first has to carry the ground's torque. The model adopts dead time, lag and gain once they are significant; the
/// disturbance has a separate belief (wheel_belief.hpp). Constant commands change nothing.
///
/// The acceleration limit of a robot without identification opens, in the middle of an acceleration too: twice the
/// acceleration that the wheels followed is tried next, up to the first that the motors could not follow (lambda < 1).
/// It does not fall below half of the configured limit.

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/predictive/drive_train_fit.hpp"

namespace jackal_aic {

/// Dead time, lag, acceleration limit and gain of a drive train. The gain is not kept for the next start: encoders of a
/// wrong scale look the same.
struct DriveTrainTiming {
  double dead_time = 0.0;           ///< delta, from a command until the motors follow it [s]
  double lag = 0.0;                 ///< T, time constant of the wheel speed [s]
  double acceleration_limit = 0.0;  ///< in use, of the wheel circumference [m/s^2]; 0: as configured
  double gain_share = 1.0;          ///< gamma, gain in multiples of the configured one
};

/// Longest dead time and lag [s] and largest acceleration limit [m/s^2] that are learned. The limit is that of the
/// stock robot's commands.
inline constexpr DriveTrainTiming kLongestTiming{DriveTrainFit::kLongestDeadTime, 0.5, 20.0};

/// Lists the fields of DriveTrainTiming with unit and range.
template <class Visitor>
void describeFields(Visitor& v, DriveTrainTiming& p) {
  v.field("dead_time", p.dead_time, {0.0, kLongestTiming.dead_time}, "s", Presence::required);
  v.field("lag", p.lag, {0.0, kLongestTiming.lag}, "s", Presence::required);
  v.field("acceleration_limit", p.acceleration_limit, {0.0, 1000.0}, "m/s^2", Presence::optional);
}

/// Learning of dead time, lag and acceleration limit, the same for both sides. Nothing here allocates.
class DriveTrainLearning {
 public:
  /// @param model to start from; @param wheel_radius r [m]; @param wheel_variance Sigma_y of a measured wheel speed,
  /// lower bound of the residual's variance [(rad/s)^2].
  DriveTrainLearning(const PlantModel& model, double wheel_radius, double wheel_variance);

  /// Advances by DriveTrain::kStep. @param given present effective commands [rad/s].
  void predict(const WheelVector& given);

  /// Takes measured wheel speeds [rad/s]. @param step since the last ones [s]. Returns the new timing, if it changed.
  std::optional<DriveTrainTiming> correct(const WheelVector& measured, double step);

  /// An encoder is excluded: as resetMotion(), and withdraws the learned gain, which may have come from it. True if
  /// the timing changed.
  bool withdrawGain();

  /// Excludes the recent commands and motion from learning.
  void resetMotion();

  /// Sets a timing, with the weight of a configured one.
  void setTiming(const DriveTrainTiming& timing);

  /// Sigma_y of a measured wheel speed from now on [(rad/s)^2].
  void setWheelVariance(double variance) { wheel_variance_ = variance; }

  /// Timing of the model now.
  const DriveTrainTiming& timing() const { return timing_; }

 private:
  static constexpr double kStep = DriveTrainFit::kStep;
  static constexpr int kTicks = static_cast<int>(kStep / DriveTrain::kStep + 0.5);  // inner steps in one of the fit
  static constexpr std::size_t kCommands = 1024;  // steps that are kept; the longest change, and the time to review it
  static constexpr std::size_t kSamples = 512;    // measurements that are kept, as long at the least distance
  using Sums = DriveTrainFit::Sums;

  /// Measured wheel speeds.
  struct Sample {
    WheelVector speed = WheelVector::Zero();  // [rad/s]
    double time = 0.0;                        // in steps
  };

  /// A change of the commands: a range of the kept steps.
  struct Change {
    std::size_t first = 0;        // step from which the drive train runs
    std::size_t counted = 0;      // step from which measurements count
    std::size_t next_step = 0;    // of the run under way
    std::size_t next_sample = 0;  // of the run under way
    std::size_t first_sample = 0;
    std::size_t end_sample = 0;
    bool turns = false;                         // a turn: the lag is that of loaded motors
    double last_time = 0.0;                     // of the last measurement of the run, in steps
    WheelVector resting = WheelVector::Zero();  // wheel speeds of before [rad/s]
  };

  /// The best run of a review.
  struct Best {
    DriveTrainVector theta = DriveTrainVector::Zero();
    double free_energy = HUGE_VAL;
    Sums sums;
    double samples = 0.0;
    double motion = 0.0;
    double acceleration = 0.0;  // [m/s^2]
  };

  /// Minimum along theta over the changes so far, for one dead time.
  struct Minimum {
    DriveTrainVector change;  // of theta
    double free_energy;
    double log_lag_variance;  // of ln T, with this dead time
    double gain_variance;     // of gamma, with this dead time
  };

  enum class State { unknown, settled, changing };

  void watch(const WheelVector& given);
  bool settles() const;
  void endChange();
  double turnShare(std::size_t first) const;
  WheelVector restingSpeed(std::size_t first, std::size_t& first_sample) const;
  void run(const DriveTrainVector& theta);
  void review();
  void judge();
  DriveTrainVector deviations() const;
  DriveTrainVector expected() const;
  double freeEnergy(const DriveTrainFit& fit) const;
  double leastSquares() const;
  DriveTrainVector newtonStep() const;
  void learn();
  bool learnLimit();
  bool openLimit();
  void setLimit(double limit);
  std::optional<DriveTrainTiming> takenOver();
  Minimum minimum(int i) const;
  int bestDeadTime() const;

  double wheel_radius_;
  double wheel_variance_;
  bool identified_;
  double least_limit_;  // that is learned [m/s^2]
  DriveTrainTiming timing_;
  double largest_limit_ = kLongestTiming.acceleration_limit;  // that the motors may follow [m/s^2]
  double expected_log_lag_ = 0.0;                             // ln T of the configured or restored timing
  DriveTrainVector theta_ = DriveTrainVector::Zero();         // around which memory_ is
  Sums memory_;                                               // of earlier changes, over the variance of each

  // Kept commands and measurements.
  std::array<WheelVector, kCommands> commands_{};  // of each step, a ring [rad/s]
  std::array<Sample, kSamples> samples_;           // a ring
  std::size_t step_ = 0;                           // steps so far
  std::size_t sample_ = 0;                         // measurements so far
  WheelVector given_ = WheelVector::Zero();        // sum of the commands since the last step [rad/s]
  int ticks_ = 0;                                  // inner steps since then

  State state_ = State::unknown;
  WheelVector resting_ = WheelVector::Zero();  // commands about which they are settled [rad/s]
  std::size_t known_ = 0;                      // step since which the motion is known
  std::size_t settled_ = 0;                    // steps since the commands last changed
  std::size_t first_ = 0;                      // step from which the drive train of the present change runs
  std::size_t counted_ = 0;                    // step from which its measurements count

  // The change that is reviewed.
  bool reviewing_ = false;
  int runs_ = 0;
  Change change_;
  DriveTrainFit fit_;
  Best best_;
  DriveTrainVector next_ = DriveTrainVector::Zero();  // step from the best theta
  std::optional<DriveTrainTiming> learned_;           // not adopted by the model yet
};

}  // namespace jackal_aic
