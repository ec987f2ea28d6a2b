#pragma once

/// @file
/// Compares the encoder of one side with a prediction from the commands that were applied.

#include <algorithm>
#include <array>
#include <cstddef>

#include "jackal_aic/faults/channel_monitor.hpp"
#include "jackal_aic/faults/density.hpp"
#include "jackal_aic/faults/fault_parameters.hpp"
#include "jackal_aic/faults/reachable_speeds.hpp"
#include "jackal_aic/faults/repetition.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/robot_range.hpp"
#include "jackal_aic/model/wheel_belief.hpp"

namespace jackal_aic {

/// Predicted acceleration dw/dt of a wheel in a step [rad/s^2].
struct WheelRates {
  double believed;  ///< of the model
  Range possible;   ///< of any drive train in the range
};

/// Prediction, comparison and verdict for one encoder. Allocates when it is made, and not after.
class WheelMonitor {
 public:
  /// Commanded speed up to which stiction, play and the motor's steady-state error may hold a wheel at rest [rad/s].
  static constexpr double kStiction = 0.8;

  /// Number of spikes in about half a second that makes an encoder faulty. Of one in ten seconds, which recordings of
  /// healthy robots have, chance makes so many once in days.
  static constexpr double kSpikes = 2.5;

  /// @param wheel_radius r [m].
  WheelMonitor(const FaultParameters& parameters, const PlantModel& model, double wheel_radius);

  /// Forgets everything but the parameters, without allocating.
  void forget();

  /// Starts at a measured speed [rad/s] with no fault. @param commands_known keeps the commands within the dead time;
  /// otherwise they have been those of this speed.
  void start(double speed, bool commands_known = false);

  /// Sets the prediction to a measured speed [rad/s] while the command is unknown. Keeps the noise estimate and the
  /// suspicion.
  void follow(double speed);

  /// Moves the prediction by one DriveTrain::kStep during which a command [rad/s] is applied.
  WheelRates predict(double command);

  /// Compares a measured speed [rad/s] with the prediction. The result is in suspect(), frozen() and distance(). @param
  /// step time since the last sample [s].
  void compare(double measurement, double step);

  /// Updates the verdict. A good sample corrects the prediction, an outlier does not. @param step since the last
  /// sample.
  void conclude(double measurement, double step);

  /// Accepts the last measured speed and clears the suspicion: the wheel was moved from outside.
  void forgive();

  /// Accepts the last measured speed and counts its distance from the model as model error. @param step time since the
  /// last sample [s].
  void acceptMeasured(double step) { learnMisfit(measured_, variance(), step); }

  /// Declares the encoder frozen if it repeats while the other encoder, which has the same messages, is frozen.
  void freezeWithTheOther();

  /// The last sample is between half and all of the predicted speed: the wheel is slowed down but not blocked.
  bool slowed() const;
  /// The last sample is beyond every speed that the commands may have given it.
  bool fasterThanCommanded() const { return std::abs(measured_) > reachable_.largest(); }
  /// No command of late makes it turn: what turns it comes from outside.
  bool commandedToRest() const { return reachable_.largest() < thresholds::kMoving; }
  bool suspect() const { return suspect_; }  ///< the last sample is an outlier
  bool frozen() const { return frozen_; }    ///< because it repeats exactly
  /// The last sample is an outlier that approaches the prediction, or leads it towards the commanded speed.
  bool recovering() const { return recovering_; }
  double distance() const { return distance_; }                  ///< in multiples of the bound
  ChannelState state() const { return persistence_.state(); }    ///< verdict with the last sample
  bool suspecting() const { return persistence_.suspecting(); }  ///< an outlier is among the last samples
  double speed() const { return belief_.speed(); }               ///< believed wheel speed [rad/s]
  double longestHold() const { return hold_.longest(); }         ///< for which the encoder holds its value [s]
  Range reachable() const { return held_.reachable; }            ///< by its commands [rad/s]
  double nominal() const { return reachable_.nominal(); }        ///< speed of the model, by its commands alone [rad/s]

  /// Declares the encoder faulty because gyro and commands contradict it.
  void declareWrong() { persistence_.declareFaulty(); }

  /// Short outliers come more often than from a healthy encoder.
  bool spikes() const { return spikes_ > kSpikes; }

  /// Speed of the wheel [rad/s] with its variance. @param measured use the measurement; otherwise the belief, with the
  /// uncertainty of its drive train.
  faults::Normal turns(bool measured) const;

 private:
  static Range hull(const Range& a, const Range& b) { return {std::min(a.low, b.low), std::max(a.high, b.high)}; }
  /// Intervals of a sample.
  struct Intervals {
    Range possible;
    Range reachable;
    double time;  // of the sample, by clock_ [s]
  };
  double speedVariance() const;
  double resolutionVariance() const;
  double variance() const;
  Range possible() const;
  Range steady() const;
  void holdIntervals(double step);
  bool jumps(double measurement, double step) const;
  double errorOf(double measurement) const;
  bool isFrozen(double measurement, double step);
  double leastMissed(double measurement) const;
  double comesNearer(double before, double now) const;
  bool isAhead(double measurement) const;
  void countSpikes(double step);
  bool isBehind(double measurement) const;
  void learnMisfit(double measurement, double variance, double step);
  double beyondUsual(double measurement, const Range& speeds) const;
  double steadyMisfit(double speed) const;

  FaultParameters parameters_;
  ReachableSpeeds reachable_;  // keeps the commands under way
  WheelBelief belief_;         // of the command that acts
  bool identified_;
  double change_ = 0.0;                   // recent change of the belief, over kMemory [rad/s]
  double noise_ = faults::kUnknownNoise;  // learned factor of the variance of an error
  Persistence persistence_;
  faults::Repetition repetition_;
  double silence_ = 0.0;  // ln of the odds of the repetitions so far that the encoder is frozen
  double quantum_ = 0.0;  // resolution of the encoder; 0 before it is known [rad/s]
  MissedMotion missed_motion_;
  SampleHold hold_;
  std::array<Intervals, 64> intervals_{};  // of the last samples, a ring
  std::size_t newest_ = 0;
  Intervals held_{};     // of the last sample, for as long as it may have been held
  double clock_ = 0.0;   // time that the samples have taken [s]
  double misfit_ = 0.0;  // mean square of what the drive train's model is usually off by [(rad/s)^2]
  // Largest Mahalanobis distance of a good sample, d = 1/sqrt(alpha). Chebyshev's inequality P(e^2/S >= 1/alpha) <=
  // alpha holds for any distribution of zero mean and variance S. Slip and timing give the errors heavy tails, so a
  // quantile of the normal distribution would be too small.
  double bound_;
  double last_speed_ = 0.0;  // believed when the last sample came [rad/s]
  double measured_ = 0.0;    // last [rad/s]
  double error_ = 0.0;
  double distance_ = 0.0;
  bool frozen_ = false;
  bool suspect_ = false;
  bool recovering_ = false;
  double spikes_ = 0.0;             // number of late
  double outlier_time_ = 0.0;       // of the present one [s]
  bool waits_ = false;              // the last value was held, and its renewal is not due yet
  double behind_ = 0.0;             // time for which the wheel has had too little of its command [s]
  double rise_ = 0.0, fall_ = 0.0;  // change since the last sample by any drive train [rad/s]
  bool jumped_ = false;             // away from its belief, and not back yet
  double motors_;                   // acceleration limit of the model [rad/s^2]
};

}  // namespace jackal_aic
