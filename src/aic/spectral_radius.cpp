#include "jackal_aic/aic/spectral_radius.hpp"

#include <cmath>

namespace jackal_aic {

double spectralRadius(Eigen::MatrixXd map) {
  if (!map.allFinite()) return HUGE_VAL;
  double logarithm = 0.0;
  Eigen::MatrixXd squared(map.rows(), map.cols());
  for (int doubling = 0; doubling <= 50; ++doubling) {
    const double norm = map.cwiseAbs().rowwise().sum().maxCoeff();
    if (norm == 0.0) return 0.0;
    // ln |M^2n|/2n = ln |M^n|/n + ln |(M^n/|M^n|)^2|/2n
    logarithm += std::ldexp(std::log(norm), -doubling);
    map /= norm;
    squared.noalias() = map * map;
    map.swap(squared);
  }
  return std::exp(logarithm);
}

}  // namespace jackal_aic
