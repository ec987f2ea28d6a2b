#include "analyze.hpp"

#include <boost/program_options.hpp>
#include <cmath>
#include <ostream>
#include <utility>

#include "jackal_aic/certificate/advice.hpp"
#include "jackal_aic/config/yaml_text.hpp"
#include "tool_files.hpp"

namespace jackal_aic {
namespace {

namespace po = boost::program_options;

/// Keys and finished values, printed as YAML or as JSON.
using Fields = std::vector<std::pair<std::string, std::string>>;

std::string number(double value) { return std::isfinite(value) ? yamlNumber(value, 6) : "null"; }

std::string boolean(bool value) { return value ? "true" : "false"; }

std::string quoted(const std::string& text) {
  std::string escaped = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') escaped += '\\';
    escaped += c;
  }
  return escaped + "\"";
}

/// {"key": value, ...} in one line, which YAML reads too.
std::string object(const Fields& fields) {
  std::string text;
  for (const auto& [key, value] : fields) text += (text.empty() ? "" : ", ") + quoted(key) + ": " + value;
  return "{" + text + "}";
}

void print(const Fields& fields, bool json, std::ostream& out) {
  if (json) {
    out << object(fields) << "\n";
    return;
  }
  for (const auto& [key, value] : fields) out << key << ": " << value << "\n";
}

Fields modeFields(const ModeCertificate& mode) {
  return {{"spectral_radius", number(mode.spectral_radius)},
          {"gain_margin", number(mode.gain_margin)},
          {"gain_reduction", number(mode.gain_reduction)},
          {"delay_margin_s", number(mode.delay_margin)}};
}

Fields plantFields(const PlantModel& plant) {
  return {{"dead_time", number(plant.dead_time)},
          {"lag", number(plant.lag)},
          {"gain", number(plant.gain)},
          {"velocity_loop_integral", number(plant.velocity_loop_integral)},
          {"effective_track", number(plant.effective_track)},
          {"on_box", boolean(plant.on_box)},
          {"sensor_rate", number(plant.sensor_rate)}};
}

Fields certificateFields(const ControllerFile& file, const PlantModel& plant) {
  const Certificate certificate = certify(file.controller, file.geometry, plant);
  Fields slopes;
  for (const auto& [parameter, value] : sensitivities(file.controller, file.geometry, plant)) {
    slopes.emplace_back(parameter, number(value));
  }
  return {{"belief_spectral_radius", number(certificate.belief_spectral_radius)},
          {"loop_spectral_radius", number(certificate.loop_spectral_radius)},
          {"radius_uncertainty", number(certificate.radius_uncertainty)},
          {"gain_margin", number(certificate.gain_margin)},
          {"delay_margin_s", number(certificate.delay_margin)},
          {"stable", boolean(certificate.stable())},
          {"straight", object(modeFields(certificate.straight))},
          {"turn", object(modeFields(certificate.turn))},
          {"sensitivity", object(slopes)},
          {"period_s", number(certificate.period)},
          {"plant_model", object(plantFields(plant))},
          {"advice", quoted(advice(certificate, file.controller, file.geometry, plant))}};
}

Fields predictiveFields(const PredictiveFile& file, const PlantModel& robot) {
  const PlantModel model = file.model.value_or(robot);
  const PredictiveCertificate certificate = certify(file.parameters, model, robot);
  Fields slopes;
  for (const auto& [parameter, value] : sensitivities(file.parameters, model, robot)) {
    slopes.emplace_back(parameter, number(value));
  }
  return {{"belief_spectral_radius", number(certificate.belief_spectral_radius)},
          {"loop_spectral_radius", number(certificate.loop_spectral_radius)},
          {"radius_uncertainty", number(certificate.radius_uncertainty)},
          {"gain_margin", number(certificate.gain_margin)},
          {"gain_reduction", number(certificate.gain_reduction)},
          {"delay_margin_s", number(certificate.delay_margin)},
          {"delay_reduction_s", number(certificate.delay_reduction)},
          {"stable", boolean(certificate.stable())},
          {"sensitivity", object(slopes)},
          {"period_s", number(certificate.period)},
          {"plant_model", object(plantFields(model))},
          {"robot", object(plantFields(robot))},
          {"advice", quoted(advice(certificate, file.parameters, model, robot))}};
}

Gain gainNamed(const std::string& name) {
  std::string names;
  for (std::size_t i = 0; i < kGainNames.size(); ++i) {
    if (name == kGainNames[i]) return static_cast<Gain>(i);
    names += (names.empty() ? "" : ", ") + std::string(kGainNames[i]);
  }
  throw ParameterError("range = '" + name + "': expected one of " + names);
}

Fields rangeFields(const ControllerFile& file, const PlantModel& plant, Gain gain) {
  ControllerParameters controller = file.controller;
  const auto range = stableRange(controller, file.geometry, plant, gain);
  Fields fields{{"parameter", quoted(kGainNames[static_cast<std::size_t>(gain)])},
                {"present", number(gainOf(controller, gain))},
                {"stable", boolean(isStable(LinearLoop(controller, file.geometry, plant)))}};
  fields.emplace_back("low", range ? number(range->low) : "null");
  fields.emplace_back("high", range ? number(range->high) : "null");
  fields.emplace_back("low_is_bound", boolean(range && range->low_is_bound));
  fields.emplace_back("high_is_bound", boolean(range && range->high_is_bound));
  return fields;
}

po::options_description optionsOfAnalyze() {
  po::options_description options("Options");
  options.add_options()("help,h", "print this text");
  options.add_options()(
      "config", po::value<std::string>(),
      "CONFIG.yaml: gains (controller.* or predictive.*), geometry (robot.*), the drive train that a predictive "
      "controller believes in (plant_model.*; by default the plant itself)");
  options.add_options()("plant", po::value<std::string>(),
                        "PLANT.yaml: a plant model (plant_model.*) or a simulated robot (plant.*); by default what "
                        "config/jackal_model.yaml assumes");
  options.add_options()("range", po::value<std::string>(),
                        "print the stable interval of tau, kappa_mu or kappa_a instead, the others as they are");
  options.add_options()("json", "print one line of JSON");
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
    out << "analyze CONFIG.yaml [--plant PLANT.yaml] [--range tau|kappa_mu|kappa_a] [--json]\n"
        << "Stability certificate of a controller: spectral radii, gain and delay margin.\n"
        << options;
    return 0;
  }
  if (given.count("config") == 0) throw ParameterError("CONFIG.yaml: missing; see analyze --help");
  const std::string path = given["config"].as<std::string>();
  const PlantModel plant =
      given.count("plant") > 0 ? readPlantFile(given["plant"].as<std::string>()).model : PlantModel{};
  if (describesPredictive(path)) {
    if (given.count("range") > 0) throw ParameterError("range: only for the gains of controller.*");
    print(predictiveFields(readPredictiveFile(path), plant), given.count("json") > 0, out);
    return 0;
  }
  const ControllerFile file = readControllerFile(path);
  const Fields fields = given.count("range") > 0 ? rangeFields(file, plant, gainNamed(given["range"].as<std::string>()))
                                                 : certificateFields(file, plant);
  print(fields, given.count("json") > 0, out);
  return 0;
}

}  // namespace jackal_aic
