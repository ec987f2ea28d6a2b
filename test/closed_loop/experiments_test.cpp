// The experiments program: tables, campaigns, shards, searches, fit, command line.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "calibration.hpp"
#include "campaign.hpp"
#include "commands.hpp"
#include "jackal_aic/config/text_file.hpp"
#include "parallel.hpp"
#include "usable_range.hpp"
#include "yaml_fields.hpp"

namespace jackal_aic::sim {
namespace {

namespace fs = std::filesystem;

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

/// A directory of its own for every test, gone afterwards.
class Experiments : public ::testing::Test {
 protected:
  Experiments() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    directory_ =
        fs::temp_directory_path() / (std::string("jackal_aic_") + test->name() + "_" + std::to_string(getpid()));
    fs::remove_all(directory_);
    fs::create_directories(directory_);
  }
  ~Experiments() override { fs::remove_all(directory_); }

  std::string path(const std::string& name) const { return (directory_ / name).string(); }

  fs::path directory_;
};

std::string complaint(const std::vector<std::string>& arguments) {
  try {
    runCommand(arguments);
  } catch (const ParameterError& error) {
    return error.what();
  }
  return "accepted";
}

bool startsWith(const std::string& text, const std::string& start) { return text.rfind(start, 0) == 0; }

/// Every map `set` in a part of the table, with what a loop with it throws.
void expectReadable(const YAML::Node& node, int& sets) {
  if (node.IsMap() && node["set"]) {
    const Overrides overrides = readOverrides(node["set"], "");
    const auto begins = [&](const char* prefix) {
      return std::any_of(overrides.begin(), overrides.end(),
                         [&](const auto& o) { return o.first.rfind(prefix, 0) == 0; });
    };
    const char* controller = begins("controller.") ? "standard" : "predictive";
    EXPECT_NO_THROW(loadSetup(files(), controller, "ground", overrides)) << node;
    ++sets;
  }
  for (const auto& child : node) expectReadable(node.IsMap() ? child.second : YAML::Node(child), sets);
}

TEST_F(Experiments, EveryOverrideOfTheTableIsRead) {
  int sets = 0;
  expectReadable(YAML::LoadFile(files().path("sim/experiments/experiments.yaml")), sets);
  EXPECT_GT(sets, 40);
}

TEST_F(Experiments, EveryTableWithResultsIsRunAndHasItsRows) {
  const ExperimentTable table(files());
  const ThesisTables thesis(files().path("sim/thesis/tables.yaml"));
  EXPECT_EQ(table.runs("table_3-1b").size(), thesis.steps("3-1b").size());
  for (const char* name : {"3-1a", "5-1", "5-2", "5-4", "5-5", "5-6", "5-9"}) {
    EXPECT_EQ(table.runs(std::string("table_") + name).size(), 2 * thesis.steps(name).size()) << name;
  }
  EXPECT_EQ(table.runs("table_5-10").size(), 3u * 2u * 2u);
  EXPECT_EQ(table.runs("table_5-7").size(), 4u * 4u + 2u * 2u);
}

TEST_F(Experiments, RowsCarryTheThesisValues) {
  const ResultRow row = ExperimentTable(files()).runs("table_5-9").back()().row;
  EXPECT_EQ(row.experiment, "table_5-9");
  EXPECT_EQ(row.controller, "improved");
  EXPECT_EQ(row.integrator, "exact");
  EXPECT_DOUBLE_EQ(row.thesis_settling_s.value(), 0.51);
  EXPECT_DOUBLE_EQ(row.thesis_rise_s.value(), 0.19);
}

TEST_F(Experiments, RunsNeedNothingBesideThemselves) {
  const auto runs = ExperimentTable(PackageFiles(JACKAL_AIC_SOURCE_DIR)).runs("table_5-9");
  EXPECT_EQ(resultLine(runs.back()().row), resultLine(ExperimentTable(files()).runs("table_5-9").back()().row));
}

TEST_F(Experiments, JobsAndShardsDoNotChangeTheFiles) {
  const ExperimentTable table(files());
  const std::vector<std::string> names{"table_5-9", "figure_4-5"};
  runCampaign(table, names, path("one"), {}, 1, false);
  runCampaign(table, names, path("many"), {}, 4, false);
  for (std::size_t k = 1; k <= 3; ++k) runCampaign(table, names, path("shards"), {k, 3}, 0, false);
  EXPECT_EQ(mergeShards({path("shards")}, path("merged")), (std::vector<std::string>{"figure_4-5", "table_5-9"}));
  for (const char* file : {"table_5-9.csv", "table_5-9_traces.csv", "figure_4-5.csv", "figure_4-5_traces.csv"}) {
    const std::string whole = readText(path(std::string("one/") + file));
    EXPECT_EQ(whole, readText(path(std::string("many/") + file))) << file;
    EXPECT_EQ(whole, readText(path(std::string("merged/") + file))) << file;
  }
}

TEST_F(Experiments, MergeNoticesWhatIsMissingOrTwice) {
  writeText(path("a.1-of-2.csv"), resultHeader());
  EXPECT_EQ(complaint({"merge", directory_.string(), "--out", path("out")}), "a: shard 2 of 2 is missing");
  fs::create_directories(path("again"));
  writeText(path("again/a.1-of-2.csv"), resultHeader());
  EXPECT_NE(complaint({"merge", directory_.string(), path("again"), "--out", path("out")}).find("there twice"),
            std::string::npos);
  fs::create_directories(path("empty"));
  EXPECT_EQ(complaint({"merge", path("empty"), "--out", path("out")}), "merge: no files NAME.K-of-N.csv found");
  EXPECT_FALSE(fs::exists(path("out"))) << "nothing is made before it is needed";
}

TEST_F(Experiments, StepWritesOneRowAndItsTrace) {
  ASSERT_EQ(runCommand({"step", "--controller", "improved", "--plant", "box", "--step", "0.5", "--set",
                        "controller.tau=0.01", "--set", "plant.dead_time=0.05", "--csv", path("row.csv"), "--trace",
                        path("trace.csv"), "--share", JACKAL_AIC_SOURCE_DIR}),
            0);
  const std::string text = readText(path("row.csv"));
  EXPECT_TRUE(startsWith(text, resultHeader()));
  EXPECT_TRUE(startsWith(text.substr(resultHeader().size()), "step,improved,box,0.5,0,1000,50,exact,0.01,0.1,8,3,"))
      << text;
  EXPECT_TRUE(startsWith(readText(path("trace.csv")), traceHeader()));
}

/// Settings and figures of a result row: all up to the thesis' own, without the name of the experiment.
std::string figuresOf(const std::string& line) {
  std::size_t end = 0;
  for (int i = 0; i < 17; ++i) end = line.find(',', end) + 1;
  return line.substr(line.find(','), end - line.find(','));
}

TEST_F(Experiments, AStepAsPrintedIsTheRowOfTheReport) {
  const ThesisTables thesis(files().path("sim/thesis/tables.yaml"));
  int rows = 0;
  for (const char* name : {"3-1a", "5-9"}) {
    const auto runs = ExperimentTable(files()).runs(std::string("table_") + name);
    const auto steps = thesis.steps(name);
    ASSERT_EQ(runs.size(), 2 * steps.size());
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const ThesisStep& step = steps[i / 2];
      const RunResult result = runs[i]();
      std::vector<std::string> arguments{"step",
                                         "--controller",
                                         step.controller,
                                         "--plant",
                                         step.plant,
                                         "--step",
                                         std::to_string(step.step),
                                         "--csv",
                                         path("row.csv"),
                                         "--share",
                                         JACKAL_AIC_SOURCE_DIR,
                                         "--set",
                                         "controller.printed=true",
                                         "--set",
                                         "controller.integrator=" + result.row.integrator};
      for (const auto& [key, value] : step.overrides) arguments.insert(arguments.end(), {"--set", key + "=" + value});
      ASSERT_EQ(runCommand(arguments), 0);
      EXPECT_EQ(figuresOf(readText(path("row.csv")).substr(resultHeader().size())), figuresOf(resultLine(result.row)));
      ++rows;
    }
  }
  EXPECT_GT(rows, 8);
}

