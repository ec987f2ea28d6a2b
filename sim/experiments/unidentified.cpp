#include "unidentified.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "campaign.hpp"
#include "csv.hpp"
#include "parallel.hpp"
#include "plant_conversion.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kArrival = 2.0;        // s after a change of the set point that belong to its step response
constexpr double kForwardSwing = 0.05;  // m/s
constexpr double kYawSwing = 0.15;      // rad/s

/// Counts the turning points of a value that are further from the last one than a threshold.
class Swings {
 public:
  explicit Swings(double threshold) : threshold_(threshold) {}

  void add(double value) {
    if (!any_) low_ = high_ = value;
    any_ = true;
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
    if (direction_ >= 0 && high_ - value > threshold_) {
      turn(-1, value);
    } else if (direction_ <= 0 && value - low_ > threshold_) {
      turn(1, value);
    }
  }

  int count() const { return count_; }

 private:
  void turn(int direction, double value) {
    if (direction_ != 0) ++count_;
    direction_ = direction;
    low_ = high_ = value;
  }

  double threshold_;
  double low_ = 0.0, high_ = 0.0;  // since the last turning point was left behind
  int direction_ = 0;
  int count_ = 0;
  bool any_ = false;
};

/// The setup of a preset on a robot, of which it believes what is assumed.
LoopSetup setupFor(const PackageFiles& files, const std::string& controller, const PlantModel& assumed,
                   const DriveTrainRatios& robot, std::uint64_t seed) {
  const LimitParameters limits;  // of the drive gate, as on a robot
  LoopSetup setup = loadSetup(files, controller, "ground",
                              {{"limits.linear_acceleration", fmt::format("{}", limits.linear_acceleration)},
                               {"limits.angular_acceleration", fmt::format("{}", limits.angular_acceleration)}});
  setup.drive.plant_model = assumed;
  setup.plant = scaled(simulatedRobot(assumed, setup.plant), robot);
  setup.plant.seed = seed;
  return setup;
}

std::string lineOf(const std::string& controller, const DriveTrainRatios& robot, double duration,
                   const UnidentifiedDrive& drive) {
  return fmt::format("{},{:g},{:g},{:g},{:g},{:g},{},{},{}\n", controller, robot.dead_time, robot.lag, robot.gain,
                     robot.acceleration_limit, duration, drive.swings, drive.faults, csvField(drive.first));
}

}  // namespace

PlantModel assumedModel(const PackageFiles& files) {
  ParameterMap map = files.configuration("jackal_model");
  return readPlantModel(map);
}

std::vector<DriveTrainRatios> unidentifiedRobots() {
  std::vector<DriveTrainRatios> robots{{}};
  for (const double dead_time : {0.5, 2.0}) {
    for (const double lag : {0.5, 2.0}) {
      for (const double gain : {0.8, 1.2}) {
        for (const double limit : {0.5, 1.0, 3.0}) robots.push_back({dead_time, lag, gain, limit});
      }
    }
  }
  return robots;
}

int mostSwings(const std::vector<MonitoredSample>& samples) {
  int most = 0;
  SetPoint set_point;
  double since = 0.0;
  Swings forward(kForwardSwing), yaw_rate(kYawSwing);
  for (const MonitoredSample& sample : samples) {
    if (sample.set_point.vector() != set_point.vector()) {
      set_point = sample.set_point;
      since = sample.time;
      forward = Swings(kForwardSwing);
      yaw_rate = Swings(kYawSwing);
    }
    if (sample.time < since + kArrival) continue;
    forward.add(sample.velocity);
    yaw_rate.add(sample.yaw_rate);
    most = std::max({most, forward.count(), yaw_rate.count()});
  }
  return most;
}

UnidentifiedDrive driveUnidentified(const PackageFiles& files, const std::string& controller,
                                    const DriveTrainRatios& robot, double duration, std::uint64_t seed) {
  const PlantModel assumed = assumedModel(files);
  const LoopSetup setup = setupFor(files, controller, assumed, robot, seed);
  const auto samples = runMonitored(setup, assumed, joystickDriving(seed, duration), {});
  UnidentifiedDrive drive;
  drive.swings = mostSwings(samples);
  bool faulty = false;
  for (const MonitoredSample& sample : samples) {
    if (sample.report.faulty() && !faulty && drive.faults++ == 0) {
      drive.first = fmt::format("{} at {:.6f} s", sample.report.reason(), sample.time);
    }
    faulty = sample.report.faulty();
  }
  return drive;
}

std::string writeUnidentifiedTable(const PackageFiles& files, const std::string& controller, double duration,
                                   std::uint64_t seed, const std::string& directory, unsigned jobs) {
  const auto robots = unidentifiedRobots();
  const auto drives = parallelResults("unidentified robots", robots.size(), jobs, [&](std::size_t i) {
    return driveUnidentified(files, controller, robots[i], duration, seed + i);
  });
  std::string text = "controller,dead_time,lag,gain,acceleration_limit,duration_s,swings,faults,first\n";
  for (std::size_t i = 0; i < robots.size(); ++i) text += lineOf(controller, robots[i], duration, drives[i]);
  writeTable(directory, "unidentified.csv", text);
  const auto count = [&](const auto& condition) { return std::count_if(drives.begin(), drives.end(), condition); };
  return fmt::format("oscillating: {}, with faults: {} of {} robots",
                     count([](const UnidentifiedDrive& d) { return d.oscillates(); }),
                     count([](const UnidentifiedDrive& d) { return d.faults > 0; }), robots.size());
}

}  // namespace jackal_aic::sim
