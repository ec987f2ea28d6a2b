#include "verdict_table.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <vector>

#include "csv.hpp"

namespace jackal_aic::sim {
namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f", value);
  return text;
}

std::string number(const std::optional<double>& value) { return value ? number(*value) : ""; }

/// A text as a CSV field on one line: whoever follows the file while it grows takes a line for a row.
std::string lineField(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return csvField(text);
}

std::string joined(const std::vector<std::string>& texts, const char* separator) {
  std::string line;
  for (const std::string& text : texts) line += (line.empty() ? "" : separator) + text;
  return line;
}

/// The faults of a scenario in words: "imu bias 0.2 of gyro".
std::string faultsOf(const Scenario& scenario) {
  std::vector<std::string> words;
  const auto amount = [](double value) {
    char text[32];
    std::snprintf(text, sizeof text, " %g", value);
    return value == 0.0 ? std::string() : std::string(text);
  };
  for (const TopicFault& fault : scenario.faults) {
    const MessageFault& f = fault.fault;
    std::string text = std::string(kFaultTopicNames[static_cast<std::size_t>(fault.topic)]) + " " +
                       kFaultKindNames[static_cast<std::size_t>(f.kind)] + amount(f.amount);
    if (f.channel != FaultChannel::all) {
      text += std::string(" of ") + kFaultChannelNames[static_cast<std::size_t>(f.channel)];
    }
    words.push_back(text + (f.share < 1.0 ? " in" + amount(f.share) : ""));
  }
  if (scenario.system) {
    words.push_back(kSystemFaultKindNames[static_cast<std::size_t>(scenario.system->kind)] +
                    amount(scenario.system->amount));
  }
  return joined(words, "; ");
}

}  // namespace

std::string verdictHeader() {
  return "scenario,faults,expected,distance_m,standstill_s,allowed_s,command_step_radps,acceleration_use,limit_use,"
         "overspeed_mps,yaw_overspeed_radps,detected_s,told,result,failures,history\n";
}

std::string verdictLine(const Scenario& scenario, const Verdict& verdict) {
  const bool stops = scenario.expectation.outcome == Outcome::stops;
  return joined({csvField(scenario.name), csvField(faultsOf(scenario)),
                 kOutcomeNames[static_cast<std::size_t>(scenario.expectation.outcome)], number(verdict.distance),
                 number(verdict.standstill), stops ? number(verdict.allowed_standstill) : std::string(),
                 number(verdict.command_step), number(verdict.acceleration_use), number(verdict.limit_use),
                 number(verdict.overspeed), number(verdict.yaw_overspeed), number(verdict.detected_after),
                 lineField(verdict.told), verdict.passed() ? "passed" : "failed",
                 lineField(joined(verdict.failures, "; ")), lineField(verdict.history)},
                ",") +
         "\n";
}

}  // namespace jackal_aic::sim
