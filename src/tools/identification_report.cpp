#include "identification_report.hpp"

#include <fmt/format.h>

#include "jackal_aic/config/yaml_text.hpp"

namespace jackal_aic {
namespace {

std::string row(const char* name, const Estimate& estimate, const char* unit) {
  if (estimate.known()) {
    return fmt::format("{:<26} {:9.4f} +- {:.4f} {}\n", name, estimate.value, estimate.half_width, unit);
  }
  const std::string value = estimate.value > 0.0 ? fmt::format(" ({:.4f} {})", estimate.value, unit) : "";
  return fmt::format("{:<26}   unknown: {}{}\n", name, estimate.unknown, value);
}

void requireKnown(const char* name, const Estimate& estimate) {
  if (!estimate.known()) throw IdentificationError(std::string(name) + " is unknown: " + estimate.unknown);
}

/// Mean of the directions that are known; 0 (the controller's own) if none is.
double effectiveTrack(const Identification& result) {
  const bool left = result.track_left.known(), right = result.track_right.known();
  const double sum = (left ? result.track_left.value : 0.0) + (right ? result.track_right.value : 0.0);
  return left || right ? sum / (left + right) : 0.0;
}

}  // namespace

std::string identificationTable(const Identification& result) {
  std::string text = "estimate (95 % confidence)\n";
  text += row("dead time", result.dead_time, "s");
  text += row("lag", result.lag, "s");
  text += row("gain", result.gain, "");
  text += row("acceleration limit", result.acceleration_limit, "m/s^2");
  text += row("effective track, left", result.track_left, "m");
  text += row("effective track, right", result.track_right, "m");
  text += fmt::format("{:<26} {:9.4f} rad/s\n", "residual (RMS)", result.residual);
  for (const auto& remark : result.remarks) text += remark + "\n";
  return text;
}

std::string plantModelYaml(const Identification& result, const std::string& source, const std::string& robot) {
  requireKnown("dead time", result.dead_time);
  requireKnown("lag", result.lag);
  requireKnown("gain", result.gain);
  const Estimate& limit = result.acceleration_limit;
  std::string text = "# Identified from " + source + "; +- is the 95 % confidence interval.\nplant_model:\n";
  if (!robot.empty()) text += "  robot: " + yamlQuoted(robot) + "\n";
  const auto line = [&](const char* name, double value, const std::string& comment) {
    text += fmt::format("  {:<26} # {}", fmt::format("{}: {}", name, yamlNumber(value, 4)), comment);
  };
  line("dead_time", result.dead_time.value, fmt::format("s, +- {:.4f}\n", result.dead_time.half_width));
  line("lag", result.lag.value, fmt::format("s, +- {:.4f}\n", result.lag.half_width));
  line("gain", result.gain.value, fmt::format("+- {:.4f}\n", result.gain.half_width));
  line("acceleration_limit", limit.value,
       "m/s^2, " + (limit.known() ? fmt::format("+- {:.3f}\n", limit.half_width) : limit.unknown + "\n"));
  line("effective_track", effectiveTrack(result), "m");
  const auto side = [&](const char* name, const Estimate& track) {
    return track.known() ? fmt::format(", {} {:.4f} +- {:.4f}", name, track.value, track.half_width)
                         : fmt::format(", {} unknown: {}", name, track.unknown);
  };
  return text + side("left", result.track_left) + side("right", result.track_right) + "\n";
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
