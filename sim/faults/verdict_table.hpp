#pragma once

/// @file
/// Verdicts of the fault campaign as lines of a CSV file.

#include <string>

#include "judge.hpp"
#include "scenario.hpp"

namespace jackal_aic::sim {

/// A text as a CSV field on one line: whoever follows the file while it grows takes a line for a row.
std::string lineField(std::string text);

/// Header line of the table.
std::string verdictHeader();

/// Line of one scenario.
std::string verdictLine(const Scenario& scenario, const Verdict& verdict);

}  // namespace jackal_aic::sim
