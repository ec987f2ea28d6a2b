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
#include <string>
#include <utility>
#include <vector>

#include "jackal_aic/certificate/closed_loop_certificate.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/wheel_belief.hpp"
#include "jackal_aic/predictive/predictive_parameters.hpp"

namespace jackal_aic {

/// Change of the robot for which a margin asks.
struct RobotChange {
  double gain = 1.0;             ///< factor on the wheel speed that a command gives
  double extra_dead_time = 0.0;  ///< added to the robot's dead time, which stays 0 or more [s]
  double phase = 0.0;  ///< age of the newest measurement when the action is computed [s], up to longestPhase()
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
  Eigen::MatrixXd periodMap(const RobotChange& change = {}) const;

  /// Spectral radius of periodMap() with its uncertainty (spectral_radius.hpp) on top, so that what is below 1 is
  /// stable; infinity if the map is not finite.
  double spectralRadius(const RobotChange& change = {}) const;

  /// Longest phase between the timers of sensor and action [s]: the shorter one of their periods.
  double longestPhase() const;

  /// The largest spectral radius over the phase. @param change whose phase does not matter.
  double worstSpectralRadius(RobotChange change = {}) const;

  /// How much smaller than worstSpectralRadius() the true one may be.
  double radiusUncertainty() const;

  /// Spectral radius of the error of the belief over a period: of the belief alone, whatever is driven.
  double beliefSpectralRadius() const { return converged_.spectral_radius; }

  const PredictiveParameters& parameters() const { return parameters_; }
  const PlantModel& robot() const { return robot_; }

 private:
  class Trajectories;
  /// The belief alone, with the gain to which its covariance converges.
  struct Belief {
    std::vector<Eigen::Vector3d> gains;  // of the corrections in a period, in order
    double spectral_radius;              // of its error over a period
  };
  /// @param phase [ns].
  Belief convergedBelief(std::int64_t phase) const;
  /// Events of a period as (time [ns], kind), in order. @param remainder of the robot's dead time in an action period
  /// [ns]; @param phase [ns].
  std::vector<std::pair<std::int64_t, int>> schedule(std::int64_t remainder, std::int64_t phase) const;

  PredictiveParameters parameters_;
  PlantModel model_;
  PlantModel robot_;
  WheelBelief belief_;
  int action_steps_;  // per period
  int sensor_steps_;  // per period
  Belief converged_;  // with phase 0
};

/// Certificate of the predictive controller.
struct PredictiveCertificate {
  double period;                  ///< common period of sensor, belief and action [s]
  double belief_spectral_radius;  ///< of the belief alone over one period
  double loop_spectral_radius;    ///< of the closed loop over one period; as the margins, for the worst phase
  double radius_uncertainty;      ///< the true radius is not above loop_spectral_radius, and less than this below it
  double gain_margin;      ///< factor on the robot's gain at which the radius is 1, above 1; kLargestGainMargin if none
  double gain_reduction;   ///< likewise, below 1; 0 if none down to 1e-3
  double delay_margin;     ///< extra dead time of the robot at which the radius is 1 [s]
  double delay_reduction;  ///< how much shorter the robot's dead time may be [s]; the whole of it if it does not matter

  /// True if the closed loop and the belief alone are stable.
  bool stable() const { return belief_spectral_radius < kStabilityLimit && loop_spectral_radius < kStabilityLimit; }

  /// True if gain and delay margin are at least these.
  bool keeps(const MarginBounds& bounds) const { return gain_margin >= bounds.gain && delay_margin >= bounds.delay; }
};

/// Certifies the predictive controller. Margins of an unstable loop are 1 and 0. @throws ParameterError as
/// PredictiveLinearLoop.
PredictiveCertificate certify(const PredictiveParameters& parameters, const PlantModel& model, const PlantModel& robot);

/// What is thin about a stable loop, in words; empty if both bounds are kept. Needs two evaluations of the loop only.
std::string thinMargin(const PredictiveLinearLoop& loop, const MarginBounds& bounds = {});

/// One or two plain sentences: what the certificate means and what helps.
std::string advice(const PredictiveCertificate& certificate, const PredictiveParameters& parameters,
                   const PlantModel& model, const PlantModel& robot, const MarginBounds& bounds = {});

/// Sensitivities d ln(rho) / d ln(parameter) of kappa_a, kappa_mu, wheel_variance, speed_process_noise and
/// disturbance_process_noise, the largest magnitude first; those that are zero are left out.
std::vector<Sensitivity> sensitivities(const PredictiveParameters& parameters, const PlantModel& model,
                                       const PlantModel& robot);

/// @throws ParameterError, one line with the spectral radius and what is most to blame, if loop or belief is unstable.
void requireStable(const PredictiveParameters& parameters, const PlantModel& model, const PlantModel& robot);

}  // namespace jackal_aic
