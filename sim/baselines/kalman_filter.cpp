#include "kalman_filter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace jackal_aic::sim {
namespace {

constexpr int kMostDoublings = 60;
constexpr double kConverged = 1e-12;  // relative change of P in one doubling

using Matrix3 = Eigen::Matrix3d;

/// One step of (w, z, d) of a wheel below its acceleration limit; the same discretisation as in wheel_belief.cpp.
Matrix3 wheelTransition(const PlantModel& model, double response, double step) {
  const double k = model.velocity_loop_integral * step;
  Matrix3 transition = Matrix3::Identity();
  transition.row(0) << 1.0 - response, response, response;
  transition.row(1) << -k * (1.0 - 0.5 * response), 1.0 - 0.5 * k * response, k * (1.0 - 0.5 * response);
  return transition;
}

double responseOf(const PlantModel& model, double step) {
  return model.lag > 0.0 ? -std::expm1(-step / model.lag) : 1.0;
}

GeometryParameters withTrack(GeometryParameters geometry, const PlantModel& model) {
  if (model.effective_track > 0.0) geometry.effective_track = model.effective_track;
  return geometry;
}

Eigen::MatrixXd outputMatrix(const GeometryParameters& geometry, bool on_box) {
  Eigen::MatrixXd output = Eigen::MatrixXd::Zero(on_box ? 2 : 3, 6);
  output(0, 0) = output(1, 3) = 1.0;
  if (!on_box) {
    output(2, 3) = geometry.wheel_radius * geometry.slip_factor / geometry.effective_track;
    output(2, 0) = -output(2, 3);
  }
  return output;
}

}  // namespace

Eigen::MatrixXd predictionCovariance(const Eigen::MatrixXd& transition, const Eigen::MatrixXd& output,
                                     const Eigen::MatrixXd& process, const Eigen::MatrixXd& noise) {
  const Eigen::Index n = transition.rows();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixXd a = transition.transpose();
  Eigen::MatrixXd g = output.transpose() * noise.inverse() * output;
  Eigen::MatrixXd p = process;
  for (int i = 0; i < kMostDoublings; ++i) {
    const Eigen::MatrixXd inverse = (identity + g * p).inverse();
    const Eigen::MatrixXd change = a.transpose() * p * inverse * a;
    g = (g + a * inverse * g * a.transpose()).eval();
    a = (a * inverse * a).eval();
    p += change;
    if (!p.allFinite()) break;
    if (change.cwiseAbs().maxCoeff() <= kConverged * p.cwiseAbs().maxCoeff()) return 0.5 * (p + p.transpose());
  }
  throw ParameterError("Kalman filter: has no steady state; the model must be detectable and excited by its noise");
}

SteadyStateKalmanFilter::SteadyStateKalmanFilter(const PredictiveParameters& parameters,
                                                 const GeometryParameters& geometry, const PlantModel& model)
    : model_(model),
      kinematics_(withTrack(geometry, model)),
      limit_(model.acceleration_limit / geometry.wheel_radius),
      response_(responseOf(model, kStep)),
      output_(outputMatrix(withTrack(geometry, model), model.on_box)),
      commands_(static_cast<std::size_t>(std::lround(model.dead_time / kStep)) + 1) {
  Eigen::MatrixXd step = Eigen::MatrixXd::Zero(6, 6);
  step.topLeftCorner<3, 3>() = step.bottomRightCorner<3, 3>() = wheelTransition(model, response_, kStep);
  Eigen::VectorXd fluctuation(6);
  fluctuation << parameters.speed_process_noise, 0.0, parameters.disturbance_process_noise,
      parameters.speed_process_noise, 0.0, parameters.disturbance_process_noise;

  // Over the period of the sensors.
  const auto steps = std::lround(1.0 / (model.sensor_rate * kStep));
  Eigen::MatrixXd transition = Eigen::MatrixXd::Identity(6, 6);
  Eigen::MatrixXd process = Eigen::MatrixXd::Zero(6, 6);
  for (long i = 0; i < steps; ++i) {
    process = (step * process * step.transpose()).eval();
    process.diagonal() += kStep * fluctuation;
    transition = (step * transition).eval();
  }

  Eigen::VectorXd variance = Eigen::VectorXd::Constant(output_.rows(), parameters.wheel_variance);
  if (!model.on_box) variance(2) = parameters.gyro_variance;
  const Eigen::MatrixXd noise = variance.asDiagonal();
  const Eigen::MatrixXd covariance = predictionCovariance(transition, output_, process, noise);
  gain_ = covariance * output_.transpose() * (output_ * covariance * output_.transpose() + noise).inverse();
}

void SteadyStateKalmanFilter::predictWheel(Eigen::Index first, double command) {
  auto x = state_.segment<3>(first);
  const double k = model_.velocity_loop_integral * kStep;
  const double r = model_.gain * command + x(2);
  const double wanted = response_ * (r + x(1) - x(0));
  const double change = std::clamp(wanted, -limit_ * kStep, limit_ * kStep);
  if (change == wanted) x(1) += k * (r - x(0) - 0.5 * change);
  x(0) += change;
}

void SteadyStateKalmanFilter::predict(const WheelCommand& command) {
  commands_[head_] = command;
  head_ = (head_ + 1) % commands_.size();
  const WheelCommand& acting = commands_[head_];
  predictWheel(0, acting.left);
  predictWheel(3, acting.right);
}

void SteadyStateKalmanFilter::correct(const Observation& observation) {
  Eigen::VectorXd measured(output_.rows());
  measured.head<2>() << observation.wheel_left, observation.wheel_right;
  if (!model_.on_box) measured(2) = observation.yaw_rate;
  state_ += (gain_ * (measured - output_ * state_)).eval();
}

}  // namespace jackal_aic::sim
