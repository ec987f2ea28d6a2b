#include "commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/program_options.hpp>
#include <filesystem>
#include <iostream>

#include "baseline_table.hpp"
#include "belief_consistency.hpp"
#include "bounds.hpp"
#include "calibration.hpp"
#include "campaign.hpp"
#include "detection_table.hpp"
#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/text_file.hpp"
#include "odometry_table.hpp"
#include "progress_bar.hpp"
#include "quiet_hours.hpp"
#include "real_drives.hpp"
#include "robustness.hpp"
#include "stop_table.hpp"
#include "unidentified.hpp"

namespace jackal_aic::sim {
namespace {

namespace po = boost::program_options;

/// One command: how it is called, what it does, its options.
struct Command {
  const char* name;
  const char* usage;
  const char* purpose;
  void (*describe)(po::options_description&, po::positional_options_description&);
  int (*run)(const po::variables_map&);
};

/// The directory of --out, which is there afterwards. @throws ParameterError if it cannot be made: before a run of
/// minutes, not after it.
std::string outputDirectory(const po::variables_map& options) {
  const auto directory = options["out"].as<std::string>();
  createDirectory(directory);
  return directory;
}

PackageFiles packageFiles(const po::variables_map& options) { return PackageFiles(options["share"].as<std::string>()); }

unsigned jobs(const po::variables_map& options) {
  const int count = options["jobs"].as<int>();
  if (count < 0 || count > 1024) throw ParameterError(fmt::format("jobs = {}: must be in [0, 1024]", count));
  return static_cast<unsigned>(count);
}

void addJobs(po::options_description& options) {
  options.add_options()("jobs", po::value<int>()->default_value(0),
                        "threads; 0 takes all cores (results do not differ)");
}

void addSeed(po::options_description& options, const char* purpose) {
  options.add_options()("seed", po::value<std::int64_t>()->default_value(1), purpose);
}

std::uint64_t seed(const po::variables_map& options) {
  const auto value = options["seed"].as<std::int64_t>();
  if (value < 0) throw ParameterError(fmt::format("seed = {}: must be 0 or more", value));
  return static_cast<std::uint64_t>(value);
}

void addOverrides(po::options_description& options) {
  options.add_options()("set", po::value<std::vector<std::string>>()->composing(),
                        "key=value, e.g. plant.dead_time=0.14, controller.tau=0.01, or loop.phase=0.01, the age of the "
                        "newest measurement when the action is computed; may be repeated");
}

Overrides overrides(const po::variables_map& options) {
  Overrides overrides;
  if (options.count("set") == 0) return overrides;
  for (const auto& text : options["set"].as<std::vector<std::string>>()) overrides.push_back(parseOverride(text));
  return overrides;
}

// ---- list

void describeList(po::options_description&, po::positional_options_description&) {}

int list(const po::variables_map& options) {
  const PackageFiles files = packageFiles(options);
  const std::vector<ExperimentSummary> experiments = ExperimentTable(files).list();
  std::size_t width = 0;
  for (const ExperimentSummary& experiment : experiments) width = std::max(width, experiment.name.size());
  for (const ExperimentSummary& experiment : experiments) {
    std::cout << fmt::format("{:<{}}  {}", experiment.name, width, experiment.title);
    if (!experiment.figures.empty()) std::cout << fmt::format("  (figures {})", fmt::join(experiment.figures, ", "));
    std::cout << "\n";
  }
  return 0;
}

// ---- run

void describeRun(po::options_description& options, po::positional_options_description& positional) {
  options.add_options()("experiment", po::value<std::string>()->required(), "name of an experiment, or all");
  options.add_options()("out", po::value<std::string>()->required(), "directory for NAME.csv and NAME_traces.csv");
  options.add_options()("shard", po::value<std::string>()->default_value("1/1"), "K/N: run only the K-th of N parts");
  addJobs(options);
  positional.add("experiment", 1);
}

int run(const po::variables_map& options) {
  const PackageFiles files = packageFiles(options);
  const ExperimentTable table(files);
  std::vector<std::string> names{options["experiment"].as<std::string>()};
  if (names.front() == "all") {
    names.clear();
    for (const auto& experiment : table.list()) names.push_back(experiment.name);
  }
  const std::string directory = outputDirectory(options);
  const Shard shard = Shard::parse(options["shard"].as<std::string>());
  runCampaign(table, names, directory, shard, jobs(options), true);
  for (const std::string& name : names) {
    std::cout << fmt::format("Wrote {0}/{1}{2}.csv and {1}_traces{2}.csv\n", directory, name, shard.suffix());
  }
  return 0;
}

// ---- merge

void describeMerge(po::options_description& options, po::positional_options_description& positional) {
  options.add_options()("directory", po::value<std::vector<std::string>>()->required(), "directories with shards");
  options.add_options()("out", po::value<std::string>()->required(), "directory for the joined files");
  positional.add("directory", -1);
}

int merge(const po::variables_map& options) {
  for (const auto& name :
       mergeShards(options["directory"].as<std::vector<std::string>>(), options["out"].as<std::string>())) {
    std::cout << name << "\n";
  }
  return 0;
}

// ---- step and square

void addLoopOptions(po::options_description& options) {
  options.add_options()("controller", po::value<std::string>()->required(),
                        "diff_drive, standard, improved, tuned, predictive or FILE.yaml");
  options.add_options()("plant", po::value<std::string>()->required(), "box, ground, real or FILE.yaml");
  addOverrides(options);
  options.add_options()("csv", po::value<std::string>(),
                        "file for the row of results; - prints it; by default a short table is printed");
  options.add_options()("trace", po::value<std::string>(), "file for the time series");
}

void runLoop(const po::variables_map& options, const std::string& name, const SetPointProfile& profile) {
  const PackageFiles files = packageFiles(options);
  const LoopSetup setup =
      loadSetup(files, options["controller"].as<std::string>(), options["plant"].as<std::string>(), overrides(options));
  RunResult result = runSetup(setup, profile);
  result.row.experiment = name;
  if (options.count("csv") > 0) {
    writeText(options["csv"].as<std::string>(), resultHeader() + resultLine(result.row));
  } else {
    std::cout << resultText(result.row);
  }
  if (options.count("trace") > 0) writeText(options["trace"].as<std::string>(), traceHeader() + traceLines(0, result));
}

void describeStep(po::options_description& options, po::positional_options_description&) {
  addLoopOptions(options);
  options.add_options()("step", po::value<double>()->default_value(0.0),
                        "forward speed [m/s]; what is assessed if not 0");
  options.add_options()("turn", po::value<double>()->default_value(0.0), "yaw rate [rad/s]");
  options.add_options()("duration", po::value<double>()->default_value(4.0), "length of the response [s]");
}

int step(const po::variables_map& options) {
  runLoop(options, "step",
          stepProfile(options["step"].as<double>(), options["turn"].as<double>(), options["duration"].as<double>()));
  return 0;
}

void describeSquare(po::options_description& options, po::positional_options_description&) {
  addLoopOptions(options);
  options.add_options()("min", po::value<double>()->required(), "lower forward speed [m/s]");
  options.add_options()("max", po::value<double>()->required(), "upper forward speed [m/s]");
  options.add_options()("period", po::value<double>()->default_value(4.0), "period [s]");
  options.add_options()("cycles", po::value<int>()->default_value(3),
                        "periods; the second rise from min to max is assessed");
}

int square(const po::variables_map& options) {
  runLoop(options, "square",
          squareProfile({options["min"].as<double>(), options["max"].as<double>(), options["period"].as<double>(),
                         options["cycles"].as<int>()}));
  return 0;
}

// ---- calibrate

void describeCalibrate(po::options_description& options, po::positional_options_description&) {
  options.add_options()("plant", po::value<std::string>()->default_value("all"), "box, ground or all");
  options.add_options()("out", po::value<std::string>()->required(), "directory for plant_box.yaml and plant.yaml");
  options.add_options()("evaluations", po::value<int>()->default_value(200),
                        "of the global and of the local search each");
  options.add_options()("leave-one-out", "also the error of each table by a fit to the others");
  addJobs(options);
}

void printResiduals(const PackageFiles& files, const CalibrationTask& task, const PlantParameters& plant,
                    unsigned jobs) {
  for (const auto& table : task.tables) {
    const auto rows = residuals(files, {table}, plant, jobs);
    std::cout << fmt::format("Table {}: mean |ln(ours/thesis)| {:.3f}\n", table, meanError(rows));
    for (const Residual& row : rows) {
      std::cout << fmt::format("  {:<6} {:<9} settling {:5.2f} (thesis {:5.2f})  rise {:5.2f} (thesis {:5.2f})\n",
                               row.thesis.row, row.thesis.column, row.settling.value_or(NAN),
                               row.thesis.settling.value_or(NAN), row.rise.value_or(NAN),
                               row.thesis.rise.value_or(NAN));
    }
  }
}

/// Each table by the plant fitted to the others, set out from the one fitted to all.
void printLeaveOneOut(const PackageFiles& files, const CalibrationTask& task, const PlantParameters& plant,
                      int evaluations, unsigned jobs) {
  double sum = 0.0;
  for (const auto& table : task.tables) {
    const double error = leaveOneOutError(files, task, table, plant, evaluations, jobs);
    std::cout << fmt::format("Table {} by a fit to the others: mean |ln(ours/thesis)| {:.3f}\n", table, error)
              << std::flush;
    sum += error;
  }
  std::cout << fmt::format("mean over the tables {:.3f}\n", sum / static_cast<double>(task.tables.size()));
}

int calibratePlants(const po::variables_map& options) {
  const PackageFiles files = packageFiles(options);
  const auto wanted = options["plant"].as<std::string>();
  const int evaluations = options["evaluations"].as<int>();
  if (evaluations < 1) throw ParameterError(fmt::format("evaluations = {}: must be 1 or more", evaluations));
  if (wanted != "box" && wanted != "ground" && wanted != "all") {
    throw ParameterError("plant = " + quoted(wanted) + ": unknown; known: box, ground, all");
  }
  for (const CalibrationTask& task : calibrationTasks()) {
    if (wanted != "all" && wanted != task.plant) continue;
    ProgressBar bar("calibrate " + task.plant, static_cast<std::size_t>(2 * evaluations + 1), true);
    const Calibration found = calibrate(files, task, evaluations, jobs(options), [&](int count, double error) {
      bar.show(static_cast<std::size_t>(count), fmt::format("error {:.6f}", error));
    });
    const auto file = std::filesystem::path(outputDirectory(options)) / task.file;
    writeText(file.string(), withFittedValues(readText(files.path("config/" + task.file)), task, found.plant));
    std::cout << file.string() << "\n";
    printResiduals(files, task, found.plant, jobs(options));
    if (options.count("leave-one-out") > 0) {
      printLeaveOneOut(files, task, found.plant, evaluations, jobs(options));
    }
  }
  return 0;
}

// ---- detection

void describeDetection(po::options_description& options, po::positional_options_description&) {
  options.add_options()("out", po::value<std::string>(), "directory for detection.csv and alarms.csv");
  options.add_options()("quiet-hours", po::value<double>(),
                        "instead: hours of driving without a fault, 30 minutes each drive, drawn by seed");
  addSeed(options, "of the quiet hours");
  options.add_options()("unidentified", "quiet hours of robots that have not been identified");
  options.add_options()("plant", po::value<std::string>(),
                        "real: the quiet hours or the table on that plant; by default on box and ground");
  addJobs(options);
}

int detect(const po::variables_map& options) {
  if (options.count("out") == options.count("quiet-hours")) {
    throw ParameterError("detection: needs either --out or --quiet-hours");
  }
  const bool named = options.count("plant") > 0;
  const std::string plant = named ? options["plant"].as<std::string>() : "";
  if (named && plant != "real") throw ParameterError("plant = " + quoted(plant) + ": unknown; known: real");
  const World world = named ? World::real : World::simple;
  if (options.count("quiet-hours") > 0) {
    const auto robots = options.count("unidentified") > 0 ? QuietRobots::unidentified : QuietRobots::identified;
    runQuietHours(packageFiles(options), options["quiet-hours"].as<double>(), seed(options), robots, jobs(options),
                  world);
    return 0;
  }
  writeDetectionTables(packageFiles(options), outputDirectory(options), jobs(options), world);
  return 0;
}

// ---- stops

void describeStops(po::options_description& options, po::positional_options_description&) {
  options.add_options()("out", po::value<std::string>()->required(), "directory for stops.csv");
  addOverrides(options);
  addJobs(options);
}

int stops(const po::variables_map& options) {
  const std::size_t missed =
      writeStopTable(packageFiles(options), outputDirectory(options), overrides(options), jobs(options));
  std::cout << missed << " of " << stopCases().size() << " do not keep their bars\n";
  return missed == 0 ? 0 : 1;
}

// ---- bounds

void describeBounds(po::options_description& options, po::positional_options_description&) {
  options.add_options()("out", po::value<std::string>()->required(), "directory for bounds.csv");
  addJobs(options);
}

int compareWithBounds(const po::variables_map& options) {
  const std::size_t missed = writeBoundsTable(packageFiles(options), outputDirectory(options), jobs(options));
  std::cout << "predictive misses " << missed << " bars\n";
  return 0;
}

// ---- baselines

void describeBaselines(po::options_description& options, po::positional_options_description&) {
  options.add_options()("out", po::value<std::string>()->required(),
                        "directory for baselines.csv and baselines_driven.csv");
  addJobs(options);
}

int compareWithBaselines(const po::variables_map& options) {
  writeBaselineTables(packageFiles(options), outputDirectory(options), jobs(options));
  return 0;
}

// ---- robustness

void describeRobustness(po::options_description& options, po::positional_options_description&) {
  options.add_options()("draws", po::value<std::int64_t>()->default_value(1000), "robots that are drawn");
  addSeed(options, "of the first; the others follow");
  options.add_options()("out", po::value<std::string>()->required(),
                        "directory for robustness.csv and soft_motors.csv");
  addJobs(options);
}

int assessRobustness(const po::variables_map& options) {
  constexpr std::int64_t kMost = 1000000;
  const auto draws = options["draws"].as<std::int64_t>();
  if (draws < 1 || draws > kMost) throw ParameterError(fmt::format("draws = {}: must be in [1, {}]", draws, kMost));
  writeRobustnessTable(packageFiles(options), static_cast<std::size_t>(draws), seed(options), outputDirectory(options),
                       jobs(options));
  return 0;
}

// ---- unidentified

void describeUnidentified(po::options_description& options, po::positional_options_description&) {
  options.add_options()("controller", po::value<std::string>()->default_value("predictive"), "a preset or FILE.yaml");
  options.add_options()("minutes", po::value<double>()->default_value(30.0), "of joystick driving, each robot");
  addSeed(options, "of joystick and noise");
  options.add_options()("out", po::value<std::string>()->required(), "directory for unidentified.csv");
  addJobs(options);
}

int driveUnidentifiedRobots(const po::variables_map& options) {
  const double minutes = options["minutes"].as<double>();
  if (!(minutes > 0.0 && minutes <= 1e4)) {
    throw ParameterError(fmt::format("minutes = {:g}: must be in (0, 10000]", minutes));
  }
  std::cout << writeUnidentifiedTable(packageFiles(options), options["controller"].as<std::string>(), 60.0 * minutes,
                                      seed(options), outputDirectory(options), jobs(options))
            << " in " << minutes << " minutes each\n";
  return 0;
}

// ---- odometry

void describeOdometry(po::options_description& options, po::positional_options_description&) {
  options.add_options()("out", po::value<std::string>()->required(), "directory for odometry.csv and belief.csv");
  addJobs(options);
}

int assessOdometry(const po::variables_map& options) {
  writeOdometryTable(packageFiles(options), outputDirectory(options), jobs(options));
  writeConsistencyTable(packageFiles(options), outputDirectory(options), jobs(options));
  return 0;
}

// ---- real

void describeReal(po::options_description& options, po::positional_options_description&) {
  options.add_options()("data", po::value<std::string>()->required(),
                        "directory with recordings of real robots, husky*.csv and warthog*.csv");
  options.add_options()("csv", po::value<std::string>()->default_value(""), "file for the rows of the table");
  addJobs(options);
}

int replayRecordings(const po::variables_map& options) {
  const auto directory = options["data"].as<std::string>();
  if (!std::filesystem::exists(directory)) {
    std::cout << "skipped: " << quoted(directory) << " is absent; recordings of real robots come with no package\n";
    return 0;
  }
  std::cout << replayRealDrives(packageFiles(options), directory, options["csv"].as<std::string>(), jobs(options))
            << "\n";
  return 0;
}

constexpr Command kCommands[] = {
    {"list", "list", "names the experiments", describeList, list},
    {"run", "run NAME|all --out DIR [--jobs N] [--shard K/N]", "runs experiments and writes their results as CSV",
     describeRun, run},
    {"merge", "merge DIR... --out DIR", "joins the shards of a campaign", describeMerge, merge},
    {"step", "step --controller NAME|FILE --plant NAME|FILE --step V [--turn W] [--set KEY=VALUE ...]",
     "runs one step response", describeStep, step},
    {"square", "square --controller NAME|FILE --plant NAME|FILE --min V --max V [--set KEY=VALUE ...]",
     "runs one square wave", describeSquare, square},
    {"detection", "detection --out DIR | --quiet-hours N [--seed S] [--unidentified] [--plant real] [--jobs N]",
     "times to find a fault, and false alarms of ten minutes of driving, or of hours", describeDetection, detect},
    {"stops", "stops --out DIR [--jobs N] [--set KEY=VALUE ...]",
     "overshoot and running back of every preset, from rest to a set point and back to rest", describeStops, stops},
    {"bounds", "bounds --out DIR [--jobs N]",
     "steps and disturbances of every preset, in multiples of what no controller can beat", describeBounds,
     compareWithBounds},
    {"baselines", "baselines --out DIR [--jobs N]",
     "predictive compared with published controllers of a plant with dead time, all tuned under the same margins",
     describeBaselines, compareWithBaselines},
    {"unidentified", "unidentified --out DIR [--controller NAME] [--minutes M] [--seed S] [--jobs N]",
     "joystick driving of robots that have not been identified: which oscillate, which are called faulty",
     describeUnidentified, driveUnidentifiedRobots},
    {"robustness", "robustness --out DIR [--draws N] [--seed S] [--jobs N]",
     "a step by every preset on robots drawn over everything in which a real one differs from its model, and turns "
     "with soft "
     "motors",
     describeRobustness, assessRobustness},
    {"odometry", "odometry --out DIR [--jobs N]",
     "drift of the odometry by the metre, ours and the stock controller's, over the same drives", describeOdometry,
     assessOdometry},
    {"real", "real --data DIR [--csv FILE] [--jobs N]",
     "recordings of real robots through the drive loop: false alarms, and what is learned of the slip", describeReal,
     replayRecordings},
    {"calibrate", "calibrate --out DIR [--plant box|ground|all]", "fits the plants to the thesis' tables",
     describeCalibrate, calibratePlants},
};

std::string overview() {
  std::string text = "The thesis' experiments on the simulated Jackal, without ROS.\n\n";
  for (const Command& command : kCommands) {
    text += "  experiments " + std::string(command.usage) + "\n      " + command.purpose + "\n";
  }
  return text +
         "\n--help after a command lists its options.\n"
         "Campaigns on many cores or machines:\n"
         "  parallel experiments run all --out DIR --shard {}/8 ::: $(seq 8) && experiments merge DIR --out DIR\n"
         "  sbatch --array=1-8 --wrap 'experiments run all --out DIR --shard $SLURM_ARRAY_TASK_ID/8'\n";
}

std::string optionNames(const po::options_description& options) {
  std::string names;
  for (const auto& option : options.options()) names += (names.empty() ? "--" : ", --") + option->long_name();
  return names;
}

int dispatch(const Command& command, const std::vector<std::string>& arguments) {
  po::options_description options("Options");
  po::positional_options_description positional;
  command.describe(options, positional);
  options.add_options()("share", po::value<std::string>()->default_value(""), "directory of the package's files");
  options.add_options()("help", "shows this");
  po::variables_map values;
  try {
    // Abbreviations are refused: a new option must not change what an old command line means.
    const int style = po::command_line_style::default_style & ~po::command_line_style::allow_guessing;
    po::store(po::command_line_parser(arguments).options(options).positional(positional).style(style).run(), values);
    if (values.count("help") > 0) {
      std::cout << "experiments " << command.usage << "\n" << command.purpose << "\n\n" << options;
      return 0;
    }
    po::notify(values);
  } catch (const po::error& error) {
    throw ParameterError(std::string(command.name) + ": " + error.what() + "; options: " + optionNames(options));
  }
  return command.run(values);
}

}  // namespace

int runCommand(const std::vector<std::string>& arguments) {
  if (arguments.empty() || arguments[0] == "--help" || arguments[0] == "-h") {
    std::cout << overview();
    return arguments.empty() ? 1 : 0;
  }
  std::string names;
  for (const Command& command : kCommands) {
    if (arguments[0] == command.name) return dispatch(command, {arguments.begin() + 1, arguments.end()});
    names += (names.empty() ? "" : ", ") + std::string(command.name);
  }
  throw ParameterError("command = " + quoted(arguments[0]) + ": unknown; known: " + names);
}

}  // namespace jackal_aic::sim
