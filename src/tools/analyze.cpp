#include <fmt/format.h>

#include <algorithm>
#include <boost/algorithm/string/replace.hpp>
#include <boost/program_options.hpp>
#include <cmath>
#include <functional>
#include <ostream>
#include <variant>

#include "jackal_aic/certificate/certificate.hpp"
#include "jackal_aic/certificate/jitter_search.hpp"
#include "jackal_aic/config/yaml.hpp"
#include "parameters/node_parameters.hpp"
#include "programs.hpp"

namespace jackal_aic {
namespace {

namespace po = boost::program_options;

/// A figure as a line of YAML, with its meaning.
std::string line(const std::string& key, const std::string& value, const std::string& meaning) {
  return fmt::format("{:<31} # {}\n", key + ": " + value, meaning);
}
std::string number(const std::string& key, double value, const std::string& meaning) {
  return line(key, std::isfinite(value) ? yamlNumber(value, 6) : ".inf", meaning);
}
std::string flag(const std::string& key, bool value, const std::string& meaning) {
  return line(key, value ? "true" : "false", meaning);
}

/// Figures below a key.
std::string group(const std::string& key, const std::string& meaning, const std::string& figures) {
  return line(key, "", meaning) + "  " + boost::replace_all_copy(figures.substr(0, figures.size() - 1), "\n", "\n  ") +
         "\n";
}

/// Legend, and the reason why figures of an assumed model differ from its file.
std::string explanation(bool identified) {
  std::string text =
      "# spectral radius  factor by which an error grows per common period; below 1 it dies out: stable\n"
      "# gain margin      factor by which the action gain may rise before the loop oscillates\n"
      "# delay margin     dead time that may be added before the loop oscillates\n"
      "# common period    time after which the timers of belief, action and sensors stand as at its beginning\n";
  if (identified) return text;
  return text +
         "# The plant model is assumed, not identified. Its dead time and lag are taken 20 % and its gain 10 % larger "
         "than assumed:\n"
         "# these values suit robots of half to twice the assumed times best. identify.launch replaces the "
         "assumption.\n";
}

/// A margin. @param largest that is searched for.
std::string margin(const std::string& key, double value, double largest, const std::string& meaning) {
  return number(key, value, value < largest ? meaning : meaning + "; at least: no larger one is searched for");
}

/// @param largest_delay margin that is searched for [s].
std::string marginsOf(const Margins& margins, double largest_delay) {
  return margin("gain_margin", margins.gain_margin, kLargestGainMargin, "x the action gain") +
         number("gain_reduction", margins.gain_reduction, "x the action gain, below which it is unstable") +
         margin("delay_margin_s", margins.delay_margin, largest_delay, "s more dead time") +
         number("delay_reduction_s", margins.delay_reduction, "s less dead time");
}

std::string modeOf(const Margins& mode, double largest_delay) {
  return number("spectral_radius", mode.spectral_radius, "below 1: stable") + marginsOf(mode, largest_delay);
}

/// Result of the tool: figures as YAML, and whether the loop is stable.
struct Finding {
  std::string figures;
  bool stable = false;
};

/// A loop on another robot.
using LoopOn = std::function<LinearLoop(const PlantModel&)>;

/// The worst over the corners of an identified plant's confidence box; stable without a box.
Finding boxOf(const PlantModel& robot, const LoopOn& loop_on) {
  const std::vector<PlantModel> corners = confidenceBox(robot);
  if (corners.size() < 2) return {"", true};
  double radius = 0.0, gain = kLargestGainMargin, delay = kLargestDelayMargin;
  bool stable = true;
  for (const PlantModel& corner : corners) {
    const Certificate certificate = certify(loop_on(corner));
    stable = stable && certificate.stable();
    radius = std::max(radius, certificate.spectral_radius);
    gain = std::min(gain, certificate.gain_margin);
    delay = std::min(delay, certificate.delay_margin);
  }
  return {group("confidence_box", "at the worst corner of the plant's confidence box",
                number("loop_spectral_radius", radius, "below 1: stable") +
                    number("gain_margin", gain, "x the action gain") +
                    number("delay_margin_s", delay, "s more dead time") + flag("stable", stable, "at all corners")),
          stable};
}

/// Margins on an irregular clock: each period has its own phase, delay and possibly a lost sample.
std::string jitterOf(const LinearLoop& loop) {
  const JitterMargins margins = jitterMargins(loop);
  return group("jitter", fmt::format("on an irregular clock (searched {} sequences, no proof)", kJitterSequences),
               number("sequences", kJitterSequences, "searched, of each kind") +
                   flag("any_phase", margins.any_phase, "none grows with phases in any order") +
                   margin("jitter_margin_s", margins.delay, kLongestJitter, "s more dead time: none grows up to it") +
                   margin("lost_samples", margins.lost, kMostLost, "in a row: none grows up to it"));
}

Finding certificateOf(const LinearLoop& loop, const LoopOn& loop_on, bool jitter) {
  const Certificate certificate = certify(loop);
  const double largest_delay = largestDelayMargin(loop);
  std::string figures = "advice: " + yamlQuoted(advice(certificate, loop)) + "\n" +
                        number("belief_spectral_radius", certificate.belief_spectral_radius, "below 1: stable") +
                        number("loop_spectral_radius", certificate.spectral_radius, "below 1: stable") +
                        marginsOf(certificate, largest_delay) +
                        flag("stable", certificate.stable(), "the loop on this robot") +
                        number("period_s", certificate.period, "s, common period of the timers");
  if (loop.modes().size() > 1) {
    figures += group("straight", "driving straight", modeOf(certificate.straight, largest_delay)) +
               group("turn", "turning", modeOf(certificate.turn, largest_delay));
  }
  const Finding box = boxOf(loop.robot(), loop_on);
  figures += box.figures;
  if (jitter) figures += jitterOf(loop);
  if (loop.predictive()) {
    figures += "# as the controller believes the robot\n" + yamlBlock("plant_model", loop.model()) + "# the robot\n" +
               yamlBlock("robot", loop.robot());
  } else {
    figures += "# the robot\n" + yamlBlock("plant_model", loop.robot());
  }
  return {figures, certificate.stable() && box.stable};
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
  return options;
}

}  // namespace

int analyze(const std::vector<std::string>& arguments, std::ostream& out) {
  const po::options_description options = optionsOfAnalyze();
  const auto positional = po::positional_options_description().add("config", 1);
  po::variables_map given;
  po::store(po::command_line_parser(arguments).options(options).positional(positional).run(), given);
  if (given.count("help") > 0) {
    out << "analyze CONFIG.yaml [--plant PLANT.yaml] [--jitter]\n"
        << "Stability certificate of a controller as YAML: spectral radii, gain and delay margin. Exit status 1 if it "
           "is unstable.\n"
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
  NodeParameters file = readControllerFile(path);
  if (!file.plant_model) file.plant_model = given_plant;
  const auto loop_on = [&](const PlantModel& robot) { return closedLoop(file, robot); };
  const LinearLoop loop = loop_on(plant);
  if (jitter && !loop.predictive()) throw ParameterError("jitter: only for the gains of predictive.*");
  const Finding finding = certificateOf(loop, loop_on, jitter);
  out << finding.figures << explanation(given_plant.identified);
  return finding.stable ? 0 : 1;
}

}  // namespace jackal_aic
