#pragma once

/// @file
/// Parameters of the predictive controller.

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/sensor_noise.hpp"
#include "jackal_aic/model/wheel_belief.hpp"

namespace jackal_aic {

/// Parameters of the predictive controller. YAML prefix `predictive`; `sensors` for the variances of the measurements
/// and `plant_model` for the drive train.
struct PredictiveParameters : SensorNoise {
  double belief_rate = 1000.0;              ///< rate of the belief update, a multiple of action_rate [Hz]
  double action_rate = 50.0;                ///< rate of the action update [Hz]
  double belief_learning_rate = 1.0;        ///< kappa_mu, learning rate of the belief (natural gradient)
  double action_learning_rate = 1.0;        ///< kappa_a, learning rate of the action (natural gradient)
  double reference_time = 0.01;             ///< tau_ref, time constant of the reference model [s]
  double speed_process_noise = 0.01;        ///< of a wheel's speed [(rad/s)^2/s]
  double yaw_process_noise = 1e-4;          ///< of the yaw rate, added to that of the wheels [(rad/s)^2/s]
  double disturbance_process_noise = 0.01;  ///< of a wheel's input disturbance [(rad/s)^2/s]
  double dead_time_deviation = 0.01;        ///< standard deviation of the dead time [s]
  bool learn_track = true;                  ///< learn the effective track
  bool learn_drive_train = true;            ///< learn dead time, lag and gain of the drive train
  double yaw_delay_deviation = 0.05;        ///< sigma_y, standard deviation of the yaw's delay behind the wheels [s]
  double slip_excitation = 0.5;             ///< least wheel speed difference to learn from [rad/s]
  double turning_centre = 0.0;              ///< l, distance of the turning centre ahead of the IMU [m]

  /// Belief updates per action update.
  int beliefStepsPerAction() const;
};

/// Lists the fields of PredictiveParameters, without the variances, with unit and range.
template <class Visitor>
void describeFields(Visitor& v, PredictiveParameters& p) {
  v.field("belief_rate", p.belief_rate, {1.0, 1000.0}, "Hz", Presence::required);
  v.field("action_rate", p.action_rate, {1.0, 1000.0}, "Hz", Presence::required);
  v.field("belief_learning_rate", p.belief_learning_rate, {1e-6, 1.0}, "", Presence::optional);
  v.field("action_learning_rate", p.action_learning_rate, {0.0, 1.0}, "", Presence::optional);
  v.field("reference_time", p.reference_time, {1e-4, 10.0}, "s", Presence::optional);
  v.field("speed_process_noise", p.speed_process_noise, {0.0, 1e3}, "(rad/s)^2/s", Presence::required);
  v.field("disturbance_process_noise", p.disturbance_process_noise, {0.0, 1e3}, "(rad/s)^2/s", Presence::required);
  v.field("yaw_process_noise", p.yaw_process_noise, {0.0, 1e3}, "(rad/s)^2/s", Presence::optional);
  v.field("dead_time_deviation", p.dead_time_deviation, {0.0, 1.0}, "s", Presence::required);
  v.field("learn_track", p.learn_track, Presence::optional);
  v.field("learn_drive_train", p.learn_drive_train, Presence::optional);
  v.field("yaw_delay_deviation", p.yaw_delay_deviation, {0.0, 1.0}, "s", Presence::optional);
  v.field("slip_excitation", p.slip_excitation, {0.05, 100.0}, "rad/s", Presence::optional);
  v.field("turning_centre", p.turning_centre, {-1.0, 1.0}, "m", Presence::optional);
}

/// The same parameters. @throws ParameterError if belief_rate is not a whole multiple of action_rate, or does not
/// divide 1 kHz.
const PredictiveParameters& validate(const PredictiveParameters& parameters);

/// The parameters of the belief about a wheel with this drive train.
WheelBeliefParameters wheelBeliefParameters(const PredictiveParameters& parameters, const PlantModel& model);

}  // namespace jackal_aic
