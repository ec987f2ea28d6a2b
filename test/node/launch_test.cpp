// Files through roslaunch and rosparam into the real nodes: every preset that ships and every file that the tools write
// has to start a controller that drives.

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <tuple>

#include "../temporary_directory.hpp"
#include "identification_report.hpp"
#include "jackal_aic/config/text_file.hpp"
#include "jackal_aic/config/yaml_text.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic {
namespace {

constexpr double kFinalWindow = 0.5;                              // s
constexpr double kWheelRadius = 0.098, kEffectiveTrack = 0.5621;  // m
const std::string kConfig = std::string(JACKAL_AIC_SOURCE_DIR) + "/config/";

/// A free port.
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

/// What step_recorder drives, and how many of its set points are not zero.
struct ManoeuvreFile {
  const char* text;
  std::size_t legs;
};

const ManoeuvreFile kStep{R"(manoeuvre:
  durations: [1, 2.5]
  forward: [0, 0.5]
  yaw_rate: [0, 0]
)",
                          1};

/// Slow, fast, an arc, a turn, each with a stop.
const ManoeuvreFile kTour{R"(manoeuvre:
  durations: [1, 2, 1, 2.5, 1.5, 2, 1, 2, 1]
  forward: [0, 0.1, 0, 1.5, 0, 0.5, 0, 0, 0]
  yaw_rate: [0, 0, 0, 0, 0, 0.5, 0, 0.5, 0]
)",
                          4};

/// What tells the motion.
enum class Witness {
  truth,  ///< of the chassis
  wheels  ///< on the box: encoders for the forward speed, commands for the yaw rate, where a turn can only be told so
};

/// A set point that is not zero, and the motion while it holds.
struct Leg {
  SetPoint set_point;
  double forward = 0.0, yaw_rate = 0.0;  // mean in the end [m/s, rad/s]
  double fastest = 0.0;                  // forward [m/s]
};

/// Legs of a response.csv.
std::vector<Leg> legsOf(const std::string& path, Witness witness) {
  enum Column {
    kTime,
    kSetForward,
    kSetYawRate,
    kTrueForward,
    kTrueYawRate,
    kMeasuredForward,
    kLeft = 9,
    kRight,
    kAll
  };
  std::vector<std::vector<std::vector<double>>> parts;  // rows of equal set points
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<double> cells;
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(std::strtod(cell.c_str(), nullptr));
    if (cells.size() < kAll) continue;
    if (parts.empty() || !std::equal(&cells[kSetForward], &cells[kTrueForward], &parts.back()[0][kSetForward])) {
      parts.emplace_back();
    }
    parts.back().push_back(cells);
  }
  std::vector<Leg> legs;
  for (const auto& rows : parts) {
    Leg leg;
    leg.set_point = {rows[0][kSetForward], 0.0, rows[0][kSetYawRate]};
    if (leg.set_point.vector().isZero(0.0)) continue;
    int count = 0;
    for (const auto& row : rows) {
      const bool truth = witness == Witness::truth;
      const double forward = row[truth ? kTrueForward : kMeasuredForward];
      leg.fastest = std::max(leg.fastest, forward);
      if (row[kTime] < rows.back()[kTime] - kFinalWindow) continue;
      ++count;
      leg.forward += (forward - leg.forward) / count;
      const double turning = kWheelRadius * (row[kRight] - row[kLeft]) / kEffectiveTrack;
      leg.yaw_rate += ((truth ? row[kTrueYawRate] : turning) - leg.yaw_rate) / count;
    }
    legs.push_back(leg);
  }
  return legs;
}

