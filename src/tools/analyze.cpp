#include "analyze.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/program_options.hpp>
#include <cmath>
#include <functional>
#include <ostream>
#include <variant>

#include "jackal_aic/certificate/certificate.hpp"
#include "jackal_aic/certificate/jitter_search.hpp"
#include "jackal_aic/config/yaml_text.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic {
namespace {

namespace po = boost::program_options;

struct Figure;

/// What is printed, as lines of a table or as an object of JSON.
using Figures = std::vector<Figure>;

/// One of it: its key in JSON, its name and unit in the table, its value; a group has figures of its own.
struct Figure {
  std::string key;
  std::string name;
  std::string unit;
  std::variant<double, bool, std::string, Figures> value;
};

/// {"key": value, ...} in one line, which YAML reads too.
std::string json(const Figures& figures) {
  struct Text {
    std::string operator()(double value) const { return std::isfinite(value) ? yamlNumber(value, 6) : "null"; }
    std::string operator()(bool value) const { return value ? "true" : "false"; }
    std::string operator()(const std::string& value) const { return yamlQuoted(value); }
    std::string operator()(const Figures& group) const { return json(group); }
  };
  std::string text;
  for (const Figure& figure : figures) {
    text += (text.empty() ? "" : ", ") + yamlQuoted(figure.key) + ": " + std::visit(Text{}, figure.value);
  }
  return "{" + text + "}";
}

/// A line for each figure: its name, its value, its unit; those of a group below its name.
std::string table(const Figures& figures, const std::string& indent = "") {
  constexpr std::size_t kNames = 40;  // columns
  std::string text;
  for (const Figure& figure : figures) {
    if (const auto* group = std::get_if<Figures>(&figure.value)) {
      if (!group->empty()) text += fmt::format("\n{}{}\n{}", indent, figure.name, table(*group, indent + "  "));
      continue;
    }
    struct Text {
      std::string operator()(double value) const { return std::isfinite(value) ? fmt::format("{:.6g}", value) : "any"; }
      std::string operator()(bool value) const { return value ? "yes" : "no"; }
      std::string operator()(const std::string& value) const { return value; }
      std::string operator()(const Figures&) const { return ""; }
    };
    const std::string value = std::visit(Text{}, figure.value);
    if (figure.name.empty()) {
      text += value + "\n\n";  // a sentence
      continue;
    }
    text +=
        fmt::format("{:<{}}{}{}{}\n", indent + figure.name, kNames, value, figure.unit.empty() ? "" : " ", figure.unit);
  }
  return text;
}

/// What the words of the table mean, and why the figures of an assumed model differ from its file.
std::string explanation(bool identified) {
  std::string text =
      "\nspectral radius  factor by which an error grows per common period; below 1 it dies out: stable\n"
      "gain margin      factor by which the action gain may rise before the loop oscillates\n"
      "delay margin     dead time that may be added before the loop oscillates\n"
      "common period    time after which the timers of belief, action and sensors stand as at its beginning\n";
  if (identified) return text;
  return text +
         "\nThe plant model is assumed, not identified. Its dead time and lag are taken 20 % and its gain 10 % larger "
         "than assumed:\n"
         "these values suit robots of half to twice the assumed times best. identify.launch replaces the assumption.\n";
}

/// A margin with its unit. @param largest margin that is searched for.
Figure marginFigure(const std::string& key, const std::string& name, const std::string& unit, double margin,
                    double largest) {
  return {key, name, margin < largest ? unit : unit + ", at least", margin};
}

/// @param largest_delay margin that is searched for [s].
Figures marginFigures(const Margins& margins, double largest_delay) {
  return {marginFigure("gain_margin", "gain margin", "x the action gain", margins.gain_margin, kLargestGainMargin),
          {"gain_reduction", "gain below which it is unstable", "x the action gain", margins.gain_reduction},
          marginFigure("delay_margin_s", "delay margin", "s more dead time", margins.delay_margin, largest_delay),
          {"delay_reduction_s", "delay reduction", "s less dead time", margins.delay_reduction}};
}

Figures modeFigures(const ModeCertificate& mode, double largest_delay) {
  Figures figures = marginFigures(mode, largest_delay);
  figures.insert(figures.begin(), {"spectral_radius", "spectral radius", "", mode.spectral_radius});
  return figures;
}

Figures plantFigures(const PlantModel& plant) {
  return {{"dead_time", "dead time", "s", plant.dead_time},
          {"lag", "lag", "s", plant.lag},
          {"gain", "gain", "", plant.gain},
          {"offset", "offset (no part of the linear loop)", "rad/s", plant.offset},
          {"velocity_loop_integral", "integral gain of the velocity loop", "1/s", plant.velocity_loop_integral},
          {"effective_track", "effective track (0: the controller's)", "m", plant.effective_track},
          {"on_box", "wheels in the air", "", plant.on_box},
          {"sensor_rate", "rate of the sensors", "Hz", plant.sensor_rate}};
}

/// What a tool has found: the figures, and whether the loop is stable.
struct Finding {
  Figures figures;
  bool stable = false;
};

/// A loop on another robot.
using LoopOn = std::function<LinearLoop(const PlantModel&)>;

/// The worst over the corners of an identified plant's confidence box; true if it is stable, or there is no box.
bool addBox(Figures& figures, const PlantModel& robot, const LoopOn& loop_on) {
  const std::vector<PlantModel> corners = confidenceBox(robot);
  if (corners.size() < 2) return true;
  double radius = 0.0, gain = kLargestGainMargin, delay = kLargestDelayMargin;
  bool stable = true;
  for (const PlantModel& corner : corners) {
    const Certificate certificate = certify(loop_on(corner));
    stable = stable && certificate.stable();
    radius = std::max(radius, certificate.loop_spectral_radius);
    gain = std::min(gain, certificate.gain_margin);
    delay = std::min(delay, certificate.delay_margin);
  }
  figures.push_back({"confidence_box", "at the worst corner of the plant's confidence box", "",
                     Figures{{"loop_spectral_radius", "spectral radius of the loop", "(stable below 1)", radius},
                             {"gain_margin", "gain margin", "x the action gain", gain},
                             {"delay_margin_s", "delay margin", "s more dead time", delay},
                             {"stable", "stable", "", stable}}});
  return stable;
}

/// Of a clock on which every period has a phase, a delay and maybe a lost sample of its own.
Figure jitterFigures(const LinearLoop& loop) {
  const JitterMargins margins = jitterMargins(loop);
  const Figures figures{
      {"sequences", "sequences searched, of each kind", "", static_cast<double>(kJitterSequences)},
      {"any_phase", "none grows with phases in any order", "", margins.any_phase},
      marginFigure("jitter_margin_s", "none grows with delays up to", "s more dead time", margins.delay,
                   kLongestJitter),
      marginFigure("lost_samples", "none grows with lost in a row", "samples", margins.lost, kMostLost)};
  return {"jitter", fmt::format("on an irregular clock (searched {} sequences, no proof)", kJitterSequences), "",
          figures};
}

Finding certificateOf(const LinearLoop& loop, const LoopOn& loop_on, bool jitter) {
  const Certificate certificate = certify(loop);
  Figures figures{
      {"belief_spectral_radius", "spectral radius of the belief", "", certificate.belief_spectral_radius},
      {"loop_spectral_radius", "spectral radius of the loop", "(stable below 1)", certificate.loop_spectral_radius},
      {"radius_uncertainty", "uncertainty of that", "", certificate.radius_uncertainty}};
  const double largest_delay = largestDelayMargin(loop);
  const Figures margins = marginFigures(certificate, largest_delay);
  figures.insert(figures.end(), margins.begin(), margins.end());
  figures.push_back({"stable", "stable", "", certificate.stable()});
  figures.push_back({"period_s", "common period of the timers", "s", certificate.period});
  if (loop.modes().size() > 1) {
    figures.push_back({"straight", "driving straight", "", modeFigures(certificate.straight, largest_delay)});
    figures.push_back({"turn", "turning", "", modeFigures(certificate.turn, largest_delay)});
  }
  const bool box_stable = addBox(figures, loop.robot(), loop_on);
  if (jitter) figures.push_back(jitterFigures(loop));
  if (loop.predictive()) {
    figures.push_back({"plant_model", "as the controller believes the robot", "", plantFigures(loop.model())});
    figures.push_back({"robot", "on the robot", "", plantFigures(loop.robot())});
  } else {
    figures.push_back({"plant_model", "on the robot", "", plantFigures(loop.robot())});
  }
  figures.insert(figures.begin(), {"advice", "", "", advice(certificate, loop)});
  return {figures, certificate.stable() && box_stable};
}

po::options_description optionsOfAnalyze() {
  po::options_description options("Options");
  options.add_options()("help,h", "print this text");
  options.add_options()(
      "config", po::value<std::string>(),
      "CONFIG.yaml: gains (controller.* or predictive.*), geometry (robot.*), the drive train that a predictive "
      "controller believes in (plant_model.*; by default the plant itself)");
  options.add_options()("plant", po::value<std::string>(),
                        "PLANT.yaml: a plant model (plant_model.*), as identify writes it; by default what "
                        "config/jackal_model.yaml assumes");
  options.add_options()(
      "jitter",
      "of a predictive controller: search 10,000 sequences of phases, delays and lost samples for one "
      "that grows; takes seconds");
  options.add_options()("json", "print one line of JSON instead of the table");
  return options;
}

}  // namespace

