#include <fmt/format.h>
#include <ros/package.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <boost/program_options.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>
#include <sstream>

#include "bag_file.hpp"
#include "drive_bag.hpp"
#include "identification_report.hpp"
#include "jackal_aic/config/text.hpp"

namespace {

namespace po = boost::program_options;
using jackal_aic::IdentificationError;

struct Options {
  std::string bag, out, robot, plot, csv;
  double wheel_radius = 0.098;
  double wheel_distance = 0.376;  // m
  double slip_factor = 1.0;
  std::string imu_rotation;
  bool no_plot = false;
  jackal_aic::BagTopics topics;
};

/// A text that is a number, whichever; nothing of another.
std::optional<double> number(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return end != text.c_str() && *end == '\0' ? std::optional<double>(value) : std::nullopt;
}

/// Orientation by roll, pitch and yaw [deg], of fixed axes in this order. @throws po::error if they are not three
/// numbers within a turn.
Eigen::Quaterniond rotationOf(const std::string& text) {
  constexpr double kTurn = 360.0;  // deg
  std::istringstream words(text);
  const std::vector<std::string> degrees{std::istream_iterator<std::string>(words), {}};
  std::vector<double> angles;  // rad
  for (const std::string& word : degrees) {
    const auto angle = number(word);
    if (angle && std::abs(*angle) <= kTurn) angles.push_back(*angle * (M_PI / 180.0));
  }
  if (degrees.size() != 3 || angles.size() != 3) {
    throw po::error(fmt::format("--imu-rotation = {}: must be three angles within +-{:g} deg: roll, pitch and yaw",
                                jackal_aic::quoted(text), kTurn));
  }
  return Eigen::Quaterniond(Eigen::AngleAxisd(angles[2], Eigen::Vector3d::UnitZ()) *
                            Eigen::AngleAxisd(angles[1], Eigen::Vector3d::UnitY()) *
                            Eigen::AngleAxisd(angles[0], Eigen::Vector3d::UnitX()));
}

/// The arguments with the angles behind --imu-rotation as its one value: program_options would take -90 for an option,
/// and a bag behind three angles for a fourth.
std::vector<std::string> joinedRotation(int argc, char** argv) {
  const std::string name = "--imu-rotation";
  std::vector<std::string> arguments(argv + 1, argv + argc), joined;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    joined.push_back(arguments[i]);
    const bool first_follows = arguments[i] == name;
    if (!first_follows && arguments[i].rfind(name + "=", 0) != 0) continue;
    const std::size_t last = i + (first_follows ? 3 : 2);
    std::string& angles = joined.back();
    for (; i < last && i + 1 < arguments.size() && number(arguments[i + 1]); ++i) {
      angles += (angles == name ? "=" : " ") + arguments[i + 1];
    }
  }
  return joined;
}

/// The picture of a bag: in its folder, by another name than the one that `plot` draws.
std::string pictureOf(const std::string& bag) {
  std::filesystem::path path(bag);
  if (path.extension() == ".bag") path.replace_extension();
  return path.string() + "_identification.png";
}

/// The options, or nothing if the help was asked for.
bool parse(int argc, char** argv, Options& options) {
  po::options_description named("Options");
  named.add_options()("help,h", "show this text")("bag", po::value(&options.bag), "bag to read (also without --bag)")(
      "out", po::value(&options.out),
      "write the plant model as YAML; a file of this name is kept as NAME.1, NAME.2, ...")(
      "robot", po::value(&options.robot), "which robot it is, in a few words, for the plant model")(
      "plot", po::value(&options.plot), "picture to write (default: the bag's name with _identification.png)")(
      "no-plot", po::bool_switch(&options.no_plot), "draw no picture")("csv", po::value(&options.csv),
                                                                       "write measured and fitted wheel speeds")(
      "wheel-radius", po::value(&options.wheel_radius)->default_value(options.wheel_radius, "0.098"), "m")(
      "wheel-distance", po::value(&options.wheel_distance)->default_value(options.wheel_distance, "0.376"),
      "of the left wheels from the right ones, m: no robot turns by less")(
      "slip-factor", po::value(&options.slip_factor)->default_value(options.slip_factor),
      "robot.slip_factor of the controller that the model is for")(
      "command-topic", po::value(&options.topics.commands)->default_value(options.topics.commands),
      "jackal_msgs/Drive, geometry_msgs/Twist or TwistStamped")(
      "command-track",
      po::value(&options.topics.geometry.effective_track)
          ->default_value(options.topics.geometry.effective_track, "0.5621"),
      "m, wheel separation times multiplier with which the robot's controller turns a Twist into wheel speeds")(
      "wheel-topic", po::value(&options.topics.wheels)->default_value(options.topics.wheels), "sensor_msgs/JointState")(
      "imu-topic", po::value(&options.topics.imu)->default_value(options.topics.imu), "sensor_msgs/Imu")(
      "imu-rotation", po::value(&options.imu_rotation)->value_name("ROLL PITCH YAW"),
      "how the IMU is mounted, deg (default: as /tf_static or /tf in the bag says)")(
      "base-frame", po::value(&options.topics.base_frame)->default_value(options.topics.base_frame),
      "frame of the robot in them");
  po::positional_options_description positional;
  positional.add("bag", 1);
  po::variables_map values;
  po::store(po::command_line_parser(joinedRotation(argc, argv)).options(named).positional(positional).run(), values);
  po::notify(values);
  if (values.count("help") > 0) {
    std::cout
        << "Usage: identify BAG [--out plant_model.yaml] [options]\nFits dead time, lag, gain, acceleration limit and "
           "effective track to a recorded drive (see launch/identify.launch).\n"
        << named;
    return false;
  }
  if (options.bag.empty()) throw po::error("no bag given; usage: identify BAG [--out plant_model.yaml], see --help");
  if (options.no_plot && !options.plot.empty()) throw po::error("--plot and --no-plot: give one of them");
  const auto within = [](double value) { return value >= 0.001 && value <= 10.0; };
  if (!within(options.wheel_radius)) throw po::error("--wheel-radius must be in [0.001, 10] m");
  if (!within(options.wheel_distance)) throw po::error("--wheel-distance must be in [0.001, 10] m");
  if (!within(options.slip_factor)) throw po::error("--slip-factor must be in [0.001, 10]");
  if (!within(options.topics.geometry.effective_track)) throw po::error("--command-track must be in [0.001, 10] m");
  options.topics.geometry.wheel_radius = options.wheel_radius;
  if (values.count("imu-rotation") > 0) options.topics.imu_rotation = rotationOf(options.imu_rotation);
  return true;
}

