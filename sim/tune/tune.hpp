#pragma once

/// @file
/// The `tune` tool: searches the gains that settle fastest on a robot and writes them.

#include <cstddef>
#include <iosfwd>
#include <string>
#include <vector>

#include "gain_search.hpp"

namespace jackal_aic {

/// Runs the tool with the arguments after the program's name; see its --help. Returns the exit status.
/// @throws ParameterError, also if no gains keep the bounds, or boost::program_options::error for bad options.
int tune(const std::vector<std::string>& arguments, std::ostream& out);

/// How long work goes on that took this long so far [s], in words; empty while nothing, or when all of it is finished.
std::string timeLeft(double elapsed, std::size_t finished, std::size_t all);

/// Gains as a preset. @param comment lines for its head.
std::string presetText(const Gains& controller, const std::string& comment);

/// Numbers of orders "A..B" or "A". @throws ParameterError if they are not 0..5, or B is below A.
std::pair<int, int> parseOrders(const std::string& text);

/// A table of assessments, a line for each name and robot: figures of the robot as it is / otherwise.
std::string assessmentTable(const GainSearchTask& task,
                            const std::vector<std::pair<std::string, GainAssessment>>& rows);

}  // namespace jackal_aic
