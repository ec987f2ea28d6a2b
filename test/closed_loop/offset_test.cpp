// Motors that turn by an offset slower than commanded (clearpath_robot#280), and controllers whose model knows it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "excitation.hpp"
#include "identification_report.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "jackal_aic/identification/plant_identification.hpp"
#include "loop_setup.hpp"
#include "monitored_loop.hpp"
#include "plant_conversion.hpp"
#include "stop_figures.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kOffset = 0.5;  // rad/s, of wheels whose gain is 1
constexpr double kDrive = 4.0;   // s
constexpr double kStand = 3.0;   // s

const SetPoint kStraight[] = {{0.1, 0.0, 0.0}, {0.5, 0.0, 0.0}, {1.5, 0.0, 0.0}, {-0.5, 0.0, 0.0}};
const SetPoint kTurns[] = {{0.0, 0.0, 0.5}, {0.3, 0.0, 0.3}, {0.5, 0.0, -0.5}, {1.0, 0.0, 1.0}};

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

/// The predictive preset with the limits of the drive gate. @param offset of the motors; @param told of the model
/// [rad/s].
LoopSetup setup(double offset, double told, const std::string& plant = "ground") {
  const LimitParameters limits;
  const auto text = [](double value) { return std::to_string(value); };
  return loadSetup(files(), "predictive", plant,
                   {{"limits.linear_acceleration", text(limits.linear_acceleration)},
                    {"limits.angular_acceleration", text(limits.angular_acceleration)},
                    {"plant.wheel_offset", text(offset)},
                    {"plant_model.offset", text(told)}});
}

/// Figures of a drive from rest to a set point and back, of which an arc is driven twice: how much it slips is learned
/// the first time.
struct Drive {
  StopFigures stop;
  double steady_forward = 0.0;    ///< mean of the last half second before the stop [m/s]
  double steady_yaw_rate = 0.0;   ///< likewise [rad/s]
  double believed_forward = 0.0;  ///< likewise, belief less truth [m/s]
  double believed_yaw_rate = 0.0;
};

Drive drive(const LoopSetup& setup, const SetPoint& set_point) {
  JackalPlant plant(setup.urdf, setup.plant);
  DriveLoop loop = makeLoop(setup);
  SetPointProfile profile = stopProfile(set_point, kDrive, kStand);
  const double begin = set_point.yaw_rate != 0.0 ? profile.duration : 0.0;
  if (begin > 0.0) {
    const auto once = profile.changes;
    for (auto change : once) {
      change.time += begin;
      profile.changes.push_back(change);
    }
    profile.duration += begin;
  }
  auto samples = runClosedLoop(plant, loop, profile, setup.plant.support, setup.drive.geometry, setup.loop);
  samples.erase(samples.begin(), std::find_if(samples.begin(), samples.end(),
                                              [begin](const Sample& sample) { return sample.time >= begin; }));
  Drive result;
  int count = 0;
  for (Sample& sample : samples) {
    sample.time -= begin;
    const double before_stop = kRestTime + kDrive - sample.time;
    if (before_stop <= 0.0 || before_stop > 0.5) continue;
    ++count;
    result.steady_forward += sample.velocity;
    result.steady_yaw_rate += sample.yaw_rate;
    result.believed_forward += (*sample.belief)(kForward)-sample.velocity;
    result.believed_yaw_rate += (*sample.belief)(kYaw)-sample.yaw_rate;
  }
  for (double* sum :
       {&result.steady_forward, &result.steady_yaw_rate, &result.believed_forward, &result.believed_yaw_rate}) {
    *sum /= count;
  }
  result.stop = assessStop(samples, set_point, kDrive);
  return result;
}

std::string nameOf(const SetPoint& set_point) {
  char text[64];
  std::snprintf(text, sizeof text, "%g m/s, %g rad/s", set_point.forward, set_point.yaw_rate);
  return text;
}

