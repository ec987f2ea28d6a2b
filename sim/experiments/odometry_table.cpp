#include "odometry_table.hpp"

#include <fmt/format.h>

#include <cmath>
#include <deque>

#include "belief_consistency.hpp"
#include "campaign.hpp"
#include "jackal_aic/safety/loop_odometry.hpp"
#include "parallel.hpp"
#include "planar_ekf.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kStockTrack = 0.563385;  // m, 1.5 times the distance between the wheels

/// Odometry of the stock controller: the ways of the wheels, on arcs, and their means as velocities.
class StockOdometry {
 public:
  StockOdometry(double wheel_radius, double period) : wheel_radius_(wheel_radius), period_(period) {}

  void update(const PlantMeasurement& measurement) {
    const double left = wheel_radius_ * measurement.wheel_position[kFrontLeft];
    const double right = wheel_radius_ * measurement.wheel_position[kFrontRight];
    if (started_) {
      const double moved_left = left - left_, moved_right = right - right_;
      const PlanarMotion moved{0.5 * (moved_left + moved_right), (moved_right - moved_left) / kStockTrack};
      reckoning_.advance(moved, 1.0);
      last_.push_back({moved.forward / period_, moved.yaw_rate / period_});
      if (last_.size() > kWindow) last_.pop_front();
    }
    started_ = true;
    left_ = left;
    right_ = right;
  }

  const PlanarPose& pose() const { return reckoning_.pose(); }

  /// With the variances of its twist as configured on the stock robot.
  PlanarMotion motion() const {
    PlanarMotion mean;
    for (const Eigen::Vector2d& velocity : last_) {
      mean.forward += velocity(0) / static_cast<double>(last_.size());
      mean.yaw_rate += velocity(1) / static_cast<double>(last_.size());
    }
    mean.covariance.diagonal() << 0.001, 0.03;
    return mean;
  }

 private:
  static constexpr std::size_t kWindow = 10;  // velocity_rolling_window_size

  double wheel_radius_;
  double period_;                     // of the samples [s]
  std::deque<Eigen::Vector2d> last_;  // x_dot, theta_dot
  bool started_ = false;
  double left_ = 0.0, right_ = 0.0;  // m
  DeadReckoning reckoning_;
};

double headingOf(const PlantTruth& truth) {
  const auto& q = truth.orientation;
  return std::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()), 1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()));
}

Drift driftOf(const PlanarPose& pose, const PlantTruth& truth, double way) {
  const double error = std::hypot(pose.x - truth.position.x(), pose.y - truth.position.y());
  return {way > 0.0 ? error / way : 0.0, std::abs(std::remainder(pose.heading - headingOf(truth), 2.0 * M_PI))};
}

SetPointProfile segments(const std::vector<SetPointProfile::Change>& segments) {
  SetPointProfile profile;  // here a change's time is how long it lasts
  profile.duration = kRestTime;
  for (const auto& segment : segments) {
    profile.changes.push_back({profile.duration, segment.set_point});
    profile.duration += segment.time;
  }
  profile.changes.push_back({profile.duration, {}});
  profile.duration += 2.0;
  return profile;
}

SetPointProfile square() {
  std::vector<SetPointProfile::Change> sides;
  for (int i = 0; i < 4; ++i) {
    sides.push_back({6.0, {0.5, 0.0, 0.0}});
    sides.push_back({1.0, {}});
    sides.push_back({2.0, {0.0, 0.0, 0.25 * M_PI}});
    sides.push_back({1.0, {}});
  }
  return segments(sides);
}

std::vector<std::pair<std::string, SetPointProfile>> profiles() {
  DrivingCycle cycle;
  cycle.seed = 7;
  return {{"straight line", segments({{30.0, {0.8, 0.0, 0.0}}})},
          {"square", square()},
          {"circles", segments({{40.0, {0.5, 0.0, 0.5}}})},
          {"eight", segments({{12.5, {0.6, 0.0, 0.5}}, {12.5, {0.6, 0.0, -0.5}}})},
          {"driving cycle", cycleProfile(cycle)}};
}

}  // namespace

