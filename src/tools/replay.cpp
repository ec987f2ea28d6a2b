#include <fmt/format.h>
#include <fmt/ostream.h>
#include <fmt/ranges.h>
#include <ros/package.h>

#include <Eigen/Core>
#include <algorithm>
#include <boost/program_options.hpp>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <utility>

#include "bag_file.hpp"
#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/yaml.hpp"
#include "outputs/state_output.hpp"
#include "parameters/node_parameters.hpp"
#include "programs.hpp"
#include "recorded_drive.hpp"

namespace jackal_aic {
namespace {

namespace po = boost::program_options;

struct Options {
  std::string bag, output, preset, robot, plant_model, set_point, name_space = "/";
  std::vector<std::string> settings;
  bool messages = false, check = false, help = false;

  /// True if the options change the configuration of the recording.
  bool changed() const { return !preset.empty() || !robot.empty() || !plant_model.empty() || !settings.empty(); }
};

po::options_description optionsOf(Options& o) {
  po::options_description options("Options");
  auto add = options.add_options();
  add("help,h", po::bool_switch(&o.help), "print this text");
  add("bag", po::value(&o.bag), "bag to read (also without --bag)");
  add("output", po::value(&o.output), "CSV to write: beliefs, commands, faults, free energy, a row per action update");
  add("preset", po::value(&o.preset), "another controller: a file of config/ by its name, or a path");
  add("robot", po::value(&o.robot), "file with other keys of the robot (config/jackal.yaml)");
  add("plant-model", po::value(&o.plant_model), "file with another plant model (plant_model.*, as identify writes)");
  add("set", po::value(&o.settings)->composing(), "key=value: another value of a key; may be repeated");
  add("messages", po::bool_switch(&o.messages),
      "from the sensors' messages, also if the bag has the log of the controller that recorded it");
  add("namespace", po::value(&o.name_space)->default_value(o.name_space), "of the topics of the robot");
  add("set-point-topic", po::value(&o.set_point),
      "geometry_msgs/Twist or TwistStamped, for a bag without that log (default: jackal_AIC/set_point)");
  add("check", po::bool_switch(&o.check), "exit with status 1 unless every recorded state is reproduced exactly");
  return options;
}

Options parse(const std::vector<std::string>& arguments) {
  Options options;
  const po::options_description named = optionsOf(options);
  po::variables_map given;
  po::store(po::command_line_parser(arguments)
                .options(named)
                .positional(po::positional_options_description().add("bag", 1))
                .run(),
            given);
  po::notify(given);
  return options;
}

void printHelp(std::ostream& out) {
  Options options;
  out << "Usage: replay BAG [options]\n"
         "Drives a recorded drive again, by the same code and as fast as it can, and prints the difference to what "
         "was\n"
         "recorded. A bag of record:=true is reproduced exactly; other bags are played from their messages "
         "(joint_states,\n"
         "imu/data, the set point, and status, feedback, e_stop, cmd_drive, tf where they are).\n"
      << optionsOf(options);
}

/// A map without the keys of the sections of gains, for those of another preset.
ParameterMap withoutGains(ParameterMap map) {
  ParameterMap rest;
  for (const std::string& key : map.keys()) {
    const std::string section = key.substr(0, key.find('.'));
    if (section != "controller" && section != "predictive" && section != "diff_drive") rest.set(key, *map.take(key));
  }
  return rest;
}

/// A file of the package's config/.
std::string configFile(const std::string& name) {
  const std::string package = ros::package::getPath("jackal_aic");
  if (package.empty()) throw ParameterError("package jackal_aic: not found; source devel/setup.bash of its workspace");
  return package + "/config/" + name + ".yaml";
}

std::string presetFile(const std::string& preset) {
  if (preset.find('/') != std::string::npos || preset.find(".yaml") != std::string::npos) return preset;
  const std::vector<std::string> presets{"predictive", "improved", "standard", "tuned", "diff_drive"};
  if (std::find(presets.begin(), presets.end(), preset) == presets.end()) {
    throw ParameterError(fmt::format("--preset = {}: unknown; known: {}, or a file NAME.yaml", quoted(preset),
                                     fmt::join(presets, ", ")));
  }
  return configFile(preset);
}

void set(const std::string& setting, ParameterMap& map) {
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos || equals == 0) throw ParameterError("--set " + setting + ": expected key=value");
  setFromText(setting.substr(0, equals), setting.substr(equals + 1), map);
}

/// The configuration of the replaying controller.
NodeParameters configurationFor(const Options& options, const std::string& recorded) {
  ParameterMap map;
  if (!recorded.empty()) {
    addYamlText(recorded, options.bag + ": configuration", map);
  } else {
    for (const char* name : {"advanced", "jackal", "jackal_model"}) addYamlFile(configFile(name), map);
  }
  if (recorded.empty() || !options.preset.empty()) {
    map = withoutGains(std::move(map));
    addYamlFile(presetFile(options.preset.empty() ? "predictive" : options.preset), map);
  }
  if (!options.robot.empty()) addYamlFile(options.robot, map);
  if (!options.plant_model.empty()) addYamlFile(options.plant_model, map);
  for (const std::string& setting : options.settings) set(setting, map);
  if (!map.has("robot.wheel_radius")) map.set("robot.wheel_radius", GeometryParameters{}.wheel_radius);
  return readNodeParameters(std::move(map), []() -> std::string {
    throw ParameterError("robot.effective_track: not given; add it with --set robot.effective_track=METRES");
  });
}

double order0(const std::vector<double>& orders) { return orders.empty() ? std::nan("") : orders.front(); }

/// Compares replayed with recorded states.
class Comparison {
 public:
  /// @param tolerance largest distance of the stamps of two states that are compared [s].
  Comparison(const std::vector<ControllerState>& recorded, double tolerance)
      : tolerance_(tolerance), none_(recorded.empty()) {
    for (const ControllerState& state : recorded) recorded_.emplace(state.header.stamp.toSec(), state);
  }

