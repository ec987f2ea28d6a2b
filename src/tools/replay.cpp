#include "replay.hpp"

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <fmt/ranges.h>
#include <ros/package.h>

#include <algorithm>
#include <boost/program_options.hpp>
#include <chrono>
#include <cmath>
#include <fstream>
#include <iostream>
#include <limits>
#include <memory>
#include <utility>

#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/text_file.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "node_parameters.hpp"
#include "recorded_drive.hpp"
#include "state_comparison.hpp"

namespace jackal_aic {
namespace {

namespace po = boost::program_options;

struct Options {
  std::string bag, output, preset, robot, plant_model, urdf, name_space = "/";
  std::string set_point = "jackal_AIC/set_point";
  std::vector<std::string> settings;
  bool messages = false, check = false, help = false;
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
  add("set-point-topic", po::value(&o.set_point)->default_value(o.set_point),
      "geometry_msgs/Twist, for a bag without that log");
  add("urdf", po::value(&o.urdf),
      "file with the robot's URDF, for a bag without that log; by default the wheels are the stock Jackal's");
  add("check", po::bool_switch(&o.check), "exit with status 1 unless every recorded state is reproduced exactly");
  return options;
}

Options parse(const std::vector<std::string>& arguments) {
  Options options;
  const po::options_description named = optionsOf(options);
  po::positional_options_description positional;
  positional.add("bag", 1);
  po::variables_map given;
  po::store(po::command_line_parser(arguments).options(named).positional(positional).run(), given);
  po::notify(given);
  return options;
}

void printHelp(std::ostream& out) {
  Options options;
  out << "Usage: replay BAG [options]\n"
         "Drives a recorded drive again, by the same code and as fast as it can, and tells the difference to what was\n"
         "recorded. A bag of record:=true is reproduced exactly; other bags are played from their messages "
         "(joint_states,\n"
         "imu/data, the set point, and status, feedback, e_stop, cmd_drive, tf where they are).\n"
      << optionsOf(options);
}

/// True if another configuration than that of the recording is asked for.
bool isChanged(const Options& options) {
  return !options.preset.empty() || !options.robot.empty() || !options.plant_model.empty() || !options.settings.empty();
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

/// The configuration of the controller that is to drive.
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
  if (options.urdf.empty() && !map.has("robot.wheel_radius")) {
    map.set("robot.wheel_radius", GeometryParameters{}.wheel_radius);
  }
  return readNodeParameters(std::move(map), [&]() -> std::string {
    if (options.urdf.empty()) {
      throw ParameterError("robot.effective_track: not given; add it with --set, or the robot's URDF with --urdf");
    }
    return readText(options.urdf);
  });
}

/// The table that is written, or none.
class Table {
 public:
  Table(const std::string& path, const char* columns) : path_(path) {
    if (path.empty()) return;
    file_.open(path);
    file_ << columns << "\n";
    require();
  }

  template <class... Values>
  void add(const Values&... values) {
    if (path_.empty()) return;
    std::size_t left = sizeof...(values);
    ((fmt::print(file_, "{}{}", values, --left > 0 ? "," : "\n")), ...);
  }

  /// @throws ParameterError if something could not be written.
  void finish(std::ostream& out) {
    if (path_.empty()) return;
    file_.flush();
    require();
    out << "Table: " << path_ << "\n";
  }

 private:
  void require() const {
    if (!file_) throw ParameterError("--output " + path_ + ": cannot be written");
  }

  std::string path_;
  std::ofstream file_;
};

const char* statusName(DriveStatus status) {
  switch (status) {
    case DriveStatus::idle:
      return "idle";
    case DriveStatus::driving:
      return "driving";
    case DriveStatus::stopped:
      return "stopped";
    case DriveStatus::braking:
      return "braking";
    case DriveStatus::faulted:
      break;
  }
  return "faulted";
}

/// A reason as a cell of a table: without what separates cells.
std::string cell(std::string text) {
  for (char& c : text) {
    if (c == ',') c = ';';
  }
  return text;
}

/// Drives a loop by recorded inputs, compares, writes and notes what it does.
class Replay {
 public:
  /// What is not as it was recorded.
  struct Changes {
    bool gains = false;   ///< those that it begins with stay, despite changes in the recording
    bool motors = false;  ///< they got the recorded commands, not those of the loop
    bool start = false;   ///< the recording begins in the middle of a drive, or may do so
  };

