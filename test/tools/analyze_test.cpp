#include <fmt/format.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <sstream>

#include "../complaint.hpp"
#include "../temporary_directory.hpp"
#include "jackal_aic/certificate/certificate.hpp"
#include "jackal_aic/config/text_file.hpp"
#include "parameters/node_parameters.hpp"
#include "programs.hpp"

namespace jackal_aic {
namespace {

std::string config(const std::string& name) { return std::string(JACKAL_AIC_SOURCE_DIR) + "/config/" + name; }

std::string output(const std::vector<std::string>& arguments, int status = 0) {
  std::ostringstream out;
  EXPECT_EQ(analyze(arguments, out), status);
  return out.str();
}

YAML::Node figures(const std::vector<std::string>& arguments, int status = 0) {
  return YAML::Load(output(arguments, status));
}

std::string refusal(const std::vector<std::string>& arguments) {
  std::ostringstream out;
  return complaint([&] { analyze(arguments, out); });
}

class Analyze : public testing::Test {
 protected:
  /// A file of the package with text after it. @returns the path of both.
  std::string file(const std::string& text, const std::vector<std::string>& before = {}) {
    std::string all;
    for (const std::string& name : before) all += readText(config(name));
    return directory_.write(std::to_string(++files_) + ".yaml", all + text);
  }