/// Files of a run, gone after the test.
class Launch : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return directory_.path(name); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
    return path(name);
  }

  /// Drives a manoeuvre through launch/step_response.launch, twice as fast as real time. Expects the robot to follow
  /// its set point in every leg; returns the legs.
  std::vector<Leg> drive(const ManoeuvreFile& manoeuvre, const std::string& arguments, Witness witness) const {
    launch(manoeuvre, arguments);
    const std::vector<Leg> legs = legsOf(path("response.csv"), witness);
    EXPECT_EQ(legs.size(), manoeuvre.legs) << text("log");
    for (const Leg& leg : legs) {
      SCOPED_TRACE(testing::Message() << arguments << "\n"
                                      << leg.set_point.vector().transpose() << "\n"
                                      << text("log"));
      EXPECT_NEAR(leg.forward, leg.set_point.forward, 0.05 * std::max(0.1, std::abs(leg.set_point.forward)));
      EXPECT_NEAR(leg.yaw_rate, leg.set_point.yaw_rate, std::max(0.03, 0.1 * std::abs(leg.set_point.yaw_rate)));
    }
    return legs;
  }

  /// Runs launch/step_response.launch to its end; what it says is in the file log.
  void launch(const ManoeuvreFile& manoeuvre, const std::string& arguments) const {
    roslaunch("step_response.launch real_time_factor:=2 manoeuvre:=" + write("manoeuvre.yaml", manoeuvre.text) +
              " output_directory:=" + directory_.path() + " " + arguments);
  }

  /// Runs a launch file to its end, in a namespace and the directory of the test; what it says is in the file log.
  void roslaunch(const std::string& arguments, const std::string& name_space = "/") const {
    const std::string port = std::to_string(freePort());
    const std::string command = "cd " + directory_.path() + " && ROS_NAMESPACE=" + name_space +
                                " ROS_MASTER_URI=http://127.0.0.1:" + port + " timeout -s INT 300 roslaunch -p " +
                                port + " jackal_aic " + arguments + " > " + path("log") + " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0);
  }

  std::string text(const std::string& name) const { return readText(path(name)); }

 private:
  TemporaryDirectory directory_;
};

/// Preset and plant.
class LaunchPreset : public Launch, public testing::WithParamInterface<std::tuple<const char*, const char*>> {};

TEST_P(LaunchPreset, DrivesSlowlyFastOnAnArcAndInPlaceAndStops) {
  const auto [preset, plant] = GetParam();
  const bool on_box = plant == std::string("box");
  drive(kTour, std::string("preset:=") + preset + (on_box ? " plant:=box" : ""),
        on_box ? Witness::wheels : Witness::truth);
}

INSTANTIATE_TEST_SUITE_P(Config, LaunchPreset,
                         testing::Combine(testing::Values("standard", "improved", "tuned", "predictive", "diff_drive"),
                                          testing::Values("ground", "box")));

Estimate known(double value) { return {value, 0.01 * value, ""}; }

/// What `identify` finds out about a robot that is close to the simulated one.
Identification identified() {
  Identification result;
  result.dead_time = known(0.08);
  result.lag = known(0.00636);
  result.gain = known(1.0);
  result.acceleration_limit = known(1.65);
  result.track_left = result.track_right = known(0.547);
  return result;
}

/// The same as `identify` writes it.
std::string identifiedModel() { return plantModelYaml(identified(), {"some.bag", "", ""}); }

/// The plant with numbers that are short only with an exponent or without a point, as YAML allows.
std::string calibratedPlant() {
  std::string text = readText(kConfig + "plant.yaml");
  for (const auto& [key, value] : {std::pair{"motor_lag", "1.0e-05"}, {"velocity_loop_integral", "1.0"}}) {
    text =
        std::regex_replace(text, std::regex(std::string("(\\n +") + key + ": )[^ \\n]+"), std::string("$01") + value);
  }
  return text;
}

TEST_F(Launch, TakesThePresetOfTuneAndTheModelOfIdentify) {
  ControllerParameters gains = std::get<ControllerParameters>(readControllerFile(kConfig + "improved.yaml").controller);
  gains.sensory_variances = {2.0, 2.0, 1e8, 1e12};
  drive(kStep,
        "preset:=" + write("tuned.yaml", "# as tune writes it\n" + yamlBlock("controller", gains)) + " plant_model:=" +
            write("model.yaml", identifiedModel()) + " plant:=" + write("plant.yaml", calibratedPlant()),
        Witness::truth);
}

// Without the action bound the action winds up while the motors are at their limit.
TEST_F(Launch, DrivesAsTheThesisPrints) {
  const ManoeuvreFile step{"manoeuvre:\n  durations: [1, 3]\n  forward: [0, 1]\n  yaw_rate: [0, 0]\n", 1};
  for (const bool printed : {false, true}) {
    const auto legs =
        drive(step, std::string("preset:=standard printed:=") + (printed ? "true" : "false"), Witness::truth);
    ASSERT_EQ(legs.size(), 1u);
    EXPECT_EQ(legs[0].fastest > 1.05, printed) << legs[0].fastest;
  }
}

