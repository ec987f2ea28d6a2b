// The way a user goes: files through roslaunch and rosparam, which reads YAML 1.1, into the real nodes. Every preset
// that ships and every file that the tools write has to start a controller that drives.

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "calibration.hpp"
#include "identification_report.hpp"
#include "package_files.hpp"
#include "slip_file.hpp"
#include "tune.hpp"

namespace jackal_aic {
namespace {

constexpr double kSpeed = 0.5;        // m/s
constexpr double kFinalWindow = 0.5;  // s
const std::string kConfig = std::string(JACKAL_AIC_SOURCE_DIR) + "/config/";

/// A port on which nobody listens.
int freePort() {
  const int listener = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  bind(listener, reinterpret_cast<sockaddr*>(&address), size);
  getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
  close(listener);
  return ntohs(address.sin_port);
}

/// Files of a run, gone after the test.
class Launch : public testing::Test {
 protected:
  Launch() {
    char name[] = "/tmp/launch_test_XXXXXX";
    directory_ = mkdtemp(name);
    write("step.yaml", "manoeuvre:\n  durations: [1, 2.5]\n  forward: [0, 0.5]\n  yaw_rate: [0, 0]\n");
  }
  ~Launch() override { std::filesystem::remove_all(directory_); }

  std::string path(const std::string& name) const { return directory_ + "/" + name; }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
    return path(name);
  }

  /// Drives a step through launch/step_response.launch; expects the wheels to be as fast as they are told.
  void expectDrives(const std::string& arguments) const {
    const std::string port = std::to_string(freePort());
    const std::string command = "ROS_MASTER_URI=http://127.0.0.1:" + port + " roslaunch -p " + port +
                                " jackal_aic step_response.launch real_time_factor:=2 manoeuvre:=" + path("step.yaml") +
                                " output_directory:=" + directory_ + " " + arguments + " > " + path("log") + " 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0) << text("log");
    EXPECT_NEAR(finalSpeed(), kSpeed, 0.05 * kSpeed) << arguments << "\n" << text("log");
  }

  std::string text(const std::string& name) const { return sim::readText(path(name)); }

 private:
  /// Mean measured speed [m/s] in the end; 0 if nothing was recorded.
  double finalSpeed() const {
    std::ifstream file(path("response.csv"));
    std::string line;
    std::getline(file, line);
    double sum = 0.0;
    int count = 0;
    while (std::getline(file, line)) {
      std::vector<double> row;
      std::istringstream cells(line);
      for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::strtod(cell.c_str(), nullptr));
      if (row.size() <= kMeasuredForward || row[0] < kEnd - kFinalWindow) continue;
      sum += row[kMeasuredForward];
      ++count;
    }
    return count > 0 ? sum / count : 0.0;
  }

  static constexpr double kEnd = 3.5;  // s
  static constexpr std::size_t kMeasuredForward = 5;
  std::string directory_;
};

class LaunchPreset : public Launch, public testing::WithParamInterface<const char*> {};

TEST_P(LaunchPreset, DrivesOnTheGround) { expectDrives(std::string("preset:=") + GetParam()); }

TEST_P(LaunchPreset, DrivesOnTheBox) {
  expectDrives(std::string("preset:=") + GetParam() + " plant:=" + kConfig + "plant_box.yaml plant_model:=" + kConfig +
               "plant_model_box.yaml");
}

INSTANTIATE_TEST_SUITE_P(Config, LaunchPreset,
                         testing::Values("standard", "improved", "tuned", "predictive", "diff_drive"));

Estimate known(double value) { return {value, 0.01 * value, ""}; }

/// A plant model as `identify` writes it, close to the simulated robot's.
std::string identifiedModel() {
  Identification result;
  result.dead_time = known(0.08);
  result.lag = known(0.00636);
  result.gain = known(1.0);
  result.acceleration_limit = known(1.65);
  result.track_left = result.track_right = known(0.547);
  return plantModelYaml(result, "some.bag");
}

/// The plant as `experiments calibrate` writes it, with numbers that are short only with an exponent or without a
/// point.
std::string calibratedPlant() {
  const sim::CalibrationTask& task = sim::calibrationTasks().back();
  sim::PlantParameters plant;
  plant.dead_time = 0.08;
  plant.motor_lag = 1e-5;
  plant.velocity_loop_integral = 1.0;
  plant.acceleration_limit = 2.0;
  return sim::withFittedValues(sim::readText(kConfig + task.file), task, plant);
}

TEST_F(Launch, TakesThePresetThatTuneWritesAndTheModelsThatIdentifyAndCalibrateWrite) {
  ControllerParameters gains = readControllerFile(kConfig + "improved.yaml").controller;
  gains.sensory_variances = {2.0, 2.0, 1e8, 1e12};
  expectDrives("preset:=" + write("tuned.yaml", presetText(gains, "as tune writes it")) + " plant_model:=" +
               write("model.yaml", identifiedModel()) + " plant:=" + write("plant.yaml", calibratedPlant()));
}

TEST_F(Launch, TakesTheSlipFileThatThePredictiveControllerWrote) {
  writeSlipFile(path("slip.yaml"), {0.55, 1.0});
  const std::string load =
      "/usr/bin/python3 -c 'import sys, rosparam; slip = rosparam.load_file(sys.argv[1])[0][0][\"slip\"]; "
      "sys.exit(not all(type(v) is float for v in slip.values()))' ";
  EXPECT_EQ(std::system((load + path("slip.yaml")).c_str()), 0) << text("slip.yaml");
}

}  // namespace
}  // namespace jackal_aic
