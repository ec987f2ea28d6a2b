#include "jackal_aic/aic/coloured_noise.hpp"

#include <Eigen/LU>
#include <cmath>

namespace jackal_aic {
namespace {

/// V of smoothness 1.
OrderMatrix scaledCovariance(int size) {
  OrderMatrix V = OrderMatrix::Zero(size, size);
  for (int i = 0; i < size; ++i) {
    for (int j = i % 2; j < size; j += 2) {
      const int k = (i + j) / 2;
      double derivative = 1.0;  // ρ^(2k)(0) of s = 1
      for (int m = 1; m <= k; ++m) derivative *= -0.5 * (2 * m - 1);
      V(i, j) = (i % 2 == 0 ? 1.0 : -1.0) * derivative;
    }
  }
  return V;
}

/// (1, x, x^2, ...)
OrderMatrix powers(int size, double x) {
  OrderMatrix scale = OrderMatrix::Zero(size, size);
  for (int i = 0; i < size; ++i) scale(i, i) = std::pow(x, i);
  return scale;
}

}  // namespace

OrderMatrix noisePrecision(int orders, double smoothness) {
  if (smoothness <= 0.0) return OrderMatrix::Identity(orders + 1, orders + 1);
  const OrderMatrix scale = powers(orders + 1, smoothness);
  const Eigen::MatrixXd inverse = Eigen::MatrixXd(scaledCovariance(orders + 1)).inverse();
  return scale * inverse * scale;
}

}  // namespace jackal_aic
