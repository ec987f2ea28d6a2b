#include "planar_ekf.hpp"

#include <Eigen/LU>
#include <cmath>

namespace jackal_aic::sim {
namespace {

constexpr double kForwardNoise = 1.0;       // (m/s)^2/s
constexpr double kAccelerationNoise = 1.0;  // (m/s^2)^2/s
constexpr double kYawNoise = 0.5 * M_PI;    // (rad/s)^2/s

/// s <- s + K (y - H s),  K = P H' (H P H' + R)^-1,  P <- (I - K H) P.
template <int kSize>
void correctBy(const Eigen::Matrix<double, kSize, 1>& measured, const Eigen::Matrix<double, kSize, 3>& h,
               const Eigen::Matrix<double, kSize, kSize>& r, Eigen::Vector3d& state, Eigen::Matrix3d& covariance) {
  const Eigen::Matrix<double, 3, kSize> gain =
      covariance * h.transpose() * (h * covariance * h.transpose() + r).inverse();
  state += gain * (measured - h * state);
  covariance = ((Eigen::Matrix3d::Identity() - gain * h) * covariance).eval();
}

}  // namespace

void PlanarEkf::predict(double duration) {
  const double way = duration * state_(0) + 0.5 * duration * duration * state_(1);
  pose_.x += way * std::cos(pose_.heading);
  pose_.y += way * std::sin(pose_.heading);
  pose_.heading += duration * state_(2);
  Eigen::Matrix3d f = Eigen::Matrix3d::Identity();
  f(0, 1) = duration;
  state_ = (f * state_).eval();
  covariance_ = (f * covariance_ * f.transpose()).eval();
  covariance_.diagonal() += duration * Eigen::Vector3d(kForwardNoise, kAccelerationNoise, kYawNoise);
}

void PlanarEkf::correct(const PlanarMotion& motion) {
  Eigen::Matrix<double, 2, 3> h = Eigen::Matrix<double, 2, 3>::Zero();
  h(0, 0) = h(1, 2) = 1.0;
  correctBy<2>({motion.forward, motion.yaw_rate}, h, motion.covariance, state_, covariance_);
}

void PlanarEkf::correct(double yaw_rate, double variance) {
  correctBy<1>(Eigen::Matrix<double, 1, 1>(yaw_rate), Eigen::RowVector3d::UnitZ(),
               Eigen::Matrix<double, 1, 1>(variance), state_, covariance_);
}

}  // namespace jackal_aic::sim
