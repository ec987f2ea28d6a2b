// Motors that turn slower than commanded by an offset (clearpath_robot#280), and controllers whose model knows it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "../excitation.hpp"
#include "drives.hpp"
#include "identification_report.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "jackal_aic/identification/plant_identification.hpp"
#include "loop_setup.hpp"
#include "plant_conversion.hpp"
#include "stop_figures.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kOffset = 0.5;  // rad/s, of wheels whose gain is 1
constexpr double kDrive = 4.0;   // s
constexpr double kStand = 3.0;   // s

/// The predictive preset with the limits of the drive gate. @param offset of the motors; @param known to the model
/// [rad/s].
LoopSetup setup(double offset, double known, const std::string& plant = "ground") {
  const LimitParameters limits;
  const auto text = [](double value) { return std::to_string(value); };
  return loadSetup(files(), "predictive", plant,
                   {{"limits.linear_acceleration", text(limits.linear_acceleration)},
                    {"limits.angular_acceleration", text(limits.angular_acceleration)},
                    {"plant.wheel_offset", text(offset)},
                    {"plant_model.offset", text(known)}});
}

/// Figures of a drive from rest to a set point and back; an arc is driven twice, to learn its slip first.
struct Drive {
  StopFigures stop;
  double forward = 0.0;                              ///< mean of the last half second before the stop [m/s]
  double yaw_rate = 0.0;                             ///< [rad/s]
  double forward_error = 0.0, yaw_rate_error = 0.0;  ///< belief minus truth, of the same mean
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
    result.forward += sample.velocity;
    result.yaw_rate += sample.yaw_rate;
    result.forward_error += (*sample.belief)(kForward)-sample.velocity;
    result.yaw_rate_error += (*sample.belief)(kYaw)-sample.yaw_rate;
  }
  for (double* sum : {&result.forward, &result.yaw_rate, &result.forward_error, &result.yaw_rate_error}) *sum /= count;
  result.stop = assessStop(samples, set_point, kDrive);
  return result;
}

/// Within 2 % of the set point as motors without an offset, settled in 1.25 times the time.
void expectAsWithoutOffset(const LoopSetup& with, const SetPoint& set_point) {
  SCOPED_TRACE(testing::Message() << set_point.forward << " m/s, " << set_point.yaw_rate << " rad/s");
  const Drive nominal = drive(setup(0.0, 0.0), set_point), known = drive(with, set_point);
  const double forward = std::max(0.02 * std::abs(set_point.forward), 1e-3);
  const double yaw_rate = std::max(0.02 * std::abs(set_point.yaw_rate), 2e-3);
  EXPECT_NEAR(known.forward, nominal.forward, forward);
  EXPECT_NEAR(known.yaw_rate, nominal.yaw_rate, yaw_rate);
  EXPECT_NEAR(known.forward_error, nominal.forward_error, forward);
  EXPECT_NEAR(known.yaw_rate_error, nominal.yaw_rate_error, yaw_rate);
  ASSERT_TRUE(nominal.stop.settling && known.stop.settling);
  EXPECT_LE(*known.stop.settling, 1.25 * *nominal.stop.settling);
  EXPECT_LE(known.stop.overshoot_pct, std::max(5.0, nominal.stop.overshoot_pct + 2.0));
}

TEST(Offset, KnownToTheModelDisturbsNoDrive) {
  for (const SetPoint& set_point :
       {SetPoint{0.1, 0.0, 0.0}, SetPoint{0.5, 0.0, 0.0}, SetPoint{1.5, 0.0, 0.0}, SetPoint{-0.5, 0.0, 0.0},
        SetPoint{0.0, 0.0, 0.5}, SetPoint{0.3, 0.0, 0.3}, SetPoint{0.5, 0.0, -0.5}, SetPoint{1.0, 0.0, 1.0}}) {
    expectAsWithoutOffset(setup(kOffset, kOffset), set_point);
  }
}

/// How a robot comes to rest after a stop.
struct Rest {
  int changes = 0;       ///< of the sign of the left wheels' command
  double command = 0.0;  ///< largest one from half a second after the stop on [rad/s]
};