TEST_F(Experiments, AStepIsPrintedAsAShortTableUnlessARowIsAskedFor) {
  testing::internal::CaptureStdout();
  const int status = runCommand(
      {"step", "--controller", "predictive", "--plant", "box", "--step", "0.5", "--share", JACKAL_AIC_SOURCE_DIR});
  const std::string text = testing::internal::GetCapturedStdout();
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(startsWith(text, "experiment          step\ncontroller          predictive\n")) << text;
  EXPECT_NE(text.find("\nsettling_s          0."), std::string::npos) << text;
  EXPECT_EQ(text.find("thesis"), std::string::npos) << "nothing that the row does not have:\n" << text;
}

TEST_F(Experiments, CommandLineErrorsAreOneLineWithTheValidNames) {
  const std::vector<std::string> share{"--share", JACKAL_AIC_SOURCE_DIR};
  const auto with_share = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), share.begin(), share.end());
    return complaint(arguments);
  };
  EXPECT_EQ(complaint({"fly"}),
            "command = 'fly': unknown; known: list, run, merge, step, square, detection, stops, bounds, baselines, "
            "unidentified, robustness, odometry, real, calibrate");
  EXPECT_TRUE(startsWith(with_share({"run", "table_9", "--out", path("x")}),
                         "experiment = 'table_9': unknown; known: all, table_3-1a"));
  EXPECT_TRUE(
      startsWith(with_share({"run", "all"}), "run: the option '--out' is required but missing; options: --experiment"));
  EXPECT_TRUE(startsWith(with_share({"run", "all", "--ou", path("x")}), "run: unrecognised option '--ou'; options:"));
  EXPECT_EQ(with_share({"run", "all", "--out", path("x"), "--shard", "3/2"}),
            "shard = '3/2': expected K/N with 1 <= K <= N <= 100000");
  EXPECT_EQ(with_share({"run", "all", "--out", path("x"), "--jobs", "-1"}), "jobs = -1: must be in [0, 1024]");
  EXPECT_TRUE(startsWith(with_share({"step", "--controller", "improved", "--plant", "box"}), "step = 0: must be"));
  for (const char* speed : {"nan", "1e+300", "11"}) {
    EXPECT_TRUE(startsWith(with_share({"step", "--controller", "improved", "--plant", "box", "--step", speed}),
                           std::string("step = ") + speed))
        << speed;
  }
  EXPECT_TRUE(startsWith(
      with_share({"step", "--controller", "improved", "--plant", "box", "--step", "1", "--turn", "51"}), "turn = 51"));
  EXPECT_EQ(complaint({"fl\033y"}).find('\033'), std::string::npos) << "a terminal obeys it";
  EXPECT_EQ(with_share({"robustness", "--out", path("x"), "--draws", "0"}), "draws = 0: must be in [1, 1000000]");
  EXPECT_EQ(with_share({"robustness", "--out", path("x"), "--draws", "-1"}), "draws = -1: must be in [1, 1000000]");
  for (const char* command : {"robustness", "unidentified"}) {
    EXPECT_EQ(with_share({command, "--out", path("x"), "--seed", "-1"}), "seed = -1: must be 0 or more") << command;
  }
  const auto square = [&](const char* low, const char* high) {
    return with_share({"square", "--controller", "improved", "--plant", "box", "--min", low, "--max", high});
  };
  EXPECT_EQ(square("nan", "1"), "min = nan: must be within +-10 m/s");
  EXPECT_EQ(square("0", "1e+300"), "max = 1e+300: must be within +-10 m/s and different from min");
  EXPECT_EQ(square("1", "1"), "max = 1: must be within +-10 m/s and different from min");
  EXPECT_TRUE(startsWith(with_share({"step", "--controller", "improved", "--plant", "box", "--step", "fast"}),
                         "step: the argument ('fast')"));
  EXPECT_TRUE(startsWith(
      with_share({"step", "--controller", "improved", "--plant", "box", "--step", "1", "--csv", "/nonexistent/x"}),
      "'/nonexistent/x': cannot be written"));
  EXPECT_EQ(with_share({"calibrate", "--out", path(""), "--plant", "moon"}),
            "plant = 'moon': unknown; known: box, ground, all");
  EXPECT_TRUE(startsWith(complaint({"list", "--share", "/nonexistent"}), "share = '/nonexistent': holds no"));
}

