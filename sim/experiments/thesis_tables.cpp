#include "thesis_tables.hpp"

#include <yaml-cpp/yaml.h>

#include "yaml_fields.hpp"

namespace jackal_aic::sim {
namespace {

YAML::Node findTable(const std::string& path, const std::string& table, const std::string& kind) {
  const YAML::Node root = YAML::LoadFile(path);
  for (const YAML::Node& node : root["tables"]) {
    if (node["table"].as<std::string>() != table) continue;
    if (node["kind"].as<std::string>() == kind) return node;
    throw ParameterError(path + ": table " + table + " is not of kind " + kind);
  }
  throw ParameterError(path + ": has no table " + table);
}

/// Field of a row, else of its table, else a default.
std::string inherited(const YAML::Node& row, const YAML::Node& table, const char* key) {
  return row[key] ? row[key].as<std::string>() : table[key].as<std::string>();
}

ThesisStep readStep(const YAML::Node& row, const YAML::Node& table) {
  ThesisStep step;
  step.table = table["table"].as<std::string>();
  step.row = row["row"].as<std::string>();
  step.column = row["column"].as<std::string>("");
  step.controller = inherited(row, table, "controller");
  step.plant = inherited(row, table, "support");
  step.step = row["step"].as<double>();
  step.overrides = readOverrides(row["set"], "controller.");
  step.settling = readOptional(row["settling"]);
  step.rise = readOptional(row["rise"]);
  step.unstable = row["unstable"].as<bool>(false);
  return step;
}

ThesisLimit readLimit(const YAML::Node& row, const YAML::Node& table) {
  return {row["parameter"].as<std::string>(),
          row["column"].as<std::string>(),
          row["limit"].as<std::string>() == "minimum",
          inherited(row, table, "controller"),
          inherited(row, table, "support"),
          readOverrides(row["set"], "controller."),
          row["value"].as<double>()};
}

ThesisSquare readSquare(const YAML::Node& row, const YAML::Node&) {
  return {row["row"].as<std::string>(), row["minimum"].as<double>(), row["maximum"].as<double>()};
}

template <class Row>
std::vector<Row> readRows(const std::string& path, const std::string& table, const char* kind,
                          Row (*read)(const YAML::Node&, const YAML::Node&)) {
  return guardYaml(path, [&] {
    const YAML::Node node = findTable(path, table, kind);
    std::vector<Row> rows;
    for (const YAML::Node& row : node["rows"]) rows.push_back(read(row, node));
    return rows;
  });
}

}  // namespace

std::vector<ThesisStep> ThesisTables::steps(const std::string& table) const {
  return readRows(path_, table, "step_response", readStep);
}

std::vector<ThesisSquare> ThesisTables::squares(const std::string& table) const {
  return readRows(path_, table, "square_wave", readSquare);
}

std::vector<ThesisLimit> ThesisTables::limits(const std::string& table) const {
  return readRows(path_, table, "usable_range", readLimit);
}

}  // namespace jackal_aic::sim
