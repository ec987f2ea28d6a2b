#pragma once

/// @file
/// What certificates mean, in words: for a log, a refusal, a report.

#include <string>

#include "jackal_aic/certificate/closed_loop_certificate.hpp"
#include "jackal_aic/certificate/predictive_certificate.hpp"

namespace jackal_aic {

/// One or two plain sentences: what the certificate means and which change helps most.
std::string advice(const Certificate& certificate, const ControllerParameters& controller,
                   const GeometryParameters& geometry, const PlantModel& plant, const MarginBounds& bounds = {});

/// As above, for the predictive structure. @param model drive train as it is believed; @param robot the true one.
std::string advice(const PredictiveCertificate& certificate, const PredictiveParameters& parameters,
                   const PlantModel& model, const PlantModel& robot, const MarginBounds& bounds = {});

/// What is thin about a stable loop; empty if both bounds are kept.
std::string thinMargin(const LinearLoop& loop, const MarginBounds& bounds = {});
std::string thinMargin(const PredictiveLinearLoop& loop, const MarginBounds& bounds = {});  ///< likewise

/// @param running gains before a change that is to be judged. @throws ParameterError, one line with the spectral radius
/// and the parameter most to blame, first of all one that was changed, if loop or belief is unstable on the plant
/// model.
void requireStable(const ControllerParameters& controller, const GeometryParameters& geometry, const PlantModel& plant,
                   const ControllerParameters* running = nullptr);

/// As above, for the predictive structure.
void requireStable(const PredictiveParameters& parameters, const PlantModel& model, const PlantModel& robot,
                   const PredictiveParameters* running = nullptr);

}  // namespace jackal_aic
