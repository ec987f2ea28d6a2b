#include "identification_report.hpp"

#include <fmt/format.h>

#include <map>
#include <vector>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/yaml_text.hpp"
#include "jackal_aic/model/plant_model.hpp"

namespace jackal_aic {
namespace {

std::string row(const char* name, const Estimate& estimate, const char* unit) {
  if (estimate.known()) {
    return fmt::format("{:<26} {:9.4f} +- {:.4f} {}\n", name, estimate.value, estimate.half_width, unit);
  }
  const std::string value = estimate.value > 0.0 ? fmt::format(" ({:.4f} {})", estimate.value, unit) : "";
  return fmt::format("{:<26}   unknown: {}{}\n", name, estimate.unknown, value);
}

/// Mean of the directions that are known; 0 (the controller's own) if none is.
double effectiveTrack(const Identification& result) {
  const bool left = result.track_left.known(), right = result.track_right.known();
  const double sum = (left ? result.track_left.value : 0.0) + (right ? result.track_right.value : 0.0);
  return left || right ? sum / (left + right) : 0.0;
}

/// Rounds to the four digits of a file.
double rounded(double value) { return std::stod(yamlNumber(value, 4)); }

std::string confidence(const Estimate& estimate) {
  return estimate.known() ? fmt::format("+- {:.4f}", estimate.half_width) : estimate.unknown;
}

/// The comment of an estimated field of the plant model; empty for the others.
std::string remark(const std::string& field, const Identification& result) {
  const std::map<std::string, const Estimate*> estimates{{"dead_time", &result.dead_time},
                                                         {"lag", &result.lag},
                                                         {"gain", &result.gain},
                                                         {"offset", &result.offset},
                                                         {"acceleration_limit", &result.acceleration_limit}};
  if (const auto found = estimates.find(field); found != estimates.end()) return confidence(*found->second);
  if (field != "effective_track") return "";
  const auto side = [](const char* name, const Estimate& track) {
    return track.known() ? fmt::format("{} {:.4f} ", name, track.value) + confidence(track)
                         : std::string(name) + " unknown: " + track.unknown;
  };
  return side("left", result.track_left) + ", " + side("right", result.track_right);
}

}  // namespace

void remarkOnTrack(double least, Identification& result) {
  const auto check = [&](const char* side, const Estimate& track) {
    if (!track.known() || track.value + track.half_width >= least) return;
    result.remarks.push_back(
        fmt::format("effective track, {}: {:.4f} m is below the distance of the wheels, {:g} m: are --wheel-distance, "
                    "--wheel-radius and the scale of the gyro right?",
                    side, track.value, least));
  };
  check("left", result.track_left);
  check("right", result.track_right);
}

std::string identificationTable(const Identification& result) {
  std::string text = "estimate (95 % confidence)\n";
  text += row("dead time", result.dead_time, "s");
  text += row("lag", result.lag, "s");
  text += row("gain", result.gain, "");
  text += row("offset", result.offset, "rad/s");
  text += row("acceleration limit", result.acceleration_limit, "m/s^2");
  text += row("effective track, left", result.track_left, "m");
  text += row("effective track, right", result.track_right, "m");
  text += fmt::format("{:<26} {:9.4g} Hz\n", "sensor rate", result.sensor_rate);
  text += fmt::format("{:<26} {:9.4f} rad/s\n", "residual (RMS)", result.residual);
  text += fmt::format("{:<26} {:9.4f}\n", "R^2", result.r_squared);
  for (const auto& remark : result.remarks) text += remark + "\n";
  return text;
}

std::string plantModelYaml(const Identification& result, const RecordingSource& source) {
  for (const auto& [name, estimate] :
       {std::pair("dead time", &result.dead_time), {"lag", &result.lag}, {"gain", &result.gain}}) {
    if (!estimate->known()) throw IdentificationError(std::string(name) + " is unknown: " + estimate->unknown);
  }
  PlantModel model;
  model.dead_time = rounded(result.dead_time.value);
  model.lag = rounded(result.lag.value);
  model.gain = rounded(result.gain.value);
  model.acceleration_limit = rounded(result.acceleration_limit.value);
  model.effective_track = rounded(effectiveTrack(result));
  model.sensor_rate = result.sensor_rate;
  model.dead_time_half_width = rounded(result.dead_time.half_width);
  model.lag_half_width = rounded(result.lag.half_width);
  model.gain_half_width = rounded(result.gain.half_width);
  if (result.offset.significant()) {
    model.offset = rounded(result.offset.value);
    model.offset_half_width = rounded(result.offset.half_width);
  }
  std::vector<Field> fields = fieldsOf(model);
  for (Field& field : fields) {
    if (field.name == "robot") field.value = source.robot;
    const std::string found = remark(field.name, result);
    if (!found.empty()) field.unit += (field.unit.empty() ? "" : ", ") + found;
  }
  std::string head = fmt::format("# Identified from {}", onOneLine(source.recording));
  if (!source.date.empty()) head += ", recorded " + source.date;
  head += fmt::format(", {:.1f} s.\n# R^2 {:.4f}, residual {:.4f} rad/s (RMS); +- is the 95 % confidence interval.\n",
                      result.duration, result.r_squared, result.residual);
  if (result.offset.known()) {
    head += fmt::format(
        "# Wheels turn {:.4f} +- {:.4f} rad/s slower than gain x command{}.\n", result.offset.value,
        result.offset.half_width,
        result.offset.significant() ? "" : "; not significantly above zero, so that plant_model.offset stays 0");
  }
  for (const auto& remark : result.remarks) head += "# " + remark + "\n";
  return head + yamlBlock("plant_model", fields);
}

std::string identificationCsv(const DriveRecording& recording, const Identification& result) {
  std::string text = "time,command_left,command_right,measured_left,measured_right,fitted_left,fitted_right\n";
  std::size_t next = 0;
  WheelCommand command;
  for (std::size_t i = 0; i < recording.wheels.size(); ++i) {
    const WheelSample& measured = recording.wheels[i];
    const WheelCommand& fitted = result.fitted[i].speed;
    while (next < recording.commands.size() && recording.commands[next].time <= measured.time) {
      command = recording.commands[next++].command;
    }
    text +=
        fmt::format("{:.4f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f}\n", measured.time - recording.wheels.front().time,
                    command.left, command.right, measured.speed.left, measured.speed.right, fitted.left, fitted.right);
  }
  return text;
}

}  // namespace jackal_aic