int analyze(const std::vector<std::string>& arguments, std::ostream& out) {
  const po::options_description options = optionsOfAnalyze();
  po::positional_options_description positional;
  positional.add("config", 1);
  po::variables_map given;
  po::store(po::command_line_parser(arguments).options(options).positional(positional).run(), given);
  if (given.count("help") > 0) {
    out << "analyze CONFIG.yaml [--plant PLANT.yaml] [--jitter] [--json]\n"
        << "Stability certificate of a controller: spectral radii, gain and delay margin. Exit status 1 if it is "
           "unstable.\n"
        << options;
    return 0;
  }
  if (given.count("config") == 0) throw ParameterError("CONFIG.yaml: missing; see analyze --help");
  const std::string path = given["config"].as<std::string>();
  // As the node that would drive it certifies it.
  PlantModel assumed;
  assumed.identified = false;
  const PlantModel given_plant =
      given.count("plant") > 0 ? readPlantModelFile(given["plant"].as<std::string>()) : assumed;
  const PlantModel plant = drivenModel(given_plant);
  const bool jitter = given.count("jitter") > 0;
  const ControllerFile file = readControllerFile(path);
  const auto loop_on = [&](const PlantModel& robot) {
    if (const auto* gains = std::get_if<ControllerParameters>(&file.controller)) {
      return LinearLoop(*gains, file.geometry, robot);
    }
    return LinearLoop(std::get<PredictiveParameters>(file.controller), file.model ? drivenModel(*file.model) : plant,
                      robot);
  };
  const LinearLoop loop = loop_on(plant);
  if (jitter && !loop.predictive()) throw ParameterError("jitter: only for the gains of predictive.*");
  const Finding finding = certificateOf(loop, loop_on, jitter);
  out << (given.count("json") > 0 ? json(finding.figures) + "\n"
                                  : table(finding.figures) + explanation(given_plant.identified));
  return finding.stable ? 0 : 1;
}

}  // namespace jackal_aic
