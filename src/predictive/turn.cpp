#include "jackal_aic/predictive/turn.hpp"

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

constexpr double kMemory = 120.0;          // T [s]
constexpr double kGroundTime = 0.5;        // T_h [s]
constexpr double kGroundDeviation = 0.03;  // sigma_h
constexpr double kMotionDeviation = 0.03;  // of q_2 and q_4 before the first turn, relative to c, per m/s
constexpr double kChatter = 4e-4;          // s before the first turn: a deviation of 0.14 in samples of 20 ms [s]
constexpr double kTrustTime = 2.0;         // least withdrawn time of turning [s]

double sign(double value) { return value > 0.0 ? 1.0 : value < 0.0 ? -1.0 : 0.0; }

}  // namespace

Turn::Turn(const SlipState& configured, double wheel_radius, double range)
    : slip_factor_(configured.slip_factor),
      configured_(configured.slip_factor / configured.effective_track),
      radius_(wheel_radius),
      range_(range) {
  // The range is three deviations; a range of 1 forbids learning.
  const double of_range = std::max(range - 1.0, thresholds::kRounding) / thresholds::kSure;
  prior_ = (configured_ * Eigen::Vector4d(of_range, kMotionDeviation, kVeer, kMotionDeviation)).cwiseAbs2();
  setState(configured);
}

// ---- the turn

double Turn::ratio(double x, double v, double ground) const {
  const State& q = belief_.mean;
  const double ratio = q(0) + q(1) * std::abs(v) + q(3) * v * sign(x) + ground * configured_;
  return std::clamp(ratio, configured_ / range_, configured_ * range_);
}

double Turn::yawRate(const WheelVector& wheels) const {
  return yawPerDifference(wheels) * (wheels(1) - wheels(0)) + belief_.mean(2) * radius_ * wheels.mean();
}

double Turn::usualYawRate(const WheelVector& wheels) const {
  const double x = radius_ * (wheels(1) - wheels(0)), v = radius_ * wheels.mean();
  return ratio(x, v, 0.0) * x + belief_.mean(2) * v;
}

double Turn::yawPerDifference(const WheelVector& wheels) const {
  return radius_ * ratio(wheels(1) - wheels(0), radius_ * wheels.mean(), belief_.mean(4));
}

double Turn::wheelDifference(double yaw_rate, double mean) const {
  const double v = radius_ * mean, turned = yaw_rate - belief_.mean(2) * v;  // has the sign of x: the ratio is positive
  return turned / (radius_ * ratio(turned, v, belief_.mean(4)));
}

WheelVector Turn::wheelSpeeds(double forward, double yaw_rate) const {
  const double mean = forward / (radius_ * slip_factor_);
  const double half_difference = 0.5 * wheelDifference(yaw_rate, mean);
  return {mean - half_difference, mean + half_difference};
}

double Turn::effectiveTrack() const { return slip_factor_ / ratio(0.0, 0.0, belief_.mean(4)); }

// ---- learning

Turn::State Turn::motion(double x, double v) const {
  return (State() << x, x * std::abs(v), v, v * std::abs(x), configured_ * x).finished();
}

void Turn::pass(double step) {
  const double kept = keptAfter(step, kGroundTime);
  auto& P = belief_.covariance;
  belief_.mean(4) *= kept;
  P.row(4) *= kept;
  P.col(4) *= kept;
  P(4, 4) += (1.0 - kept * kept) * square(kGroundDeviation);
}

void Turn::learn(const TurnSample& sample, double least, double step) {
  const auto motionOf = [this](const WheelVector& w) { return motion(radius_ * (w(1) - w(0)), radius_ * w.mean()); };
  const double v = radius_ * sample.before.mean();
  if (contradicted(sample, v, step)) return withdraw();
  const double difference = sample.before(1) - sample.before(0);
  const bool turns = std::abs(difference) > least;
  if (!turns && std::abs(v) < thresholds::kSlow) return;  // a robot at rest
  const double error = sample.yaw_rate - motionOf(sample.wheels).dot(belief_.mean);
  // With the encoders' noise in error and regressor, a steady turn would seem not to depend on the wheels.
  const State phi = turns ? motionOf(sample.before) : motion(0.0, v);
  // On a straight line the ground causes as much veer as tyres do, for T_h: one independent measurement in 2 T_h.
  const double veer = turns ? 0.0 : prior_(2) * square(v);
  // A larger error than of any robot and ground is a sensor's.
  const double chatter = belief_.chatter * square(phi(4)) / step;
  const double possible = phi.head<4>().cwiseAbs2().dot(prior_) + veer + chatter + sample.variance;
  if (square(error) > square(thresholds::kSure) * possible) return;
  if (turns) {
    keep(step);
    forget(step);
    const double known = sample.variance + phi.dot(belief_.covariance * phi);
    learnChatter((error * error - known) / square(phi(4)), step);
  }
  const double of_ground = turns ? belief_.chatter * square(phi(4)) : 2.0 * kGroundTime * veer;
  correct(error, phi, sample.variance + of_ground / step);
}

