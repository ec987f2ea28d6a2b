#pragma once

/// @file
/// Generalised coordinates: the shift operator D and the generalisation of measurements (section 3-3-4).

#include <Eigen/Core>
#include <cmath>

#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// D mu_tilde: every order replaced by the next higher one, the highest by zero (mu^(p+1) = 0). Works on any matrix
/// whose columns are orders.
template <class Generalized>
Generalized shiftOrders(const Generalized& x) {
  Generalized shifted = Generalized::Zero(x.rows(), x.cols());
  shifted.leftCols(x.cols() - 1) = x.rightCols(x.cols() - 1);
  return shifted;
}

/// D' mu_tilde, the transpose of shiftOrders: every order replaced by the next lower one, order 0 by zero.
template <class Generalized>
Generalized shiftOrdersTransposed(const Generalized& x) {
  Generalized shifted = Generalized::Zero(x.rows(), x.cols());
  shifted.rightCols(x.cols() - 1) = x.leftCols(x.cols() - 1);
  return shifted;
}

/// Generalisation of measurements by the recursion of eq. 3-22: y_k^(i) = (y_k^(i-1) - y_{k-1}^(i-1)) / h, with h from
/// the stamps. A signal is taken as constant before its first sample, so that its derivatives start at zero. 1/h^i
/// amplifies the noise of samples that are close together. Such samples change y only; derivatives use samples at least
/// the shortest gap apart.
template <int sensors>
class Generalization {
 public:
  using Sample = Eigen::Matrix<double, sensors, 1>;  ///< one value of each channel

  /// @param orders highest order p, 0..kMaxOrders.
  /// @param shortest_gap least h [s].
  /// @param longest_gap time between samples beyond which the history is useless for the derivatives, and the signal
  /// starts again [s].
  Generalization(int orders, double shortest_gap, double longest_gap)
      : y_(Generalized<sensors>::Zero(sensors, orders + 1)), shortest_gap_(shortest_gap), longest_gap_(longest_gap) {}

  /// Takes a sample of a time [s]. A refused sample leaves y_tilde as it was.
  SampleVerdict update(double stamp, const Sample& sample) {
    if (!sample.allFinite() || !std::isfinite(stamp)) return SampleVerdict::not_finite;
    if (started_ && stamp <= stamp_) return SampleVerdict::stale;
    const bool restarts = !started_ || stamp - stamp_ > longest_gap_;
    stamp_ = stamp;
    if (restarts) {
      y_.setZero();
      y_.col(0) = differenced_ = sample;
      differenced_at_ = stamp_;
      started_ = true;
      return SampleVerdict::restarted;
    }
    const double h = stamp_ - differenced_at_;
    if (h < shortest_gap_) {
      y_.col(0) = sample;
      return SampleVerdict::accepted;
    }
    // y_k^(i) = (y_k^(i-1) - y_{k-1}^(i-1)) / h                                   (3-22)
    y_.col(0) = differenced_;
    Sample current = sample;
    for (Eigen::Index i = 0; i < y_.cols(); ++i) {
      const Sample previous = y_.col(i);
      y_.col(i) = current;
      current = (current - previous) / h;
    }
    differenced_ = sample;
    differenced_at_ = stamp_;
    return SampleVerdict::accepted;
  }

  /// y_tilde of the last accepted sample, sensors x (p+1); zero before the first.
  const Generalized<sensors>& measurement() const { return y_; }

  /// Stamp of the last accepted sample [s]; meaningful only if hasMeasurement().
  double stamp() const { return stamp_; }

  /// True once a sample was accepted.
  bool hasMeasurement() const { return started_; }

  /// Forgets all samples.
  void reset() {
    y_.setZero();
    stamp_ = differenced_at_ = 0.0;
    started_ = false;
  }

 private:
  Generalized<sensors> y_;
  double shortest_gap_;
  double longest_gap_;
  Sample differenced_ = Sample::Zero();  // of the last differences
  double differenced_at_ = 0.0;          // its stamp [s]
  double stamp_ = 0.0;
  bool started_ = false;
};

}  // namespace jackal_aic
