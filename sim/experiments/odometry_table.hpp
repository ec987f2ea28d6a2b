#pragma once

/// @file
/// How far odometry drifts: ours, and that of the stock controller, over the same drives.

#include <string>
#include <vector>

#include "closed_loop.hpp"
#include "loop_setup.hpp"

namespace jackal_aic::sim {

/// A drive of which the odometry is assessed.
struct OdometryDrive {
  std::string name;              ///< what is driven, on what
  std::string controller;        ///< a preset
  std::string plant = "ground";  ///< box or ground
  SetPointProfile profile;
  Overrides overrides;  ///< e.g. of the plant
};

/// Where an odometry ends against the truth.
struct Drift {
  double position = 0.0;  ///< error of the position by the length of the way [m/m]
  double heading = 0.0;   ///< |error of the heading| [rad]
};

/// What came of a drive. Poses are those of the ground; on the box nobody moves, and there the velocity is what the
/// wheels would give.
struct OdometryFigures {
  double way = 0.0;  ///< length of the true path [m]
  Drift ours;
  Drift stock;           ///< wheels alone, at the effective track as configured on the stock robot
  Drift ours_filtered;   ///< what an EKF makes of ours (planar_ekf.hpp)
  Drift stock_filtered;  ///< what it makes of the stock controller's and the gyro
  double nees = 0.0;     ///< mean normalised squared error of (x_dot, theta_dot); 2 for a covariance that is right
  double inside = 0.0;   ///< part of the samples within the 95 % bounds of the covariance
};

/// Straight lines, squares, circles, eights and driving cycles on the ground of the thesis, on one with less and with
/// more grip and under a payload, with the predictive controller and the thesis' improved one.
std::vector<OdometryDrive> odometryDrives();

/// Drives one.
OdometryFigures driveOdometry(const PackageFiles& files, const OdometryDrive& drive);

/// Drives all and writes odometry.csv into a directory. @param jobs threads; 0: one per core.
void writeOdometryTable(const PackageFiles& files, const std::string& directory, unsigned jobs);

}  // namespace jackal_aic::sim
