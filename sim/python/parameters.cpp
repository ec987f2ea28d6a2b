#include <fmt/format.h>

#include "bindings.hpp"
#include "jackal_aic/config/yaml.hpp"

namespace jackal_aic::python {
namespace {

/// Files of config/ by their names in Python.
using Names = std::vector<std::pair<std::string, std::string>>;

const Names kPresets{{"predictive", "predictive"},
                     {"improved", "improved"},
                     {"standard", "standard"},
                     {"tuned", "tuned"},
                     {"diff_drive", "diff_drive"}};
const Names kPlantModels{{"assumed", "jackal_model"},
                         {"ground", "plant_model"},
                         {"real", "plant_model"},
                         {"box", "plant_model_box"},
                         {"gazebo", "gazebo_model"}};
const Names kRobots{{"jackal", "jackal"}};

/// Adds the file of a name or path. @throws ParameterError with the names.
void addFile(const char* what, const std::string& name, const Names& names, ParameterMap& map) {
  if (name.find(".yaml") != std::string::npos || name.find(".yml") != std::string::npos) return addYamlFile(name, map);
  std::vector<std::string> known;
  for (const auto& [word, file] : names) {
    if (word == name) return addYamlFile(sim::packageFile("config/" + file + ".yaml"), map);
    known.push_back(word);
  }
  sim::requireKnown(what, name, known);
}

Parameters checked(ParameterMap map, const py::dict& overrides) {
  for (const auto& [key, value] : overridesOf(overrides)) setFromText(key, value, map);
  return readNodeParameters(std::move(map), sim::robotUrdf);
}

/// As controller.launch reads them.
Parameters readParameters(const std::string& preset, const std::string& plant_model, const std::string& robot,
                          const py::dict& overrides) {
  ParameterMap map;
  addYamlFile(sim::packageFile("config/advanced.yaml"), map);
  addFile("preset", preset, kPresets, map);
  addFile("robot", robot, kRobots, map);
  addFile("plant_model", plant_model, kPlantModels, map);
  map.set("preset", preset);
  return checked(std::move(map), overrides);
}

py::dict values(const Parameters& parameters) {
  ParameterMap map;
  addYamlText(configurationText(parameters), "parameters", map);
  py::dict dict;
  for (const std::string& key : map.keys()) dict[key.c_str()] = py::cast(*map.take(key));
  return dict;
}

std::string textOf(const py::handle& value) {
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>() ? "true" : "false";
  if (py::isinstance<py::str>(value)) return value.cast<std::string>();
  if (PyIndex_Check(value.ptr()))
    return fmt::format("{}", py::int_(py::reinterpret_borrow<py::object>(value)).cast<long>());
  if (PyNumber_Check(value.ptr()))
    return fmt::format("{}", py::float_(py::reinterpret_borrow<py::object>(value)).cast<double>());
  if (!py::isinstance<py::sequence>(value)) {
    throw ParameterError(py::repr(value).cast<std::string>() + ": must be a number, a text, a truth value or a list");
  }
  std::string list;
  for (const py::handle& item : value) list += (list.empty() ? "[" : ", ") + textOf(item);
  return list.empty() ? "[]" : list + "]";
}

}  // namespace

const char* structureOf(const DriveParameters& parameters) {
  constexpr const char* kStructures[] = {"thesis", "predictive", "diff_drive"};
  return kStructures[parameters.controller.index()];
}

DriveParameters driveParameters(const Parameters& parameters) {
  DriveParameters drive = parameters;
  drive.motors_shared = false;
  return drive;
}

sim::Overrides overridesOf(const py::dict& overrides) {
  sim::Overrides list;
  for (const auto& [key, value] : overrides) list.emplace_back(py::str(key).cast<std::string>(), textOf(value));
  return list;
}

py::dict dictOf(const std::vector<Field>& fields) {
  py::dict dict;
  for (const Field& field : fields) dict[field.name.c_str()] = py::cast(field.value);
  return dict;
}

void bindParameters(py::module& m) {
  py::class_<Parameters>(m, "Parameters",
                         R"(Settings of a controller and its drive loop, as controller.launch reads them.

The YAML files are read in the order of the launch file (advanced.yaml, preset, robot, plant model) by the node's own
reader: the same keys, ranges and errors.)")
      .def(py::init(&readParameters), py::arg("preset") = "improved", py::arg("plant_model") = "assumed",
           py::arg("robot") = "jackal", py::arg("overrides") = py::dict(),
           R"(Reads and checks all parameters.

preset: "predictive", "improved", "standard", "tuned", "diff_drive", or the path of a YAML file.
plant_model: "assumed" (a Jackal that was not identified), "ground", "box", "real", "gazebo", or the path of a YAML file.
robot: "jackal" (config/jackal.yaml), or the path of a YAML file.
overrides: values by key that replace those of the files, such as {"predictive.reference_time": 0.02}.
Raises ValueError for an unknown name (with the list of names), key, type or value, and if the loop is unstable.)")
      .def("values", &values, "All keys with their values, as a dict such as {'controller.tau': 0.03}.")
      .def("__getitem__",
           [](const Parameters& parameters, const std::string& key) {
             const py::dict all = values(parameters);
             if (!all.contains(key.c_str())) throw py::key_error(key);
             return py::object(all[key.c_str()]);
           })
      .def(
          "yaml", [](const Parameters& parameters) { return configurationText(parameters); },
          "The text of a YAML file with all keys.")
      .def(py::pickle([](const Parameters& parameters) { return configurationText(parameters); },
                      [](const std::string& yaml) {
                        ParameterMap map;
                        addYamlText(yaml, "parameters", map);
                        return checked(std::move(map), {});
                      }))
      .def_property_readonly(
          "structure", [](const Parameters& parameters) { return structureOf(parameters); },
          "\"thesis\", \"predictive\" or \"diff_drive\".")
      .def("__repr__", [](const Parameters& parameters) {
        return fmt::format("<Parameters {}. {}>", parameters.preset, describeRobot(parameters));
      });
}

}  // namespace jackal_aic::python