 private:
  TemporaryDirectory directory_;
  int files_ = 0;
};

TEST_F(Analyze, PrintsTheCertificate) {
  const YAML::Node printed = figures({config("improved.yaml"), "--plant", config("plant_model.yaml")});
  const NodeParameters file = readControllerFile(config("improved.yaml"));
  const Certificate expected = certify(std::get<ControllerParameters>(file.controller), file.geometry,
                                       readPlantModelFile(config("plant_model.yaml")));
  EXPECT_NEAR(printed["belief_spectral_radius"].as<double>(), expected.belief_spectral_radius, 1e-10);
  EXPECT_NEAR(printed["loop_spectral_radius"].as<double>(), expected.loop_spectral_radius, 1e-5);
  EXPECT_NEAR(printed["gain_margin"].as<double>(), expected.gain_margin, 1e-4);
  EXPECT_NEAR(printed["delay_margin_s"].as<double>(), expected.delay_margin, 1e-5);
  EXPECT_NEAR(printed["turn"]["spectral_radius"].as<double>(), expected.turn.spectral_radius, 1e-5);
  EXPECT_TRUE(printed["stable"].as<bool>());
  EXPECT_NE(printed["advice"].as<std::string>().find("Stable with room"), std::string::npos);
}

TEST_F(Analyze, SaysWhatTheFiguresMean) {
  const std::string text = output({config("standard.yaml")});
  for (const char* part : {"\nstable: true", "# s more dead time\n", "# x the action gain\n", "# driving straight\n",
                           "dead_time: 0.096", "Stable with room", "# delay margin "}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  }
}

TEST_F(Analyze, UnstableGainsAreAResultAndAnExitStatus) {
  std::string text = readText(config("improved.yaml"));
  text.replace(text.find("kappa_a: 8"), 10, "kappa_a: 60");
  const YAML::Node printed = figures({file(text)}, 1);
  EXPECT_FALSE(printed["stable"].as<bool>());
  EXPECT_NE(printed["advice"].as<std::string>().find("kappa_a = 60 is too large: stable below"), std::string::npos);
}

TEST_F(Analyze, ReadsTheConfigurationOfAPredictiveNodeThatKeepsItsSlip) {
  const std::vector<std::string> node{"predictive.yaml", "jackal.yaml", "plant_model.yaml"};
  EXPECT_TRUE(figures({file("slip: {file: /var/lib/jackal/slip.yaml}\n", node)})["stable"].as<bool>());
  EXPECT_NE(refusal({file("slip: {fil: /var/lib/jackal/slip.yaml}\n", node)}).find("slip.fil"), std::string::npos);
}

TEST_F(Analyze, CertifiesTheConfidenceBoxOfAnIdentifiedPlant) {
  const std::string model = "plant_model: {dead_time: 0.08, lag: 0.00636, velocity_loop_integral: 0.678";
  const std::string known = file(model + "}"),
                    narrow = file(model + ", dead_time_half_width: 0.01, gain_half_width: 0.05}"),
                    wide = file(model + ", dead_time_half_width: 0.01, gain_half_width: 2.0}");
  for (const char* preset : {"improved.yaml", "predictive.yaml"}) {
    EXPECT_FALSE(figures({config(preset), "--plant", known})["confidence_box"]) << preset;
    const YAML::Node printed = figures({config(preset), "--plant", narrow});
    const YAML::Node box = printed["confidence_box"];
    EXPECT_GE(box["loop_spectral_radius"].as<double>(), printed["loop_spectral_radius"].as<double>()) << preset;
    EXPECT_LT(box["gain_margin"].as<double>(), printed["gain_margin"].as<double>()) << preset;
    EXPECT_LT(box["delay_margin_s"].as<double>(), printed["delay_margin_s"].as<double>()) << preset;
    EXPECT_TRUE(box["stable"].as<bool>()) << preset;
  }
  const YAML::Node printed = figures({config("predictive.yaml"), "--plant", wide}, 1);
  EXPECT_TRUE(printed["stable"].as<bool>()) << "as the model says";
  EXPECT_FALSE(printed["confidence_box"]["stable"].as<bool>());
}

TEST_F(Analyze, SearchesAnIrregularClockWhereAsked) {
  // A robot with which the loop is unstable on a regular one, so that nothing has to be searched.
  const std::string slow = file("plant_model: {dead_time: 0.4, lag: 0.006, velocity_loop_integral: 0.7}\n");
  const std::string model = file(
      "predictive: {belief_rate: 1000, action_rate: 50, speed_process_noise: 0.01, disturbance_process_noise: 0.01,\n"
      "  dead_time_deviation: 0.03}\n"
      "plant_model: {dead_time: 0.08, lag: 0.006, velocity_loop_integral: 0.7}\n");
  const YAML::Node jitter = figures({model, "--plant", slow, "--jitter"}, 1)["jitter"];
  ASSERT_TRUE(jitter);
  EXPECT_EQ(jitter["sequences"].as<double>(), 10000.0);
  EXPECT_FALSE(jitter["any_phase"].as<bool>());
  EXPECT_EQ(jitter["jitter_margin_s"].as<double>(), 0.0);
  EXPECT_EQ(jitter["lost_samples"].as<double>(), 0.0);
  EXPECT_FALSE(figures({model, "--plant", slow}, 1)["jitter"]);
  EXPECT_NE(refusal({config("improved.yaml"), "--jitter"}).find("jitter"), std::string::npos);
}

TEST_F(Analyze, PredictiveModelOfTheConfigurationMayDifferFromThePlant) {
  const std::string robot = file("plant_model: {dead_time: 0.4, lag: 0.01}\n");
  const YAML::Node printed = figures({file("", {"predictive.yaml", "plant_model.yaml"}), "--plant", robot}, 1);
  EXPECT_FALSE(printed["stable"].as<bool>()) << "a dead time five times as long as believed";
  EXPECT_EQ(printed["robot"]["dead_time"].as<double>(), 0.4);
}

TEST_F(Analyze, BadInputGivesOneClearLine) {
  EXPECT_NE(refusal({}).find("CONFIG.yaml"), std::string::npos);
  EXPECT_NE(refusal({"/nowhere.yaml"}).find("/nowhere.yaml: cannot be read"), std::string::npos);
  EXPECT_NE(refusal({config("plant.yaml")}).find("controller."), std::string::npos);
  EXPECT_NE(
      refusal({config("improved.yaml"), "--plant", config("plant.yaml")}).find("plant.yaml: has no plant_model.*"),
      std::string::npos)
      << "parameters of the simulated robot";
  for (const auto& [plant, said] : {std::pair("", "no keys"),
                                    {"plant_model: {dead_time: 0.1, lag: -0.03}", "plant_model.lag = -0.03"},
                                    {"plant_model: {lag: 0.03}", "plant_model.dead_time: missing"}}) {
    EXPECT_NE(refusal({config("improved.yaml"), "--plant", file(plant)}).find(said), std::string::npos) << said;
  }
}

}  // namespace
}  // namespace jackal_aic