  Replay(const NodeParameters& parameters, std::vector<ControllerState> recorded, double tolerance,
         const Changes& changes, Table& table)
      : loop_(parameters, makeController(parameters)),
        changes_(changes),
        kinematics_(parameters.geometry),
        comparison_(std::move(recorded), tolerance),
        table_(table) {
    if (changes.start) loop_.release();
  }

  void take(const DriveInput& input) {
    if (changes_.gains && std::holds_alternative<GainsInput>(input.what)) {
      ++gains_left_out_;
      return;
    }
    if (const auto* wheels = std::get_if<WheelsInput>(&input.what)) {
      const Observation& y = wheels->reading.observation;
      const BodyVector velocity = kinematics_.bodyVelocity({y.wheel_left, y.wheel_right});
      state_.measured(kForward) = velocity(kForward);
    } else if (const auto* imu = std::get_if<ImuInput>(&input.what)) {
      state_.measured(kYaw) = imu->reading.observation.yaw_rate;
    }
    if (std::isnan(first_)) first_ = input.now;
    if (input.now > last_) driven_ += std::min(input.now - last_, kLongestStep);
    last_ = input.now;
    const auto command = loop_.take(input);
    if (command) note(*command);
  }

  const StateComparison& comparison() const { return comparison_; }
  const DriveLoop& loop() const { return loop_; }
  double driven() const { return driven_; }  ///< time that was driven [s]

  /// Changes of gains in the recording that were not made.
  std::size_t gainsLeftOut() const { return gains_left_out_; }

  /// What it did when, from the second update on where that changes.
  const std::vector<std::string>& events() const { return events_; }

 private:
  static constexpr double kLongestStep =
      1.0;  // between inputs of a drive; more is a pause, or the start of the clock [s]

  void note(const WheelCommand& command) {
    const std::string before = said_;
    state_.time = last_;
    state_.status = loop_.status();
    state_.set_point = loop_.setPoint();
    state_.belief = loop_.controller().believedVelocity();
    state_.free_energy = loop_.controller().freeEnergy();
    state_.action = loop_.action();
    state_.command = command;
    const std::string why = reason(state_.status);
    said_ = statusName(state_.status.decision.status) + (why.empty() ? "" : ": " + why);
    if (said_ != before) events_.push_back(fmt::format("{:12.3f} s  {}", last_ - first_, said_));
    const ControllerState* recorded = comparison_.compare(state_);
    if (changes_.motors && recorded != nullptr) {
      loop_.applied({recorded->command_left, recorded->command_right}, AppliedSource::drive, last_);
    }
    static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    const auto order0 = [](const std::vector<double>& orders) { return orders.empty() ? kNone : orders.front(); };
    table_.add(state_.time, statusName(state_.status.decision.status), cell(why), state_.set_point.forward,
               state_.set_point.yaw_rate, state_.measured(kForward), state_.measured(kYaw), state_.belief(kForward),
               state_.belief(kYaw), state_.free_energy, state_.action.left, state_.action.right, command.left,
               command.right, recorded != nullptr ? recorded->command_left : kNone,
               recorded != nullptr ? recorded->command_right : kNone,
               recorded != nullptr ? order0(recorded->belief_forward) : kNone,
               recorded != nullptr ? order0(recorded->belief_yaw_rate) : kNone);
  }

  DriveLoop loop_;
  Changes changes_;
  std::size_t gains_left_out_ = 0;
  SkidSteerKinematics kinematics_;
  StateComparison comparison_;
  Table& table_;
  ReplayedState state_;
  std::string said_;
  std::vector<std::string> events_;
  double first_ = std::numeric_limits<double>::quiet_NaN();
  double last_ = 0.0;
  double driven_ = 0.0;
};

constexpr const char* kColumns =
    "time,status,reason,set_point_forward,set_point_yaw_rate,measured_forward,measured_yaw_rate,belief_forward,"
    "belief_yaw_rate,free_energy,action_left,action_right,command_left,command_right,recorded_command_left,"
    "recorded_command_right,recorded_belief_forward,recorded_belief_yaw_rate";

/// Plays the log of the controller that recorded, or the messages.
class Source {
 public:
  Source(const RecordedDrive& drive, const Options& options, const NodeParameters& parameters)
      : drive_(drive), options_(options), parameters_(parameters) {}

