#include "soak.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <ostream>
#include <random>

#include "node_process.hpp"
#include "soak_memory.hpp"
#include "verdict_table.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kMebibyte = 1024.0 * 1024.0;
constexpr double kLargestGrowth = 1.0;  // MiB

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
  SoakMemory resident(duration);
  int runs = 0, unsound_runs = 0;
  while (ros::ok() && campaign.simulatedTime() < duration) {
    const Scenario& scenario = pool[static_cast<std::size_t>(random() % pool.size())];
    std::vector<std::string> unsound = judge(scenario, campaign.run(scenario), limits).unsound;
    const double memory = static_cast<double>(residentMemory(campaign.controllerProcess())) / kMebibyte;
    if (memory > 0.0) {
      resident.add(campaign.simulatedTime(), memory);
    } else {
      unsound.emplace_back("the controller does not run");
    }
    ++runs;
    unsound_runs += unsound.empty() ? 0 : 1;
    const std::string result =
        unsound.empty() ? "sound" : lineField(fmt::format("unsound: {}", fmt::join(unsound, "; ")));
    results << campaign.simulatedTime() << ',' << scenario.name << ',' << memory << ',' << result << '\n' << std::flush;
  }
  const double growth = resident.growth();
  const bool passed = unsound_runs == 0 && growth < kLargestGrowth;
  results << "# " << (passed ? "passed" : "failed") << ": " << unsound_runs << " of " << runs
          << " runs unsound, memory grown by " << growth << " MiB after the warm-up, allowed " << kLargestGrowth << '\n'
          << std::flush;
  return passed;
}

}  // namespace jackal_aic::sim
