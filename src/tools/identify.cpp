#include <fmt/chrono.h>
#include <fmt/format.h>
#include <ros/package.h>
#include <unistd.h>

#include <array>
#include <boost/algorithm/string/replace.hpp>
#include <boost/program_options.hpp>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "drive_bag.hpp"
#include "identification_report.hpp"
#include "jackal_aic/config/text.hpp"
#include "programs.hpp"

namespace jackal_aic {
namespace {

namespace fs = std::filesystem;
namespace po = boost::program_options;

struct IdentifyOptions {
  std::string bag, out, robot, plot, csv;
  double wheel_radius = 0.098;
  double wheel_distance = 0.376;  // m
  double slip_factor = 1.0;
  std::array<double, 3> imu_angles{};  // deg, roll, pitch and yaw
  bool no_plot = false;
  BagTopics topics;
};

/// Orientation by roll, pitch and yaw [deg], of fixed axes in this order.
Eigen::Quaterniond rotationOf(const std::array<double, 3>& angles) {
  constexpr double kDegree = M_PI / 180.0;
  return Eigen::Quaterniond(Eigen::AngleAxisd(angles[2] * kDegree, Eigen::Vector3d::UnitZ()) *
                            Eigen::AngleAxisd(angles[1] * kDegree, Eigen::Vector3d::UnitY()) *
                            Eigen::AngleAxisd(angles[0] * kDegree, Eigen::Vector3d::UnitX()));
}

/// Path of the picture of a bag: in its folder, with another name than the picture of `plot`.
std::string pictureOf(const std::string& bag) {
  fs::path path(bag);
  if (path.extension() == ".bag") path.replace_extension();
  return path.string() + "_identification.png";
}

/// The options, or nothing if the help was asked for.
bool parse(const std::vector<std::string>& arguments, std::ostream& out, IdentifyOptions& options) {
  po::options_description named("Options");
  auto add = named.add_options();
  auto& topics = options.topics;
  auto& track = topics.geometry.effective_track;
  add("help,h", "show this text");
  add("bag", po::value(&options.bag), "bag to read (also without --bag)");
  add("out", po::value(&options.out),
      "write the plant model as YAML; a file of this name is kept as NAME.1, NAME.2, ...");
  add("robot", po::value(&options.robot), "which robot it is, in a few words, for the plant model");
  add("plot", po::value(&options.plot), "picture to write (default: the bag's name with _identification.png)");
  add("no-plot", po::bool_switch(&options.no_plot), "draw no picture");
  add("csv", po::value(&options.csv), "write measured and fitted wheel speeds");
  add("wheel-radius", po::value(&options.wheel_radius)->default_value(options.wheel_radius, "0.098"), "m");
  add("wheel-distance", po::value(&options.wheel_distance)->default_value(options.wheel_distance, "0.376"),
      "of the left wheels from the right ones, m: no robot turns by less");
  add("slip-factor", po::value(&options.slip_factor)->default_value(options.slip_factor),
      "robot.slip_factor of the controller that the model is for");
  add("command-topic", po::value(&topics.commands)->default_value(topics.commands),
      "jackal_msgs/Drive, geometry_msgs/Twist or TwistStamped");
  add("command-track", po::value(&track)->default_value(track, "0.5621"),
      "m, wheel separation times multiplier with which the robot's controller turns a Twist into wheel speeds");
  add("wheel-topic", po::value(&topics.wheels)->default_value(topics.wheels), "sensor_msgs/JointState");
  add("imu-topic", po::value(&topics.imu)->default_value(topics.imu), "sensor_msgs/Imu");
  constexpr std::array<const char*, 3> kAngles{"imu-roll", "imu-pitch", "imu-yaw"};
  for (std::size_t i = 0; i < kAngles.size(); ++i) {
    add(kAngles[i], po::value(&options.imu_angles[i]),
        "deg, how the IMU is mounted (default: as /tf_static or /tf say)");
  }
  add("base-frame", po::value(&topics.robot.base_frame)->default_value(topics.robot.base_frame),
      "frame of the robot in them");
  const auto positional = po::positional_options_description().add("bag", 1);
  po::variables_map values;
  po::store(po::command_line_parser(arguments).options(named).positional(positional).run(), values);
  po::notify(values);
  if (values.count("help") > 0) {
    out << "Usage: identify BAG [--out plant_model.yaml] [options]\nFits dead time, lag, gain, acceleration limit and "
           "effective track to a recorded drive (see launch/identify.launch).\n"
        << named;
    return false;
  }
  if (options.bag.empty()) throw po::error("no bag given; usage: identify BAG [--out plant_model.yaml], see --help");
  if (options.no_plot && !options.plot.empty()) throw po::error("--plot and --no-plot: give one of them");
  for (const auto& [name, value] : {std::pair("wheel-radius", options.wheel_radius),
                                    {"wheel-distance", options.wheel_distance},
                                    {"slip-factor", options.slip_factor},
                                    {"command-track", track}}) {
    if (!(value >= 0.001 && value <= 10.0)) throw po::error(fmt::format("--{} must be in [0.001, 10]", name));
  }
  options.topics.geometry.wheel_radius = options.wheel_radius;
  for (std::size_t i = 0; i < kAngles.size(); ++i) {
    constexpr double kTurn = 360.0;  // deg
    if (!(std::abs(options.imu_angles[i]) <= kTurn)) {
      throw po::error(fmt::format("--{} must be in [-{}, {}] deg", kAngles[i], kTurn, kTurn));
    }
    if (values.count(kAngles[i]) > 0) topics.imu_rotation = rotationOf(options.imu_angles);
  }
  return true;
}

void write(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  if (!(file << text) || !file.flush()) throw IdentificationError(path + ": cannot be written");
}

/// Renames a file to NAME.1 or the next free number. @returns the new name; empty for a device, or without a file.
std::string keepEarlier(const std::string& path) {
  if (!fs::is_regular_file(path)) return "";
  int number = 1;
  while (fs::exists(path + "." + std::to_string(number))) ++number;
  const std::string earlier = path + "." + std::to_string(number);
  fs::rename(path, earlier);
  return earlier;
}

/// A text as one word of a shell.
std::string word(const std::string& text) { return "'" + boost::replace_all_copy(text, "'", "'\\''") + "'"; }

/// Draws the picture of a table by the package's matplotlib script. Fails only for a picture that the user requested.
void draw(const IdentifyOptions& options, const std::string& table, std::ostream& out) {
  if (options.no_plot) return;
  const std::string picture = options.plot.empty() ? pictureOf(options.bag) : options.plot;
  const std::string script = ros::package::getPath("jackal_aic") + "/src/tools/view/plot_identification.py";
  std::signal(SIGPIPE, SIG_IGN);  // of a script that ends before it has read the table
  FILE* child = popen(("/usr/bin/python3 " + word(script) + " - " + word(picture)).c_str(), "w");
  if (child != nullptr) std::fputs(table.c_str(), child);
  if (child != nullptr && pclose(child) == 0) {
    out << "Figure: " << onOneLine(picture) << "\n";
    return;
  }
  const std::string failure = picture + ": could not be drawn, as said above; --no-plot leaves it out";
  if (!options.plot.empty()) throw IdentificationError(failure);
  std::cerr << "identify: " << onOneLine(failure) << "\n";
}

/// A time of the recording's clock as a date; empty if the clock is a simulation's.
std::string dateOf(double time) {
  constexpr double kFirstDate = 946684800.0;  // s, 2000-01-01
  return time >= kFirstDate ? fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(static_cast<std::time_t>(time))) : "";
}

/// Prints the present step for a waiting user.
void progress(const std::string& text) {
  if (isatty(STDERR_FILENO) != 0) std::cerr << text << "\n";
}

}  // namespace

int identify(const std::vector<std::string>& arguments, std::ostream& out) {
  IdentifyOptions options;
  if (!parse(arguments, out, options)) return 0;
  progress("Reading " + onOneLine(options.bag));
  const auto recording = readDriveBag(options.bag, options.topics);
  progress("Fitting " + std::to_string(recording.wheels.size()) + " wheel samples");
  auto result = identifyDriveTrain(recording, options.wheel_radius, options.slip_factor);
  remarkOnTrack(options.wheel_distance * options.slip_factor, result);
  out << identificationTable(result);
  if (!options.out.empty()) {
    const RecordingSource source{options.bag, dateOf(recording.commands.front().time), options.robot};
    const std::string model = plantModelYaml(result, source), earlier = keepEarlier(options.out);
    write(options.out, model);
    out << "Plant model: " << onOneLine(options.out) << "\n";
    if (!earlier.empty()) out << "The earlier plant model is now " << onOneLine(earlier) << "\n";
  }
  const std::string table = identificationCsv(recording, result);
  if (!options.csv.empty()) {
    write(options.csv, table);
    out << "Table: " << onOneLine(options.csv) << "\n";
  }
  out.flush();
  draw(options, table, out);
  return 0;
}

}  // namespace jackal_aic
