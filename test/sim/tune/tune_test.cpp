#include "tune.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "jackal_aic/config/text_file.hpp"
#include "package_files.hpp"

namespace jackal_aic {
namespace {

const std::string kPackage = JACKAL_AIC_SOURCE_DIR;
const std::string kBox = kPackage + "/config/plant_box.yaml";

/// A directory that goes with the test.
class Tune : public testing::Test {
 protected:
  Tune() {
    char name[] = "/tmp/tune_test_XXXXXX";
    directory_ = mkdtemp(name);
  }
  ~Tune() override { std::filesystem::remove_all(directory_); }

  std::string file(const std::string& name) const { return directory_ + "/" + name; }

  static std::string complaint(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--share", kPackage, "--linear-evaluations", "300"});
    std::ostringstream out;
    try {
      tune(arguments, out);
    } catch (const ParameterError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      return error.what();
    }
    ADD_FAILURE() << "accepted: " << out.str();
    return "";
  }

  std::string directory_;
};

TEST_F(Tune, WritesAPresetThatSaysForWhatItHolds) {
  std::ostringstream out;
  const std::vector<std::string> arguments{
      "--plant", kBox,      "--out", file("tuned.yaml"), "--orders", "1", "--evaluations", "3", "--linear-evaluations",
      "800",     "--draws", "3",     "--share",          kPackage};
  ASSERT_EQ(tune(arguments, out), 0) << out.str();
  const auto tuned = std::get<ControllerParameters>(readControllerFile(file("tuned.yaml")).controller);
  EXPECT_EQ(tuned.orders, 1);
  EXPECT_EQ(tuned.belief_rate, 1000.0);
  for (const char* word : {"standard", "start", "orders 1", "plant_box", "gain margin", "ripple",
                           "Searching orders 1..1 on 1 robot, 803 candidates", "Wrote "}) {
    EXPECT_NE(out.str().find(word), std::string::npos) << word << " in\n" << out.str();
  }
  const std::string text = readText(file("tuned.yaml"));
  for (const char* word :
       {"0.1..2 m/s", "encoder steps up to 0.1 rad/s", "plant_box: settles at 0.5 m/s", "delay margin"}) {
    EXPECT_NE(text.find(word), std::string::npos) << word << " in\n" << text;
  }
}

TEST_F(Tune, TunesThePredictivePreset) {
  std::string slow = readText(kPackage + "/config/predictive.yaml");
  const std::string key = "reference_time: ";
  slow.replace(slow.find(key) + key.size(), 4, "0.05");
  std::ofstream(file("slow.yaml")) << slow;
  std::ostringstream out;
  ASSERT_EQ(tune({"--plant", kPackage + "/config/plant.yaml", "--start", file("slow.yaml"), "--out", file("mine.yaml"),
                  "--evaluations", "1", "--draws", "0", "--share", kPackage},
                 out),
            0)
      << out.str();
  EXPECT_NE(out.str().find("Searching the predictive gains on 1 robot"), std::string::npos) << out.str();
  const auto tuned = std::get<PredictiveParameters>(readControllerFile(file("mine.yaml")).controller);
  EXPECT_EQ(tuned.belief_rate, 1000.0);
  EXPECT_LE(tuned.reference_time, 0.05);
}

TEST(TuneProgress, SaysHowLongItTakes) {
  EXPECT_EQ(timeLeft(3.0, 0, 100), "");
  EXPECT_EQ(timeLeft(10.0, 25, 100), "about 30 s left");
  EXPECT_EQ(timeLeft(60.0, 10, 100), "about 9 min left");
  EXPECT_EQ(timeLeft(60.0, 100, 100), "");
}

TEST(AssessmentTable, MarksOnlyTheRowThatMisses) {
  GainSearchTask task;
  task.robots.resize(2);
  task.robots[0].name = "first";
  task.robots[1].name = "second";
  GainAssessment assessment;
  assessment.robots.resize(2);
  assessment.robots[1].missed = 3;
  assessment.missed = {"second: margins", "second: a", "second: b"};
  std::istringstream table(assessmentTable(task, {{"tuned", assessment}}));
  std::vector<std::string> lines;
  for (std::string line; std::getline(table, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_EQ(lines[1].back(), ' ') << lines[1];
  EXPECT_EQ(lines[2].substr(lines[2].size() - 2), " 3") << lines[2];
  EXPECT_EQ(lines[3], "tuned misses, first, second: margins");
}

TEST_F(Tune, GainsThatMissAnythingAreNoResult) {
  const std::string line = complaint({"--plant", kBox, "--out", file("none.yaml"), "--orders", "1", "--evaluations",
                                      "1", "--draws", "0", "--gain-margin", "90"});
  EXPECT_NE(line.find("no gains found that keep gain margin 90"), std::string::npos) << line;
  EXPECT_NE(line.find(" missed: plant_box"), std::string::npos) << line;
  EXPECT_FALSE(std::filesystem::exists(file("none.yaml")));
}

TEST_F(Tune, JudgesGains) {
  std::ostringstream out;
  const std::vector<std::string> improved{"--plant", kBox, "--judge", kPackage + "/config/improved.yaml",
                                          "--draws", "0",  "--share", kPackage};
  EXPECT_EQ(tune(improved, out), 0) << out.str();
  std::vector<std::string> strict = improved;
  strict.insert(strict.end(), {"--overshoot", "3"});
  EXPECT_EQ(tune(strict, out), 1);
  EXPECT_NE(out.str().find("phase 0.019 s: overshoots by"), std::string::npos) << out.str();
}

TEST_F(Tune, BadInputGivesOneClearLine) {
  const std::string out = file("out.yaml");
  EXPECT_NE(complaint({"--out", out}).find("--plant: missing"), std::string::npos);
  EXPECT_NE(complaint({"--plant", kBox}).find("--out: missing"), std::string::npos);
  EXPECT_NE(complaint({"--plant", file("no.yaml"), "--out", out}).find("cannot be read"), std::string::npos);
  EXPECT_NE(complaint({"--plant", kBox, "--out", out, "--orders", "3..1"}).find("orders = '3..1'"), std::string::npos);
  EXPECT_NE(complaint({"--plant", kBox, "--out", out, "--overshoot", "-1"}).find("overshoot = -1"), std::string::npos);
  EXPECT_NE(complaint({"--plant", kBox, "--out", out, "--evaluations", "0"}).find("evaluations = 0"),
            std::string::npos);
  std::ofstream(file("negative.yaml")) << "plant_model: {dead_time: 0.1, lag: -0.03}";
  EXPECT_NE(complaint({"--plant", file("negative.yaml"), "--out", out}).find("plant_model.lag = -0.03"),
            std::string::npos);
  EXPECT_NE(complaint({"--plant", kBox, "--out", out, "--start", "diff_drive"}).find("expected gains"),
            std::string::npos);
  EXPECT_NE(complaint({"--plant", kBox, "--out", out, "--start", "nonesuch"}).find("does not exist"),
            std::string::npos);
  EXPECT_NE(complaint({"--plant", kBox, "--out", file("no/such/out.yaml")}).find("cannot be written"),
            std::string::npos);
}

TEST(ParseOrders, TakesOneOrARange) {
  EXPECT_EQ(parseOrders("2"), std::pair(2, 2));
  EXPECT_EQ(parseOrders("1..5"), std::pair(1, 5));
  for (const char* bad : {"", "6", "1..6", "5..1", "1-5", "a"}) EXPECT_THROW(parseOrders(bad), ParameterError) << bad;
}

TEST(PresetText, ReadsBackAsTheSameGains) {
  ControllerParameters gains;
  gains.belief_rate = 1000;
  gains.integrator = Integrator::exact;
  gains.orders = 2;
  gains.tau = 0.01234;
  gains.kappa_mu = 1.5e-3;
  gains.kappa_a = 11.25;
  gains.state_variances = {0.01, 2.0, 1e6};
  gains.sensory_variances = {2.0, 0.0625, 3.5e7};
  char path[] = "/tmp/preset_test_XXXXXX";
  close(mkstemp(path));
  std::ofstream(path) << presetText(gains, "comment");
  const auto read = std::get<ControllerParameters>(readControllerFile(path).controller);
  std::filesystem::remove(path);
  EXPECT_EQ(read.orders, 2);
  EXPECT_EQ(read.tau, gains.tau);
  EXPECT_EQ(read.kappa_mu, gains.kappa_mu);
  EXPECT_EQ(read.kappa_a, gains.kappa_a);
  EXPECT_EQ(read.state_variances, gains.state_variances);
  EXPECT_EQ(read.sensory_variances, gains.sensory_variances);
}

}  // namespace
}  // namespace jackal_aic
