#include "scenario.hpp"

#include <algorithm>
#include <set>

#include "jackal_aic/config/text_file.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "message_access.hpp"
#include "plant_parameters.hpp"

namespace jackal_aic::sim {
namespace {

constexpr const char* kScenarios = "scenarios";
constexpr const char* kMotions = "motions";

/// An entry of the file: one kind of trouble, with the motions it is tried in.
struct Entry {
  std::string name;
  std::vector<std::string> motions;
  std::vector<std::string> core;  ///< motions in which it is part of the test suite
  std::vector<std::string> real;  ///< motions in which it is run on the plant `real` as well
  Scenario scenario;
};

template <class Visitor>
void describeFields(Visitor& v, Entry& p) {
  v.field("motions", p.motions, Presence::required);
  v.field("core", p.core, Presence::optional);
  v.field("real", p.real, Presence::optional);
  v.field("onset", p.scenario.onset, {0.5, 3600.0}, "s", Presence::optional);
  v.field("recovery", p.scenario.recovery, {0.0, 3600.0}, "s", Presence::optional);
  v.field("own_launch", p.scenario.own_launch, Presence::optional);
}

/// Names between `prefix.` and the next dot among the keys of a map.
std::set<std::string> namesBelow(const ParameterMap& map, const std::string& prefix) {
  std::set<std::string> names;
  for (const std::string& key : map.keys()) {
    if (key.rfind(prefix + ".", 0) != 0) continue;
    const std::string rest = key.substr(prefix.size() + 1);
    names.insert(rest.substr(0, rest.find('.')));
  }
  return names;
}

bool possible(FaultTopic topic, FaultKind kind, FaultChannel channel) {
  switch (topic) {
    case FaultTopic::joint_states:
      return canSuffer<sensor_msgs::JointState>(kind, channel);
    case FaultTopic::imu:
      return canSuffer<sensor_msgs::Imu>(kind, channel);
    case FaultTopic::feedback:
      return canSuffer<jackal_msgs::Feedback>(kind, channel);
    case FaultTopic::status:
      return canSuffer<jackal_msgs::Status>(kind, channel);
    case FaultTopic::set_point:
      return canSuffer<geometry_msgs::Twist>(kind, channel);
    case FaultTopic::cmd_drive:
      return canSuffer<jackal_msgs::Drive>(kind, channel);
  }
  return false;
}

/// Parameters of the plant that an entry gives, checked; unknown ones are refused with the rest of the file.
std::vector<std::pair<std::string, ParameterValue>> readPlant(ParameterMap& map, const std::string& prefix) {
  readParameters<PlantParameters>(map, prefix);
  ParameterMap given = map;
  std::vector<std::pair<std::string, ParameterValue>> plant;
  for (const std::string& name : namesBelow(map, prefix)) {
    if (const ParameterValue* value = given.take(prefix + "." + name)) plant.emplace_back(name, *value);
  }
  return plant;
}

Entry readEntry(ParameterMap& map, const std::string& name) {
  const std::string prefix = std::string(kScenarios) + "." + name;
  Entry entry = readParameters<Entry>(map, prefix);
  entry.name = name;
  Scenario& scenario = entry.scenario;
  const auto parts = namesBelow(map, prefix);
  for (std::size_t i = 0; i < kFaultTopicNames.size(); ++i) {
    if (parts.count(kFaultTopicNames[i]) == 0) continue;
    const std::string key = prefix + "." + kFaultTopicNames[i];
    const TopicFault fault{static_cast<FaultTopic>(i), readParameters<InjectedFault>(map, key)};
    if (!possible(fault.topic, fault.fault.kind, fault.fault.channel)) {
      throw ParameterError(key + ": " + kFaultKindNames[static_cast<std::size_t>(fault.fault.kind)] + " of " +
                           kFaultChannelNames[static_cast<std::size_t>(fault.fault.channel)] +
                           " is not a fault of this topic");
    }
    scenario.faults.push_back(fault);
  }
  if (parts.count("system") > 0) scenario.system = readParameters<SystemFault>(map, prefix + ".system");
  scenario.plant = readPlant(map, prefix + ".plant");
  if (scenario.faults.empty() && !scenario.system && scenario.plant.empty()) {
    throw ParameterError(prefix + ": has no fault");
  }
  scenario.expectation = readParameters<Expectation>(map, prefix + ".expect");
  const Expectation& expectation = scenario.expectation;
  const bool needs_reason =
      expectation.detected_by == Detection::state || expectation.detected_by == Detection::diagnostics;
  if (needs_reason && expectation.reasons.empty()) {
    throw ParameterError(prefix + ".expect.reasons: missing, though detected_by needs them");
  }
  return entry;
}

const Motion& motionNamed(const std::vector<Motion>& motions, const std::string& name, const std::string& key) {
  const auto found = std::find_if(motions.begin(), motions.end(), [&](const Motion& m) { return m.name == name; });
  if (found != motions.end()) return *found;
  std::string known;
  for (const Motion& motion : motions) known += (known.empty() ? "" : ", ") + motion.name;
  throw ParameterError(key + " = '" + name + "': unknown motion; known: " + known);
}

Scenario withMotion(const Entry& entry, const Motion& motion) {
  Scenario scenario = entry.scenario;
  scenario.motion = motion;
  scenario.name = entry.name + "/" + motion.name;
  scenario.core = std::count(entry.core.begin(), entry.core.end(), motion.name) > 0;
  scenario.real = std::count(entry.real.begin(), entry.real.end(), motion.name) > 0;
  return scenario;
}

std::vector<Scenario> scenariosIn(ParameterMap& map) {
  std::vector<Motion> motions;
  for (const std::string& name : namesBelow(map, kMotions)) {
    motions.push_back(readParameters<Motion>(map, std::string(kMotions) + "." + name));
    motions.back().name = name;
  }
  std::vector<Scenario> scenarios;
  for (const std::string& name : namesBelow(map, kScenarios)) {
    const Entry entry = readEntry(map, name);
    const std::string key = std::string(kScenarios) + "." + name;
    for (const auto& motion : entry.core) motionNamed(motions, motion, key + ".core");
    for (const auto& motion : entry.real) motionNamed(motions, motion, key + ".real");
    for (const auto& motion : entry.motions) {
      scenarios.push_back(withMotion(entry, motionNamed(motions, motion, key + ".motions")));
    }
  }
  map.refuseUnknown();
  return scenarios;
}

}  // namespace

double Scenario::clear() const {
  double last = 0.0;
  for (const TopicFault& fault : faults) last = std::max(last, fault.fault.start + fault.fault.duration);
  if (system) last = std::max(last, system->start + system->duration);
  return onset + last;
}

std::vector<Scenario> parseScenarios(const std::string& text, const std::string& name) {
  ParameterMap map;
  addYamlText(text, name, map);
  try {
    return scenariosIn(map);
  } catch (const ParameterError& error) {
    throw ParameterError(name + ": " + error.what());
  }
}

std::vector<Scenario> readScenarios(const std::string& path) { return parseScenarios(readText(path), path); }

}  // namespace jackal_aic::sim
