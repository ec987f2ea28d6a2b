#pragma once

/// @file
/// Between the inputs of a drive loop and the messages that keep them. Pure functions.

#include <jackal_aic/LoopInputs.h>

#include <string>
#include <vector>

#include "jackal_aic/safety/drive_input.hpp"

namespace jackal_aic {

/// Adds an input to a message, gains as their text. Numbers keep their bits.
void addInput(const DriveInput& input, LoopInputs& message);

/// The inputs of a message, in their order; exactly those that were added.
/// @throws ParameterError if an input is of a kind that is not known, lacks values, or its gains are no gains.
std::vector<DriveInput> inputsOf(const LoopInputs& message);

}  // namespace jackal_aic
