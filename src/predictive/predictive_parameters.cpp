#include "jackal_aic/predictive/predictive_parameters.hpp"

#include <fmt/format.h>

#include <cmath>

#include "jackal_aic/aic/parameters.hpp"

namespace jackal_aic {
namespace {

constexpr double kTimingTimeConstant = 0.035;  // s; for motors of a Jackal's size, stiff to soft
constexpr double kTurningTimeConstant = 0.1;   // s; in which a soft velocity loop compensates the ground's torque
constexpr double kLimitDeviation = 0.6;        // of the motors' acceleration limit; half of it is usual
constexpr double kAssumedDeviation = 0.05;  // of an assumed gain; with 0.1 commands hunt while the dead time is unknown

}  // namespace

int PredictiveParameters::beliefStepsPerAction() const {
  return static_cast<int>(std::lround(belief_rate / action_rate));
}

const PredictiveParameters& validate(const PredictiveParameters& parameters) {
  requireWholeRatio("predictive", parameters.belief_rate, parameters.action_rate);
  if (!isWhole(1.0 / (parameters.belief_rate * WheelBelief::kStep))) {
    throw ParameterError(fmt::format("predictive.belief_rate = {:g} Hz: must divide 1000 Hz", parameters.belief_rate));
  }
  return parameters;
}

WheelBeliefParameters wheelBeliefParameters(const PredictiveParameters& p, const PlantModel& model) {
  WheelBeliefParameters belief;
  belief.measurement_variance = p.wheel_variance;
  belief.speed_process_noise = p.speed_process_noise;
  belief.disturbance_process_noise = p.disturbance_process_noise;
  belief.dead_time_deviation = p.dead_time_deviation;
  belief.timing_time_constant = kTimingTimeConstant;
  belief.turning_time_constant = kTurningTimeConstant;
  belief.learning_rate = p.belief_learning_rate;
  belief.limit_deviation = kLimitDeviation;
  belief.gain_deviation = model.identified ? 0.5 * model.gain_half_width / model.gain : kAssumedDeviation;
  return belief;
}

}  // namespace jackal_aic