/// The body turns faster than the gyro reads.
bool Turn::contradicted(const TurnSample& sample, double v, double step) {
  arc_.update(sample.lateral, v * sample.yaw_rate, step);
  return arc_.value() - thresholds::kSure * arc_.deviation() > range_;
}

void Turn::forget(double step) {
  const Eigen::Matrix4d P = belief_.covariance.topLeftCorner<4, 4>();
  belief_.covariance.topLeftCorner<4, 4>() += step / kMemory * (P - P * prior_.cwiseInverse().asDiagonal() * P);
}

/// s <- s + w/N (unexplained - s), N <- 1 + (N - 1) T/(T + step) + w; the first s counts as 1.
void Turn::learnChatter(double unexplained, double step) {
  const double w = std::min(1.0, step / kGroundTime);
  belief_.evidence = 1.0 + (belief_.evidence - 1.0) * keptAfter(step, kMemory) + w;
  belief_.chatter += w / belief_.evidence * (std::max(0.0, unexplained * step) - belief_.chatter);
}

void Turn::correct(double error, const State& phi, double variance) {
  auto& P = belief_.covariance;
  const State P_phi = P * phi;
  const double S = phi.dot(P_phi) + variance;
  State gain = P_phi / S;
  // A straight line shows the veer, and a turn the others: the gain of a Schmidt-Kalman filter.
  if (phi(4) == 0.0) {
    gain = gain(2) * State::Unit(2);
  } else {
    gain(2) = 0.0;
  }
  belief_.mean += gain * error;
  P += S * gain * gain.transpose() - gain * P_phi.transpose() - P_phi * gain.transpose();
  P.triangularView<Eigen::StrictlyUpper>() = P.transpose();  // rounding
  bound();
}

void Turn::bound() {
  State& q = belief_.mean;
  q(0) = std::clamp(q(0), configured_ / range_, configured_ * range_);
  const Eigen::Vector3d most = thresholds::kSure * prior_.tail<3>().cwiseSqrt();
  q.segment<3>(1) = q.segment<3>(1).cwiseMax(-most).cwiseMin(most);
}

void Turn::keep(double step) {
  trusted_ += step;
  if (trusted_ < kTrustTime) return;
  kept_ = recent_;
  recent_ = belief_;
  trusted_ = 0.0;
}

void Turn::withdraw() {
  belief_ = recent_ = kept_;
  trusted_ = 0.0;
}

// ---- state

SlipState Turn::state() const {
  return {slip_factor_ / belief_.mean(0), slip_factor_,
          TurnCoefficients{belief_.mean.head<4>(), belief_.covariance.topLeftCorner<4, 4>()}};
}

void Turn::setState(const SlipState& state) {
  const double ratio = state.slip_factor / state.effective_track;
  const TurnCoefficients q =
      state.turn.value_or(TurnCoefficients{ratio * Eigen::Vector4d::Unit(0), prior_.asDiagonal()});
  const Eigen::LLT<Eigen::Matrix4d> factors(q.covariance);
  if (!q.mean.allFinite() || !q.covariance.allFinite() || factors.info() != Eigen::Success) {
    throw ParameterError(
        "slip.turn_covariance: must be finite and positive definite, and slip.turn_coefficients finite");
  }
  belief_ = {State::Zero(), Eigen::Matrix<double, 5, 5>::Zero(), kChatter, 1.0};
  belief_.mean.head<4>() = q.mean;
  belief_.covariance.topLeftCorner<4, 4>() = q.covariance;
  belief_.covariance(4, 4) = square(kGroundDeviation);
  bound();
  recent_ = kept_ = belief_;
}

}  // namespace jackal_aic
