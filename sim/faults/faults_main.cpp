/// @file
/// Node faults: runs the fault campaign and writes a line per scenario. Ends with status 0 if all passed, 2 if one
/// failed.

#include <ros/ros.h>

#include <fstream>

#include "campaign_parameters.hpp"
#include "fault_campaign.hpp"
#include "jackal_aic/config/text.hpp"
#include "parameters/ros_parameters.hpp"
#include "soak.hpp"
#include "verdict_table.hpp"

namespace jackal_aic::sim {
namespace {

/// Each scenario once. @return how many failed.
int runAll(FaultCampaign& campaign, const std::vector<Scenario>& scenarios, const CampaignLimits& limits,
           std::ostream& results) {
  int failed = 0;
  results << verdictHeader() << std::flush;
  for (const Scenario& scenario : scenarios) {
    if (!ros::ok()) break;
    const Verdict verdict = judge(scenario, campaign.run(scenario), limits);
    results << verdictLine(scenario, verdict) << std::flush;
    failed += verdict.passed() ? 0 : 1;
  }
  return failed;
}

int run(ros::NodeHandle& node, ros::NodeHandle& private_node) {
  ParameterMap map = readRosParameters(private_node);
  const auto parameters = readParameters<CampaignParameters>(map, "");
  map.refuseUnknown();
  const auto scenarios = selectedScenarios(parameters);
  const CampaignLimits limits = campaignLimits(parameters);
  std::ofstream results(parameters.results.empty() ? "/dev/stdout" : parameters.results);
  if (!results) throw ParameterError("results = '" + parameters.results + "': cannot be written");
  FaultCampaign campaign(node, parameters.nodes);
  if (parameters.soak > 0.0) return soak(campaign, scenarios, limits, parameters.soak, results) ? 0 : 2;
  return runAll(campaign, scenarios, limits, results) == 0 ? 0 : 2;
}

}  // namespace
}  // namespace jackal_aic::sim

int main(int argc, char** argv) {
  ros::init(argc, argv, "faults");
  ros::NodeHandle node, private_node("~");  // kept to the end: without a handle roscpp shuts down and logs no more
  try {
    return jackal_aic::sim::run(node, private_node);
  } catch (const std::exception& error) {
    ROS_FATAL("%s", jackal_aic::onOneLine(error.what()).c_str());
    return 1;
  }
}
