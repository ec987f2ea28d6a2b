#include "coloured_filter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "jackal_aic/model/square.hpp"

namespace jackal_aic::sim {
namespace {

using WindowMatrix = SmoothNoise::WindowMatrix;

constexpr double kLeastPart = 0.1;         // of the innovations that the noise with a memory is taken to have
constexpr double kLargestSurprise = 50.0;  // e^2 from which is learned
constexpr double kRange = 1e4;             // of the learned variance / the white one, to either side of 1
constexpr double kSteady = 2.0;            // rad/s^2; largest acceleration of a wheel of a steady drive
constexpr double kAveraged = 0.1;          // s; over which it is averaged, for the noise in the commands
constexpr double kQuiet = 0.01;            // fluctuations of a steady drive, as part of those that are trusted
constexpr double kSettled = 0.5;           // s; until nothing is left of an acceleration

using Scalar = BeliefWithNoise<1>::State;

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
  const double largest = std::exp(-step_ / SmoothnessLearning::kMost);
  coefficient = std::clamp(coefficient + rate * correlation, 0.0, largest);
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
      left_{CommandsUnderWay(model.dead_time), {noise(true)}},
      right_{CommandsUnderWay(model.dead_time), {noise(true)}},
      yaw_{noise(false)} {}

void ColouredNoiseFilter::start(const Observation& y) {
  constexpr double kFirst = 0.02;  // s, until the step of the samples is known
  const double disturbance = square(WheelBeliefParameters().disturbance_deviation);
  for (auto [wheel, speed] : {std::pair(&left_, y.wheel_left), std::pair(&right_, y.wheel_right)}) {
    wheel->commands.fill(speed / drive_train_.gain());
    const NoiseModel& noise = *wheel->channel.noise;
    const Eigen::Matrix3d known = Eigen::Vector3d(noise.covariance(kFirst)(0, 0), 0.0, disturbance).asDiagonal();
    wheel->channel.belief.start({speed, 0.0, 0.0}, known, noise, kFirst);
  }
  yaw_.belief.start(Scalar(y.yaw_rate), Scalar(yaw_.noise->covariance(kFirst)(0, 0)), *yaw_.noise, kFirst);
  stamp_ = y.stamp;
  started_ = true;
}

void ColouredNoiseFilter::predict(const WheelCommand& command) {
  predict(left_, command.left);
  predict(right_, command.right);
  const Eigen::Vector2d acceleration(left_.acceleration, right_.acceleration);
  const double turn = kinematics_.yawPerDifference() * (acceleration(1) - acceleration(0)) * kStep;
  const Scalar fluctuation(parameters_.yaw_process_noise * kStep);
  for (auto [belief, part] : {std::pair(&yaw_.belief, 1.0), std::pair(&yaw_.steady, kQuiet)}) {
    belief->state()(0) += turn;
    belief->predict(Scalar::Identity(), part * fluctuation);
  }
  unfollowed_ += turn - std::min(kStep / parameters_.yaw_delay_deviation, 1.0) * unfollowed_;
  acceleration_ += kStep / kAveraged * (acceleration - acceleration_);
  steady_time_ = acceleration_.cwiseAbs().maxCoeff() > kSteady ? 0.0 : steady_time_ + kStep;
}

void ColouredNoiseFilter::predict(Wheel& wheel, double command) {
  const double acting = wheel.commands.step(dead_zone_.effective(command));
  const Eigen::Vector3d fluctuation(parameters_.speed_process_noise, 0.0, parameters_.disturbance_process_noise);
  for (auto [belief, part] : {std::pair(&wheel.channel.steady, kQuiet), std::pair(&wheel.channel.belief, 1.0)}) {
    const auto [change, limited] = drive_train_.step(belief->state(), acting);
    const Eigen::Matrix3d J = limited ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : drive_train_.transition();
    belief->predict(J, part * kStep * fluctuation);
    wheel.acceleration = change / kStep;
  }
}

void ColouredNoiseFilter::correct(const Observation& y) {
  if (!started_) return start(y);
  const double step = y.stamp - stamp_;
  if (!(step > 0.0)) return;
  stamp_ = y.stamp;
  correct(left_, y.wheel_left, step);
  correct(right_, y.wheel_right, step);
  if (on_box_) return;
  yaw_.belief.predict(Scalar::Identity(), Scalar(square(unfollowed_)));
  correct(yaw_, y.yaw_rate, step);
}

void ColouredNoiseFilter::correct(Wheel& wheel, double measured, double step) {
  const double late = parameters_.dead_time_deviation * wheel.acceleration;
  wheel.channel.belief.predict(Eigen::Matrix3d::Identity(), {square(late), 0.0, 0.0});
  correct(wheel.channel, measured, step);
}

template <int n>
void ColouredNoiseFilter::correct(Channel<n>& channel, double measured, double step) {
  channel.belief.correct(measured, *channel.noise, step);
  if (steady()) {
    channel.noise->learn(channel.steady.correct(measured, *channel.noise, step));
  } else {
    channel.steady = channel.belief;
  }
}

bool ColouredNoiseFilter::steady() const { return steady_time_ > kSettled; }

BodyVector ColouredNoiseFilter::velocity() const {
  BodyVector velocity = kinematics_.bodyVelocity({left_.channel.belief.state()(0), right_.channel.belief.state()(0)});
  if (!on_box_) velocity(kYaw) = yaw_.belief.state()(0);
  return velocity;
}

}  // namespace jackal_aic::sim