  /// The recorded state at the time of a replayed one; empty without one.
  std::optional<ControllerState> compare(const ControllerState& now) {
    const double time = now.header.stamp.toSec();
    const auto found = recorded_.lower_bound(time - tolerance_);
    if (found == recorded_.end() || found->first > time + tolerance_) return std::nullopt;
    const ControllerState then = found->second;
    recorded_.erase(found);
    ++compared_;
    const Values values = valuesOf(now), recorded = valuesOf(then);
    const bool same = (values == recorded).all() && now.status == then.status;
    if (!same && different_++ == 0) first_difference_ = time;
    different_status_ += now.status != then.status ? 1 : 0;
    largest_ = largest_.max((values - recorded).abs());
    return then;
  }

  /// True if states were compared and all are identical.
  bool exact() const { return compared_ > 0 && different_ == 0; }

  std::string text() const {
    if (none_) return "No recorded states to compare with";
    if (compared_ == 0) return "No recorded state is of a time of the replay";
    if (different_ == 0) return fmt::format("Recorded states: {} compared, all identical", compared_);
    return fmt::format(
        "Recorded states: {} compared, {} differ, the first at {:.3f} s; {} in the status (driving, braking, ...)\n"
        "Largest differences: commands {:.3g} rad/s, belief {:.3g} m/s and {:.3g} rad/s",
        compared_, different_, first_difference_, different_status_, std::max(largest_[0], largest_[1]), largest_[2],
        largest_[3]);
  }

 private:
  using Values = Eigen::Array<double, 9, 1>;

  static Values valuesOf(const ControllerState& state) {
    const auto believed = [](const std::vector<double>& orders) { return orders.empty() ? 0.0 : orders.front(); };
    Values values;
    values << state.command_left, state.command_right, believed(state.belief_forward), believed(state.belief_yaw_rate),
        state.action_left, state.action_right, state.set_point_forward, state.set_point_yaw_rate, state.free_energy;
    return values;
  }

  std::multimap<double, ControllerState> recorded_;  // not compared yet, by their stamps
  double tolerance_;
  bool none_;
  std::size_t compared_ = 0, different_ = 0, different_status_ = 0;
  double first_difference_ = 0.0;  // time of it [s]
  Values largest_ = Values::Zero();
};

constexpr const char* kColumns =
    "time,status,reason,set_point_forward,set_point_yaw_rate,measured_forward,measured_yaw_rate,belief_forward,"
    "belief_yaw_rate,free_energy,action_left,action_right,command_left,command_right,recorded_command_left,"
    "recorded_command_right,recorded_belief_forward,recorded_belief_yaw_rate\n";

/// Drives a loop by recorded inputs. Compares, writes and lists its states.
class Replay {
 public:
  /// Differences from the recording.
  struct Changes {
    bool gains = false;   ///< initial gains stay, despite changes in the recording
    bool motors = false;  ///< they received the recorded commands, not those of the loop
    bool start = false;   ///< the recording begins, or may begin, in the middle of a drive
  };

  /// @param table rows are added to it; nullptr: none.
  Replay(const NodeParameters& parameters, Comparison comparison, const Changes& changes, std::ostream* table)
      : loop_(parameters, makeController(parameters)),
        changes_(changes),
        comparison_(std::move(comparison)),
        table_(table) {
    if (changes.start) loop_.release();
    if (table_ != nullptr) *table_ << kColumns;
  }

