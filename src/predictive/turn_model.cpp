#include "jackal_aic/predictive/turn_model.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/forgetting.hpp"

namespace jackal_aic {
namespace {

constexpr double kTrackDeviation = 0.5;    // prior of q_1, relative to the configured ratio
constexpr double kMotionDeviation = 0.05;  // prior of q_2 and q_4, relative to it, per m/s
constexpr double kVeerDeviation = 0.03;    // prior of q_3, relative to it
constexpr double kModelError = 0.1;        // sigma_m of a robot that has not turned yet [rad/s]
constexpr double kLeastError = 0.02;       // its bounds [rad/s]
constexpr double kLargestError = 0.3;
constexpr double kErrorEvidence = 2.0;    // N_0
constexpr double kModelErrorLasts = 1.5;  // tau_m [s]
constexpr double kStraight = 0.05;        // largest |x| of a straight line [m/s]
constexpr double kEnough = 1e3;           // information about the veer, in that of the prior: more would make it stiff
constexpr double kLargestCoefficient = 0.5;  // of q_2 and q_4, relative to the configured ratio, per m/s
constexpr double kLargestVeer = 0.1;         // of q_3, relative to it: three times what tyres differ by as a rule
constexpr double kSlack = 4.0 / 3.0;         // factor beyond the range, up to which a turn counts as one at its bound

double sign(double value) { return value > 0.0 ? 1.0 : value < 0.0 ? -1.0 : 0.0; }

}  // namespace

TurnModel::TurnModel(double ratio, double range)
    : configured_(ratio),
      range_(range),
      mean_(ratio, 0.0, 0.0, 0.0),
      model_error_(kModelError * kModelError),
      error_evidence_(kErrorEvidence) {
  const Eigen::Vector4d deviations(kTrackDeviation, kMotionDeviation, kVeerDeviation, kMotionDeviation);
  prior_ = (ratio * deviations).cwiseAbs2().cwiseInverse().asDiagonal();
  information_ = prior_;
  covariance_ = (ratio * deviations).cwiseAbs2().asDiagonal();
}

double TurnModel::bounded(double ratio) const { return std::clamp(ratio, configured_ / range_, configured_ * range_); }

double TurnModel::perDifference(double x, double v, double correction) const {
  return bounded(correction * (mean_(0) + mean_(1) * std::abs(v) + sign(x) * mean_(3) * v));
}

bool TurnModel::plausible(double yaw_rate, double x, double v) const {
  if (std::abs(x) <= kStraight)
    return std::abs(yaw_rate) <= kSlack * configured_ * (kLargestVeer * std::abs(v) + kStraight);
  const double of_asked = yaw_rate / (configured_ * x), most = kSlack * range_;
  return of_asked >= 1.0 / most && of_asked <= most;
}

double TurnModel::perSpeed(double x, double v) const {
  return mean_(1) * x * sign(v) + mean_(2) + mean_(3) * std::abs(x);
}

double TurnModel::yawRate(double x, double v, double correction) const {
  return perDifference(x, v, correction) * x + correction * mean_(2) * v;
}

double TurnModel::difference(double yaw_rate, double v, double correction) const {
  const double turned = yaw_rate - correction * mean_(2) * v;  // has the sign of x: perDifference() is positive
  return turned / perDifference(turned, v, correction);
}

void TurnModel::learn(double yaw_rate, double x, double v, double variance, double step) {
  const bool turns = std::abs(x) > kTurn;
  const bool straight = std::abs(x) <= kStraight && std::abs(v) > kTurn;
  if (!(turns || straight) || !(step > 0.0)) return;
  const Eigen::Vector4d motion(x, x * std::abs(v), v, v * std::abs(x));
  // A straight line tells the veer alone: its x is mostly the encoders' noise, which would draw q_1 towards zero.
  const Eigen::Vector4d phi = turns ? motion : Eigen::Vector4d(0.0, 0.0, v, 0.0);
  const double error = yaw_rate - motion.dot(mean_);
  const double forgetting = turns ? keptAfter(step, kTimeConstant) : 1.0;
  if (turns) {
    learnError(error * error - variance - motion.dot(covariance_ * motion), step / kModelErrorLasts, forgetting);
  }
  const double Sigma = variance + model_error_ * std::max(1.0, kModelErrorLasts / step);
  // P^-1 <- P_0^-1 + (P^-1 - P_0^-1) T/(T + step) + phi phi^T / Sigma
  if (turns) information_ = (prior_ + forgetting * (information_ - prior_)).eval();
  if (turns || information_(2, 2) < kEnough * prior_(2, 2)) {
    information_ += phi * phi.transpose() / Sigma;
    covariance_ = information_.inverse();
  }
  // q <- q + P phi (y - phi^T q) / Sigma
  mean_ += covariance_ * phi * (error / Sigma);
  bound();
}

void TurnModel::learnError(double unexplained, double weight, double forgetting) {
  // N <- N_0 + (N - N_0) T/(T + step) + w,   sigma_m^2 <- sigma_m^2 + w/N (max(0, eps^2 - ...) - sigma_m^2)
  const double w = std::min(1.0, weight);
  error_evidence_ = kErrorEvidence + (error_evidence_ - kErrorEvidence) * forgetting + w;
  model_error_ += w / error_evidence_ * (std::max(0.0, unexplained) - model_error_);
  model_error_ = std::clamp(model_error_, kLeastError * kLeastError, kLargestError * kLargestError);
}

void TurnModel::bound() {
  const Eigen::Vector3d others = configured_ * Eigen::Vector3d(kLargestCoefficient, kLargestVeer, kLargestCoefficient);
  mean_(0) = bounded(mean_(0));
  mean_.tail<3>() = mean_.tail<3>().cwiseMax(-others).cwiseMin(others);
}

TurnCoefficients TurnModel::coefficients() const {
  return {mean_, covariance_.selfadjointView<Eigen::Lower>()};  // symmetric in spite of rounding
}

void TurnModel::setCoefficients(const TurnCoefficients& coefficients) {
  const Eigen::LLT<Eigen::Matrix4d> factors(coefficients.covariance);
  if (!coefficients.mean.allFinite() || !coefficients.covariance.allFinite() || factors.info() != Eigen::Success) {
    throw ParameterError(
        "slip.turn_covariance: must be finite and positive definite, and slip.turn_coefficients finite");
  }
  mean_ = coefficients.mean;
  information_ = factors.solve(Eigen::Matrix4d::Identity());
  covariance_ = coefficients.covariance;
  bound();
}

}  // namespace jackal_aic