void show(const char* kind, const SetPoint& set_point, const Drive& drive) {
  std::printf("%-8s %-20s settles in %.3f s, overshoot %5.2f %%, steady %.4f m/s %.4f rad/s, belief off by %.4f %.4f\n",
              kind, nameOf(set_point).c_str(), drive.stop.settling.value_or(-1.0), drive.stop.overshoot_pct,
              drive.steady_forward, drive.steady_yaw_rate, drive.believed_forward, drive.believed_yaw_rate);
}

/// As on motors without an offset: within 2 % of the set point, and settled in 1.25 times the time.
void expectAsWithout(const LoopSetup& with, const SetPoint& set_point) {
  const Drive nominal = drive(setup(0.0, 0.0), set_point), told = drive(with, set_point);
  show("none", set_point, nominal);
  show("told", set_point, told);
  show("untold", set_point, drive(setup(kOffset, 0.0), set_point));
  const double forward = 0.02 * std::abs(set_point.forward), yaw_rate = 0.02 * std::abs(set_point.yaw_rate);
  EXPECT_NEAR(told.steady_forward, nominal.steady_forward, std::max(forward, 1e-3)) << nameOf(set_point);
  EXPECT_NEAR(told.steady_yaw_rate, nominal.steady_yaw_rate, std::max(yaw_rate, 2e-3)) << nameOf(set_point);
  EXPECT_NEAR(told.believed_forward, nominal.believed_forward, std::max(forward, 1e-3)) << nameOf(set_point);
  EXPECT_NEAR(told.believed_yaw_rate, nominal.believed_yaw_rate, std::max(yaw_rate, 2e-3)) << nameOf(set_point);
  ASSERT_TRUE(nominal.stop.settling && told.stop.settling) << nameOf(set_point);
  EXPECT_LE(*told.stop.settling, 1.25 * *nominal.stop.settling) << nameOf(set_point);
  EXPECT_LE(told.stop.overshoot_pct, std::max(5.0, nominal.stop.overshoot_pct + 2.0)) << nameOf(set_point);
}

TEST(Offset, KnownToTheModelIsNoneOfADriveStraight) {
  for (const SetPoint& set_point : kStraight) expectAsWithout(setup(kOffset, kOffset), set_point);
}

TEST(Offset, KnownToTheModelIsNoneOfATurn) {
  for (const SetPoint& set_point : kTurns) expectAsWithout(setup(kOffset, kOffset), set_point);
}

TEST(Offset, OfTheModelIsThatOfTheSimulatedRobot) {
  PlantParameters robot;
  robot.wheel_gain = 0.8;
  robot.wheel_offset = kOffset;
  EXPECT_DOUBLE_EQ(linearModel(robot).offset, 0.8 * kOffset) << "that of a wheel, not of its command";
  EXPECT_DOUBLE_EQ(simulatedRobot(linearModel(robot)).wheel_offset, kOffset);
}

TEST(Offset, OfThePlantFileIsToldNobodyByName) {
  EXPECT_EQ(loadSetup(files(), "predictive", "real", {}).drive.plant_model->offset, 0.0);
  EXPECT_GT(loadSetup(files(), "predictive", "real", {}).plant.wheel_offset, 0.0);
  EXPECT_EQ(monitorModel(files(), "real").offset, 0.0);
}

/// Commands and largest speed of a robot that is told to stand.
void expectRest(const std::vector<Sample>& samples, double from) {
  double command = 0.0, speed = 0.0;
  for (const Sample& sample : samples) {
    if (sample.time < from) continue;
    command = std::max({command, std::abs(sample.command.left), std::abs(sample.command.right)});
    speed = std::max(speed, std::abs(sample.velocity));
  }
  EXPECT_EQ(command, 0.0);
  EXPECT_LT(speed, 1e-3);
}

/// How a robot comes to rest after a stop.
struct Rest {
  int changes = 0;       ///< of the sign of the left wheels' command
  double command = 0.0;  ///< largest one from half a second after the stop on [rad/s]
};

