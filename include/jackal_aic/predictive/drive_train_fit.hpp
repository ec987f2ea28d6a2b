#pragma once

/// @file
/// Fit of a drive train to the motion of a wheel under its commands, for every dead time at once.
///
/// A drive train of the model (drive_train.hpp) without dead time runs through the commands, uncorrected, from rest.
/// Its speed a time delta ago is the present speed of a wheel with the dead time delta. It also computes the
/// sensitivities psi of its speed w to
///
///     theta = (ln T, lambda, gamma, o),
///
/// T its lag, lambda and gamma the motor's acceleration limit and gain in multiples of the model's and o an offset
/// against the command, which would otherwise look like a delay. Measured speed y, w and psi pass the same washout
/// filter s/(s + 1/T_w), so that constant errors, of a slope or the tyres, do not count. For each delta of a grid it
/// keeps the sums of
///
///     1/2 sum_k (y_k - w(t_k - delta) - psi(t_k - delta)' (theta - theta_0))^2
/// over the measurements.

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Number of parameters theta.
inline constexpr int kDriveTrainParameters = 4;

/// Fitted parameters of a drive train, without its dead time: (ln T, lambda, gamma, o).
using DriveTrainVector = Eigen::Matrix<double, kDriveTrainParameters, 1>;

/// Its square.
using DriveTrainMatrix = Eigen::Matrix<double, kDriveTrainParameters, kDriveTrainParameters>;

/// Indices of DriveTrainVector.
enum DriveTrainParameter {
  kLogLag,      ///< ln T, T in s
  kLimitShare,  ///< lambda
  kGainShare,   ///< gamma
  kOffset       ///< o [rad/s]
};

/// Sums over measurements for one dead time, around theta_0.
struct DriveTrainSums {
  DriveTrainMatrix curvature = DriveTrainMatrix::Zero();  ///< sum of psi psi'
  DriveTrainVector slope = DriveTrainVector::Zero();      ///< sum of psi epsilon
  double squares = 0.0;                                   ///< sum of epsilon^2

  /// Divided by a variance.
  DriveTrainSums over(double variance) const { return {curvature / variance, slope / variance, squares / variance}; }

  /// The sums around theta_0 + change: epsilon <- epsilon - psi' change.
  DriveTrainSums around(const DriveTrainVector& change) const {
    const DriveTrainVector moved = curvature * change;
    return {curvature, slope - moved, squares + change.dot(moved) - 2.0 * change.dot(slope)};
  }

  /// The sums with one parameter marginalised: least squares along it.
  DriveTrainSums marginalised(int parameter) const {
    const double bend = curvature(parameter, parameter);
    if (!(bend > 0.0)) return *this;
    const DriveTrainVector along = curvature.col(parameter) / bend;
    const double pull = slope(parameter);
    return {curvature - along * curvature.row(parameter), slope - along * pull, squares - pull * pull / bend};
  }

  /// Adds other sums around the same theta_0.
  void add(const DriveTrainSums& other) {
    curvature += other.curvature;
    slope += other.slope;
    squares += other.squares;
  }
};

/// A run of a drive train through commands, and its sums. Nothing here allocates.
class DriveTrainFit {
 public:
  static constexpr double kStep = 0.005;           ///< of the prediction, and between the dead times [s]
  static constexpr double kLongestDeadTime = 0.4;  ///< [s]
  static constexpr int kGrid = static_cast<int>(kLongestDeadTime / kStep) + 2;  ///< dead times 0, kStep, ...
  using Sums = std::array<DriveTrainSums, kGrid>;                               ///< by dead time

  /// @param model gain, acceleration limit and integral of the velocity loop; @param wheel_radius r [m].
  DriveTrainFit(const PlantModel& model, double wheel_radius) : model_(model), radius_(wheel_radius) {}

  /// Sets all to rest. @param theta to run with; @param given last effective commands [rad/s]; @param measured last
  /// wheel speeds [rad/s].
  void reset(const DriveTrainVector& theta, const WheelVector& given, const WheelVector& measured);

  /// Advances by kStep. @param given mean effective commands in it [rad/s].
  void step(const WheelVector& given);

  /// Takes wheel speeds. @param measured [rad/s]; @param step since the last ones [s]; @param part elapsed part of the
  /// next step; @param counts false: only passes the filter.
  void observe(const WheelVector& measured, double step, double part, bool counts);

  const DriveTrainVector& theta() const { return theta_; }  ///< of the run
  const Sums& sums() const { return sums_; }                ///< over the counted measurements
  double samples() const { return samples_; }               ///< their number, of both wheels
  double motion() const { return motion_; }                 ///< sum of y^2 of them, behind the washout filter
  double acceleration() const { return acceleration_; }     ///< largest of the run [m/s^2]

  /// Limit that lambda multiplies, from the next run on [m/s^2].
  void setAccelerationLimit(double limit) { model_.acceleration_limit = limit; }

 private:
  static constexpr std::size_t kHistory = 128;  // steps, more than the longest dead time, a power of two
  using Speeds = Eigen::Matrix<double, 1, 1 + kDriveTrainParameters>;  // w and its derivatives by theta

  struct Wheel {
    Speeds speed = Speeds::Zero();         // w
    Speeds correction = Speeds::Zero();    // z
    Speeds filtered = Speeds::Zero();      // speed behind the washout filter
    std::array<Speeds, kHistory> history;  // of filtered
    double measured = 0.0;                 // y, the last one [rad/s]
    double measured_filtered = 0.0;
    double rate = 0.0;  // dw/dt behind a low-pass [rad/s^2]
  };

  Speeds input(double given) const;
  void reset(Wheel& wheel, double given, double measured) const;
  void step(Wheel& wheel, double given);
  void observe(Wheel& wheel, double part);

  PlantModel model_;
  double radius_;
  DriveTrainVector theta_ = DriveTrainVector::Zero();
  double lag_ = 0.0;        // T [s]
  double rest_ = 0.0;       // of a difference of speed after a step, e^(-h/T)
  double limit_ = 0.0;      // L of dw/dt, with lambda [rad/s^2]
  std::size_t newest_ = 0;  // of the histories
  Wheel left_;
  Wheel right_;
  Sums sums_;
  double samples_ = 0.0;
  double motion_ = 0.0;
  double acceleration_ = 0.0;
};

}  // namespace jackal_aic
