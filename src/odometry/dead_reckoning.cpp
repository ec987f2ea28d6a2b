#include "jackal_aic/odometry/dead_reckoning.hpp"

#include <cmath>

namespace jackal_aic {
namespace {

double sinc(double angle) { return std::abs(angle) < 1e-6 ? 1.0 : std::sin(angle) / angle; }

}  // namespace

void DeadReckoning::advance(const PlanarMotion& motion, double duration) {
  const double turned = motion.yaw_rate * duration, half = 0.5 * turned;
  const double way = motion.forward * duration * sinc(half);
  if (!std::isfinite(turned) || !std::isfinite(way) || !(duration > 0.0)) return;
  const double along = std::cos(pose_.heading + half), across = std::sin(pose_.heading + half);
  pose_.x += way * along;
  pose_.y += way * across;
  pose_.heading += turned;

  // P ← F P F' + 2 τ/h G Σ G'
  Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
  F(0, 2) = -way * across;
  F(1, 2) = way * along;
  Eigen::Matrix<double, 3, 2> G;
  G << along, -0.5 * way * across,  //
      across, 0.5 * way * along,    //
      0.0, 1.0;
  G *= duration;
  covariance_ = (F * covariance_ * F.transpose()).eval();
  covariance_ += 2.0 * kErrorTime / duration * (G * motion.covariance * G.transpose());
}

}  // namespace jackal_aic