Rest stop(LoopSetup setup, const SetPoint& set_point) {
  // Two robots are compared, without the dead time that each learns.
  std::get<PredictiveParameters>(setup.drive.controller).learn_drive_train = false;
  constexpr double kStop = kRestTime + 2.0;  // s
  JackalPlant robot(setup.urdf, setup.plant);
  DriveLoop loop = makeLoop(setup);
  const SetPointProfile profile = stopProfile(set_point, 2.0, 6.0);
  Rest rest;
  double last = 0.0;
  for (const Sample& s : runClosedLoop(robot, loop, profile, setup.plant.support, setup.drive.geometry, setup.loop)) {
    const double command = std::max(std::abs(s.command.left), std::abs(s.command.right));
    if (s.time < 0.4 || s.time >= profile.duration - 3.0) {
      EXPECT_EQ(command, 0.0) << s.time;
      EXPECT_LT(std::abs(s.velocity), 1e-3) << s.time;
    }
    if (s.time < kStop || s.command.left == 0.0) continue;
    rest.changes += s.command.left * last < 0.0;
    last = s.command.left;
    if (s.time >= kStop + 0.5) rest.command = std::max(rest.command, command);
  }
  return rest;
}

TEST(Offset, RobotComesToRest) {
  for (const char* plant : {"ground", "box"}) {
    for (const SetPoint& set_point : {SetPoint{0.5, 0.0, 0.0}, SetPoint{-0.1, 0.0, 0.0}, SetPoint{0.0, 0.0, 1.0}}) {
      const Rest known = stop(setup(kOffset, kOffset, plant), set_point);
      EXPECT_LE(known.changes, stop(setup(0.0, 0.0, plant), set_point).changes + 2);
      EXPECT_LT(known.command, 0.6 * kOffset) << "moves no wheel, nor one of a smaller offset";
    }
  }
}

TEST(Offset, KnownToTheModelIsNoFault) {
  SetPointProfile profile;  // through rest, in both directions and turns
  for (const SetPoint& set_point :
       {SetPoint{0.1, 0.0, 0.0}, SetPoint{1.0, 0.0, 0.0}, SetPoint{-0.5, 0.0, 0.0}, SetPoint{}, SetPoint{0.0, 0.0, 1.0},
        SetPoint{0.5, 0.0, 0.5}, SetPoint{0.05, 0.0, -0.3}, SetPoint{}, SetPoint{0.03, 0.0, 0.0}, SetPoint{}}) {
    profile.changes.push_back({kRestTime + 3.0 * static_cast<double>(profile.changes.size()), set_point});
  }
  profile.duration = kRestTime + 3.0 * static_cast<double>(profile.changes.size());
  PlantModel model = monitorModel(files(), "ground");
  for (const double known : {0.35, kOffset, 0.65}) {
    model.offset = known;
    for (const std::uint64_t seed : {1, 2, 3}) {
      LoopSetup with = setup(kOffset, known);
      with.plant.seed = seed;
      for (const MonitoredSample& sample : runMonitored(with, model, profile, {})) {
        ASSERT_STREQ(sample.report.reason(), "") << "known " << known << ", seed " << seed << ", " << sample.time;
      }
    }
  }
}

/// The plant model that `identify` makes of a robot's excitation, as it is read from its file.
PlantModel identified(const PlantParameters& robot) {
  JackalPlant plant(files().urdf(), robot);
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
  ParameterMap map;
  addYamlText(plantModelYaml(identifyDriveTrain(recording, GeometryParameters{}.wheel_radius),
                             {"simulated.bag", "", "simulated"}),
              "identified.yaml", map);
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
  EXPECT_GT(model.offset_half_width, 0.0);
  EXPECT_NEAR(model.offset, 0.9 * kOffset, model.offset_half_width);
  EXPECT_NEAR(simulatedRobot(model).wheel_offset, kOffset, 0.05);
  expectAsWithoutOffset(robot, {0.1, 0.0, 0.0});
  expectAsWithoutOffset(robot, {0.5, 0.0, 0.0});
  const PlantModel none = identified(setup(0.0, 0.0).plant);
  EXPECT_LT(none.offset, 0.05);
  EXPECT_EQ(none.offset == 0.0, none.offset_half_width == 0.0);
}

}  // namespace
}  // namespace jackal_aic::sim