TEST_F(Experiments, HelpNeedsNothingElse) {
  for (const char* command : {"list", "run", "merge", "step", "square", "calibrate"}) {
    ::testing::internal::CaptureStdout();
    EXPECT_EQ(runCommand({command, "--help"}), 0);
    EXPECT_TRUE(startsWith(::testing::internal::GetCapturedStdout(), std::string("experiments ") + command));
  }
}

TEST(ParallelFor, RunsEveryTaskOnceAndPassesOnTheFirstError) {
  std::vector<int> runs(100, 0);
  std::size_t finished = 0;
  parallelFor(
      100, 8, [&](std::size_t i) { ++runs[i]; }, [&](std::size_t n) { finished = n; });
  EXPECT_EQ(runs, std::vector<int>(100, 1));
  EXPECT_EQ(finished, 100u);
  EXPECT_THROW(parallelFor(10, 4,
                           [](std::size_t i) {
                             if (i == 3) throw std::runtime_error("three");
                           }),
               std::runtime_error);
}

TEST(SearchLimit, FindsTheFirstLimitOnTheWayUpAndDown) {
  const RangeLimit up = searchLimit(1.0, 1000.0, [](double v) { return v < 37.0 || v > 100.0; });
  EXPECT_NEAR(up.value, 37.0, 0.4);
  EXPECT_LT(up.value, 37.0);
  EXPECT_FALSE(up.at_bound);
  const RangeLimit down = searchLimit(1.0, 1e-4, [](double v) { return v > 0.02; });
  EXPECT_NEAR(down.value, 0.02, 2e-4);
  EXPECT_FALSE(down.at_bound);
}