Rest expectStand(LoopSetup setup, const SetPoint& set_point) {
  // Two robots are compared, and not what each teaches of its dead time.
  std::get<PredictiveParameters>(setup.drive.controller).learn_drive_train = false;
  constexpr double kStop = kRestTime + 2.0;  // s
  JackalPlant robot(setup.urdf, setup.plant);
  DriveLoop loop = makeLoop(setup);
  const SetPointProfile profile = stopProfile(set_point, 2.0, 6.0);
  const auto samples = runClosedLoop(robot, loop, profile, setup.plant.support, setup.drive.geometry, setup.loop);
  expectRest({samples.begin(), samples.begin() + 400}, 0.0);
  expectRest(samples, profile.duration - 3.0);
  Rest rest;
  double last = 0.0;
  for (const Sample& s : samples) {
    if (s.time < kStop || s.command.left == 0.0) continue;
    rest.changes += s.command.left * last < 0.0;
    last = s.command.left;
    if (s.time < kStop + 0.5) continue;
    rest.command = std::max({rest.command, std::abs(s.command.left), std::abs(s.command.right)});
  }
  return rest;
}

TEST(Offset, RobotThatIsToStandStands) {
  for (const char* plant : {"ground", "box"}) {
    for (const SetPoint& set_point : {SetPoint{0.5, 0.0, 0.0}, SetPoint{-0.1, 0.0, 0.0}, SetPoint{0.0, 0.0, 1.0}}) {
      const Rest told = expectStand(setup(kOffset, kOffset, plant), set_point);
      const Rest none = expectStand(setup(0.0, 0.0, plant), set_point);
      std::printf("%s, %s: sign changes %d (without %d), command at rest %.3f rad/s (without %.3f)\n", plant,
                  nameOf(set_point).c_str(), told.changes, none.changes, told.command, none.command);
      EXPECT_LE(told.changes, none.changes + 2);
      EXPECT_LT(told.command, 0.6 * kOffset) << "moves no wheel, nor one of a smaller offset";
    }
  }
}

TEST(Offset, KnownRoughlyHelps) {
  for (const double told : {0.35, 0.65}) {
    for (const double speed : {0.1, 0.5}) {
      const SetPoint set_point{speed, 0.0, 0.0};
      const Drive none = drive(setup(0.0, 0.0), set_point), rough = drive(setup(kOffset, told), set_point);
      show("rough", set_point, rough);
      EXPECT_NEAR(rough.steady_forward, none.steady_forward, 0.02 * speed);
      EXPECT_LE(rough.stop.settling.value(), drive(setup(kOffset, 0.0), set_point).stop.settling.value());
      EXPECT_LE(rough.stop.beyond_mps, 0.05);
    }
  }
}

TEST(Offset, LimitsOfTheCommandCostLittle) {
  for (const double acceleration : {1.1, 2.0, 5.0}) {
    for (const double speed : {0.1, 0.5, 1.5}) {
      const auto limited = [&](double offset) {
        LoopSetup robot = setup(offset, offset);
        robot.drive.gate.limits.linear_acceleration = acceleration;
        return drive(robot, {speed, 0.0, 0.0});
      };
      const Drive none = limited(0.0), told = limited(kOffset);
      std::printf("%g m/s^2, %g m/s: settles in %.3f s, without %.3f s; overshoot %.2f %%, without %.2f %%\n",
                  acceleration, speed, told.stop.settling.value_or(-1.0), none.stop.settling.value_or(-1.0),
                  told.stop.overshoot_pct, none.stop.overshoot_pct);
      // The limit takes its time for the command of the offset, too.
      EXPECT_LE(told.stop.settling.value(),
                1.25 * none.stop.settling.value() + kOffset * GeometryParameters{}.wheel_radius / acceleration);
    }
  }
}