  bool fromLog() const { return drive_.hasLog() && !options_.messages; }

  /// Plays everything. Says what was played.
  void play(const RecordedDrive::Sink& sink, std::ostream& out) {
    if (fromLog()) {
      log_ = drive_.playLog(sink);
      out << fmt::format("Log of the controller: {} inputs\n", log_.inputs);
      if (log_.first > 0) out << fmt::format("It begins {} inputs after the start of the controller\n", log_.first);
      if (log_.missing > 0) out << fmt::format("{} inputs are missing from it\n", log_.missing);
      if (log_.restarted) out << "The controller was restarted in this bag: its first drive is replayed\n";
      return;
    }
    const auto controller = makeController(parameters_);
    PlayerSettings settings;
    settings.name_space = options_.name_space;
    settings.set_point = options_.set_point;
    settings.belief_step = controller->beliefStep();
    settings.action_step = controller->actionStep();
    settings.commands = parameters_.motors_shared;
    MessagePlayer player(parameters_, settings, sink);
    drive_.playMessages(player, options_.set_point);
    out << "Messages of the sensors; the timers of the controller as they come\n";
    for (const auto& [reason, count] : player.refusals()) out << fmt::format("{} refused: {}\n", count, reason);
  }

 private:
  const RecordedDrive& drive_;
  const Options& options_;
  const NodeParameters& parameters_;
  LogReport log_;
};

int replayLoop(const RecordedDrive& drive, const Options& options, NodeParameters parameters, std::ostream& out) {
  // The recorded commands reached the motors: the beliefs are about those.
  const bool from_log = drive.hasLog() && !options.messages;
  const Replay::Changes changes{!options.preset.empty(), from_log && isChanged(options) && !parameters.motors_shared,
                                !from_log || drive.firstInput() > 0};
  if (!from_log && drive.has(resolvedTopic(options.name_space, "cmd_drive"))) parameters.motors_shared = true;
  if (changes.motors) parameters.motors_shared = true;
  Table table(options.output, kColumns);
  Source source(drive, options, parameters);
  const double period = makeController(parameters)->actionStep();
  Replay replay(parameters, drive.states(), from_log ? 0.0 : 0.5 * period, changes, table);
  const auto start = std::chrono::steady_clock::now();
  source.play([&](const DriveInput& input) { replay.take(input); }, out);
  const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  if (replay.gainsLeftOut() > 0) {
    out << fmt::format("{} changes of gains in it left out: those of --preset hold\n", replay.gainsLeftOut());
  }
  constexpr std::size_t kMostEvents = 20;
  for (std::size_t i = 0; i < std::min(replay.events().size(), kMostEvents); ++i) out << replay.events()[i] << "\n";
  if (replay.events().size() > kMostEvents) out << fmt::format("... {} more\n", replay.events().size() - kMostEvents);
  out << replay.comparison().text() << "\n"
      << fmt::format("Replayed {:.1f} s in {:.3f} s: {:.0f} x real time\n", replay.driven(), took,
                     took > 0.0 ? replay.driven() / took : 0.0);
  table.finish(out);
  const StateComparison& comparison = replay.comparison();
  return options.check && (comparison.compared() == 0 || comparison.different() > 0) ? 1 : 0;
}

}  // namespace

std::string bagOf(const std::vector<std::string>& arguments) {
  const Options options = parse(arguments);
  return options.help ? "" : options.bag;
}

int replay(const std::vector<std::string>& arguments, std::ostream& out) {
  const Options options = parse(arguments);
  if (options.help) {
    printHelp(out);
    return 0;
  }
  if (options.bag.empty()) throw po::error("BAG: missing; see replay --help");
  const RecordedDrive drive(options.bag, options.name_space);
  const std::string recorded = drive.configuration();
  const NodeParameters parameters = configurationFor(options, recorded);
  out << "Configuration: " << (recorded.empty() ? "that of config/" : "as recorded")
      << (isChanged(options) ? ", changed as asked for" : "") << "\n";
  return replayLoop(drive, options, parameters, out);
}

}  // namespace jackal_aic