void write(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  if (!(file << text) || !file.flush()) throw IdentificationError(path + ": cannot be written");
}

/// Writes a file as a whole, or leaves what is there as it was. What is no file, as /dev/stdout, is written to.
/// @returns the name by which an earlier file is kept, as keepEarlier().
std::string replace(const std::string& path, const std::string& text) {
  std::error_code error;
  if (std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error)) {
    write(path, text);
    return "";
  }
  const std::string fresh = path + ".new";
  try {
    write(fresh, text);
  } catch (const IdentificationError&) {
    std::filesystem::remove(fresh, error);
    throw IdentificationError(path + ": cannot be written");
  }
  std::string earlier = jackal_aic::keepEarlier(path);
  std::filesystem::rename(fresh, path);
  return earlier;
}

/// A directory that is gone with the object.
class TemporaryDirectory {
 public:
  TemporaryDirectory() : path_((std::filesystem::temp_directory_path() / "identify_XXXXXX").string()) {
    if (mkdtemp(path_.data()) == nullptr) throw IdentificationError(path_ + ": cannot be made");
  }
  ~TemporaryDirectory() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// Draws the picture by the package's matplotlib script.
void plot(const std::string& csv, const std::string& picture) {
  const std::string script = ros::package::getPath("jackal_aic") + "/src/tools/view/plot_identification.py";
  const pid_t child = fork();
  if (child == 0) {
    execl("/usr/bin/python3", "python3", script.c_str(), csv.c_str(), picture.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child || status != 0) {
    throw IdentificationError(picture + ": could not be drawn, as said above; --no-plot leaves it out");
  }
}

/// Writes the table if it was asked for.
void writeTable(const Options& options, const std::string& table) {
  if (options.csv.empty()) return;
  write(options.csv, table);
  std::cout << "Table: " << jackal_aic::onOneLine(options.csv) << "\n";
}

/// Draws the picture of a table. Only one that was asked for is a reason to fail.
void drawTable(const Options& options, const std::string& table) {
  if (options.no_plot) return;
  const std::string picture = options.plot.empty() ? pictureOf(options.bag) : options.plot;
  try {
    const TemporaryDirectory directory;
    const std::string csv = directory.path() + "/identification.csv";
    write(csv, table);
    plot(csv, picture);
    std::cout << "Figure: " << jackal_aic::onOneLine(picture) << "\n";
  } catch (const std::exception& error) {
    if (!options.plot.empty()) throw;
    std::cerr << "identify: " << jackal_aic::onOneLine(error.what()) << "\n";
  }
}

/// A time of the recording's clock as a date; empty if the clock is a simulation's.
std::string dateOf(double time) {
  constexpr double kFirstDate = 946684800.0;  // s, 2000-01-01
  if (!(time >= kFirstDate)) return "";
  const auto seconds = static_cast<std::time_t>(time);
  std::tm utc{};
  std::array<char, 32> text{};
  if (gmtime_r(&seconds, &utc) == nullptr) return "";
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M UTC", &utc)};
}

jackal_aic::RecordingSource sourceOf(const Options& options, const jackal_aic::DriveRecording& recording) {
  return {options.bag, dateOf(recording.commands.front().time), options.robot};
}

/// Says what is being done, to a person who waits.
void progress(const std::string& text) {
  if (isatty(STDERR_FILENO) != 0) std::cerr << text << "\n";
}

void identify(const Options& options) {
  progress("Reading " + jackal_aic::onOneLine(options.bag));
  const auto recording = jackal_aic::readDriveBag(options.bag, options.topics);
  progress("Fitting " + std::to_string(recording.wheels.size()) + " wheel samples");
  auto result = jackal_aic::identifyDriveTrain(recording, options.wheel_radius, options.slip_factor);
  jackal_aic::remarkOnTrack(options.wheel_distance * options.slip_factor, result);
  std::cout << jackal_aic::identificationTable(result);
  if (!options.out.empty()) {
    const std::string model = jackal_aic::plantModelYaml(result, sourceOf(options, recording));
    const std::string earlier = replace(options.out, model);
    std::cout << "Plant model: " << jackal_aic::onOneLine(options.out) << "\n";
    if (!earlier.empty()) std::cout << "The earlier plant model is now " << jackal_aic::onOneLine(earlier) << "\n";
  }
  const std::string table = jackal_aic::identificationCsv(recording, result);
  writeTable(options, table);
  std::cout.flush();
  drawTable(options, table);
}

}  // namespace

int main(int argc, char** argv) {
  return jackal_aic::inChildProcess("identify", [&] {
    try {
      Options options;
      if (parse(argc, argv, options)) identify(options);
      return 0;
    } catch (const std::exception& error) {
      std::cerr << "identify: " << jackal_aic::onOneLine(error.what()) << "\n";
      return 1;
    }
  });
}
