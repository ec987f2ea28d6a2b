#include "jackal_aic/aic/parameters.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "jackal_aic/config/yaml_parameters.hpp"

namespace jackal_aic {
namespace {

const std::string kConfig = std::string(JACKAL_AIC_SOURCE_DIR) + "/config/";

ControllerParameters load(const std::string& yaml) {
  ParameterMap map;
  addYamlText(yaml, "test.yaml", map);
  auto controller = readParameters<ControllerParameters>(map, "controller");
  map.refuseUnknown();
  validate(controller, GeometryParameters{});
  return controller;
}

std::string preset(const std::string& extra = "", const std::string& without = "") {
  ParameterMap map;
  std::string yaml = "controller:\n";
  const std::pair<const char*, const char*> lines[] = {{"belief_rate", "1000"},
                                                       {"action_rate", "50"},
                                                       {"orders", "3"},
                                                       {"tau", "0.03"},
                                                       {"kappa_mu", "0.01"},
                                                       {"kappa_a", "8"},
                                                       {"integrator", "exact"},
                                                       {"state_variances", "[1.5, 2, 4, 8]"},
                                                       {"sensory_variances", "[2, 2, 1.0e+5, 1.0e+5]"}};
  for (const auto& line : lines) {
    const bool replaced = extra.rfind(std::string(line.first) + ":", 0) == 0;
    if (line.first != without && !replaced) yaml += "  " + std::string(line.first) + ": " + line.second + "\n";
  }
  return yaml + (extra.empty() ? "" : "  " + extra + "\n");
}

/// The message of the ParameterError that loading throws; fails the test if it does not throw or spans two lines.
std::string refusal(const std::string& yaml) {
  try {
    load(yaml);
  } catch (const ParameterError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "accepted:\n" << yaml;
  return "";
}

void expectNames(const std::string& message, const std::vector<std::string>& parts) {
  for (const auto& part : parts) EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' in: " << message;
}

TEST(Parameters, StandardPresetIsTableC1) {
  ParameterMap map;
  addYamlFile(kConfig + "standard.yaml", map);
  const auto c = readParameters<ControllerParameters>(map, "controller");
  map.refuseUnknown();
  EXPECT_NO_THROW(validate(c, {}));
  EXPECT_EQ(c.tau, 0.03);
  EXPECT_EQ(c.kappa_mu, 0.01);
  EXPECT_EQ(c.kappa_a, 8);
  EXPECT_EQ(c.orders, 3);
  EXPECT_EQ(c.state_variances, (std::vector<double>{1.5, 2, 4, 8}));
  EXPECT_EQ(c.sensory_variances, (std::vector<double>{2, 2, 1e5, 1e5}));
  EXPECT_EQ(c.belief_rate, 50);
  EXPECT_EQ(c.action_rate, 50);
}

TEST(Parameters, ImprovedPresetIsTable58) {
  ParameterMap map;
  addYamlFile(kConfig + "improved.yaml", map);
  const auto c = readParameters<ControllerParameters>(map, "controller");
  EXPECT_NO_THROW(validate(c, {}));
  EXPECT_EQ(c.belief_rate, 1000);
  EXPECT_EQ(c.action_rate, 50);
  EXPECT_EQ(c.beliefStepsPerAction(), 20);
  EXPECT_EQ(c.tau, 0.001);
  EXPECT_EQ(c.kappa_mu, 0.1);
  EXPECT_EQ(c.kappa_a, 8);
}

TEST(Parameters, MissingKeyIsNamedWithItsRange) {
  expectNames(refusal(preset("", "kappa_mu")), {"controller.kappa_mu", "missing"});
  expectNames(refusal(preset("", "state_variances")), {"controller.state_variances", "missing"});
}

TEST(Parameters, UnknownKeyIsNamedWithTheKnownOnes) {
  expectNames(refusal(preset("taau: 0.1")),
              {"controller.taau = 0.1: unknown key; nearest known keys: controller.tau, "});
}

TEST(Parameters, ASectionThatIsNoneIsToldWhatBelongsIntoIt) {
  ParameterMap map;
  map.set("controller", 5.0);
  map.declare("controller.kappa_a");
  map.declare("controller.tau");
  try {
    map.refuseUnknown();
    FAIL() << "taken";
  } catch (const ParameterError& error) {
    EXPECT_STREQ(error.what(), "controller = 5: expected keys below it, controller.kappa_a for one");
  }
}

TEST(Parameters, WrongTypeIsNamed) {
  expectNames(refusal(preset("tau: fast")), {"controller.tau", "'fast'", "number"});
  expectNames(refusal(preset("tau: \"0.03\"")), {"controller.tau", "'0.03'", "number"});
  expectNames(refusal(preset("orders: 2.5")), {"controller.orders", "2.5", "whole number"});
  expectNames(refusal(preset("orders: 010")), {"controller.orders", "'010'", "whole number"});  // 8 for rosparam
  expectNames(refusal(preset("orders: -01")), {"controller.orders", "'-01'"});
  expectNames(refusal(preset("orders: true")), {"controller.orders", "true"});
  expectNames(refusal(preset("tau: [1, 2]")), {"controller.tau", "[1, 2]"});
  expectNames(refusal(preset("state_variances: 3")), {"controller.state_variances", "list"});
  expectNames(refusal(preset("integrator: runge_kutta")), {"controller.integrator", "runge_kutta", "exact, euler"});
}

TEST(Parameters, OutOfRangeIsNamedWithValueAndBound) {
  expectNames(refusal(preset("tau: -0.1")), {"controller.tau = -0.1", "[1e-05, 10] s"});
  expectNames(refusal(preset("orders: 6")), {"controller.orders = 6", "[0, 5]"});
  expectNames(refusal(preset("tau: .nan")), {"controller.tau = nan"});
  expectNames(refusal(preset("kappa_a: .inf")), {"controller.kappa_a = inf"});
  expectNames(refusal(preset("sensory_variances: [2, -2, 1, 1]")), {"controller.sensory_variances[1] = -2"});
}

TEST(Parameters, RatesMustBeAWholeRatio) {
  expectNames(refusal(preset("belief_rate: 75")), {"controller.belief_rate = 75", "whole multiple", "50"});
  expectNames(refusal(preset("belief_rate: 10")), {"whole multiple"});
}

TEST(Parameters, EveryOrderNeedsAVariance) {
  expectNames(refusal(preset("orders: 4")), {"controller.state_variances has 4 values", "at least 5"});
  EXPECT_NO_THROW(load(preset("orders: 1"))) << "variances of higher orders may stay in the file";
}

TEST(Parameters, DivergingEulerIsRefusedWithItsNumber) {
  ControllerParameters c;
  c.integrator = Integrator::euler;
  EXPECT_NO_THROW(validate(c, {}));
  c.tau = 0.001;
  try {
    validate(c, {});
    FAIL() << "accepted a diverging belief update";
  } catch (const ParameterError& error) {
    expectNames(error.what(),
                {"euler", "diverges", "spectral radius", "kappa_mu Pi_mu / tau^2 = 133.3", "must be below 2"});
  }
  c.integrator = Integrator::exact;
  EXPECT_NO_THROW(validate(c, {}));
}

TEST(YamlParameters, UnreadableOrBrokenFilesAreNamed) {
  ParameterMap map;
  EXPECT_THROW(addYamlFile("/nonexistent/gains.yaml", map), ParameterError);
  EXPECT_THROW(addYamlText("controller: [1, 2", "broken.yaml", map), ParameterError);
  EXPECT_THROW(addYamlText("", "empty.yaml", map), ParameterError);
  EXPECT_THROW(addYamlText("controller:\n  tau:\n", "null.yaml", map), ParameterError);
  EXPECT_THROW(addYamlText("a:\n  - [1, 2]\n", "nested.yaml", map), ParameterError);
}

TEST(YamlParameters, RefuseAKeyOverSeveralLines) {
  ParameterMap map;
  try {
    addYamlText("good: 1\n? \"bad\\nkey\"\n: 2\n", "file", map);
    FAIL() << "accepted";
  } catch (const ParameterError& error) {
    EXPECT_STREQ(error.what(), "file: key 'bad...': goes over more than one line");
  }
}

TEST(YamlParameters, AnErrorAboutATextStaysOnOneShortLine) {
  ParameterMap map;
  addYamlText("text: \"first\\n" + std::string(200, 'x') + "\"\n", "file", map);
  try {
    map.refuseUnknown();
    FAIL() << "accepted";
  } catch (const ParameterError& error) {
    const std::string what = error.what();
    EXPECT_EQ(what.find('\n'), std::string::npos);
    EXPECT_LT(what.size(), 200u);
  }
}

/// What reading a text is refused with; empty if it is read.
std::string yamlRefusal(const std::string& text) {
  ParameterMap map;
  try {
    addYamlText(text, "file", map);
  } catch (const ParameterError& error) {
    return error.what();
  }
  return "";
}

TEST(YamlParameters, AnItemOfAListKeepsItsTypeAndItsCommas) {
  ParameterMap map;
  addYamlText("quoted: ['1', '2']\ncommas: ['left, front', right]\nnumbers: [1, 2.5]\ntext: 'true'\n", "file", map);
  setFromText("set", "['a,b', c]", map);
  EXPECT_EQ(std::get<std::vector<std::string>>(*map.take("quoted")), (std::vector<std::string>{"1", "2"}));
  EXPECT_EQ(std::get<std::vector<std::string>>(*map.take("commas")),
            (std::vector<std::string>{"left, front", "right"}));
  EXPECT_EQ(std::get<std::vector<double>>(*map.take("numbers")), (std::vector<double>{1.0, 2.5}));
  EXPECT_EQ(std::get<std::string>(*map.take("text")), "true");
  EXPECT_EQ(std::get<std::vector<std::string>>(*map.take("set")), (std::vector<std::string>{"a,b", "c"}));
  EXPECT_EQ(yamlRefusal("mixed: [1, '2']"), "file: mixed: expected a flat list of numbers or of words, not of both");
}

TEST(YamlParameters, TruthHasTheWordsOfEveryReader) {
  ParameterMap map;
  addYamlText("a: yes\nb: Off\nc: 'no'\nd: nan\ne: 0x10\n", "file", map);
  EXPECT_EQ(std::get<bool>(*map.take("a")), true);
  EXPECT_EQ(std::get<bool>(*map.take("b")), false);
  EXPECT_EQ(std::get<std::string>(*map.take("c")), "no");
  EXPECT_EQ(std::get<std::string>(*map.take("d")), "nan");
  EXPECT_EQ(std::get<std::string>(*map.take("e")), "0x10");
}

TEST(YamlParameters, RefuseWhatIsNoConfiguration) {
  EXPECT_EQ(yamlRefusal("a: 1\nb: 2\na: 3\n"), "file: a: given twice");
  EXPECT_EQ(yamlRefusal("a: {b: 1}\na.b: 2\n"), "file: a.b: given twice");
  EXPECT_EQ(yamlRefusal("a: 1\n---\na: 2\n"), "file: more than one document (---)");
  EXPECT_EQ(yamlRefusal("{}"), "file: no keys found; expected 'key: value' lines");
  ParameterMap map;
  EXPECT_THROW(addYamlFile(testing::TempDir(), map), ParameterError);
  EXPECT_EQ(yamlRefusal("a: " + std::string(2 << 20, '1')), "file: more than 1 MiB of text");
}

/// A map of ten seeds, a map of ten aliases of it, and so on, twenty levels deep.
std::string aliasBomb(const std::string& seed) {
  std::string text, last = seed;
  for (int i = 0; i < 20; ++i) {
    const std::string name = "a" + std::to_string(i);
    text += name + ": &" + name + " {";
    for (int k = 0; k < 10; ++k) text += (k > 0 ? ", k" : "k") + std::to_string(k) + ": " + last;
    text += "}\n";
    last = "*" + name;
  }
  return text;
}

TEST(YamlParameters, SurviveWhatGrowsWithoutEnd) {
  EXPECT_EQ(yamlRefusal("a: &a\n  b: *a\n").find("file: "), 0U);
  EXPECT_EQ(yamlRefusal("a: &a [*a]\n").find("file: "), 0U);
  for (const char* seed : {"1", "[]", "[1, 2]"}) {
    EXPECT_EQ(yamlRefusal(aliasBomb(seed)), "file: more than 10000 keys and values") << seed;
  }
  EXPECT_EQ(yamlRefusal(aliasBomb("{}")).find("file: a0.k0 = {}: "), 0U);
  EXPECT_EQ(yamlRefusal(std::string(1001, 'k') + ": {a: 1, b: 2}"),
            "file: " + std::string(80, 'k') + "...: more than 1000 characters");
  for (const char* open : {"[", "{", "- ", "? ", "{a: "}) {
    std::string nested = "a: \n";
    for (int i = 0; i < 100000; ++i) nested += open;
    EXPECT_EQ(yamlRefusal(nested), "file: more than 200 levels of brackets or dashes") << open;
  }
}

TEST(YamlParameters, AnEmptyMapIsNoValueAndNoSection) {
  EXPECT_EQ(yamlRefusal("plant_model: {gain: {}}"), "file: plant_model.gain = {}: expected a value, or keys below it");
  EXPECT_EQ(yamlRefusal("a: 1\ncontroller: {}\n"), "file: controller = {}: expected a value, or keys below it");
  ParameterMap map;
  EXPECT_THROW(setFromText("plant_model.gain", "{}", map), ParameterError);
}

TEST(YamlParameters, ALongListIsNotEchoed) {
  ParameterMap map;
  std::string text = "unknown: [1";
  for (int i = 0; i < 9000; ++i) text += ", 1";
  addYamlText(text + "]\n", "file", map);
  try {
    map.refuseUnknown();
    FAIL() << "accepted";
  } catch (const ParameterError& error) {
    EXPECT_STREQ(error.what(), "unknown = [1, 1, 1, 1, 1, 1, 1, 1, ... 9001 in all]: unknown key");
  }
}

TEST(YamlParameters, LaterFilesReplaceEarlierValues) {
  ParameterMap map;
  addYamlText("controller: {tau: 0.03, kappa_a: 8}", "first", map);
  addYamlText("controller: {tau: 0.01}", "second", map);
  setFromText("controller.kappa_a", "10", map);
  ControllerParameters defaults;
  ParameterReader reader(map, "controller");
  reader.field("tau", defaults.tau, {0, 1}, "s", Presence::required);
  reader.field("kappa_a", defaults.kappa_a, {0, 100}, "", Presence::required);
  EXPECT_EQ(defaults.tau, 0.01);
  EXPECT_EQ(defaults.kappa_a, 10);
}

}  // namespace
}  // namespace jackal_aic
