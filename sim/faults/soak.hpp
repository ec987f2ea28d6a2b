#pragma once

/// @file
/// Endurance: scenarios picked at random, one after another, with an eye on the controller's memory.

#include <iosfwd>
#include <vector>

#include "fault_campaign.hpp"
#include "judge.hpp"
#include "scenario.hpp"

namespace jackal_aic::sim {

/// Runs scenarios picked at random (seeded) until `duration` [s] is simulated and writes a line of CSV after each:
/// simulated time, scenario, resident memory of the controller, result. Scenarios that end the controller's process are
/// left out, because its memory is what is watched.
/// @return true if no run was unsound (see Verdict), and the memory after the warm-up (see SoakMemory) grew by less
/// than 1 MiB.
bool soak(FaultCampaign& campaign, const std::vector<Scenario>& scenarios, const CampaignLimits& limits,
          double duration, std::ostream& results);

}  // namespace jackal_aic::sim
