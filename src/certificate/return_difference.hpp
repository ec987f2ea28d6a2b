#pragma once

/// @file
/// Where a loop reaches its limit of stability, told by its return difference. Internal to the core.
///
/// M(k) is the map of a loop over a common period with its gain times k. Where one sample or one action passes in a
/// period, its characteristic polynomial is affine in k, and by the return difference (Bode 1945)
///
///     F(z) = det(z − M(1)) / det(z − M(0)) = 1 − L(z),    det(z − M(k)) = det(z − M(0)) (1 − k L(z)).
///
/// An eigenvalue is on the unit circle z = e^(jω) at the gain k where L is real and k L = 1; and with a dead time that
/// is d periods longer, z^-d L, where |L| = 1 and d ω = arg L.

#include <Eigen/Core>
#include <complex>
#include <vector>

namespace jackal_aic {

/// Return difference of a loop on the upper half of the unit circle, as the product over its zeros and poles.
class ReturnDifference {
 public:
  /// @param open, closed M(0) and M(1), square and of the same size.
  ReturnDifference(const Eigen::MatrixXd& open, const Eigen::MatrixXd& closed);

  /// False if an eigenvalue of the maps is not to be had: then what else it tells means nothing.
  bool known() const;

  /// Positive gains k with an eigenvalue on the unit circle, in no order.
  std::vector<double> criticalGains() const;

  /// The shortest delay d with an eigenvalue on the unit circle that is not below `least` [common periods]; infinity if
  /// there is none. The loop with it is the one that is meant if d is whole.
  double criticalDelay(double least) const;

 private:
  /// F and how fast it may turn, |d ln F / dω|, at a frequency.
  struct Point {
    double frequency;
    std::complex<double> value;
    double rate;
  };

  Point at(double frequency) const;
  template <class Curve>
  std::vector<Point> zerosOf(const Curve& curve) const;

  std::vector<std::complex<double>> zeros_, poles_;
};

}  // namespace jackal_aic
