#pragma once

/// @file
/// Remedies for stops and failed sensors: the second sentence of a log line.

#include "jackal_aic/faults/fault.hpp"
#include "jackal_aic/safety/loss_policy.hpp"
#include "jackal_aic/safety/stop_cause.hpp"

namespace jackal_aic {

/// Remedy of a stop; empty for `none`, and for a cause whose text includes the remedy.
const char* remedy(StopCause cause);

/// Remedy of a fault; empty for `none`.
const char* remedy(Fault fault);

/// Remedy of a loss; empty for `none`.
const char* remedy(Loss loss);

}  // namespace jackal_aic
