#pragma once

/// @file
/// The controller and a linear robot as one linear periodic system.
///
/// Belief update (3-11, either integrator), generalisation (3-22), action update (3-13), their rates and holds, and the
/// response of a PlantModel are all linear. Left/right symmetry splits them into three loops that do not see each
/// other: the mean of the wheels with the forward belief, half their difference with the yaw belief, and the lateral
/// belief alone. Over the common period of sensor, belief and action each loop maps its state linearly; the loop is
/// asymptotically stable if and only if the spectral radius of that map is below 1.

#include <Eigen/Core>
#include <vector>

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/certificate/loop_clock.hpp"
#include "jackal_aic/certificate/margins.hpp"
#include "jackal_aic/model/plant_model.hpp"

namespace jackal_aic {

struct GenerativeModel;
struct WorstPhase;
class BeliefUpdate;

/// The loops that symmetry leaves.
enum class LoopMode {
  straight,  ///< mean wheel speed and forward belief
  turn,      ///< half the difference of the wheel speeds, yaw rate and yaw belief
  lateral    ///< lateral belief: neither measured nor driven
};

/// Linear periodic system of the closed loop. At one and the same time the sensor comes first, then the belief, then
/// the action, whose command the plant receives after the dead time; any dead time is represented exactly, as a switch
/// from one held command to the next within an action period. The timers of sensor and action run freely beside each
/// other: how old a measurement is when it is used, their phase, is an argument. Left out: limits on speed and
/// acceleration, noise, and wheel slip dynamics.
class LinearLoop {
 public:
  /// The gains need not be stable. @throws ParameterError if rates or variances are invalid, or sensor and action rate
  /// have no common period within 50 action periods.
  LinearLoop(const ControllerParameters& controller, const GeometryParameters& geometry, const PlantModel& plant);

  /// Common period of sensor, belief and action [s].
  double period() const;

  /// Map of the state of a mode over one period. The state is the belief and the generalised measurement of the wheels,
  /// order i scaled by (sensor period)^i, the action, the commands under way, the wheel speed and the velocity loop's
  /// correction.
  Eigen::MatrixXd periodMap(LoopMode mode, const LoopChange& change = {}) const;

  /// True if one sample and one action pass in a common period: the characteristic polynomial of periodMap() is then
  /// affine in the gain.
  bool singleRate() const { return clock_.sensor_steps == 1 && clock_.action_steps == 1; }

  /// Spectral radius of periodMap() with its uncertainty (spectral_radius.hpp) on top, so that what is below 1 is
  /// stable; infinity if the map is not finite.
  double spectralRadius(LoopMode mode, const LoopChange& change = {}) const;

  /// The largest over all modes.
  double spectralRadius() const;

  /// Longest phase [s]: the shorter one of sensor and action period. A measurement that comes just after the action has
  /// this age at the next one; beyond it everything repeats.
  double longestPhase() const;

  /// The largest spectral radius over the phase between the timers of sensor and action. @param change whose phase does
  /// not matter.
  double worstSpectralRadius(LoopMode mode, LoopChange change = {}) const;

  /// True if a mode is stable at every phase: worstSpectralRadius() < kStabilityLimit, and sooner told.
  bool stable(LoopMode mode, const LoopChange& change = {}) const;

  /// The largest over all modes and phases; where two differ by less than the error of their eigenvalues, either.
  double worstSpectralRadius() const;

  /// How much smaller than worstSpectralRadius() the true one may be.
  double radiusUncertainty() const;

  /// Wheel speed of a mode at the end of each period after a step of the set point from rest, as a part of its final
  /// value. The straight mode only has a final value that equals the set point; the turn's is taken as if it had.
  /// @param periods number of periods; @param change of the loop.
  Eigen::VectorXd stepResponse(LoopMode mode, int periods, const LoopChange& change = {}) const;

  /// Spectral radius of one belief step with the measurement held.
  double beliefSpectralRadius() const { return belief_radius_; }

  const ControllerParameters& controller() const { return controller_; }  ///< gains of the loop
  const PlantModel& plant() const { return plant_; }                      ///< robot in the loop

 private:
  /// Controller equations of one mode, with belief and measurement scaled by (sensor period)^order.
  struct ModeEquations {
    Eigen::MatrixXd belief;                      // belief over one step, from the belief
    Eigen::MatrixXd measurement;                 // and from the generalised wheel speed
    Eigen::RowVectorXd action_from_belief;       // change of the action in one step, from the belief
    Eigen::RowVectorXd action_from_measurement;  // and from the generalised wheel speed
  };
  class Trajectories;

  /// Radius as rough as spectralRadiusBeside() tells it.
  WorstPhase worstPhase(LoopMode mode, LoopChange change, double enough) const;
  ModeEquations equations(LoopMode mode, const GenerativeModel& model, const BeliefUpdate& update) const;

  ControllerParameters controller_;
  GeometryParameters geometry_;
  PlantModel plant_;
  LoopClock clock_;
  double belief_radius_ = 0.0;
  std::vector<ModeEquations> modes_;
};

}  // namespace jackal_aic
