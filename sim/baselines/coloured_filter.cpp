#include "coloured_filter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace jackal_aic::sim {
namespace {

using WindowMatrix = SmoothNoise::WindowMatrix;

constexpr double kLargestCoefficient = 0.99;  // of noise of first order
constexpr double kLeastPart = 0.1;            // of the innovations that the noise with a memory is taken to have
constexpr double kLargestSurprise = 50.0;     // e^2 from which is learned
constexpr double kRange = 1e4;                // of the learned variance / the white one, to either side of 1
constexpr double kSteady = 1.0;               // rad/s^2; largest acceleration of a wheel of a steady drive
constexpr double kSettled = 0.5;              // s; until nothing is left of an acceleration

double square(double x) { return x * x; }

}  // namespace

WindowMatrix ExponentialNoise::covariance(double step) const {
  WindowMatrix R = WindowMatrix::Zero();
  for (Eigen::Index i = 0; i < R.rows(); ++i) {
    for (Eigen::Index j = 0; j < R.cols(); ++j) {
      const double lag = static_cast<double>(std::abs(i - j)) * step;
      R(i, j) = i == j ? variance : correlation_time > 0.0 ? variance * std::exp(-lag / correlation_time) : 0.0;
    }
  }
  R.diagonal().array() += white_variance;
  return R;
}

Eigen::Vector2d LearnedSmoothNoise::learned() const {
  return {std::sqrt(learning_.noise().variance), learning_.noise().smoothness};
}

WhitenedNoise::WhitenedNoise(const ExponentialNoise& start, double memory, double step)
    : noise_(start), memory_(memory), step_(step) {}

Eigen::Vector2d WhitenedNoise::learned() const { return {std::sqrt(noise_.variance), noise_.correlation_time}; }

void WhitenedNoise::learn(const NoiseEvidence& evidence) {
  const double e = evidence.innovation / std::sqrt(evidence.innovation_variance);
  const double part = std::clamp(noise_.variance / evidence.innovation_variance, kLeastPart, 1.0);
  const double rate = std::min(evidence.step / memory_, 1.0) / part;
  const double correlation = std::clamp(e * last_, -kLargestSurprise, kLargestSurprise);
  last_ = e;

  // φ ← φ + (h/T) e_k e_(k-1) / g
  double coefficient = noise_.correlation_time > 0.0 ? std::exp(-step_ / noise_.correlation_time) : 0.0;
  coefficient = std::clamp(coefficient + rate * correlation, 0.0, kLargestCoefficient);
  noise_.correlation_time = coefficient > 0.0 ? -step_ / std::log(coefficient) : 0.0;

  // ln Σ ← ln Σ + (h/T) (e² − 1) / g
  const double grown = noise_.variance * std::exp(rate * (std::min(e * e, kLargestSurprise) - 1.0));
  noise_.variance = std::clamp(grown, noise_.white_variance / kRange, noise_.white_variance * kRange);
}

template <int n>
void BeliefWithNoise<n>::start(const State& state, const StateMatrix& covariance, const NoiseModel& noise,
                               double step) {
  state_ = state;
  noise_.setZero();
  P_.setZero();
  P_.template topLeftCorner<n, n>() = covariance;
  P_.template bottomRightCorner<kWindow, kWindow>() = noise.covariance(step);
}

template <int n>
void BeliefWithNoise<n>::predict(const StateMatrix& J, const State& fluctuation) {
  P_.template topRows<n>() = (J * P_.template topRows<n>()).eval();
  P_.template leftCols<n>() = (P_.template leftCols<n>() * J.transpose()).eval();
  P_.diagonal().template head<n>() += fluctuation;
}

template <int n>
NoiseEvidence BeliefWithNoise<n>::correct(double measurement, const NoiseModel& noise, double step) {
  constexpr int p = SmoothNoise::kOrders;
  // Yule and Walker: c = R_11⁻¹ r, fresh variance R_00 − c' r
  const WindowMatrix R = noise.covariance(step);
  const Eigen::Matrix<double, p, 1> r = R.template block<p, 1>(1, 0);
  const Eigen::Matrix<double, p, p> R_11 = R.template bottomRightCorner<p, p>();
  const Eigen::Matrix<double, p, 1> c = R_11.inverse() * r;
  Eigen::Matrix<double, kAll, kAll> A = Eigen::Matrix<double, kAll, kAll>::Identity();
  A.template bottomRightCorner<kWindow, kWindow>().setZero();
  A.template block<1, p>(n, n) = c.transpose();
  A.template block<p, p>(n + 1, n).setIdentity();
  noise_ = (A.template bottomRightCorner<kWindow, kWindow>() * noise_).eval();
  P_ = (A * P_ * A.transpose()).eval();
  P_(n, n) += std::max(R(0, 0) - c.dot(r), 0.0);

  // y = x_0 + n_0, without any other noise
  const Eigen::Matrix<double, kAll, 1> PH = P_.col(0) + P_.col(n);
  NoiseEvidence evidence;
  evidence.innovation = measurement - state_(0) - noise_(0);
  evidence.innovation_variance = PH(0) + PH(n);
  const Eigen::Matrix<double, kAll, 1> gain = PH / evidence.innovation_variance;
  state_ += gain.template head<n>() * evidence.innovation;
  noise_ += gain.template tail<kWindow>() * evidence.innovation;
  P_ -= gain * PH.transpose();
  P_ = (0.5 * (P_ + P_.transpose())).eval();
  evidence.moments = noise_ * noise_.transpose() + P_.template bottomRightCorner<kWindow, kWindow>();
  evidence.step = step;
  return evidence;
}

