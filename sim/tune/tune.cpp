#include "tune.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/program_options.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <limits>
#include <ostream>
#include <regex>

#include "jackal_aic/config/text_file.hpp"
#include "jackal_aic/config/yaml_text.hpp"
#include "package_files.hpp"
#include "progress_bar.hpp"

namespace jackal_aic {
namespace {

namespace po = boost::program_options;

double checked(const po::variables_map& given, const char* name, Bounds bounds) {
  ParameterMap map;
  double value = given[name].as<double>();
  map.set(name, value);
  ParameterReader(map, "").field(name, value, bounds, "", Presence::required);
  return value;
}

int checkedWhole(const po::variables_map& given, const char* name, Bounds bounds) {
  ParameterMap map;
  int value = given[name].as<int>();
  map.set(name, static_cast<std::int64_t>(value));
  ParameterReader(map, "").field(name, value, bounds, "", Presence::required);
  return value;
}

po::options_description optionsOfTune() {
  po::options_description options("Options");
  auto add = options.add_options();
  add("help,h", "print this text");
  add("plant", po::value<std::vector<std::string>>()->composing(),
      "PLANT.yaml: a plant model (plant_model.*) or a simulated robot (plant.*); may be repeated: the gains have to "
      "hold "
      "on each");
  add("out", po::value<std::string>(), "TUNED.yaml: preset to write");
  add("start", po::value<std::string>()->default_value("improved"),
      "gains to begin with, which also choose the structure: a preset (improved, predictive, ...) or CONFIG.yaml");
  add("judge", po::value<std::string>(), "a preset or CONFIG.yaml: say what these gains do instead of searching any");
  add("overshoot", po::value<double>()->default_value(10.0),
      "largest overshoot of the robot as it is [%]; half as much again with its spread");
  add("gain-margin", po::value<double>()->default_value(2.0), "least gain margin");
  add("delay-margin", po::value<double>()->default_value(0.05, "0.05"), "least delay margin [s]");
  add("orders", po::value<std::string>()->default_value("1..5"), "generalised orders p to search, A or A..B");
  add("evaluations", po::value<int>()->default_value(80), "simulated candidates of each round of a local search");
  add("linear-evaluations", po::value<int>()->default_value(4000),
      "candidates of each global search, on the linear models");
  add("draws", po::value<int>()->default_value(50), "random trials of each robot that gains have to pass");
  add("seed", po::value<int>()->default_value(1), "of the global searches and of the random trials");
  add("jobs", po::value<int>()->default_value(0), "threads; 0 takes all cores (results do not differ)");
  add("share", po::value<std::string>()->default_value(""), "directory of the package's files");
  return options;
}

/// Gains by the name of a preset of the package, or by the path of a file.
ControllerFile readPreset(const std::string& preset, const sim::PackageFiles& files) {
  const bool is_name = std::regex_match(preset, std::regex("[a-z_]+"));
  return readControllerFile(is_name ? files.path("config/" + preset + ".yaml") : preset);
}

GainSearchTask readTask(const po::variables_map& given, const sim::PackageFiles& files) {
  GainSearchTask task;
  task.start = readPreset(given["start"].as<std::string>(), files);
  for (const std::string& path : given["plant"].as<std::vector<std::string>>()) {
    task.robots.push_back({std::filesystem::path(path).stem().string(), readPlantFile(path)});
  }
  task.urdf = readText(files.path("sim/urdf/jackal.urdf"));
  task.overshoot_pct = checked(given, "overshoot", {0.0, 100.0});
  task.margins.gain = checked(given, "gain-margin", {1.0, 100.0});
  task.margins.delay = checked(given, "delay-margin", {0.0, 0.9 * kLargestDelayMargin});
  std::tie(task.lowest_orders, task.highest_orders) = parseOrders(given["orders"].as<std::string>());
  task.evaluations = checkedWhole(given, "evaluations", {1, 1e6});
  task.linear_evaluations = checkedWhole(given, "linear-evaluations", {1, 1e8});
  task.draws = checkedWhole(given, "draws", {0, 1e6});
  task.seed = static_cast<std::uint64_t>(checkedWhole(given, "seed", {0, 1e9}));
  task.jobs = static_cast<unsigned>(checkedWhole(given, "jobs", {0, 1024}));
  return task;
}

/// The result with the fewest orders that misses nothing and settles at most 2 % later than the fastest that does,
/// which is no difference on a robot; nullptr if each misses something. Results are in order of their orders.
const GainSearchResult* simplestOfTheFastest(const std::vector<GainSearchResult>& results) {
  double fastest = std::numeric_limits<double>::infinity();
  for (const GainSearchResult& result : results) {
    if (result.best.missed.empty()) fastest = std::min(fastest, result.best.settling());
  }
  for (const GainSearchResult& result : results) {
    if (result.best.missed.empty() && result.best.settling() <= 1.02 * fastest) return &result;
  }
  return nullptr;
}

/// What the tuned gains gain, in a sentence.
std::string verdict(const GainSearchTask& task, const GainAssessment& tuned) {
  const GainAssessment start = assessGains(task, task.start.controller, task.jobs);
  const std::string before = start.missed.empty()
                                 ? fmt::format("the gains at the start take {:.2f} s", start.settling())
                                 : fmt::format("the gains at the start fail {} of the trials", start.missed.size());
  return fmt::format("The tuned gains settle at {:g} m/s in {:.2f} s at most and pass every trial; {}.", task.speed,
                     tuned.settling(), before);
}

[[noreturn]] void refuse(const GainSearchTask& task, const std::vector<GainSearchResult>& results) {
  const GainAssessment* nearest = &results.front().best;
  for (const GainSearchResult& result : results) {
    if (result.best.missed.size() < nearest->missed.size()) nearest = &result.best;
  }
  throw ParameterError(fmt::format(
      "no gains found that keep gain margin {:g}, delay margin {:g} s and overshoot {:g} % in every trial (nearest, "
      "with {} missed: {}); ask for less, or search with more --evaluations",
      task.margins.gain, task.margins.delay, task.overshoot_pct, nearest->missed.size(), nearest->missed.front()));
}

/// What a tuned file holds for, in lines.
std::string promise(const GainSearchTask& task, const GainAssessment& tuned) {
  std::string text = fmt::format(
      "Fastest gains that `tune` found. What they do, driven at 0.1..2 m/s, 0.5..2 rad/s, on arcs and to a stop, for\n"
      "every phase of the timers, on the robots below as they are / with encoder steps up to 0.1 rad/s, samples up to\n"
      "10 ms late, dead time +- 10 ms, lag x 0.7..1.4, gain x 0.95..1.05, acceleration limit x 0.5..2 ({} random "
      "draws):",
      task.draws);
  for (std::size_t i = 0; i < task.robots.size(); ++i) {
    const RobotAssessment& robot = tuned.robots[i];
    const sim::StopFigures &nominal = robot.as_it_is, &others = robot.otherwise;
    text += fmt::format(
        "\n{}: settles at {:g} m/s in {:.2f}..{:.2f} s; overshoot <= {:.1f} / {:.1f} %; beyond zero after a stop <= "
        "{:.3f} / {:.3f} m/s, {:.3f} / {:.3f} rad/s;\n  ripple of the command <= {:.3f} / {:.3f} rad/s rms; gain "
        "margin {:.2f}, delay margin {:.3f} s",
        task.robots[i].name, task.speed, robot.settling_first, robot.settling_last, nominal.overshoot_pct,
        others.overshoot_pct, nominal.beyond_mps, others.beyond_mps, nominal.beyond_radps, others.beyond_radps,
        nominal.ripple, others.ripple, robot.margins.gain_margin, robot.margins.delay_margin);
  }
  return text;
}

/// The gains that are compared: the thesis' standard, those of the start, and the best of each number of orders.
std::string comparison(const GainSearchTask& task, const std::vector<GainSearchResult>& results,
                       const Gains& standard) {
  std::vector<std::pair<std::string, GainAssessment>> rows{
      {"standard", assessGains(task, standard, task.jobs)},
      {"start", assessGains(task, task.start.controller, task.jobs)}};
  for (const GainSearchResult& result : results) {
    rows.emplace_back(result.name, result.best);
  }
  return assessmentTable(task, rows);
}

void requireDirectoryOf(const std::string& path) {
  const auto directory = std::filesystem::absolute(path).parent_path();
  if (!std::filesystem::is_directory(directory)) {
    throw ParameterError(path + ": cannot be written: no directory " + directory.string());
  }
}

void write(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  if (!file || !(file << text) || !file.flush()) throw ParameterError(path + ": cannot be written");
}

/// Says what gains do; returns 1 if they miss anything.
int judge(const GainSearchTask& task, const Gains& controller, std::ostream& out) {
  const GainAssessment assessment = assessGains(task, controller, task.jobs);
  out << assessmentTable(task, {{"judged", assessment}});
  out << (assessment.missed.empty() ? std::string("These gains pass every trial.\n")
                                    : fmt::format("These gains fail {} of the trials:\n", assessment.missed.size()));
  for (const std::string& missed : assessment.missed) out << "  " << missed << "\n";
  return assessment.missed.empty() ? 0 : 1;
}

}  // namespace

std::string timeLeft(double elapsed, std::size_t finished, std::size_t all) {
  if (finished == 0 || finished >= all) return "";
  const double left = elapsed * static_cast<double>(all - finished) / static_cast<double>(finished);
  return left < 60.0 ? fmt::format("about {:.0f} s left", left) : fmt::format("about {:.0f} min left", left / 60.0);
}

std::string presetText(const Gains& controller, const std::string& comment) {
  struct Block {
    std::string operator()(const ControllerParameters& gains) const { return yamlBlock("controller", gains); }
    std::string operator()(const PredictiveParameters& gains) const { return yamlBlock("predictive", gains); }
  };
  return "# " + std::regex_replace(comment, std::regex("\n"), "\n# ") + "\n" + std::visit(Block{}, controller);
}

std::pair<int, int> parseOrders(const std::string& text) {
  std::smatch match;
  if (std::regex_match(text, match, std::regex("([0-5])(?:\\.\\.([0-5]))?"))) {
    const int low = std::stoi(match[1]);
    const int high = match[2].matched ? std::stoi(match[2]) : low;
    if (low <= high) return {low, high};
  }
  throw ParameterError("orders = '" + text + "': expected A or A..B with 0 <= A <= B <= 5");
}

std::string assessmentTable(const GainSearchTask& task,
                            const std::vector<std::pair<std::string, GainAssessment>>& rows) {
  std::string text;
  const auto line = [&text](const std::vector<std::string>& cells) {
    text += fmt::format("{:<12}{:<12}", cells[0], cells[1]);
    for (std::size_t i = 2; i < cells.size(); ++i) text += fmt::format("{:>15}", cells[i]);
    text += "\n";
  };
  line({"controller", "robot", "settling s", "overshoot %", "runs back m/s", "back rad/s", "ripple rad/s",
        "gain margin", "delay margin s", "missed"});
  const auto both = [](double as_it_is, double otherwise) {
    return fmt::format("{:.3f} / {:.3f}", as_it_is, otherwise);
  };
  for (const auto& [name, assessment] : rows) {
    for (std::size_t i = 0; i < assessment.robots.size(); ++i) {
      const RobotAssessment& robot = assessment.robots[i];
      const sim::StopFigures &nominal = robot.as_it_is, &others = robot.otherwise;
      line({name, task.robots[i].name, fmt::format("{:.2f}..{:.2f}", robot.settling_first, robot.settling_last),
            fmt::format("{:.1f} / {:.1f}", nominal.overshoot_pct, others.overshoot_pct),
            both(nominal.beyond_mps, others.beyond_mps), both(nominal.beyond_radps, others.beyond_radps),
            both(nominal.ripple, others.ripple), fmt::format("{:.2f}", robot.margins.gain_margin),
            fmt::format("{:.3f}", robot.margins.delay_margin),
            robot.missed > 0 ? fmt::format("{}", robot.missed) : ""});
    }
  }
  for (const auto& [name, assessment] : rows) {
    if (!assessment.missed.empty()) text += fmt::format("{} misses, first, {}\n", name, assessment.missed.front());
  }
  return text;
}

int tune(const std::vector<std::string>& arguments, std::ostream& out) {
  const po::options_description options = optionsOfTune();
  po::variables_map given;
  po::store(po::command_line_parser(arguments).options(options).positional({}).run(), given);
  if (given.count("help") > 0) {
    out << "tune --plant PLANT.yaml [--plant ...] --out TUNED.yaml [--overshoot 10] [--gain-margin 2] "
           "[--delay-margin 0.05] [--orders 1..5]\n"
        << "Searches the gains that settle fastest after a step to 0.5 m/s and pass everything that users drive. Takes "
           "one or two minutes for each robot on two cores.\n"
        << options;
    return 0;
  }
  const bool judges = given.count("judge") > 0;
  for (const char* name : {"plant", "out"}) {
    if (given.count(name) > 0 || (judges && std::string(name) == "out")) continue;
    throw ParameterError(std::string("--") + name + ": missing; see tune --help");
  }
  const sim::PackageFiles files(given["share"].as<std::string>());
  const GainSearchTask task = readTask(given, files);
  if (judges) return judge(task, readPreset(given["judge"].as<std::string>(), files).controller, out);
  const std::string path = given["out"].as<std::string>();
  requireDirectoryOf(path);  // before the search, which takes minutes

  const bool predictive = std::holds_alternative<PredictiveParameters>(task.start.controller);
  const std::string searched =
      predictive ? "the predictive gains" : fmt::format("orders {}..{}", task.lowest_orders, task.highest_orders);
  out << fmt::format("Searching {} on {} robot{}, {} candidates each: this takes minutes, the bar says how many\n",
                     searched, task.robots.size(), task.robots.size() == 1 ? "" : "s",
                     (predictive ? 0 : task.linear_evaluations) + task.evaluations)
      << std::flush;
  sim::ProgressBar bar("Searching", 100, true);
  std::size_t shown = 0;
  const auto begin = std::chrono::steady_clock::now();
  const auto results = searchGains(task, [&](std::size_t finished, std::size_t all) {
    const std::size_t percent = 100 * finished / all;
    if (percent == shown) return;
    shown = percent;
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
    bar.show(percent, timeLeft(elapsed.count(), finished, all));
  });
  const GainSearchResult* tuned = simplestOfTheFastest(results);
  out << comparison(task, results, readPreset("standard", files).controller);
  if (tuned == nullptr) refuse(task, results);
  write(path, presetText(tuned->best.controller, promise(task, tuned->best)));
  out << verdict(task, tuned->best) << "\n"
      << fmt::format("Wrote {} ({}). Next:\n    roslaunch jackal_aic simulation.launch preset:={}\n", path, tuned->name,
                     std::filesystem::absolute(path).string());
  return 0;
}

}  // namespace jackal_aic
