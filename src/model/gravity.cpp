#include "jackal_aic/model/gravity.hpp"

#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kNormTolerance = 0.01;  // of the squared norm; that of tf2

}  // namespace

std::optional<Eigen::Quaterniond> unitAttitude(const Eigen::Quaterniond& attitude) {
  const double off = attitude.squaredNorm() - 1.0;
  if (!(std::abs(off) <= kNormTolerance)) return std::nullopt;  // NaN too
  if (attitude.coeffs() == Eigen::Quaterniond::Identity().coeffs()) return std::nullopt;
  return attitude.normalized();
}

Eigen::Vector3d gravityReaction(const Eigen::Quaterniond& attitude) {
  return attitude.conjugate() * Eigen::Vector3d(0.0, 0.0, kGravity);
}

}  // namespace jackal_aic
