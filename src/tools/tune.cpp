#include "tune.hpp"

#include <algorithm>
#include <boost/program_options.hpp>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <limits>
#include <ostream>
#include <regex>
#include <sstream>

#include "jackal_aic/yaml_text.hpp"
#include "package_files.hpp"
#include "progress_bar.hpp"

namespace jackal_aic {
namespace {

namespace po = boost::program_options;

std::string fixed(double value, int digits) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(digits) << value;
  return out.str();
}

std::string orDash(const std::optional<double>& value, int digits) { return value ? fixed(*value, digits) : "-"; }

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
  add("plant", po::value<std::string>(), "PLANT.yaml: a plant model (plant_model.*) or a simulated robot (plant.*)");
  add("out", po::value<std::string>(), "TUNED.yaml: preset to write");
  add("start", po::value<std::string>(), "CONFIG.yaml: gains to begin with, by default config/improved.yaml");
  add("overshoot", po::value<double>()->default_value(5.0), "largest overshoot of the step to 0.5 m/s [%]");
  add("gain-margin", po::value<double>()->default_value(2.0), "least gain margin");
  add("delay-margin", po::value<double>()->default_value(0.05), "least delay margin [s]");
  add("orders", po::value<std::string>()->default_value("1..5"), "generalised orders p to search, A or A..B");
  add("evaluations", po::value<int>()->default_value(300), "simulated candidates of each local search");
  add("linear-evaluations", po::value<int>()->default_value(20000),
      "candidates of each global search, on the linear model");
  add("seed", po::value<int>()->default_value(1), "of the global searches");
  add("jobs", po::value<int>()->default_value(0), "threads; 0 takes all cores (results do not differ)");
  add("share", po::value<std::string>()->default_value(""), "directory of the package's files");
  return options;
}

GainSearchTask readTask(const po::variables_map& given, const sim::PackageFiles& files) {
  GainSearchTask task;
  task.start = readControllerFile(given.count("start") > 0 ? given["start"].as<std::string>()
                                                           : files.path("config/improved.yaml"));
  task.plant = readPlantFile(given["plant"].as<std::string>());
  task.urdf = sim::readText(files.path("sim/urdf/jackal.urdf"));
  task.overshoot_pct = checked(given, "overshoot", {0.0, 100.0});
  task.margins.gain = checked(given, "gain-margin", {1.0, 100.0});
  task.margins.delay = checked(given, "delay-margin", {0.0, 0.9 * kLargestDelayMargin});
  std::tie(task.lowest_orders, task.highest_orders) = parseOrders(given["orders"].as<std::string>());
  task.evaluations = checkedWhole(given, "evaluations", {1, 1e6});
  task.linear_evaluations = checkedWhole(given, "linear-evaluations", {1, 1e8});
  task.seed = static_cast<std::uint64_t>(checkedWhole(given, "seed", {0, 1e9}));
  task.jobs = static_cast<unsigned>(checkedWhole(given, "jobs", {0, 1024}));
  return task;
}

/// The result with the fewest orders that keeps the bounds and settles at most 2 % later than the fastest that does,
/// which is no difference on a robot; nullptr if none keeps the bounds. Results are in order of their orders.
const GainAssessment* simplestOfTheFastest(const std::vector<GainSearchResult>& results) {
  double fastest = std::numeric_limits<double>::infinity();
  for (const GainSearchResult& result : results) {
    if (result.keeps_bounds) fastest = std::min(fastest, *result.best.responses[0].settling);
  }
  for (const GainSearchResult& result : results) {
    if (result.keeps_bounds && *result.best.responses[0].settling <= 1.02 * fastest) return &result.best;
  }
  return nullptr;
}

[[noreturn]] void refuse(const GainSearchTask& task) {
  std::ostringstream message;
  message << "no gains found that keep gain margin " << task.margins.gain << ", delay margin " << task.margins.delay
          << " s and overshoot " << task.overshoot_pct << " % and settle no later than the start at any speed; ask for "
          << "less, or search with more --evaluations";
  throw ParameterError(message.str());
}

/// The gains that are compared: the thesis' standard, those of the start, and the best of each number of orders.
std::string comparison(const GainSearchTask& task, const std::vector<GainSearchResult>& results,
                       const ControllerParameters& standard) {
  std::vector<std::pair<std::string, GainAssessment>> rows{{"standard", assessGains(task, standard)},
                                                           {"start", assessGains(task, task.start.controller)}};
  for (const GainSearchResult& result : results) {
    rows.emplace_back("orders " + std::to_string(result.orders) + (result.keeps_bounds ? "" : " (!)"), result.best);
  }
  return assessmentTable(rows);
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

}  // namespace

std::string presetText(const ControllerParameters& controller, const std::string& comment) {
  return "# " + comment + "\n" + yamlBlock("controller", controller);
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

std::string assessmentTable(const std::vector<std::pair<std::string, GainAssessment>>& rows) {
  std::ostringstream out;
  const auto line = [&](const std::vector<std::string>& cells) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      out << (i == 0 ? std::left : std::right) << std::setw(i == 0 ? 13 : 12) << cells[i];
    }
    out << "\n";
  };
  line({"controller", "step m/s", "settling s", "rise s", "overshoot %", "gain margin", "delay mg s"});
  for (const auto& [name, assessment] : rows) {
    for (std::size_t i = 0; i < assessment.speeds.size(); ++i) {
      const sim::ResponseMetrics& response = assessment.responses[i];
      line({name, fixed(assessment.speeds[i], 1), orDash(response.settling, 3), orDash(response.rise, 3),
            response.stable ? fixed(response.overshoot_pct, 1) : "unstable",
            fixed(assessment.certificate.gain_margin, 2), fixed(assessment.certificate.delay_margin, 3)});
    }
  }
  return out.str();
}

int tune(const std::vector<std::string>& arguments, std::ostream& out) {
  const po::options_description options = optionsOfTune();
  po::variables_map given;
  po::store(po::command_line_parser(arguments).options(options).positional({}).run(), given);
  if (given.count("help") > 0) {
    out << "tune --plant PLANT.yaml --out TUNED.yaml [--overshoot 5] [--gain-margin 2] [--delay-margin 0.05] "
           "[--orders 1..5]\n"
        << "Searches the gains that settle fastest after a step to 0.5 m/s.\n"
        << options;
    return 0;
  }
  for (const char* name : {"plant", "out"}) {
    if (given.count(name) == 0) throw ParameterError(std::string("--") + name + ": missing; see tune --help");
  }
  const sim::PackageFiles files(given["share"].as<std::string>());
  const GainSearchTask task = readTask(given, files);
  const std::string path = given["out"].as<std::string>();
  requireDirectoryOf(path);  // before the search, which takes minutes

  sim::ProgressBar bar("Searching", 100, true);
  std::size_t shown = 0;
  const auto results = searchGains(task, [&](std::size_t finished, std::size_t all) {
    const std::size_t percent = 100 * finished / all;
    if (percent != shown) bar.show(shown = percent);
  });
  out << comparison(task, results, readControllerFile(files.path("config/standard.yaml")).controller)
      << "(!) misses a bound\n";
  const GainAssessment* tuned = simplestOfTheFastest(results);
  if (tuned == nullptr) refuse(task);
  write(path, presetText(tuned->controller,
                         "Fastest gains that `tune` found; settling " + orDash(tuned->responses[0].settling, 3) +
                             " s at 0.5 m/s, gain margin " + fixed(tuned->certificate.gain_margin, 2) +
                             ", delay margin " + fixed(tuned->certificate.delay_margin, 3) + " s."));
  return 0;
}

}  // namespace jackal_aic
