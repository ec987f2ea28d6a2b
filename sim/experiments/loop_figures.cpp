#include "loop_figures.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numeric>
#include <vector>

#include "bounds.hpp"
#include "jackal_aic/model/drive_train.hpp"

namespace jackal_aic::sim {
namespace {

using Complex = std::complex<double>;

constexpr double kPi = 3.14159265358979323846;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPeriod = 0.02;     // s
constexpr int kSteps = 20;           // of DriveTrain::kStep in a period
constexpr int kWarmUp = 150;         // periods until belief and path are steady
constexpr int kPeriods = 400;        // of an answer
constexpr int kTail = 50;            // periods at its end that tell whether it fades
constexpr double kAmplitude = 1e-3;  // rad/s; far below every limit
constexpr double kFading = 0.9;      // of a second in the middle of an answer, at its end
constexpr double kNothing = 1e-9;    // rad/s: rounding
constexpr int kFrequencies = 300;
constexpr double kLowest = 0.5;  // rad/s
constexpr double kSpeed = 0.5;   // m/s
constexpr int kMoment = 10;      // steps from a sample to a disturbance

/// What is done to a loop from kWarmUp on.
struct Stimulus {
  double impulse = 0.0;  ///< on one sample [rad/s]
  double input = 0.0;    ///< of the motors, from kMoment steps later on [rad/s]
};

/// What a wheel does from kWarmUp on [rad/s].
struct Answer {
  std::vector<double> samples, commands;  // per period
  std::vector<double> speed;              // per step
};

Answer simulate(VelocityController& controller, const PlantModel& robot, double radius, const Stimulus& stimulus) {
  const DriveTrain drive_train(withoutLimit(robot), radius);
  CommandsUnderWay commands(robot.dead_time);
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  Answer answer;
  double command = 0.0;
  controller.setSetPoint({kSpeed, 0.0, 0.0});
  for (int k = 0; k < kWarmUp + kPeriods; ++k) {
    Observation y;
    y.stamp = k * kPeriod;
    y.wheel_left = y.wheel_right = x(0) + (k == kWarmUp ? stimulus.impulse : 0.0);
    controller.observe(y);
    controller.updateBelief();
    command = controller.updateAction().left;
    if (k >= kWarmUp) {
      answer.samples.push_back(y.wheel_left);
      answer.commands.push_back(command);
    }
    for (int i = 0; i < kSteps; ++i) {
      if (i == kMoment && k == kWarmUp) x(2) = stimulus.input;
      if (k >= kWarmUp) answer.speed.push_back(x(0));
      drive_train.step(x, commands.step(command));
      if (i + 1 < kSteps) controller.updateBelief();
    }
  }
  return answer;
}

std::vector<double> perAmplitude(std::vector<double> with, const std::vector<double>& without) {
  for (std::size_t i = 0; i < with.size(); ++i) with[i] = (with[i] - without[i]) / kAmplitude;
  return with;
}

double largest(const std::vector<double>& values, std::size_t from, std::size_t until) {
  double found = 0.0;
  for (std::size_t i = from; i < until; ++i) {
    found = std::isfinite(values[i]) ? std::max(found, std::abs(values[i])) : kInfinity;
  }
  return found;
}

/// True if the last second of an answer is smaller than the one in its middle.
bool fades(const std::vector<double>& samples, double nothing) {
  const std::size_t end = samples.size();
  return largest(samples, end - kTail, end) <= std::max(nothing, kFading * largest(samples, end / 2 - kTail, end / 2));
}

/// Samples less the mean of the last second.
std::vector<double> ripple(std::vector<double> samples) {
  const double mean = std::accumulate(samples.end() - kTail, samples.end(), 0.0) / kTail;
  for (double& sample : samples) sample -= mean;
  return samples;
}

/// S(e^(i omega T)) = sum of y_k e^(-i omega T k).
Complex transform(const std::vector<double>& samples, double angle) {
  const Complex turn = std::polar(1.0, -angle);
  Complex sum = 0.0;
  for (auto y = samples.rbegin(); y != samples.rend(); ++y) sum = sum * turn + *y;
  return sum;
}

/// Where, as a part of the way from a to b, a function that is linear between them is zero; empty if it is not.
bool crosses(double a, double b, double& part) {
  if ((a < 0.0) == (b < 0.0)) return false;
  part = a / (a - b);
  return true;
}

/// Fills sensitivity and margins in from the answer to an impulse.
void describeRobustness(const std::vector<double>& samples, LoopFigures& figures) {
  figures.peak_sensitivity = 0.0;
  figures.gain_margin = figures.delay_margin = kInfinity;
  Complex before = 0.0;
  double omega_before = 0.0, part = 0.0;
  for (int i = 0; i <= kFrequencies; ++i) {
    const double omega = kLowest * std::pow(kPi / kPeriod / kLowest, static_cast<double>(i) / kFrequencies);
    const Complex sensitivity = transform(samples, omega * kPeriod), loop = 1.0 / sensitivity - 1.0;
    figures.peak_sensitivity = std::max(figures.peak_sensitivity, std::abs(sensitivity));
    if (i > 0 && crosses(before.imag(), loop.imag(), part)) {
      const double real = before.real() + part * (loop.real() - before.real());
      if (real < 0.0 && real > -1.0) figures.gain_margin = std::min(figures.gain_margin, -1.0 / real);
    }
    if (i > 0 && crosses(std::abs(before) - 1.0, std::abs(loop) - 1.0, part)) {
      const double at = omega_before + part * (omega - omega_before);
      const double angle = std::arg(before + part * (loop - before));
      figures.delay_margin = std::min(figures.delay_margin, (angle + kPi) / at);
    }
    before = loop;
    omega_before = omega;
  }
  // At half the rate of the samples L is real.
  if (before.real() < 0.0 && before.real() > -1.0) {
    figures.gain_margin = std::min(figures.gain_margin, -1.0 / before.real());
  }
}

double area(const std::vector<double>& errors) {
  double sum = 0.0;
  for (const double error : errors) sum += DriveTrain::kStep * std::abs(error);
  return sum;
}

}  // namespace

PlantModel withoutLimit(PlantModel model) {
  model.acceleration_limit = 1e9;
  return model;
}

LoopFigures loopFigures(const ControllerMaker& make, const PlantModel& robot, const GeometryParameters& geometry) {
  const auto answer = [&](const Stimulus& stimulus) {
    return simulate(*make(), robot, geometry.wheel_radius, stimulus);
  };
  const Answer undisturbed = answer({}), after_impulse = answer({kAmplitude, 0.0});
  const std::vector<double> samples = perAmplitude(after_impulse.samples, undisturbed.samples);
  LoopFigures figures{fades(ripple(undisturbed.samples), kNothing) && fades(samples, kNothing / kAmplitude),
                      kInfinity,
                      0.0,
                      0.0,
                      kInfinity,
                      kInfinity};
  if (!figures.stable) return figures;
  describeRobustness(samples, figures);
  double power = 0.0;
  for (const double u : perAmplitude(after_impulse.commands, undisturbed.commands)) power += u * u;
  figures.noise = std::sqrt(power);
  figures.iae = area(perAmplitude(answer({0.0, kAmplitude}).speed, undisturbed.speed));
  return figures;
}

double leastLinearIae(const PlantModel& robot, const GeometryParameters& geometry) {
  const DriveTrain drive_train(withoutLimit(robot), geometry.wheel_radius);
  Eigen::Vector3d x(0.0, 0.0, 1.0);
  const double t_1 = (kSteps - kMoment) * DriveTrain::kStep + robot.dead_time;
  std::vector<double> errors;
  for (double t = 0.0; t < t_1 + kPeriod; t += DriveTrain::kStep) {
    errors.push_back(x(0));
    drive_train.step(x, 0.0);
  }
  return leastIae(errors, t_1, kInfinity);
}

}  // namespace jackal_aic::sim
