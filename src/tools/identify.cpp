#include <fmt/format.h>
#include <ros/package.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <boost/program_options.hpp>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iostream>

#include "drive_bag.hpp"
#include "identification_report.hpp"
#include "jackal_aic/config/text.hpp"

namespace {

namespace po = boost::program_options;
using jackal_aic::IdentificationError;

struct Options {
  std::string bag, out, robot, plot, csv;
  double wheel_radius = 0.098;
  double slip_factor = 1.0;
  std::vector<double> imu_rotation;
  jackal_aic::BagTopics topics;
};

/// Orientation by roll, pitch and yaw [deg], of fixed axes in this order. @throws po::error if they are not three
/// finite numbers.
Eigen::Quaterniond rotationOf(const std::vector<double>& degrees) {
  if (degrees.size() != 3 || !Eigen::Map<const Eigen::Vector3d>(degrees.data()).allFinite()) {
    throw po::error(
        fmt::format("--imu-rotation has {} values; expected 3, finite: roll, pitch and yaw, deg", degrees.size()));
  }
  const Eigen::Vector3d angles = Eigen::Map<const Eigen::Vector3d>(degrees.data()) * (M_PI / 180.0);
  return Eigen::Quaterniond(Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()) *
                            Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
                            Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX()));
}

/// The options, or nothing if the help was asked for.
bool parse(int argc, char** argv, Options& options) {
  po::options_description named("Options");
  named.add_options()("help,h", "show this text")("bag", po::value(&options.bag), "bag to read (also without --bag)")(
      "out", po::value(&options.out), "write the plant model as YAML")(
      "robot", po::value(&options.robot), "which robot it is, in a few words, for the plant model")(
      "plot", po::value(&options.plot), "picture to write (default: the bag's name with .png)")(
      "csv", po::value(&options.csv), "write measured and fitted wheel speeds")(
      "wheel-radius", po::value(&options.wheel_radius)->default_value(options.wheel_radius, "0.098"), "m")(
      "slip-factor", po::value(&options.slip_factor)->default_value(options.slip_factor),
      "robot.slip_factor of the controller that the model is for")(
      "drive-topic", po::value(&options.topics.drive)->default_value(options.topics.drive), "jackal_msgs/Drive")(
      "wheel-topic", po::value(&options.topics.wheels)->default_value(options.topics.wheels), "sensor_msgs/JointState")(
      "imu-topic", po::value(&options.topics.imu)->default_value(options.topics.imu), "sensor_msgs/Imu")(
      "imu-rotation", po::value(&options.imu_rotation)->multitoken()->value_name("ROLL PITCH YAW"),
      "how the IMU is mounted, deg (default: as /tf_static in the bag says, or as base_link)");
  po::positional_options_description positional;
  positional.add("bag", 1);
  po::variables_map values;
  po::store(po::command_line_parser(argc, argv).options(named).positional(positional).run(), values);
  po::notify(values);
  if (values.count("help") > 0) {
    std::cout
        << "Usage: identify BAG [--out plant_model.yaml] [options]\nFits dead time, lag, gain, acceleration limit and "
           "effective track to a recorded drive (see launch/identify.launch).\n"
        << named;
    return false;
  }
  if (options.bag.empty()) throw po::error("no bag given; usage: identify BAG [--out plant_model.yaml], see --help");
  const auto within = [](double value) { return value >= 0.001 && value <= 10.0; };
  if (!within(options.wheel_radius)) throw po::error("--wheel-radius must be in [0.001, 10] m");
  if (!within(options.slip_factor)) throw po::error("--slip-factor must be in [0.001, 10]");
  if (!options.imu_rotation.empty()) options.topics.imu_rotation = rotationOf(options.imu_rotation);
  if (options.plot.empty()) options.plot = options.bag.substr(0, options.bag.rfind(".bag")) + ".png";
  return true;
}

void write(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  if (!(file << text) || !file.flush()) throw IdentificationError(path + ": cannot be written");
}

/// Draws the picture by the package's matplotlib script.
void plot(const std::string& csv, const std::string& picture) {
  const std::string script = ros::package::getPath("jackal_aic") + "/sim/report/plot_identification.py";
  const pid_t child = fork();
  if (child == 0) {
    execl("/usr/bin/python3", "python3", script.c_str(), csv.c_str(), picture.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child || status != 0) {
    throw IdentificationError(picture + ": could not be drawn; " + script + " says why above, " + csv +
                              " holds the data");
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
  progress("Reading " + options.bag);
  const auto recording = jackal_aic::readDriveBag(options.bag, options.topics);
  progress("Fitting " + std::to_string(recording.wheels.size()) + " wheel samples");
  const auto result = jackal_aic::identifyDriveTrain(recording, options.wheel_radius, options.slip_factor);
  std::cout << jackal_aic::identificationTable(result);
  if (!options.out.empty()) write(options.out, jackal_aic::plantModelYaml(result, sourceOf(options, recording)));
  const std::string csv = options.csv.empty() ? options.plot + ".csv" : options.csv;
  write(csv, jackal_aic::identificationCsv(recording, result));
  plot(csv, options.plot);
  if (options.csv.empty()) std::remove(csv.c_str());
  if (!options.out.empty()) std::cout << "Plant model: " << options.out << "\n";
  std::cout << "Figure: " << options.plot << "\n";
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Options options;
    if (parse(argc, argv, options)) identify(options);
  } catch (const std::exception& error) {
    std::cerr << "identify: " << jackal_aic::onOneLine(error.what()) << "\n";
    return 1;
  }
  return 0;
}