TEST(SearchLimit, SaysWhenThereIsNone) {
  const RangeLimit none = searchLimit(1.0, 50.0, [](double) { return true; });
  EXPECT_TRUE(none.at_bound);
  EXPECT_DOUBLE_EQ(none.value, 50.0);
}

TEST(UsableRange, EulersLimitsAgreeWithTheSpectralRadiusAndTheThesis) {
  const auto limits = ThesisTables(files().path("sim/thesis/tables.yaml")).limits("5-7");
  const auto found = [&](std::size_t row, Integrator integrator) {
    std::vector<ResultRow> rows;
    for (const sim::Run& run : usableRangeRuns(files(), limits[row], integrator)) rows.push_back(run().row);
    return rows;
  };
  const auto kappa_mu =
      found(2, Integrator::euler);  // 50 Hz; the thesis says 0.1, h kappa_mu Pi_mu / tau^2 = 2 at 0.135
  ASSERT_EQ(kappa_mu.size(), 2u);
  EXPECT_NEAR(*kappa_mu[1].kappa_mu, 0.12, 0.02);
  EXPECT_NEAR(*kappa_mu[0].kappa_mu / *kappa_mu[1].kappa_mu, 1.0, 0.05);
  EXPECT_TRUE(kappa_mu[1].plant.empty());
  const auto exact = found(2, Integrator::exact);
  EXPECT_DOUBLE_EQ(*exact[1].kappa_mu, 1000.0);
}

TEST(Residual, ErrorIsTheLogarithmOfTheRatio) {
  ThesisStep step;
  step.settling = 0.8;
  step.rise = 0.4;
  const Residual residual{step, Integrator::euler, 0.4, std::nullopt};
  EXPECT_EQ(residual.errors().size(), 2u);
  EXPECT_DOUBLE_EQ(residual.errors()[0], std::log(2.0));
  EXPECT_DOUBLE_EQ(residual.errors()[1], kMissing);
  EXPECT_DOUBLE_EQ(meanError({residual}), 0.5 * (std::log(2.0) + kMissing));
  EXPECT_THROW(meanError({}), ParameterError);
}

