#pragma once

/// @file
/// Parameters of the fault campaign and the configuration its bars follow from.

#include <string>

#include "fault_campaign.hpp"
#include "jackal_aic/config/parameter_map.hpp"
#include "judge.hpp"

namespace jackal_aic::sim {

/// Parameters of the node, without prefix.
struct CampaignParameters {
  std::string scenarios;     ///< file with the scenarios
  std::string robot;         ///< file with geometry and limits of the controller
  std::string plant;         ///< file with the parameters of the simulated robot
  std::string results;       ///< file to write the verdicts to, line by line; empty: none
  std::string select = ".";  ///< regular expression: which scenarios
  bool own_launch = false;   ///< those that leave the ROS graph unfit for another, instead of those that do not
  bool core = false;         ///< only those of the test suite
  bool real = false;         ///< only those that run on the plant `real` as well
  double soak = 0.0;         ///< simulated time to go on with scenarios picked at random [s]; 0: each scenario once
  CampaignNodes nodes;       ///< names of controller and plant
};

/// Lists the fields of CampaignParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, CampaignParameters& p) {
  v.field("scenarios", p.scenarios, Presence::required);
  v.field("robot", p.robot, Presence::required);
  v.field("plant", p.plant, Presence::required);
  v.field("results", p.results, Presence::optional);
  v.field("select", p.select, Presence::optional);
  v.field("own_launch", p.own_launch, Presence::optional);
  v.field("core", p.core, Presence::optional);
  v.field("real", p.real, Presence::optional);
  v.field("soak", p.soak, {0.0, 1e6}, "s", Presence::optional);
  v.field("controller_node", p.nodes.controller, Presence::optional);
  v.field("plant_node", p.nodes.plant, Presence::optional);
}

/// Scenarios that the parameters select. @throws ParameterError if there are none, or as readScenarios().
std::vector<Scenario> selectedScenarios(const CampaignParameters& parameters);

/// Limits from the files of the parameters. @throws ParameterError if a file or a value is bad.
CampaignLimits campaignLimits(const CampaignParameters& parameters);

}  // namespace jackal_aic::sim
