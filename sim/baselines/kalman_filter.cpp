#include "kalman_filter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace jackal_aic::sim {
namespace {

constexpr int kMostDoublings = 60;
constexpr double kConverged = 1e-12;  // relative change of P in one doubling

Eigen::MatrixXd outputMatrix(const SkidSteerKinematics& kinematics, bool on_box) {
  Eigen::MatrixXd output = Eigen::MatrixXd::Zero(on_box ? 2 : 3, 6);
  output(0, 0) = output(1, 3) = 1.0;
  if (!on_box) {
    output(2, 3) = kinematics.yawPerDifference();
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

OverSteps overSteps(const Eigen::MatrixXd& step, const Eigen::VectorXd& fluctuation, long count) {
  const Eigen::Index n = step.rows();
  OverSteps over{Eigen::MatrixXd::Identity(n, n), Eigen::MatrixXd::Zero(n, n)};
  for (long i = 0; i < count; ++i) {
    over.process = (step * over.process * step.transpose()).eval();
    over.process.diagonal() += fluctuation;
    over.transition = (step * over.transition).eval();
  }
  return over;
}

Eigen::MatrixXd stationaryGain(const OverSteps& model, const Eigen::MatrixXd& output, const Eigen::MatrixXd& noise) {
  const Eigen::MatrixXd covariance = predictionCovariance(model.transition, output, model.process, noise);
  return covariance * output.transpose() * (output * covariance * output.transpose() + noise).inverse();
}

WheelKalmanFilter::WheelKalmanFilter(const PlantModel& model, double wheel_radius, const WheelBeliefParameters& trust,
                                     double period)
    : drive_train_(model, wheel_radius), commands_(model.dead_time, model.dead_time) {
  const Eigen::Vector3d fluctuation(trust.speed_process_noise, 0.0, trust.disturbance_process_noise);
  const OverSteps over =
      overSteps(drive_train_.transition(), DriveTrain::kStep * fluctuation, std::lround(period / DriveTrain::kStep));
  gain_ = stationaryGain(over, Eigen::RowVector3d(1.0, 0.0, 0.0),
                         Eigen::MatrixXd::Constant(1, 1, trust.measurement_variance));
}

void WheelKalmanFilter::reset(double speed) {
  commands_.fill(speed / drive_train_.gain());
  state_ << speed, 0.0, 0.0;
}

Eigen::Vector3d WheelKalmanFilter::onArrival() const {
  CommandsUnderWay commands = commands_;
  Eigen::Vector3d state = state_;
  for (std::size_t i = 0; i < commands_.delay(); ++i) drive_train_.step(state, commands.step(0.0));
  return state;
}

SteadyStateKalmanFilter::SteadyStateKalmanFilter(const PredictiveParameters& parameters,
                                                 const GeometryParameters& geometry, const PlantModel& model)
    : drive_train_(model, geometry.wheel_radius),
      dead_zone_(model),
      left_(model.dead_time),
      right_(left_),
      kinematics_(geometryOf(model, geometry)),
      output_(outputMatrix(kinematics_, model.on_box)) {
  Eigen::MatrixXd step = Eigen::MatrixXd::Zero(6, 6);
  step.topLeftCorner<3, 3>() = step.bottomRightCorner<3, 3>() = drive_train_.transition();
  Eigen::VectorXd fluctuation(6);
  fluctuation << parameters.speed_process_noise, 0.0, parameters.disturbance_process_noise,
      parameters.speed_process_noise, 0.0, parameters.disturbance_process_noise;

  const auto steps = std::lround(1.0 / (model.sensor_rate * kStep));

  Eigen::VectorXd variance = Eigen::VectorXd::Constant(output_.rows(), parameters.wheel_variance);
  if (!model.on_box) variance(2) = parameters.gyro_variance;
  const Eigen::MatrixXd noise = variance.asDiagonal();
  gain_ = stationaryGain(overSteps(step, kStep * fluctuation, steps), output_, noise);
}

void SteadyStateKalmanFilter::predict(const WheelCommand& command) {
  Eigen::Vector3d left = state_.head<3>(), right = state_.tail<3>();
  drive_train_.step(left, left_.step(dead_zone_.effective(command.left)));
  drive_train_.step(right, right_.step(dead_zone_.effective(command.right)));
  state_ << left, right;
}

void SteadyStateKalmanFilter::correct(const Observation& observation) {
  Eigen::VectorXd measured(output_.rows());
  measured.head<2>() << observation.wheel_left, observation.wheel_right;
  if (output_.rows() > 2) measured(2) = observation.yaw_rate;
  state_ += (gain_ * (measured - output_ * state_)).eval();
}

}  // namespace jackal_aic::sim
