#include "ticks.hpp"

#include <cmath>
#include <random>

#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "loop_setup.hpp"

namespace jackal_aic::benchmark {
namespace {

constexpr SetPoint kArc{0.5, 0.0, 0.2};  // m/s, rad/s

DriveParameters parametersOf(const std::string& controller, const sim::Overrides& overrides) {
  return sim::loadSetup(sim::PackageFiles(), controller, "ground", overrides).drive;
}

PredictiveController predictiveController() {
  const DriveParameters drive = predictiveParameters();
  return {std::get<PredictiveParameters>(drive.controller), drive.geometry, drive.plant_model.value()};
}

FaultMonitor faultMonitor(const DriveParameters& drive) {
  return {FaultParameters{}, drive.geometry, drive.plant_model.value()};
}

/// y_tilde of the arc: nothing changes.
GeneralizedSensor measurementOf(const GenerativeModel& model) {
  GeneralizedSensor y = GeneralizedSensor::Zero(kSensorSize, model.orders() + 1);
  y.col(0) = model.sensory_map * kArc.vector();
  return y;
}

GeneralizedBody setPointOf(const GenerativeModel& model) {
  GeneralizedBody mu_d = GeneralizedBody::Zero(kBodySize, model.orders() + 1);
  mu_d.col(0) = kArc.vector();
  return mu_d;
}

}  // namespace

DriveParameters improvedParameters(int orders) {
  std::string state = "[1.5, 2, 4, 8", sensory = "[2, 2, 1e5, 1e5";  // Table C-1
  for (int i = 4; i <= orders; ++i) {
    state += ", " + std::to_string(1 << i);
    sensory += ", 1e5";
  }
  return parametersOf("improved", {{"controller.orders", std::to_string(orders)},
                                   {"controller.state_variances", state + "]"},
                                   {"controller.sensory_variances", sensory + "]"}});
}

DriveParameters predictiveParameters() { return parametersOf("predictive", {}); }

Samples::Samples(const GeometryParameters& geometry, double period) : period_(period) {
  const WheelCommand wheels = SkidSteerKinematics(geometry).wheelSpeeds(kArc.forward, kArc.yaw_rate);
  std::mt19937 random(1);
  // Uniform noise by hand: the distributions of the standard library differ between libraries.
  const auto noise = [&random](double size) { return size * (random() / 2147483648.0 - 1.0); };
  for (Observation& y : samples_) {
    y.yaw_rate = kArc.yaw_rate + noise(5e-3);
    y.wheel_left = wheels.left + noise(0.03);
    y.wheel_right = wheels.right + noise(0.03);
    y.acceleration_x = noise(0.05);
    y.acceleration_y = noise(0.05);
  }
}

const Observation& Samples::next() {
  Observation& sample = samples_[index_++ % kSamples];
  sample.stamp = stamp_ += period_;
  return sample;
}

BeliefTick::BeliefTick(int orders) : controller_(makeController(improvedParameters(orders))) {
  Samples samples(improvedParameters(orders).geometry, 0.02);
  controller_->setSetPoint(kArc);
  for (int i = 0; i < 10; ++i) controller_->observe(samples.next());
}

template <int orders>
BoundTick<orders>::BoundTick() {
  const DriveParameters drive = improvedParameters(orders);
  const auto& controller = std::get<ControllerParameters>(drive.controller);
  const GenerativeModel model(controller, drive.geometry);
  const BeliefUpdate update(model, controller.kappa_mu, controller.beliefStep(), Integrator::exact);
  bound_.fill(update, measurementOf(model), setPointOf(model), GeneralizedBody::Zero(kBodySize, orders + 1));
}

template class BoundTick<3>;
template class BoundTick<5>;

TranscriptionTick::TranscriptionTick(int orders)
    : transcription_(std::get<ControllerParameters>(improvedParameters(orders).controller),
                     improvedParameters(orders).geometry) {
  const DriveParameters drive = improvedParameters(orders);
  const GenerativeModel model(std::get<ControllerParameters>(drive.controller), drive.geometry);
  const GeneralizedSensor y = measurementOf(model);
  const GeneralizedBody mu_d = setPointOf(model);
  measurement_ = Eigen::Map<const Eigen::VectorXd>(y.data(), y.size());
  set_point_ = Eigen::Map<const Eigen::VectorXd>(mu_d.data(), mu_d.size());
  belief_ = Eigen::VectorXd::Zero(mu_d.size());
}

template <bool sampled>
PredictiveTick<sampled>::PredictiveTick()
    : controller_(predictiveController()), samples_(predictiveParameters().geometry, sampled ? 0.001 : 0.02) {
  controller_.setSetPoint(kArc);
  for (int i = 0; i < 500; ++i) {
    if (i % 20 == 0) controller_.observe(samples_.next());
    controller_.updateBelief();
    if (i % 20 == 0) controller_.hold(controller_.updateAction());
  }
}

template class PredictiveTick<false>;
template class PredictiveTick<true>;

MonitorAdvanceTick::MonitorAdvanceTick()
    : geometry_(predictiveParameters().geometry), monitor_(faultMonitor(predictiveParameters())) {
  const WheelCommand wheels = SkidSteerKinematics(geometry_).wheelSpeeds(kArc.forward, kArc.yaw_rate);
  for (std::size_t i = 0; i < commands_.size(); ++i) {
    const double change = 0.05 * std::sin(0.3 * static_cast<double>(i));
    commands_[i] = {wheels.left + change, wheels.right - change};
  }
  command_ = wheels;
  monitor_.advance(command_, 1.0);
  monitor_.check(Samples(geometry_, 0.02).next());
}

MonitorCheckTick::MonitorCheckTick() : samples_(geometry_, 0.02) {
  samples_.next();
  for (int i = 0; i < 50; ++i) {
    for (int k = 0; k < 20; ++k) MonitorAdvanceTick::operator()();
    monitor_.check(samples_.next());
  }
}

}  // namespace jackal_aic::benchmark
