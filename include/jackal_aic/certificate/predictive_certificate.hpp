#pragma once

/// @file
/// Stability certificate of the predictive controller on a robot that need not be its model.
///
/// Below the acceleration limit everything is linear and the same for both wheels: the robot's wheel (lag, velocity
/// loop, dead time), the belief with the gain its covariance converges to, the commands under way in robot and model,
/// and the action. Over the common period of sensor, belief and action they map their state linearly; the loop is
/// asymptotically stable if and only if the spectral radius of that map is below 1. Left out: the acceleration limit,
/// the larger variance of a measurement while the wheel accelerates (which lowers the belief's gain for as long),
/// noise, and the slow learning of slip and precisions.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "jackal_aic/certificate/loop_clock.hpp"
#include "jackal_aic/certificate/margins.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/wheel_belief.hpp"
#include "jackal_aic/predictive/predictive_parameters.hpp"

namespace jackal_aic {

struct WorstPhase;

/// One action period of a loop whose clock is a real one.
struct JitteredPeriod {
  double phase = 0.0;                   ///< age of the sample when the action is computed [s], up to longestPhase()
  double extra_dead_time = 0.0;         ///< by which the robot's dead time is longer in this period [s]
  std::optional<Eigen::Vector3d> gain;  ///< of the belief on (w, z, d) for the sample; empty: it was lost
};

/// Linear periodic system of one wheel under the predictive controller.
class PredictiveLinearLoop {
 public:
  /// @param model drive train as the controller believes it; @param robot the true one, its sensor_rate included.
  /// @throws ParameterError as validate(), and if sensor and action rate have no common period within 50 action
  /// periods.
  PredictiveLinearLoop(const PredictiveParameters& parameters, const PlantModel& model, const PlantModel& robot);

  /// Common period of sensor, belief and action [s].
  double period() const;

  /// Map over one period of belief (w, z, d), last measurement, action, commands under way, wheel speed and correction.
  Eigen::MatrixXd periodMap(const LoopChange& change = {}) const;

  /// True if one sample and one action pass in a common period: the characteristic polynomial of periodMap() is then
  /// affine in the gain.
  bool singleRate() const { return clock_.sensor_steps == 1 && clock_.action_steps == 1; }

  /// Map over one action period, alike in size for every extra dead time up to a longest one [s]: of the state of
  /// periodMap() without the last measurement, which no later period needs. @throws ParameterError if sensor and action
  /// do not have the same rate.
  Eigen::MatrixXd jitteredMap(const JitteredPeriod& period, double longest_extra) const;

  /// Gains between which the belief's is while samples come irregularly: for one right after another, and those to
  /// which it converges with a sample every 1 to `most_periods` action periods, in this order.
  std::vector<Eigen::Vector3d> irregularGains(int most_periods) const;

  /// Spectral radius of periodMap() with its uncertainty (spectral_radius.hpp) on top, so that what is below 1 is
  /// stable; infinity if the map is not finite.
  double spectralRadius(const LoopChange& change = {}) const;

  /// Longest phase between the timers of sensor and action [s]: the shorter one of their periods.
  double longestPhase() const;

  /// The largest spectral radius over the phase; where two differ by less than the error of their eigenvalues, either.
  /// @param change whose phase does not matter.
  double worstSpectralRadius(LoopChange change = {}) const;

  /// True if the loop is stable at every phase: worstSpectralRadius() < kStabilityLimit, and sooner told.
  bool stable(const LoopChange& change = {}) const;

  /// How much smaller than worstSpectralRadius() the true one may be.
  double radiusUncertainty() const;

  /// Spectral radius of the error of the belief over a period: of the belief alone, whatever is driven.
  double beliefSpectralRadius() const { return converged_.spectral_radius; }

  const PredictiveParameters& parameters() const { return parameters_; }  ///< gains of the loop
  const PlantModel& robot() const { return robot_; }                      ///< robot in the loop

 private:
  class Trajectories;
  /// The belief alone, with the gain to which its covariance converges.
  struct Belief {
    std::vector<Eigen::Vector3d> gains;  // of the corrections in a period, in order
    double spectral_radius;              // of its error over a period
  };
  /// Radius as rough as spectralRadiusBeside() tells it.
  WorstPhase worstPhase(LoopChange change, double enough) const;
  /// @param phase [ns].
  Belief convergedBelief(std::int64_t phase) const;

  PredictiveParameters parameters_;
  PlantModel model_;
  PlantModel robot_;
  WheelBelief belief_;
  LoopClock clock_;
  Belief converged_;  // with phase 0
};

/// Certificate of the predictive controller; gain and dead time are the robot's.
struct PredictiveCertificate : LoopVerdict, Margins {
  double delay_reduction = 0.0;  ///< how much shorter the robot's dead time may be [s]; all of it if it does not matter
};

/// Certifies the predictive controller. @throws ParameterError as PredictiveLinearLoop.
PredictiveCertificate certify(const PredictiveParameters& parameters, const PlantModel& model, const PlantModel& robot);

/// True if loop and belief are stable with a change of the robot.
bool isStable(const PredictiveLinearLoop& loop, const LoopChange& change = {});

/// Radii of a loop, without margins.
LoopVerdict verdictOn(const PredictiveLinearLoop& loop);

/// The bound that a stable loop does not keep. Needs two evaluations of the loop only.
ThinMargin thinMarginOf(const PredictiveLinearLoop& loop, const MarginBounds& bounds = {});

/// Sensitivities to action_learning_rate, belief_learning_rate, wheel_variance, speed_process_noise and
/// disturbance_process_noise, the largest magnitude first; those that are zero are left out.
std::vector<Sensitivity> sensitivities(const PredictiveParameters& parameters, const PlantModel& model,
                                       const PlantModel& robot);

/// The parameter that is most to blame for an instability, and whether the loop is stable with what it was before or
/// with its default. @param running gains before a change, if they were changed. Empty if none has an effect.
std::optional<Culprit> culpritOf(const PredictiveParameters& parameters, const PlantModel& model,
                                 const PlantModel& robot, const PredictiveParameters* running = nullptr);

}  // namespace jackal_aic
