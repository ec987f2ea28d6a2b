#include "jackal_aic/predictive/turn_model.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/robot_range.hpp"
#include "jackal_aic/model/square.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

// Deviations of the prior.
constexpr double kRangeDeviations = 2.5;   // of q_1 within its range
constexpr double kLeastDeviation = 0.01;   // least deviation of q_1, relative to c, for a range near 1
constexpr double kMotionDeviation = 0.05;  // of q_2 and q_4, relative to c, per m/s
constexpr double kGroundDeviation = 0.04;  // sigma_h
constexpr double kGroundTime = 0.5;        // T_h [s]
constexpr double kLeastNoise = 0.01;       // least sigma_w, of a smooth floor
constexpr double kTurnNoise = 0.3;         // initial sigma_w
constexpr double kLargestNoise = 0.5;      // largest sigma_w, of a robot that skids
constexpr double kLargestMotion = 0.5;     // of q_2 and q_4, relative to c, per m/s
constexpr double kLargestVeer = 0.1;       // of q_3: three times the usual difference of tyres
constexpr double kNoiseEvidence = 2.0;     // N_0
constexpr double kSample = 0.02;           // s
constexpr double kCertainVeer =
    0.03;  // least deviation of the veer / prior's deviation: a smaller one would adapt too slowly

double sign(double value) { return value > 0.0 ? 1.0 : value < 0.0 ? -1.0 : 0.0; }

}  // namespace

TurnModel::TurnModel(double ratio, double range)
    : configured_(ratio),
      range_(range),
      mean_(State::Zero()),
      covariance_(Covariance::Zero()),
      noise_variance_(square(kTurnNoise)),
      evidence_(kNoiseEvidence) {
  mean_(0) = ratio;
  const double of_range = std::max(kLeastDeviation, (range - 1.0) / kRangeDeviations);
  const Eigen::Vector4d deviations(of_range, kMotionDeviation, kVeer, kMotionDeviation);
  prior_ = (ratio * deviations).cwiseAbs2().cwiseInverse().asDiagonal();
  covariance_.topLeftCorner<4, 4>() = (ratio * deviations).cwiseAbs2().asDiagonal();
  covariance_(4, 4) = square(kGroundDeviation);
}

double TurnModel::bounded(double ratio) const { return std::clamp(ratio, configured_ / range_, configured_ * range_); }

TurnModel::State TurnModel::motion(double x, double v) const {
  return (State() << x, x * std::abs(v), v, v * std::abs(x), configured_ * x).finished();
}

double TurnModel::ratio(double x, double v, double ground) const {
  return bounded(mean_(0) + mean_(1) * std::abs(v) + sign(x) * mean_(3) * v + ground * configured_);
}

double TurnModel::perDifference(double x, double v) const { return ratio(x, v, ground()); }

bool TurnModel::plausible(double yaw_rate, double x, double v) const {
  if (std::abs(x) <= thresholds::kSlow)
    return std::abs(yaw_rate) <= kTurnSlack * configured_ * (kLargestVeer * std::abs(v) + thresholds::kSlow);
  const double of_asked = yaw_rate / (configured_ * x), most = kTurnSlack * range_;
  return of_asked >= 1.0 / most && of_asked <= most;
}

double TurnModel::perSpeed(double x, double v) const {
  return mean_(1) * x * sign(v) + mean_(2) + mean_(3) * std::abs(x);
}

double TurnModel::yawRate(double x, double v) const { return ratio(x, v, ground()) * x + mean_(2) * v; }

double TurnModel::usualYawRate(double x, double v) const { return ratio(x, v, 0.0) * x + mean_(2) * v; }

double TurnModel::difference(double yaw_rate, double v) const {
  const double turned = yaw_rate - mean_(2) * v;  // has the sign of x: perDifference() is positive
  return turned / perDifference(turned, v);
}

void TurnModel::pass(double step) {
  const double kept = keptAfter(step, kGroundTime);
  mean_(4) *= kept;
  covariance_.row(4) *= kept;
  covariance_.col(4) *= kept;
  covariance_(4, 4) += (1.0 - kept * kept) * square(kGroundDeviation);
}

double TurnModel::error(double yaw_rate, double x, double v) const { return yaw_rate - motion(x, v).dot(mean_); }

void TurnModel::learn(double error, double x, double v, double variance, double step) {
  // P^-1 returns to that of the prior: dP/dt = (P − P P_0^-1 P) / T
  const Eigen::Matrix4d P = covariance_.topLeftCorner<4, 4>();
  covariance_.topLeftCorner<4, 4>() += step / kTimeConstant * (P - P * prior_ * P);
  const State phi = motion(x, v);
  learnNoise(error, phi, variance, step);
  // Samples that come closer than kSample share their errors.
  correct(error, phi, (variance + noise_variance_ * square(phi(4))) * std::max(1.0, kSample / step));
}

void TurnModel::learnNoise(double error, const State& phi, double variance, double step) {
  // N <- N_0 + (N - N_0) T/(T + step) + w,   sigma_w^2 <- sigma_w^2 + w/N (max(0, unexplained) - sigma_w^2)
  const double known = variance + phi.dot(covariance_ * phi);
  const double unexplained = (error * error - known) / square(phi(4)), w = std::min(1.0, step / kGroundTime);
  evidence_ = kNoiseEvidence + (evidence_ - kNoiseEvidence) * keptAfter(step, kTimeConstant) + w;
  noise_variance_ += w / evidence_ * (std::max(0.0, unexplained) - noise_variance_);
  noise_variance_ = std::clamp(noise_variance_, square(kLeastNoise), square(kLargestNoise));
}

void TurnModel::learnVeer(double error, double x, double v, double variance, double step) {
  if (std::abs(x) > thresholds::kSlow || std::abs(v) <= kTurn) return;
  if (covariance_(2, 2) * prior_(2, 2) < square(kCertainVeer)) return;
  // The ground causes as much veer as tyres do, for T_h: one independent measurement in twice that time.
  const double of_ground = square(v) / prior_(2, 2) * 2.0 * kGroundTime / step;
  correct(error, v * State::Unit(2), variance + of_ground);
}

void TurnModel::correct(double error, const State& phi, double variance) {
  const State P_phi = covariance_ * phi;
  const double S = phi.dot(P_phi) + variance;
  mean_ += P_phi * (error / S);
  covariance_ -= P_phi * P_phi.transpose() / S;
  covariance_.triangularView<Eigen::StrictlyUpper>() = covariance_.transpose();  // rounding
  bound();
}

void TurnModel::bound() {
  const Eigen::Vector3d others = configured_ * Eigen::Vector3d(kLargestMotion, kLargestVeer, kLargestMotion);
  mean_(0) = bounded(mean_(0));
  mean_.segment<3>(1) = mean_.segment<3>(1).cwiseMax(-others).cwiseMin(others);
}

TurnCoefficients TurnModel::coefficients() const { return {mean(), covariance_.topLeftCorner<4, 4>()}; }

void TurnModel::setCoefficients(const TurnCoefficients& coefficients) {
  const Eigen::LLT<Eigen::Matrix4d> factors(coefficients.covariance);
  if (!coefficients.mean.allFinite() || !coefficients.covariance.allFinite() || factors.info() != Eigen::Success) {
    throw ParameterError(
        "slip.turn_covariance: must be finite and positive definite, and slip.turn_coefficients finite");
  }
  mean_ << coefficients.mean, 0.0;
  covariance_.setZero();
  covariance_.topLeftCorner<4, 4>() = coefficients.covariance;
  covariance_(4, 4) = square(kGroundDeviation);
  bound();
}

}  // namespace jackal_aic
