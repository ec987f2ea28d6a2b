// The core of the fault campaign, or its part on the plant real (argument "real"): scenarios through the real nodes,
// each judged as ./scripts/faults does.

#include <gtest/gtest.h>
#include <ros/ros.h>

#include <algorithm>
#include <memory>
#include <string>

#include "campaign_parameters.hpp"
#include "fault_campaign.hpp"

namespace jackal_aic::sim {
namespace {

bool on_real = false;  // known before the tests are

/// The shipped configuration.
CampaignParameters parameters() {
  CampaignParameters parameters;
  const std::string source = JACKAL_AIC_SOURCE_DIR;
  parameters.scenarios = source + "/sim/faults/scenarios.yaml";
  parameters.robot = source + "/config/jackal.yaml";
  parameters.plant = source + (on_real ? "/config/plant_real.yaml" : "/config/plant.yaml");
  parameters.core = !on_real;
  parameters.real = on_real;
  return parameters;
}

/// One node for all tests: the scenarios of a campaign follow each other on one ROS graph.
FaultCampaign& campaign() {
  static FaultCampaign campaign{ros::NodeHandle(), CampaignNodes()};
  return campaign;
}

class CoreScenario : public testing::TestWithParam<Scenario> {};

TEST_P(CoreScenario, MeetsItsBars) {
  const Verdict verdict = judge(GetParam(), campaign().run(GetParam()), campaignLimits(parameters()));
  for (const std::string& failure : verdict.failures) ADD_FAILURE() << failure;
  RecordProperty("told", verdict.told);
}

INSTANTIATE_TEST_SUITE_P(Faults, CoreScenario, testing::ValuesIn(selectedScenarios(parameters())),
                         [](const testing::TestParamInfo<Scenario>& info) {
                           std::string name = info.param.name;
                           std::replace(name.begin(), name.end(), '/', '_');
                           return name;
                         });

}  // namespace
}  // namespace jackal_aic::sim

int main(int argc, char** argv) {
  jackal_aic::sim::on_real = std::find(argv, argv + argc, std::string("real")) != argv + argc;
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "faults_test");
  ros::NodeHandle keep_alive;
  const int result = RUN_ALL_TESTS();
  ros::shutdown();
  return result;
}
