#include "scenario.hpp"

#include <algorithm>
#include <fstream>
#include <random>
#include <set>
#include <sstream>

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
  bool pairs = false;             ///< may be one of a random pair
  Scenario scenario;
};

template <class Visitor>
void describeFields(Visitor& v, Entry& p) {
  v.field("motions", p.motions, Presence::required);
  v.field("core", p.core, Presence::optional);
  v.field("pairs", p.pairs, Presence::optional);
  v.field("onset", p.scenario.onset, {0.5, 3600.0}, "s", Presence::optional);
  v.field("recovery", p.scenario.recovery, {0.0, 3600.0}, "s", Presence::optional);
  v.field("own_launch", p.scenario.own_launch, Presence::optional);
}

/// How many random pairs of faults there are. YAML prefix `random_pairs`.
struct RandomPairs {
  int count = 0;
  std::uint64_t seed = 1;
};

template <class Visitor>
void describeFields(Visitor& v, RandomPairs& p) {
  v.field("count", p.count, {0, 1000}, "", Presence::optional);
  v.field("seed", p.seed, "", Presence::optional);
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
    const TopicFault fault{static_cast<FaultTopic>(i), readParameters<MessageFault>(map, key)};
    if (!possible(fault.topic, fault.fault.kind, fault.fault.channel)) {
      throw ParameterError(key + ": " + kFaultKindNames[static_cast<std::size_t>(fault.fault.kind)] + " of " +
                           kFaultChannelNames[static_cast<std::size_t>(fault.fault.channel)] +
                           " is no fault of this topic");
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
  return scenario;
}

bool shareATopic(const Scenario& a, const Scenario& b) {
  for (const TopicFault& fault : a.faults) {
    for (const TopicFault& other : b.faults) {
      if (fault.topic == other.topic) return true;
    }
  }
  return a.system && b.system;
}

/// Both at once. A fault that stops the robot does so whatever else is wrong; the earlier of two stops counts.
Scenario together(const Scenario& a, const Scenario& b) {
  const bool b_decides = b.expectation.outcome == Outcome::stops &&
                         (a.expectation.outcome != Outcome::stops || b.expectation.within < a.expectation.within);
  Scenario both = b_decides ? b : a;
  const Scenario& other = b_decides ? a : b;
  both.faults.insert(both.faults.end(), other.faults.begin(), other.faults.end());
  if (other.system) both.system = other.system;
  both.plant.insert(both.plant.end(), other.plant.begin(), other.plant.end());
  Expectation& expectation = both.expectation;
  const Expectation& others = other.expectation;
  if (others.outcome == expectation.outcome && others.detected_by == expectation.detected_by) {
    expectation.reasons.insert(expectation.reasons.end(), others.reasons.begin(), others.reasons.end());
  } else if (expectation.detected_by == Detection::tolerated) {
    expectation.detected_by = others.detected_by;
    expectation.reasons = others.reasons;
    expectation.detected_within = others.detected_within;
  }
  if (expectation.outcome == Outcome::drives && others.outcome == Outcome::resumes) {
    expectation.outcome = Outcome::resumes;
  }
  expectation.recovers = expectation.recovers && others.recovers;
  expectation.tolerance = std::max(expectation.tolerance, others.tolerance);
  expectation.overspeed = std::max(expectation.overspeed, others.overspeed);
  both.core = false;
  return both;
}

/// Index below `size`; spelled out, because the standard distributions differ between libraries.
std::size_t draw(std::mt19937_64& random, std::size_t size) { return static_cast<std::size_t>(random() % size); }

std::vector<Scenario> randomPairs(const std::vector<Scenario>& candidates, const RandomPairs& parameters) {
  std::mt19937_64 random(parameters.seed);
  std::set<std::string> seen;
  std::vector<Scenario> pairs;
  // Far more draws than pairs: only a table with next to nothing to pair runs out of them.
  const int most_draws = 1000 * parameters.count;
  for (int i = 0; i < most_draws && static_cast<int>(pairs.size()) < parameters.count; ++i) {
    const Scenario& a = candidates[draw(random, candidates.size())];
    const Scenario& b = candidates[draw(random, candidates.size())];
    if (a.motion.name != b.motion.name || shareATopic(a, b)) continue;
    Scenario both = together(a, b);
    const auto stem = [](const Scenario& s) { return s.name.substr(0, s.name.find('/')); };
    both.name = std::min(stem(a), stem(b)) + "+" + std::max(stem(a), stem(b)) + "/" + a.motion.name;
    both.seed = parameters.seed + pairs.size();
    if (seen.insert(both.name).second) pairs.push_back(both);
  }
  return pairs;
}

std::vector<Scenario> scenariosIn(ParameterMap& map) {
  std::vector<Motion> motions;
  for (const std::string& name : namesBelow(map, kMotions)) {
    motions.push_back(readParameters<Motion>(map, std::string(kMotions) + "." + name));
    motions.back().name = name;
  }
  std::vector<Scenario> scenarios, candidates;
  for (const std::string& name : namesBelow(map, kScenarios)) {
    const Entry entry = readEntry(map, name);
    const std::string key = std::string(kScenarios) + "." + name;
    for (const auto& motion : entry.core) motionNamed(motions, motion, key + ".core");
    for (const auto& motion : entry.motions) {
      scenarios.push_back(withMotion(entry, motionNamed(motions, motion, key + ".motions")));
      if (entry.pairs) candidates.push_back(scenarios.back());
    }
  }
  const auto pairs = readParameters<RandomPairs>(map, "random_pairs");
  map.refuseUnknown();
  if (!candidates.empty()) {
    for (Scenario& pair : randomPairs(candidates, pairs)) scenarios.push_back(std::move(pair));
  }
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

std::vector<Scenario> readScenarios(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) throw ParameterError(path + ": cannot be read");
  return parseScenarios(text.str(), path);
}

}  // namespace jackal_aic::sim