std::vector<OdometryDrive> odometryDrives() {
  const std::vector<std::pair<std::string, Overrides>> grounds{{"", {}},
                                                               {" on friction 0.3", {{"plant.friction", "0.3"}}},
                                                               {" on friction 0.8", {{"plant.friction", "0.8"}}},
                                                               {" with 15 kg", {{"plant.payload", "15"}}}};
  std::vector<OdometryDrive> drives;
  for (const char* controller : {"predictive", "improved"}) {
    for (const auto& [name, profile] : profiles()) {
      for (const auto& [ground, overrides] : grounds) {
        drives.push_back({name + ground, controller, "ground", profile, overrides});
      }
    }
  }
  return drives;
}

OdometryFigures driveOdometry(const PackageFiles& files, const OdometryDrive& drive) {
  const LoopSetup setup = loadSetup(files, drive.controller, drive.plant, drive.overrides);
  JackalPlant plant(setup.urdf, setup.plant);
  DriveLoop loop = makeLoop(setup.drive);
  Odometry ours = makeOdometry(setup.drive, loop);
  const double period = 1.0 / setup.plant.sensor_rate, gyro = setup.plant.noise_scale * setup.plant.gyro_noise;
  StockOdometry stock(setup.drive.geometry.wheel_radius, period);
  PlanarEkf ours_filtered, stock_filtered;
  OdometryFigures figures;
  ConsistencySums consistency;
  const std::int64_t steps = drive.profile.plantSteps();
  for (std::int64_t k = 0; k < steps; ++k, plant.step()) {
    const double now = plant.time();
    loop.setSetPoint(drive.profile.at(now), now);
    if (plant.measurement()) {
      const Observation observation = plant.measurement()->observation();
      loop.observe(observation, now);
      ours.observe(asCounted(observation, loop));
      stock.update(*plant.measurement());
      // What config/robot_localization.yaml takes, and what the stock robot's does: there the gyro comes beside.
      ours_filtered.predict(period);
      ours_filtered.correct(ours.motion());
      stock_filtered.predict(period);
      stock_filtered.correct(stock.motion());
      stock_filtered.correct(observation.yaw_rate, gyro * gyro);
    }
    if (const auto due = loop.advance(now)) plant.command(*due);
    ours.advance(loop.command(), JackalPlant::kStep);
    const PlantTruth& truth = plant.truth();
    figures.way += std::abs(truth.linear_velocity.x()) * JackalPlant::kStep;
    if (now < kRestTime || k % 10 != 5) continue;
    consistency.add(ours.motion(), trueMotion(setup, truth));
  }
  figures.nees = consistency.nees();
  figures.inside = consistency.inside();
  figures.ours = driftOf(ours.pose(), plant.truth(), figures.way);
  figures.stock = driftOf(stock.pose(), plant.truth(), figures.way);
  figures.ours_filtered = driftOf(ours_filtered.pose(), plant.truth(), figures.way);
  figures.stock_filtered = driftOf(stock_filtered.pose(), plant.truth(), figures.way);
  return figures;
}

void writeOdometryTable(const PackageFiles& files, const std::string& directory, unsigned jobs) {
  const auto drives = odometryDrives();
  const auto figures =
      parallelResults("odometry", drives.size(), jobs, [&](std::size_t i) { return driveOdometry(files, drives[i]); });
  std::string text =
      "controller,drive,way_m,drift_m_per_m,heading_error_rad,stock_drift_m_per_m,stock_heading_error_rad,"
      "ekf_drift_m_per_m,ekf_heading_error_rad,stock_ekf_drift_m_per_m,stock_ekf_heading_error_rad,nees,inside_95\n";
  for (std::size_t i = 0; i < drives.size(); ++i) {
    const OdometryFigures& f = figures[i];
    text += fmt::format("{},{},{:.4g}", drives[i].controller, drives[i].name, f.way);
    for (const Drift& drift : {f.ours, f.stock, f.ours_filtered, f.stock_filtered}) {
      text += fmt::format(",{:.4g},{:.4g}", drift.position, drift.heading);
    }
    text += fmt::format(",{:.4g},{:.4g}\n", f.nees, f.inside);
  }
  writeTable(directory, "odometry.csv", text);
}

}  // namespace jackal_aic::sim