/// Reports of the fault monitor on a drive through rest, both directions and turns.
int alarms(const LoopSetup& setup, const PlantModel& model) {
  SetPointProfile profile;
  double time = kRestTime;
  for (const SetPoint& set_point :
       {SetPoint{0.1, 0.0, 0.0}, SetPoint{1.0, 0.0, 0.0}, SetPoint{-0.5, 0.0, 0.0}, SetPoint{}, SetPoint{0.0, 0.0, 1.0},
        SetPoint{0.5, 0.0, 0.5}, SetPoint{0.05, 0.0, -0.3}, SetPoint{}, SetPoint{0.03, 0.0, 0.0}, SetPoint{}}) {
    profile.changes.push_back({time, set_point});
    time += 3.0;
  }
  profile.duration = time;
  int count = 0;
  bool reported = false;
  for (const MonitoredSample& sample : runMonitored(setup, model, profile, {})) {
    const bool now = sample.report.reason()[0] != 0;
    if (now && !reported) std::printf("%.2f s: %s\n", sample.time, sample.report.reason());
    count += now && !reported;
    reported = now;
  }
  return count;
}

TEST(Offset, KnownToTheModelIsNoFault) {
  PlantModel model = monitorModel(files(), "ground");
  for (const double told : {0.35, kOffset, 0.65}) {
    model.offset = told;
    for (const int seed : {1, 2, 3}) {
      LoopSetup with = setup(kOffset, told);
      with.plant.seed = static_cast<std::uint64_t>(seed);
      EXPECT_EQ(alarms(with, model), 0) << "told " << told << ", " << seed;
    }
  }
  model.offset = 0.0;
  std::printf("untold: %d alarms\n", alarms(setup(kOffset, 0.0), model));
}

/// The excitation of identify.launch, recorded.
DriveRecording record(const PlantParameters& parameters) {
  JackalPlant plant(files().urdf(), parameters);
  const Excitation excitation(ExcitationParameters{}, GeometryParameters{});
  DriveRecording recording;
  for (int k = 0; k < 1000 * excitation.duration(); ++k) {
    if (k % 20 == 7) {
      recording.commands.push_back({plant.time(), excitation.at(plant.time())});
      plant.command(recording.commands.back().command);
    }
    plant.step();
    if (!plant.measurement()) continue;
    const Observation y = plant.measurement()->observation();
    recording.wheels.push_back({y.stamp, {y.wheel_left, y.wheel_right}});
    recording.yaw.push_back({y.stamp, y.yaw_rate});
  }
  return recording;
}

/// The plant model that `identify` makes of a robot, as it is read from its file.
PlantModel identified(const PlantParameters& robot) {
  const std::string file = plantModelYaml(identifyDriveTrain(record(robot), GeometryParameters{}.wheel_radius),
                                          {"simulated.bag", "", "simulated"});
  ParameterMap map;
  addYamlText(file, "identified.yaml", map);
  robotName(map);
  const auto model = readParameters<PlantModel>(map, "plant_model");
  map.refuseUnknown();
  return model;
}

TEST(Offset, IsIdentifiedWrittenAndDrivenBy) {
  LoopSetup robot = setup(kOffset, 0.0);
  robot.plant.wheel_gain = 0.9;
  robot.drive.plant_model = identified(robot.plant);
  const PlantModel& model = *robot.drive.plant_model;
  std::printf("offset %.4f +- %.4f rad/s, gain %.4f +- %.4f\n", model.offset, model.offset_half_width, model.gain,
              model.gain_half_width);
  EXPECT_GT(model.offset_half_width, 0.0);
  EXPECT_NEAR(model.offset, 0.9 * kOffset, model.offset_half_width);
  EXPECT_NEAR(simulatedRobot(model).wheel_offset, kOffset, 0.05);
  expectAsWithout(robot, {0.1, 0.0, 0.0});
  expectAsWithout(robot, {0.5, 0.0, 0.0});
}

TEST(Offset, OfMotorsThatHaveNoneIsNotWritten) {
  const PlantModel model = identified(setup(0.0, 0.0).plant);
  EXPECT_LT(model.offset, 0.05);
  EXPECT_EQ(model.offset == 0.0, model.offset_half_width == 0.0);
}

}  // namespace
}  // namespace jackal_aic::sim