  void take(const DriveInput& input) {
    if (changes_.gains && std::holds_alternative<GainsInput>(input.what)) {
      ++gains_left_out_;
      return;
    }
    if (std::isnan(first_)) first_ = input.now;
    if (loop_.take(input)) note(input.now);
  }

  const Comparison& comparison() const { return comparison_; }

  /// Prints changes of the state with their time, from the second update on.
  void print(std::ostream& out) const {
    constexpr std::size_t kMostEvents = 20;
    if (gains_left_out_ > 0) {
      out << fmt::format("{} recorded changes of gains left out: the gains of --preset hold\n", gains_left_out_);
    }
    for (std::size_t i = 0; i < std::min(events_.size(), kMostEvents); ++i) out << events_[i] << "\n";
    if (events_.size() > kMostEvents) out << fmt::format("... {} more\n", events_.size() - kMostEvents);
    out << comparison_.text() << "\n";
  }

 private:
  void note(double now) {
    ControllerState state;
    fillState(loop_, ros::Time(now), state);
    addRemarks(loop_.status(), {}, "base_link", state);
    const std::string status = text(loop_.status().decision.status);
    const std::string said = status + (state.reason.empty() ? "" : ": " + state.reason);
    if (said != said_) events_.push_back(fmt::format("{:12.3f} s  {}", now - first_, said));
    said_ = said;
    const auto then = comparison_.compare(state);
    if (changes_.motors && then) {
      loop_.applied({then->command_left, then->command_right}, AppliedSource::drive, now);
    }
    if (table_ == nullptr) return;
    std::string cell = state.reason;
    std::replace(cell.begin(), cell.end(), ',', ';');
    ControllerState none;
    none.command_left = none.command_right = std::nan("");
    const ControllerState& recorded = then ? *then : none;
    fmt::print(*table_, "{},{},{},{}\n", now, status, cell,
               fmt::join(std::vector<double>{state.set_point_forward, state.set_point_yaw_rate, state.measured_forward,
                                             state.measured_yaw_rate, order0(state.belief_forward),
                                             order0(state.belief_yaw_rate), state.free_energy, state.action_left,
                                             state.action_right, state.command_left, state.command_right,
                                             recorded.command_left, recorded.command_right,
                                             order0(recorded.belief_forward), order0(recorded.belief_yaw_rate)},
                         ","));
  }

  DriveLoop loop_;
  Changes changes_;
  Comparison comparison_;
  std::ostream* table_;
  std::size_t gains_left_out_ = 0;
  std::string said_;
  std::vector<std::string> events_;
  double first_ = std::nan("");  // time of the first input [s]
};

int replayDrive(const RecordedDrive& drive, const Options& options, std::ostream& out) {
  const std::string recorded = drive.configuration();
  NodeParameters parameters = configurationFor(options, recorded);
  out << "Configuration: " << (recorded.empty() ? "that of config/" : "as recorded")
      << (options.changed() ? ", changed as asked for" : "") << "\n";
  const bool from_log = drive.hasLog() && !options.messages;
  if (from_log && !options.set_point.empty()) {
    throw ParameterError(
        "--set-point-topic: the log in this bag has the set points; replay its messages by --messages");
  }
  // The recorded commands reached the motors: the beliefs are about those.
  const Replay::Changes changes{!options.preset.empty(), from_log && options.changed() && !parameters.motors_shared,
                                !from_log || !drive.fromTheStart()};
  if (changes.motors || (!from_log && drive.has("cmd_drive"))) parameters.motors_shared = true;
  const double period = makeController(parameters)->actionStep();
  std::ofstream table;
  if (!options.output.empty()) table.open(options.output);
  Replay replay(parameters, {drive.states(), from_log ? 0.0 : 0.5 * period}, changes,
                options.output.empty() ? nullptr : &table);
  const auto take = [&](const DriveInput& input) { replay.take(input); };
  out << (from_log ? drive.playLog(take)
                   : drive.playMessages(parameters,
                                        options.set_point.empty() ? "jackal_AIC/set_point" : options.set_point, take));
  replay.print(out);
  if (!options.output.empty()) {
    if (!table.flush()) throw ParameterError("--output " + options.output + ": cannot be written");
    out << "Table: " << options.output << "\n";
  }
  return options.check && !replay.comparison().exact() ? 1 : 0;
}

}  // namespace

int replay(const std::vector<std::string>& arguments, std::ostream& out) {
  const Options options = parse(arguments);
  if (options.help) {
    printHelp(out);
    return 0;
  }
  if (options.bag.empty()) throw po::error("BAG: missing; see replay --help");
  int status = 0;
  withBag<ParameterError>(options.bag, [&](const rosbag::Bag& bag) {
    status = replayDrive(RecordedDrive(bag, options.name_space), options, out);
  });
  return status;
}

}  // namespace jackal_aic
