#include "jackal_aic/aic/parameters.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "../complaint.hpp"
#include "../repository.hpp"
#include "jackal_aic/config/yaml.hpp"

namespace jackal_aic {
namespace {

using Texts = std::vector<std::string>;

ControllerParameters load(const std::string& yaml) {
  ParameterMap map;
  addYamlText(yaml, "test.yaml", map);
  const auto controller = readParameters<ControllerParameters>(map, "controller");
  map.refuseUnknown();
  validate(controller, GeometryParameters{});
  return controller;
}

TEST(Parameters, PresetsAreTheTablesOfTheThesis) {
  const ControllerParameters standard = load(textOf("config/standard.yaml"));
  const ControllerParameters improved = load(textOf("config/improved.yaml"));
  EXPECT_EQ(std::tuple(standard.tau, standard.kappa_mu, standard.belief_rate), std::tuple(0.03, 0.01, 50.0));    // C-1
  EXPECT_EQ(std::tuple(improved.tau, improved.kappa_mu, improved.belief_rate), std::tuple(0.001, 0.1, 1000.0));  // 5-8
  EXPECT_EQ(improved.beliefStepsPerAction(), 20);
  for (const ControllerParameters& c : {standard, improved}) {
    EXPECT_EQ(std::tuple(c.kappa_a, c.action_rate, c.orders), std::tuple(8.0, 50.0, 3));
    EXPECT_EQ(c.state_variances, (std::vector<double>{1.5, 2, 4, 8}));
    EXPECT_EQ(c.sensory_variances, (std::vector<double>{2, 2, 1e5, 1e5}));
  }
}

/// The standard gains with a line in place of that of the same key; a key alone leaves its line out.
std::string gainsWith(const std::string& line) {
  const std::string key = line.substr(0, line.find(':'));
  std::string yaml = "controller:\n";
  for (const char* standard :
       {"belief_rate: 1000", "action_rate: 50", "orders: 3", "tau: 0.03", "kappa_mu: 0.01", "kappa_a: 8",
        "integrator: exact", "state_variances: [1.5, 2, 4, 8]", "sensory_variances: [2, 2, 1.0e+5, 1.0e+5]"}) {
    if (std::string(standard).rfind(key + ":", 0) != 0) yaml += std::string("  ") + standard + "\n";
  }
  return yaml + (line == key ? "" : "  " + line + "\n");
}

TEST(Parameters, ErrorsNameKeyValueAndBound) {
  const std::pair<const char*, Texts> rows[] = {
      {"kappa_mu", {"controller.kappa_mu", "missing"}},
      {"state_variances", {"controller.state_variances", "missing"}},
      {"taau: 0.1", {"controller.taau = 0.1: unknown key; nearest known keys: controller.tau, "}},
      {"tau: fast", {"controller.tau", "'fast'", "number"}},
      {"tau: \"0.03\"", {"controller.tau", "'0.03'", "number"}},
      {"orders: 2.5", {"controller.orders", "2.5", "whole number"}},
      {"orders: true", {"controller.orders", "true"}},
      {"tau: [1, 2]", {"controller.tau", "[1, 2]"}},
      {"state_variances: 3", {"controller.state_variances", "list"}},
      {"integrator: runge_kutta", {"controller.integrator", "runge_kutta", "exact, euler"}},
      {"tau: -0.1", {"controller.tau = -0.1", "[1e-05, 10] s"}},
      {"orders: 6", {"controller.orders = 6", "[0, 5]"}},
      {"tau: .nan", {"controller.tau = nan"}},
      {"kappa_a: .inf", {"controller.kappa_a = inf"}},
      {"sensory_variances: [2, -2, 1, 1]", {"controller.sensory_variances[1] = -2"}},
      {"belief_rate: 75", {"controller.belief_rate = 75", "whole multiple", "50"}},
      {"belief_rate: 10", {"whole multiple"}},
      {"orders: 4", {"controller.state_variances has 4 values", "at least 5"}}};
  for (const auto& [line, parts] : rows) {
    const std::string message = complaint([line = line] { load(gainsWith(line)); });
    for (const std::string& part : parts) expectSays(message, {part});
  }
  EXPECT_NO_THROW(load(gainsWith("orders: 1"))) << "variances of higher orders may stay in the file";
  ParameterMap section;
  section.set("controller", 5.0);
  section.declare("controller.kappa_a");
  section.declare("controller.tau");
  EXPECT_EQ(complaint([&] { section.refuseUnknown(); }),
            "controller = 5: expected keys below it, controller.kappa_a for one");
}

TEST(Parameters, DivergingEulerIsRefusedWithItsNumber) {
  ControllerParameters c;
  c.integrator = Integrator::euler;
  EXPECT_NO_THROW(validate(c, {}));
  c.tau = 0.001;
  expectSays(complaint([&c] { validate(c, {}); }),
             {"euler", "diverges", "spectral radius", "kappa_mu Pi_mu / tau^2 = 133.3", "must be below 2"});
  c.integrator = Integrator::exact;
  EXPECT_NO_THROW(validate(c, {}));
}

std::string yamlRefusal(const std::string& text) {
  return complaint([&text] {
    ParameterMap map;
    addYamlText(text, "file", map);
  });
}

TEST(YamlParameters, ValuesKeepTheirTypes) {
  ParameterMap map;
  addYamlText(
      "quoted: ['1', '2']\ncommas: ['left, front', right]\nnumbers: [1, 2.5]\ntext: 'true'\na: yes\nb: Off\n"
      "c: 'no'\nd: nan\n",
      "file", map);
  setFromText("set", "['a,b', c]", map);
  EXPECT_EQ(std::get<Texts>(*map.take("quoted")), (Texts{"1", "2"}));
  EXPECT_EQ(std::get<Texts>(*map.take("commas")), (Texts{"left, front", "right"}));
  EXPECT_EQ(std::get<Texts>(*map.take("set")), (Texts{"a,b", "c"}));
  EXPECT_EQ(std::get<std::vector<double>>(*map.take("numbers")), (std::vector<double>{1.0, 2.5}));
  EXPECT_EQ(std::get<bool>(*map.take("a")), true);
  EXPECT_EQ(std::get<bool>(*map.take("b")), false);
  for (const auto& [key, text] : {std::pair("text", "true"), std::pair("c", "no"), std::pair("d", "nan")}) {
    EXPECT_EQ(std::get<std::string>(*map.take(key)), text) << key;
  }
}

TEST(YamlParameters, RefusesTextsThatAreNoConfiguration) {
  const std::pair<std::string, std::string> rows[] = {
      {"a: 1\nb: 2\na: 3\n", "file: a: given twice"},
      {"a: {b: 1}\na.b: 2\n", "file: a.b: given twice"},
      {"a: 1\n---\na: 2\n", "file: more than one document (---)"},
      {"{}", "file: no keys found; expected 'key: value' lines"},
      {"a: " + std::string(2 << 20, '1'), "file: more than 1 MiB of text"},
      {"mixed: [1, '2']", "file: mixed: expected a flat list of numbers or of words, not of both"},
      {"plant_model: {gain: {}}", "file: plant_model.gain = {}: expected a value, or keys below it"},
      {"a: 1\ncontroller: {}\n", "file: controller = {}: expected a value, or keys below it"},
      {std::string(1001, 'k') + ": {a: 1, b: 2}", "file: " + std::string(80, 'k') + "...: more than 1000 characters"}};
  for (const auto& [text, message] : rows) EXPECT_EQ(yamlRefusal(text), message);
  for (const char* text :
       {"controller: [1, 2", "", "controller:\n  tau:\n", "a:\n  - [1, 2]\n", "a: &a\n  b: *a\n", "a: &a [*a]\n"}) {
    EXPECT_EQ(yamlRefusal(text).find("file"), 0U) << text;
  }
  ParameterMap map;
  EXPECT_THROW(addYamlFile("/nonexistent/gains.yaml", map), ParameterError);
  EXPECT_THROW(addYamlFile(testing::TempDir(), map), ParameterError);
  EXPECT_THROW(setFromText("plant_model.gain", "{}", map), ParameterError);
}

}  // namespace
}  // namespace jackal_aic
