#pragma once

/// @file
/// Watches the gyro against the wheels.

#include <cstddef>

#include "jackal_aic/faults/channel_monitor.hpp"
#include "jackal_aic/faults/fault_parameters.hpp"
#include "jackal_aic/faults/yaw_belief.hpp"
#include "jackal_aic/model/turn_agreement.hpp"

namespace jackal_aic {

/// Difference speed of the sides x = r alpha (w_R - w_L) as the wheels' beliefs have it.
struct DifferenceSpeed {
  double value;          ///< x [m/s]
  double variance;       ///< [(m/s)^2]
  double forward = 0.0;  ///< v, by which unlike tyres turn a robot that its wheels drive straight [m/s]
};

/// What the accelerometer has just felt of the ground.
struct Shock {
  bool jolt = false;       ///< the robot rocks: what the gyro reads against the wheels says nothing
  bool push = false;       ///< something changed its motion at once: a turn that jumps with it is the body's
  double vibration = 0.0;  ///< standard deviation of the forward acceleration [m/s^2], large on rough ground
};

/// Prediction, comparison and verdict for the gyro. Nothing here allocates.
///
/// A gyro that comes to read less turn than the wheels ask for, and no faster than a body changes its turn, is right:
/// the tyres slide, on ice or against a kerb. Only what jumps, or reads more than the wheels can do, is suspect. A bias
/// that grows in a turn shows when the turn ends. What the turn changes by from one ground to another is no fault
/// either, if no faster than a body can, nor is a turn by the speed of the robot, as of tyres that are not alike.
/// A sill or a kerb pushes the body aside, one wheel this way and the next one that way, and lets go of it before it
/// has turned far: outliers do not count, but make a fault only where they add up to more than such an angle, or last.
/// At a creep, where no accelerometer feels it, it may hold one side for as long as it likes: the body turns about it.
/// Jumps that end by themselves are of ground that rocks the robot: the more there were, the longer the next one may
/// last. What jumps while the accelerometer feels a push is the body's motion.
///
/// Exact zeros of a robot that need not turn are of a dead zone; a gyro that is frozen at zero misses the next turn.
///
/// A gyro that was found faulty counts again when it agrees with what was believed before the fault, or when a new
/// belief, free to learn other slip and bias, explains it by slip alone. In steady driving slip and bias look the same;
/// they part when the motion changes. Where it does not change, a gyro that a plausible slip predicts well for long
/// counts again. One that reads the turn with the wrong sign does not: it agrees with everybody on a straight line.
class YawMonitor {
 public:
  /// @param effective_track b_hat at the start [m].
  YawMonitor(const FaultParameters& parameters, double effective_track);

  /// Lets a step pass [s]. @param forward_rate dv/dt; @param difference_rate dx/dt, both of the wheels' predictions
  /// [m/s^2].
  void predict(double forward_rate, double difference_rate, double step) {
    predict(&forward_rate, &difference_rate, 1, step);
  }

  /// The same for a number of steps with a rate each.
  void predict(const double* forward_rates, const double* difference_rates, std::size_t number, double step);

  /// Yaw rate against the wheels, theta_dot - (x/b_hat + beta) [rad/s].
  double error(double yaw_rate, double x) const { return belief_.error(yaw_rate, x); }

  /// Judges a sample against wheels that are trusted. @param step since the last sample.
  /// @param moving the wheels turn: the noise of a gyro differs from that at rest.
  void check(double yaw_rate, const DifferenceSpeed& x, bool moving, const SampleStep& step, const Shock& shock = {});

  bool frozen() const { return frozen_; }                        ///< the last sample repeats exactly
  bool reversed() const { return reversed_; }                    ///< it reads the turn with the wrong sign
  double distance() const { return distance_; }                  ///< in multiples of the bound
  ChannelState state() const { return persistence_.state(); }    ///< verdict with the last sample
  bool suspecting() const { return persistence_.suspecting(); }  ///< an outlier is among the last samples

  /// Lets it count again: what was wrong with its last samples has been explained.
  void forgive() { persistence_.reset(); }

  /// Restarts after a time in which anything may have happened: counts again, and waits for the motion to settle.
  void restart();

  const YawBelief& belief() const { return belief_; }  ///< slip and bias

 private:
  /// Turn against the wheels since the first of the last suspect samples, by these.
  struct Unexplained {
    double angle = 0.0;     // [rad]
    double distance = 0.0;  // the same in multiples of the bound [s]
    double time = 0.0;      // [s]
  };

  double predicted(const DifferenceSpeed& x) const { return -belief_.error(0.0, x.value); }  // [rad/s]
  bool shouldTurn(const DifferenceSpeed& x) const;
  bool biased() const;
  bool isFrozen(double yaw_rate, const DifferenceSpeed& x, bool moving, double step);
  void sumUp(bool suspect, double step);
  bool byGround(double vibration) const;
  bool slides(const DifferenceSpeed& x) const;
  double noise() const;
  bool jumps(double yaw_rate, double x, double step) const;
  bool goesOn() const;
  void watchJumps(double yaw_rate, double x, double step, bool pushed);
  bool explained(double yaw_rate, const DifferenceSpeed& x) const;
  void compare(double yaw_rate, const DifferenceSpeed& x);
  double variance(const YawBelief& belief, const DifferenceSpeed& x) const;
  double distance(double error, double variance) const;
  double distanceFrom(const YawBelief& belief, double yaw_rate, const DifferenceSpeed& x) const;

  FaultParameters parameters_;
  YawBelief belief_;
  YawBelief alternative_;  // while the gyro is faulty: learns what slip and bias would explain it
  RecentChange forward_change_;
  RecentChange difference_change_;
  TimingVariance timing_;
  TimingVariance grip_;
  LearnedVariance learned_;
  TurnAgreement agreement_of_sign_;
  bool reversed_ = false;
  Persistence persistence_;
  MotionRepetitionTest repetition_;
  double bound_;
  double error_ = 0.0;     // of the last sample [rad/s]
  double variance_ = 0.0;  // of it [(rad/s)^2]
  double distance_ = 0.0;
  double settled_ = 0.0;         // time since the motion changed last [s]
  double agreement_ = 0.0;       // time for which a plausible slip has explained a gyro found faulty [s]
  double last_ = 0.0;            // yaw rate [rad/s]
  bool jumped_ = false;          // since the last good sample, faster than a body can
  double jumped_by_ = 0.0;       // error of the sample that did [rad/s]
  bool thrown_ = false;          // and it went on, as a body does
  double jump_time_ = 0.0;       // for which it has [s]
  double zero_in_a_turn_ = 0.0;  // time for which it has read zero where the robot should turn [s]
  double forward_lately_ = 0.0;  // fastest speed, fading [m/s]
  double jolts_ = 0.0;           // jumps that ended by themselves, those of long ago less
  Unexplained unexplained_;
  bool frozen_ = false;
};

}  // namespace jackal_aic
