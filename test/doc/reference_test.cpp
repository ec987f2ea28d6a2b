// The pages of doc/reference that are made from the code; scripts/regenerate rewrites them.

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "../repository.hpp"
#include "jackal_aic/safety/stop_cause.hpp"
#include "parameters/node_parameters.hpp"
#include "plant_parameters.hpp"

namespace jackal_aic {
namespace {

constexpr const char* kMade = "<!-- Made from the code by scripts/regenerate. Change the code, not this page. -->\n\n";

constexpr const char* kSeverities[] = {"stop", "emergency", "halt", "fault"};
constexpr const char* kNode = "src/node/parameters/node_parameters.hpp";

std::string replaced(const std::string& text, const std::string& pattern, const std::string& by) {
  return std::regex_replace(text, std::regex(pattern), by);
}

/// What a header (of the core, if it is not in src or sim) says of a field of a struct, on one line, without the unit
/// at its end.
std::string remark(const std::string& header, const std::string& structure, const Field& field) {
  const bool of_core = header.rfind("src/", 0) != 0 && header.rfind("sim/", 0) != 0;
  const std::string text = textOf((of_core ? "include/jackal_aic/" : "") + header);
  const std::size_t begin = text.find("struct " + structure);
  const std::string body = text.substr(begin, text.find("\n};", begin) - begin);
  std::smatch match;
  const std::regex documented("\\b" + field.name + "(?:\\s*[={][^;]*)?;\\s*///<((?:[^\n]*\n\\s*///<)*[^\n]*)");
  if (!std::regex_search(body, match, documented)) return "";
  const std::string line = replaced(replaced(match[1], "\\s*\n\\s*///<\\s*", " "), "^\\s+|\\s+$", "");
  const std::size_t unit = line.find(" [" + field.unit + "]");
  return unit == std::string::npos ? line : line.substr(0, unit) + line.substr(unit + field.unit.size() + 3);
}

struct Row {
  std::string key;
  Field field;
  std::string remark;
};

std::string range(const Field& field) {
  std::string words;
  for (const std::string& word : field.words) words += (words.empty() ? "" : ", ") + word;
  return field.bounds ? describe(field.bounds->low) + ".." + describe(field.bounds->high) : words;
}

std::string defaultOf(const Field& field) {
  if (field.presence == Presence::required) return "-";
  const auto* word = std::get_if<std::string>(&field.value);
  return word != nullptr ? *word : replaced(describe(field.value), "'", "");
}

std::string table(const std::vector<Row>& rows) {
  std::string text = "| key | default | range | unit | |\n|---|---|---|---|---|\n";
  for (const Row& row : rows) {
    text += "| `" + row.key + "` | " + defaultOf(row.field) + " | " + range(row.field) + " | " + row.field.unit +
            " | " + replaced(row.remark, "\\|", "\\|") + " |\n";
  }
  return text;
}

template <class Parameters>
std::vector<Row> rowsOf(const std::string& prefix, const std::string& header, const std::string& structure) {
  std::vector<Row> rows;
  for (const Field& field : fieldsOf(Parameters{})) {
    const std::string said =
        field.name == "robot" ? "name of the robot, for messages" : remark(header, structure, field);
    EXPECT_FALSE(said.empty()) << structure << ": " << field.name << " has no comment";
    rows.push_back({(prefix.empty() ? "" : prefix + ".") + field.name, field, said});
  }
  return rows;
}

template <class Enum, std::size_t N>
Field choice(const char* name, Enum value, const std::array<const char*, N>& words) {
  FieldList list;
  list.field(name, value, words, Presence::optional);
  return list.fields.front();
}

std::vector<Row> nodeRows() {
  const NodeParameters node;
  auto rows = rowsOf<NodeOptions>("", kNode, "NodeOptions");
  rows.push_back({"restart_after_stop", choice("restart_after_stop", node.gate.restart_after_stop, kRestartPolicyNames),
                  "what sets the robot moving again after an emergency stop or a stop of the robot"});
  const Field slip_file{"slip.file", node.slip_file, std::nullopt, "", {}, Presence::optional};
  rows.push_back({"slip.file", slip_file,
                  "absolute path: where the predictive controller keeps what it learns about slip and drive train"});
  return rows;
}

struct Section {
  std::string heading;
  std::vector<Row> rows;
};

std::vector<Section> controllerSections() {
  auto robot = rowsOf<GeometryParameters>("robot", "model/geometry.hpp", "GeometryParameters");
  const auto names = rowsOf<RobotNames>("robot", kNode, "RobotNames");
  robot.insert(robot.end(), names.begin(), names.end());
  const char* const gate = "safety/gate_parameters.hpp";
  return {{"Node", nodeRows()},
          {"Robot", robot},
          {"Sensors", rowsOf<SensorNoise>("sensors", "model/sensor_noise.hpp", "SensorNoise")},
          {"Limits of the command", rowsOf<LimitParameters>("limits", gate, "LimitParameters")},
          {"Deadlines", rowsOf<DeadlineParameters>("deadlines", gate, "DeadlineParameters")},
          {"Lost channels", rowsOf<LossPolicyParameters>("on_loss", "safety/loss_policy.hpp", "LossPolicyParameters")},
          {"Brake", rowsOf<BrakeParameters>("brake", gate, "BrakeParameters")},
          {"Plausibility", rowsOf<PlausibilityParameters>("plausibility", gate, "PlausibilityParameters")},
          {"Odometry", rowsOf<OdometryParameters>("odometry", kNode, "OdometryParameters")},
          {"Fault detection", rowsOf<FaultParameters>("faults", "faults/fault_parameters.hpp", "FaultParameters")},
          {"Plant model", rowsOf<PlantModel>("plant_model", "model/plant_model.hpp", "PlantModel")},
          {"Predictive controller",
           rowsOf<PredictiveParameters>("predictive", "predictive/predictive_parameters.hpp", "PredictiveParameters")},
          {"The thesis' controller",
           rowsOf<ControllerParameters>("controller", "aic/parameters.hpp", "ControllerParameters")},
          {"Differential drive", rowsOf<DifferentialDriveParameters>("diff_drive", "aic/differential_drive.hpp",
                                                                     "DifferentialDriveParameters")}};
}

/// Takes the rows of config/jackal.yaml out of the sections.
std::vector<Row> takeBasic(std::vector<Section>& sections) {
  const ParameterMap map = shipped({"jackal"});
  std::vector<Row> basic;
  for (Section& section : sections) {
    std::vector<Row> rest;
    for (const Row& row : section.rows) (map.has(row.key) ? basic : rest).push_back(row);
    section.rows = rest;
  }
  EXPECT_EQ(basic.size(), map.keys().size());
  return basic;
}

std::string parameterPage() {
  std::vector<Section> sections = controllerSections();
  const std::vector<Row> basic = takeBasic(sections);
  std::string text =
      std::string("# Parameters\n\n") + kMade +
      "Private parameters of `controller_node`. Tools and experiments read the same keys from YAML files,\n"
      "and `experiments --set` reads single keys. A key that is missing, unknown, of the wrong type or out\n"
      "of range is refused in one line. `-`: no default, a file has to give it.\n\n## What you set\n\n"
      "In `config/jackal.yaml` or a copy of it (`robot:=FILE` of the launch files), with a preset\n"
      "(`preset:=`) and the plant model (`plant_model:=`).\n\n" +
      table(basic) +
      "\n## What you rarely need\n\nIn `config/advanced.yaml`, presets and plant models; the defaults are "
      "what these files have.\n";
  for (const Section& section : sections) text += "\n### " + section.heading + "\n\n" + table(section.rows);
  return text + "\n## The simulated robot\n\nOf `plant_node`, in `config/plant.yaml`.\n\n" +
         table(rowsOf<sim::PlantParameters>("plant", "sim/plant/plant_parameters.hpp", "PlantParameters"));
}

std::string stopCausePage() {
  const std::string header = textOf(kRoot / "include/jackal_aic/safety/stop_cause.hpp");
  const std::string causes = header.substr(0, header.find("};"));
  std::string text = std::string("# Stop causes\n\n") + kMade +
                     "From mild to severe: of several causes the last one counts. `/jackal_AIC/state` shows the\n"
                     "reason. More: [what stops the robot](../concepts/drive_gate.md).\n\n"
                     "- **stop**: the robot brakes, and drives on when the cause is gone.\n"
                     "- **emergency**: the same, at the acceleration limits.\n"
                     "- **halt**: as emergency; then it waits for `restart_after_stop`.\n"
                     "- **fault**: as emergency; then it waits for a zero set point.\n\n"
                     "| cause | reason | when | severity |\n|---|---|---|---|\n";
  int cause = 1;
  const std::regex documented("\n  (\\w+),?\\s*///< ([^\n]*)");
  for (std::sregex_iterator i(causes.begin(), causes.end(), documented), end; i != end; ++i, ++cause) {
    const auto present = static_cast<StopCause>(cause);
    text += "| `" + i->str(1) + "` | " + jackal_aic::text(present) + " | " + i->str(2) + " | " +
            kSeverities[static_cast<int>(severity(present))] + " |\n";
  }
  EXPECT_EQ(cause, kStopCauses) << "a cause without a comment";
  return text;
}

void expectCurrent(const std::string& page, const std::string& made) {
  if (std::getenv("JACKAL_AIC_REGENERATE") != nullptr) std::ofstream(kRoot / page) << made;
  EXPECT_EQ(textOf(kRoot / page), made) << page << " is out of date: run scripts/regenerate";
}

TEST(Reference, EveryRemedyIsThatOfTheCode) {
  const std::string page = textOf("doc/reference/messages.md");
  const auto expectIn = [&page](const std::string& part) { EXPECT_NE(page.find(part), std::string::npos) << part; };
  for (int i = 1; i < kStopCauses; ++i) {
    const auto cause = static_cast<StopCause>(i);
    expectIn("| `" + std::string(text(cause)) + "` | " + remedy(cause));
  }
  for (int i = 1; i < kFaults; ++i) {
    const auto fault = static_cast<Fault>(i);
    expectIn("`" + std::string(text(fault)) + "`");
    if (isFault(fault)) expectIn(std::string("| ") + remedy(fault) + " |");
  }
  for (const Loss loss : {Loss::yaw_rate, Loss::left_encoder, Loss::right_encoder, Loss::encoder_and_yaw_rate,
                          Loss::both_encoders, Loss::unclear}) {
    expectIn("| `" + std::string(text(loss)) + "` | " + remedy(loss) + " |");
  }
}

TEST(Reference, DefaultsAreThoseOfTheShippedFiles) {
  ParameterMap map = shipped({"diff_drive", "advanced", "jackal", "standard", "predictive", "jackal_model", "plant"});
  // Which mean something else where they are missing: a robot without a name, one that was identified, geometry that
  // the URDF tells, and no file.
  const std::set<std::string> apart{"plant_model.robot", "plant_model.identified", "robot.wheel_radius", "slip.file"};
  std::vector<Section> sections = controllerSections();
  sections.push_back({"", rowsOf<sim::PlantParameters>("plant", "sim/plant/plant_parameters.hpp", "PlantParameters")});
  int compared = 0;
  for (const Section& section : sections) {
    for (const Row& row : section.rows) {
      if (apart.count(row.key) > 0) continue;
      ASSERT_TRUE(map.has(row.key)) << row.key << " stands in no shipped file";
      EXPECT_EQ(describe(*map.take(row.key)), describe(row.field.value)) << row.key;
      ++compared;
    }
  }
  EXPECT_GT(compared, 100);
  for (const std::string& key : apart) map.declare(key);
  EXPECT_NO_THROW(map.refuseUnknown());
}

TEST(Reference, ParametersAreThoseOfTheCode) { expectCurrent("doc/reference/parameters.md", parameterPage()); }

TEST(Reference, StopCausesAreThoseOfTheCode) { expectCurrent("doc/reference/stop_causes.md", stopCausePage()); }

}  // namespace
}  // namespace jackal_aic
