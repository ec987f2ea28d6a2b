#pragma once

/// @file
/// A controller and a linear robot as one linear periodic system: both structures in one class. The robot is a
/// PlantModel below its acceleration limit, with any dead time: commands change within an action period. The controller
/// is a linear map at each of its events:
///
///     thesis       belief update (3-11, either integrator), generalisation (3-22), action update (3-13)
///     predictive   belief (w, z, d) about a wheel, with the gain to which its covariance converges, and action
///
/// Symmetry splits the thesis' loop into two uncoupled ones: the mean of the wheels with the forward belief, half their
/// difference with the yaw belief. The lateral belief is neither measured nor driven: its radius is that of the belief.
/// The predictive structure has the same loop for both wheels.
///
/// Over the common period of sensor, belief and action a loop maps its state linearly; it is asymptotically stable if
/// and only if the spectral radius of that map is below 1. Left out: limits on speed and acceleration, noise, wheel
/// slip dynamics, the other gains of the predictive belief while a wheel accelerates, and slow learning.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/aic/spectral_radius.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/wheel_belief.hpp"
#include "jackal_aic/predictive/predictive_parameters.hpp"

namespace jackal_aic {

/// A spectral radius below this is stable. A neutral mode has the radius 1, which is not stable; rounding of the map's
/// entries may lower it slightly.
inline constexpr double kStabilityLimit = 1.0 - 1e-12;

/// Events of a period, in their order at equal times.
enum class LoopEvent { sensor, predict, belief, action, command_arrives };

/// Events of a common period.
struct LoopClock {
  std::int64_t action_period = 1;  ///< [ns]
  std::int64_t action_steps = 1;   ///< per common period, as all counts
  std::int64_t sensor_steps = 1;   ///< samples
  std::int64_t belief_steps = 1;   ///< belief updates
  std::int64_t predict_steps = 0;  ///< inner steps of the belief

  /// Events of a period as (time [ns], event), in order; those at its beginning belong to the period before.
  /// @param command_late of a command after an action step [ns], 0: at once; @param sample_early of a sample before the
  /// action step that uses it [ns].
  std::vector<std::pair<std::int64_t, LoopEvent>> events(std::int64_t command_late, std::int64_t sample_early) const;
};

/// The loops by symmetry.
enum class LoopMode {
  straight,  ///< mean wheel speed and forward belief
  turn       ///< half the difference of the wheel speeds, yaw rate and yaw belief
};

/// Change of a loop.
struct LoopChange {
  double gain = 1.0;             ///< factor on the wheel speed that a command gives; in the thesis' structure the
                                 ///< same as a factor on kappa_a
  double extra_dead_time = 0.0;  ///< added to the robot's dead time, which stays 0 or more [s]
  double phase = 0.0;  ///< age of the newest measurement when the action is computed [s], up to longestPhase()
};

/// Linear periodic system of the closed loop. The timers of sensor and action run freely: their phase, the age of a
/// measurement when it is used, is part of a LoopChange.
class LinearLoop {
 public:
  /// The thesis' structure. The gains need not be stable. @throws ParameterError if rates or variances are invalid, or
  /// sensor and action rate have no common period within 50 action periods.
  LinearLoop(const ControllerParameters& controller, const GeometryParameters& geometry, const PlantModel& robot);

  /// The predictive structure. @param model drive train in the controller; @param robot the true one, its sensor_rate
  /// included. @throws ParameterError as validate(), and for rates as above.
  LinearLoop(const PredictiveParameters& parameters, const PlantModel& model, const PlantModel& robot);

  /// Common period of sensor, belief and action [s].
  double period() const { return static_cast<double>(clock_.action_steps) * actionPeriod(); }

  /// Period of the action [s].
  double actionPeriod() const { return 1e-9 * static_cast<double>(clock_.action_period); }

  /// Longest phase [s]: the shorter one of sensor and action period. A measurement right after an action has this age
  /// at the next action.
  double longestPhase() const;

  /// Different loops: straight and turn, or straight alone if both are equal.
  const std::vector<LoopMode>& modes() const { return modes_; }

