#include "soak.hpp"

#include <algorithm>
#include <ostream>
#include <random>

#include "node_process.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kMebibyte = 1024.0 * 1024.0;
constexpr double kLargestGrowth = 1.0;  // MiB
constexpr double kWarmUp = 0.1;         // of the duration

bool endsTheProcess(const Scenario& scenario) {
  if (!scenario.system) return false;
  const SystemFaultKind kind = scenario.system->kind;
  return kind == SystemFaultKind::kill || kind == SystemFaultKind::interrupt || kind == SystemFaultKind::terminate ||
         kind == SystemFaultKind::master_restart;
}

}  // namespace

bool soak(FaultCampaign& campaign, const std::vector<Scenario>& scenarios, const CampaignLimits& limits,
          double duration, std::ostream& results) {
  std::vector<Scenario> pool;
  std::remove_copy_if(scenarios.begin(), scenarios.end(), std::back_inserter(pool), endsTheProcess);
  if (pool.empty()) throw ParameterError("select: matches no scenario that leaves the controller's process alone");
  results << "simulated_s,scenario,resident_MiB,result\n" << std::flush;
  std::mt19937_64 random(1);
  double warm = 0.0, largest = 0.0;
  bool sound = true;
  while (ros::ok() && campaign.simulatedTime() < duration) {
    const Scenario& scenario = pool[static_cast<std::size_t>(random() % pool.size())];
    const RunRecord record = campaign.run(scenario);
    const Verdict verdict = judge(scenario, record, limits);
    const bool command_sound = verdict.limit_use <= 1.0 + 1e-3 && record.breakdown.empty();
    sound = sound && command_sound;
    const double memory = static_cast<double>(residentMemory(campaign.controllerProcess())) / kMebibyte;
    if (campaign.simulatedTime() < kWarmUp * duration) warm = memory;
    largest = std::max(largest, memory);
    results << campaign.simulatedTime() << ',' << scenario.name << ',' << memory << ','
            << (command_sound ? "sound" : "unsound: " + record.breakdown) << '\n'
            << std::flush;
  }
  const double growth = largest - warm;
  const bool passed = sound && growth < kLargestGrowth;
  results << "# " << (passed ? "passed" : "failed") << ": memory grown by " << growth
          << " MiB after the warm-up, allowed " << kLargestGrowth << '\n'
          << std::flush;
  return passed;
}

}  // namespace jackal_aic::sim