// The dead time is half the shipped model's, which tells whose model the controller took.
TEST_F(Launch, GivesTheControllerTheModelOfAPlantThatIdentifyWrote) {
  Identification result = identified();
  result.dead_time = known(0.04);
  const std::string file = write("robot.yaml", plantModelYaml(result, {"some.bag", "", ""}));
  drive(kStep, "plant:=" + file, Witness::truth);
  EXPECT_NE(text("log").find("/plant_model/dead_time: 0.04"), std::string::npos) << text("log");
}

TEST_F(Launch, SaysThatAPlantWithoutAModelOfItNeedsOne) {
  launch(kStep, "plant:=" + write("plant.yaml", calibratedPlant()));
  EXPECT_TRUE(legsOf(path("response.csv"), Witness::truth).empty());
  EXPECT_NE(text("log").find("plant_model:=FILE"), std::string::npos) << text("log");
}

// The command that it shows in the end is the one that works.
TEST_F(Launch, RecordsTheExcitationInANamespaceIntoAnyPath) {
  write("my father\'s drive.bag", "an earlier drive");
  const std::string plant = write("plant.yaml", readText(kConfig + "plant.yaml") + "real_time_factor: 2.0\n");
  roslaunch("identify.launch simulated:=true countdown:=0 plant:=" + plant + " bag:=\"my father's drive.bag\"",
            "/robot1");
  std::smatch shown;
  const std::string said = text("log");
  ASSERT_TRUE(std::regex_search(said, shown, std::regex("Next:\n +(rosrun jackal_aic identify .*)\n"))) << said;
  const std::string identify = "cd " + path("") + " && " + shown.str(1) + " > identified 2>&1";
  EXPECT_EQ(std::system(identify.c_str()), 0) << identify << "\n" << text("identified");
  EXPECT_NE(text("my_jackal.yaml").find("dead_time"), std::string::npos);
  EXPECT_EQ(text("my father's drive.bag.1"), "an earlier drive");
}

// A controller that does not keep up would tell of dropped periods and measurements without an end.
TEST_F(Launch, ASimulationAsFastAsItCanWaitsForItsController) {
  for (const auto& [factor, lockstep] : {std::pair("0", "0.022"), std::pair("2", "0.0")}) {
    const std::string command = std::string("roslaunch --dump-params jackal_aic simulation.launch real_time_factor:=") +
                                factor + " > " + path("log") + " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0);
    EXPECT_NE(text("log").find(std::string("/plant/lockstep: ") + lockstep + "\n"), std::string::npos) << text("log");
  }
}

// Ctrl-C reaches the robot and its controller at once, and the controller brakes on simulated time.
TEST_F(Launch, ASimulationThatIsEndedWhileItDrivesComesToRest) {
  const std::string manoeuvre =
      write("manoeuvre.yaml", "manoeuvre: {durations: [1, 600], forward: [0, 0.5], yaw_rate: [0, 0]}\n");
  const std::string port = std::to_string(freePort());
  const std::string command =
      "cd " + path("") +
      "; touch log; (for i in $(seq 300); do grep -qs Driving log && break; sleep 0.2; done; sleep 1; " +
      "kill -INT $$) & exec env ROS_MASTER_URI=http://127.0.0.1:" + port + " stdbuf -oL roslaunch -p " + port +
      " jackal_aic step_response.launch preset:=predictive manoeuvre:=" + manoeuvre + " output_directory:=" + path("") +
      " > " + path("log") + " 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_NE(text("log").find("Driving"), std::string::npos) << text("log");
  EXPECT_NE(text("log").find("Stopping; wheels at zero"), std::string::npos) << text("log");
  EXPECT_EQ(text("log").find("before the wheels are at rest"), std::string::npos) << text("log");
}

TEST_F(Launch, EndsTheExcitationWhoseArgumentIsRefused) {
  for (const auto& [refused, said] : {std::pair("linear_speed:=50", "--linear-speed: 50: must be in [0.1, 2.0]"),
                                      {"confirm:=yes", "--confirm: invalid choice: 'yes'"},
                                      {"countdown:=abc", "--countdown: invalid number value: 'abc'"},
                                      {"repetitions:=0", "--repetitions: 0: must be in [1, 100]"}}) {
    roslaunch(std::string("identify.launch simulated:=true bag:=drive.bag ") + refused);
    EXPECT_NE(text("log").find(said), std::string::npos) << text("log");
    EXPECT_EQ(text("log").find("The excitation is complete"), std::string::npos) << refused;
  }
}

}  // namespace
}  // namespace jackal_aic