  /// Map of the state of a mode over one common period. The state is that of the controller, the action, the commands
  /// under way, the wheel speed and the velocity loop's correction. The controller's is belief and generalised
  /// measurement of the wheels, order i scaled by (sensor period)^i; or belief (w, z, d) and last measurement.
  Eigen::MatrixXd periodMap(LoopMode mode, const LoopChange& change = {}) const;

  /// Spectral radius of periodMap() (spectral_radius.hpp), so that a radius below 1 is stable; infinity if the map is
  /// not finite.
  double spectralRadius(LoopMode mode, const LoopChange& change = {}) const;

  /// Spectral radius at the phase where it is largest. @param change its phase is ignored.
  double worstSpectralRadius(LoopMode mode, LoopChange change = {}) const;

  /// True if a mode is stable at every phase.
  bool stable(LoopMode mode, const LoopChange& change = {}) const;

  /// True if the belief and every mode are stable at every phase.
  bool stable(const LoopChange& change = {}) const;

  /// Spectral radius of the belief alone: over one step with the measurement held (thesis), or of its error over a
  /// common period (predictive).
  double beliefSpectralRadius() const { return belief_radius_; }

  /// Wheel speed of the straight mode at the end of each period after a step of the set point from rest, as a part of
  /// its final value. Of the thesis' structure only. @param periods number of periods; @param change of the loop.
  Eigen::VectorXd stepResponse(int periods, const LoopChange& change = {}) const;

  /// Map over one action period of a predictive loop on an irregular clock. @param change in this period; @param gain
  /// of the belief on (w, z, d) for its sample; empty: the sample is lost; @param longest_extra dead time of any period
  /// [s]: all maps up to it have one size. @throws ParameterError of the thesis' structure, and if sensor and action do
  /// not have the same rate.
  Eigen::MatrixXd jitteredMap(const LoopChange& change, const std::optional<Eigen::Vector3d>& gain,
                              double longest_extra) const;

  /// Gains of the predictive belief with irregular samples: for a sample right after another, then those to which it
  /// converges with a sample every 1 to `most_periods` action periods, in this order.
  std::vector<Eigen::Vector3d> irregularGains(int most_periods) const;

  /// True for the predictive structure.
  bool predictive() const { return belief_.has_value(); }

  /// Gain of the action: kappa_a, or the predictive structure's action_learning_rate.
  double actionGain() const { return action_gain_; }

  const PlantModel& robot() const { return robot_; }                     ///< robot in the loop
  const PlantModel& model() const { return model_ ? *model_ : robot_; }  ///< model of a predictive controller

 private:
  /// Controller of a mode, with its state x, the action a and the measured wheel speed w.
  struct Equations {
    Eigen::MatrixXd sense;            // a sample: x ← S x + s w
    Eigen::VectorXd sense_wheel;      // s
    Eigen::MatrixXd predict;          // an inner step of a predictive belief under the command u: x ← P x + p u
    Eigen::VectorXd predict_command;  // p
    Eigen::MatrixXd believe;          // a belief update of the thesis' structure: x ← B x
    double keep;                      // an action: a ← keep a + A x
    Eigen::RowVectorXd act;           // A
    Eigen::VectorXd rest;             // x in the steady state at a wanted speed of 1
  };
  /// Of the predictive belief on (w, z, d), for the samples of a period in order; without one a sample is lost.
  using Gains = std::vector<Eigen::Vector3d>;

  /// Phase with the largest radius [s].
  struct WorstPhase {
    double radius, phase;
  };

  Equations thesisEquations(const ControllerParameters& controller, const GeometryParameters& geometry,
                            LoopMode mode) const;
  Equations predictiveEquations() const;
  const Equations& equationsOf(LoopMode mode) const;
  std::int64_t phaseOf(const LoopChange& change) const;
  WorstPhase worstPhase(LoopMode mode, LoopChange change, double enough) const;
  Eigen::MatrixXd mapOf(const Equations& equations, const LoopChange& change, const Gains& gains,
                        int least_commands = 0) const;

  PlantModel robot_;
  std::optional<PlantModel> model_;    // of a predictive controller
  std::optional<WheelBelief> belief_;  // of a predictive controller
  LoopClock clock_;
  Gains gains_;  // at phase 0
  double action_gain_;
  double belief_radius_ = 0.0;
  std::vector<LoopMode> modes_;
  std::vector<Equations> equations_;  // of each mode
};

}  // namespace jackal_aic
