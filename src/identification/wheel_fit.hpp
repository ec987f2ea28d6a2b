#pragma once

/// @file
/// Least-squares fit of the wheels' drive train to recorded commands and wheel speeds (equation and sources in
/// jackal_aic/identification/plant_identification.hpp).

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "jackal_aic/identification/plant_identification.hpp"

namespace jackal_aic::identification {

/// Parameters of the search, by index of a Theta.
enum Index { kDeadTime, kLag, kGain, kLogLimit, kOffset, kParameters };

/// Dead time [s], lag [s], gain, ln of the acceleration limit [m/s^2], offset [rad/s].
using Theta = Eigen::Matrix<double, kParameters, 1>;

/// Range of the search. A negative dead time is a wheel that answers before its command.
Theta lowest();
Theta highest();

/// A command from the time at which it was first sent [s].
using CommandChange = CommandSample;

/// A part of a recording without a gap.
struct Stretch {
  std::vector<CommandChange> commands;  ///< changes only, the first is in force at the beginning
  std::size_t begin = 0;                ///< first wheel sample, by index of the recording
  std::size_t end = 0;                  ///< behind the last one
};

/// Which wheels of a sample a fit counts.
enum Counted : char { kNeither = 0, kLeft = 1, kRight = 2, kBoth = 3 };

/// The data of a fit and its fixed parameters.
struct WheelFit {
  const std::vector<WheelSample>& wheels;
  std::vector<Stretch> stretches;
  std::vector<char> counts;                                      ///< of each wheel sample, one of Counted
  double radius;                                                 ///< of the wheels [m]
  double speed_limit = std::numeric_limits<double>::infinity();  ///< at which the motors are clipped [rad/s]

  /// Speeds of the model at the stamps of the measured ones; the measured ones outside all stretches.
  std::vector<WheelCommand> simulate(const Theta& theta) const;

  /// Measured minus fitted speed [rad/s], left and right of each sample in turn; zero where the wheel does not count.
  Eigen::VectorXd residuals(const Theta& theta) const;

  /// Number of values that count.
  std::size_t size() const;
};

/// A fit's estimate.
struct FitResult {
  Theta theta;
  Theta half_width;  ///< of the 95 % intervals; infinite where the recording does not depend on a parameter
};

/// Least squares over the whole range: the best of a coarse grid, refined by Levenberg and Marquardt's method. @param
/// gain from where to search; @param fit_offset false: the offset is zero.
Theta searchLeastSquares(const WheelFit& fit, double gain, bool fit_offset);

/// 95 % intervals for correlated residuals. The covariance of the linearised fit has scores summed over blocks of time
/// (cluster-robust "sandwich", Liang and Zeger 1986). Student's distribution has the number of blocks with information
/// about a parameter. A limit that explains no more than chance is unknown.
FitResult withIntervals(const WheelFit& fit, const Theta& theta, bool fit_offset);

/// Estimate of a part of a fit's data: the least squares near the whole's estimate `theta`, with intervals.
/// @param fit_offset false: at the offset of the whole.
FitResult fitPart(const WheelFit& part, const Theta& theta, bool fit_offset);

/// 97.5 % quantile of Student's distribution by its expansion about the normal one (Abramowitz and Stegun 26.7.5).
double studentQuantile(double degrees_of_freedom);

/// Length of the blocks over which residuals are taken to depend on each other [s].
constexpr double kBlock = 1.0;

/// Calls block(begin, end) with the indices of each block of a series of samples in order of time.
template <class Series, class Block>
void forEachBlock(const Series& series, const Block& block) {
  for (std::size_t begin = 0, end = 0; begin < series.size(); begin = end) {
    while (end < series.size() && series[end].time < series[begin].time + kBlock) ++end;
    block(begin, end);
  }
}

}  // namespace jackal_aic::identification