template class BeliefWithNoise<1>;
template class BeliefWithNoise<3>;

ColouredNoiseFilter::ColouredNoiseFilter(const PredictiveParameters& parameters, const GeometryParameters& geometry,
                                         const PlantModel& model, const NoiseModelFactory& noise)
    : parameters_(parameters),
      drive_train_(model, geometry.wheel_radius),
      dead_zone_(model),
      kinematics_(geometryOf(model, geometry)),
      on_box_(model.on_box),
      left_{CommandsUnderWay(model.dead_time), noise(true)},
      right_{CommandsUnderWay(model.dead_time), noise(true)},
      gyro_noise_(noise(false)) {}

void ColouredNoiseFilter::start(const Observation& y) {
  constexpr double kFirst = 0.02;  // s, until the step of the samples is known
  const double disturbance = square(WheelBeliefParameters().disturbance_deviation);
  for (auto [wheel, speed] : {std::pair(&left_, y.wheel_left), std::pair(&right_, y.wheel_right)}) {
    wheel->commands.fill(speed / drive_train_.gain());
    const double variance = wheel->noise->covariance(kFirst)(0, 0);
    const Eigen::Matrix3d known = Eigen::Vector3d(variance, 0.0, disturbance).asDiagonal();
    wheel->belief.start({speed, 0.0, 0.0}, known, *wheel->noise, kFirst);
  }
  using Scalar = BeliefWithNoise<1>::State;
  yaw_.start(Scalar(y.yaw_rate), Scalar(gyro_noise_->covariance(kFirst)(0, 0)), *gyro_noise_, kFirst);
  stamp_ = y.stamp;
  started_ = true;
}

void ColouredNoiseFilter::predict(const WheelCommand& command) {
  predict(left_, command.left);
  predict(right_, command.right);
  const double turn = kinematics_.yawPerDifference() * (right_.acceleration - left_.acceleration) * kStep;
  yaw_.state()(0) += turn;
  yaw_.predict(BeliefWithNoise<1>::StateMatrix::Identity(),
               BeliefWithNoise<1>::State(parameters_.yaw_process_noise * kStep));
  unfollowed_ += turn - std::min(kStep / parameters_.yaw_delay_deviation, 1.0) * unfollowed_;
  const double largest = std::max(std::abs(left_.acceleration), std::abs(right_.acceleration));
  steady_time_ = largest > kSteady ? 0.0 : steady_time_ + kStep;
}

void ColouredNoiseFilter::predict(Wheel& wheel, double command) {
  const auto [change, limited] =
      drive_train_.step(wheel.belief.state(), wheel.commands.step(dead_zone_.effective(command)));
  wheel.acceleration = change / kStep;
  const Eigen::Matrix3d J = limited ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : drive_train_.transition();
  wheel.belief.predict(J, kStep * Eigen::Vector3d(parameters_.speed_process_noise, 0.0,
                                                  parameters_.disturbance_process_noise));
}

void ColouredNoiseFilter::correct(const Observation& y) {
  if (!started_) return start(y);
  const double step = y.stamp - stamp_;
  if (!(step > 0.0)) return;
  stamp_ = y.stamp;
  correct(left_, y.wheel_left, step);
  correct(right_, y.wheel_right, step);
  if (on_box_) return;
  using Scalar = BeliefWithNoise<1>::State;
  yaw_.predict(BeliefWithNoise<1>::StateMatrix::Identity(), Scalar(square(unfollowed_)));
  const NoiseEvidence evidence = yaw_.correct(y.yaw_rate, *gyro_noise_, step);
  if (steady()) gyro_noise_->learn(evidence);
}

void ColouredNoiseFilter::correct(Wheel& wheel, double measured, double step) {
  const double late = parameters_.dead_time_deviation * wheel.acceleration;
  wheel.belief.predict(Eigen::Matrix3d::Identity(), {square(late), 0.0, 0.0});
  const NoiseEvidence evidence = wheel.belief.correct(measured, *wheel.noise, step);
  if (steady()) wheel.noise->learn(evidence);
}

bool ColouredNoiseFilter::steady() const { return steady_time_ > kSettled; }

BodyVector ColouredNoiseFilter::velocity() const {
  BodyVector velocity = kinematics_.bodyVelocity({left_.belief.state()(0), right_.belief.state()(0)});
  if (!on_box_) velocity(kYaw) = yaw_.state()(0);
  return velocity;
}

}  // namespace jackal_aic::sim
