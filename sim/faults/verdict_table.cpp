#include "verdict_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "csv.hpp"

namespace jackal_aic::sim {
namespace {

std::string number(double value) { return fmt::format("{:.3f}", value); }

std::string number(const std::optional<double>& value) { return value ? number(*value) : ""; }

/// The faults of a scenario in words: "imu bias 0.2 of gyro".
std::string faultsOf(const Scenario& scenario) {
  std::vector<std::string> words;
  const auto amount = [](double value) { return value == 0.0 ? std::string() : fmt::format(" {:g}", value); };
  for (const TopicFault& fault : scenario.faults) {
    const InjectedFault& f = fault.fault;
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
  return fmt::format("{}", fmt::join(words, "; "));
}

}  // namespace

std::string lineField(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return csvField(text);
}

std::string verdictHeader() {
  return "scenario,faults,expected,distance_m,standstill_s,allowed_s,command_step_radps,acceleration_use,limit_use,"
         "overspeed_mps,yaw_overspeed_radps,detected_s,told,result,failures,history\n";
}

std::string verdictLine(const Scenario& scenario, const Verdict& verdict) {
  const bool stops = scenario.expectation.outcome == Outcome::stops;
  const std::vector<std::string> cells{csvField(scenario.name),
                                       csvField(faultsOf(scenario)),
                                       kOutcomeNames[static_cast<std::size_t>(scenario.expectation.outcome)],
                                       number(verdict.distance),
                                       number(verdict.standstill),
                                       stops ? number(verdict.allowed_standstill) : std::string(),
                                       number(verdict.command_step),
                                       number(verdict.acceleration_use),
                                       number(verdict.limit_use),
                                       number(verdict.overspeed),
                                       number(verdict.yaw_overspeed),
                                       number(verdict.detected_after),
                                       lineField(verdict.told),
                                       verdict.passed() ? "passed" : "failed",
                                       lineField(fmt::format("{}", fmt::join(verdict.failures, "; "))),
                                       lineField(verdict.history)};
  return fmt::format("{}\n", fmt::join(cells, ","));
}

}  // namespace jackal_aic::sim