TEST(LoadSetup, TakesTheConfigurationOfANodeAsAController) {
  for (const std::string preset : {"standard", "predictive"}) {
    const std::string path = testing::TempDir() + "node" + std::to_string(getpid()) + ".yaml";
    std::ofstream(path) << readText(files().path("config/jackal.yaml"))
                        << readText(files().path("config/" + preset + ".yaml"))
                        << readText(files().path("config/plant_model.yaml"))
                        << (preset == "predictive" ? "slip: {file: /var/lib/jackal/slip.yaml}\n" : "");
    const LoopSetup setup = loadSetup(files(), path, "ground", {});
    unlink(path.c_str());
    EXPECT_EQ(std::holds_alternative<PredictiveParameters>(setup.drive.controller), preset == "predictive");
    EXPECT_EQ(setup.drive.geometry.effective_track, 0.5621);
  }
}

TEST(LoadSetup, RefusesAnOverrideThatTheBaselineDoesNotHeed) {
  EXPECT_THROW(loadSetup(files(), "diff_drive", "ground", {{"robot.effective_track", "0.7"}}), ParameterError);
  EXPECT_EQ(loadSetup(files(), "diff_drive", "ground", {{"diff_drive.effective_track", "0.7"}})
                .drive.geometry.effective_track,
            0.7);
}

TEST(LoadSetup, SimulatesTheRobotOfAPlantModelAndTellsThePredictiveController) {
  const std::string path = testing::TempDir() + "my_jackal.yaml";
  std::ofstream(path) << "plant_model:\n  robot: mine\n  dead_time: 0.15\n  lag: 0.12\n  gain: 0.9\n"
                         "  acceleration_limit: 3.0\n";
  for (const char* controller : {"predictive", "improved"}) {
    const LoopSetup setup = loadSetup(files(), controller, path, {});
    EXPECT_EQ(setup.plant.dead_time, 0.15) << controller;
    EXPECT_EQ(setup.plant.motor_lag, 0.12) << controller;
    EXPECT_EQ(setup.plant.wheel_gain, 0.9) << controller;
    EXPECT_EQ(setup.plant.acceleration_limit, 3.0) << controller;
    ASSERT_TRUE(setup.drive.plant_model) << controller;
    EXPECT_EQ(setup.drive.plant_model->dead_time, 0.15) << controller;
    EXPECT_EQ(setup.drive.plant_model->lag, 0.12) << controller;
  }
  EXPECT_EQ(loadSetup(files(), "predictive", path, {{"plant.dead_time", "0.2"}}).plant.dead_time, 0.2);
  std::remove(path.c_str());
}

TEST(CalibratedFile, KeepsEverythingButTheFittedValues) {
  const CalibrationTask& task = calibrationTasks().front();
  const std::string before = readText(files().path("config/" + task.file));
  PlantParameters plant;
  plant.dead_time = 0.123;
  plant.motor_lag = 0.0456;
  plant.velocity_loop_integral = 7.89;
  const std::string after = withFittedValues(before, task, plant);
  EXPECT_NE(after.find("  dead_time: 0.123 "), std::string::npos);
  EXPECT_NE(after.find("  velocity_loop_integral: 7.89 "), std::string::npos);
  EXPECT_EQ(std::count(after.begin(), after.end(), '\n'), std::count(before.begin(), before.end(), '\n'));
  EXPECT_EQ(withFittedValues(after, task, plant), after);
  EXPECT_THROW(withFittedValues("plant:\n", task, plant), ParameterError);
}

TEST(CalibratedFile, ASearchFindsAPlantThatFitsBetterThanItsStart) {
  CalibrationTask task = calibrationTasks().front();
  task.tables = {"5-9"};
  const PlantParameters start = loadSetup(files(), "diff_drive", "box", {{"plant.dead_time", "0.2"}}).plant;
  const Calibration found = calibrate(files(), task, 6, 0);
  EXPECT_LT(found.error, meanError(residuals(files(), task.tables, start, 0)));
  const Calibration again = calibrate(files(), task, 6, 1);
  EXPECT_DOUBLE_EQ(found.plant.dead_time, again.plant.dead_time);
  EXPECT_DOUBLE_EQ(found.error, again.error);
}

}  // namespace
}  // namespace jackal_aic::sim
