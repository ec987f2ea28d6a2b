#pragma once

/// @file
/// Learning of the drive train's dead time delta, lag T, gain and acceleration limit from the motion of the wheels
/// under their commands.
///
/// A drive train runs through the commands for each lag and each share lambda of the acceleration limit of a grid
/// (drive_train_fit.hpp). With the measurements so far, for each of them and each dead time, the free energy is
///
///     F(delta, T, lambda) = min over theta of   sum_k w_k epsilon_k^2 / (2 n_0 sigma^2) + earlier motions + prior
///
/// with theta = (gamma, o) and the least mean square sigma^2 of the residuals epsilon. A measurement errs by the change
/// of the speed y in the jitter sigma_t of its time: w = 1/(1 + (sigma_t dy/dt)^2 / Sigma_y). n_0 measurements count as
/// one, because the residuals are not white. The prior has the configured or restored values as its mean.
///
/// The model takes over the vertex of a paraboloid through the least F in (delta, ln T): dead time and gain at any
/// time, the lag at the end of a motion, when the commands have been constant. What was identified stays until
/// a difference is relevant and chance does not explain it. An earlier motion has 0.9 of the weight of the next; one
/// that no drive train explains is ignored. A turn counts for the dead time alone, because there the integral of the
/// velocity loop first has to carry the ground's torque.
///
/// The acceleration limit of a robot without identification opens: once the wheels follow the present limit and not
/// 0.63 of it, twice the limit is tried, up to the first that the motors cannot follow, and never below half the
/// configured.

#include <array>
#include <cstddef>
#include <vector>

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
inline constexpr DriveTrainTiming kLongestTiming{(DriveTrainFit::kGrid - 1) * DriveTrainFit::kSpacing, 0.5, 20.0};

/// Lists the fields of DriveTrainTiming with unit and range.
template <class Visitor>
void describeFields(Visitor& v, DriveTrainTiming& p) {
  v.field("dead_time", p.dead_time, {0.0, kLongestTiming.dead_time}, "s", Presence::required);
  v.field("lag", p.lag, {0.0, kLongestTiming.lag}, "s", Presence::required);
  v.field("acceleration_limit", p.acceleration_limit, {0.0, 1000.0}, "m/s^2", Presence::optional);
}

/// Learning for both sides at once. Only the constructor allocates.
class DriveTrainLearning {
 public:
  /// @param model to start from; @param wheel_radius r [m]; @param wheel_variance Sigma_y of a measured wheel speed,
  /// lower bound of the residual's variance [(rad/s)^2].
  DriveTrainLearning(const PlantModel& model, double wheel_radius, double wheel_variance);

  /// Advances by DriveTrain::kStep. @param given present effective commands [rad/s].
  void predict(const WheelVector& given);

  /// Takes measured wheel speeds [rad/s]. @param step since the last ones [s]. True if the timing changed.
  bool correct(const WheelVector& measured, double step);

  /// An encoder is excluded, or commands did not reach the motors: as resetMotion(), and withdraws the learned gain,
  /// which may have come from them. True if the timing changed.
  bool withdrawGain();

  /// Excludes the present motion from learning, and what comes until the runs are right again.
  void resetMotion();

  /// Sets a timing, with the weight of a configured one.
  void setTiming(const DriveTrainTiming& timing);

  /// Sigma_y of a measured wheel speed from now on [(rad/s)^2].
  void setWheelVariance(double variance) { wheel_variance_ = variance; }

  /// Timing of the model now.
  const DriveTrainTiming& timing() const { return timing_; }

 private:
  static constexpr int kLags = 10;
  static constexpr std::array<double, 4> kShares{1.0, 0.8, 0.63, 0.5};  // lambda, one for each run of a lag

  /// Minimum along theta.
  struct Minimum {
    double free_energy = 0.0;
    double gain = 1.0;           // gamma
    double gain_variance = 0.0;  // of it
  };
  /// Minima by lag and dead time, along the share of the limit.
  using Minima = std::array<std::array<Minimum, DriveTrainFit::kGrid>, kLags>;

  DriveTrainFit& fit(int lag, std::size_t run) { return fits_[static_cast<std::size_t>(lag) * kShares.size() + run]; }
  double limit(std::size_t run) const { return kShares[run] * limit_ / wheel_radius_; }  // of a run [rad/s^2]
  void watch(const WheelVector& given);
  void count();
  void beginMotion();
  bool endMotion();
  bool turns() const;
  bool explained() const;
  double weight() const;
  Minimum minimum(const DriveTrainSums& sums) const;
  double presentEnergy(const DriveTrainFit& fit, std::size_t late) const;
  void compare();
  bool takeOver(bool ended);
  bool raiseLimit();
  bool lowerLimit();
  bool setLimit(double limit, std::size_t same);

  double wheel_radius_;
  double wheel_variance_;
  bool identified_;
  double least_limit_;  // that is learned [m/s^2]
  double limit_ = 0.0;  // that the motors seem to have [m/s^2]
  DriveTrainTiming timing_;
  DriveTrainTiming expected_;   // as configured or restored
  double largest_limit_ = 0.0;  // that the motors may follow [m/s^2]
  std::vector<DriveTrainFit> fits_;
  std::array<double, DriveTrainFit::kGrid> turns_memory_{};  // F of earlier turns by dead time

  // Motion under way.
  WheelVector given_ = WheelVector::Zero();    // mean command of the present step of the runs so far [rad/s]
  double part_ = 0.0;                          // elapsed part of that step
  WheelVector before_ = WheelVector::Zero();   // commands when the motion began [rad/s]
  WheelVector resting_ = WheelVector::Zero();  // commands about which they are settled [rad/s]
  double settled_ = 0.0;                       // time since they last changed [s]
  double unknown_ = 0.0;                       // time until the runs are right [s]
  bool moving_ = false;                        // the commands have changed since then
  double turn_ = 0.0, straight_ = 0.0;         // largest change of the difference and sum of the commands [rad/s]
  WheelVector measured_ = WheelVector::Zero();
  WheelVector filtered_ = WheelVector::Zero();  // measured speeds behind the washout filter [rad/s]
  double since_counted_ = 0.0;                  // time since a measurement counted [s]
  WheelVector weight_ = WheelVector::Zero();    // of the last measurement
  double lasted_ = 0.0;                         // time of the motion so far [s]
  double samples_ = 0.0;                        // sum of the weights of the measurements that count
  double motion_ = 0.0;                         // weighted sum of their filtered squares
  double variance_ = 0.0;                       // sigma^2

  Minima minima_;
  std::array<double, kShares.size()> by_share_{};  // least F of each share of the limit
};

}  // namespace jackal_aic
