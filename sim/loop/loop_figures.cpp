#include "loop_figures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numeric>
#include <vector>

#include "jackal_aic/model/drive_train.hpp"

namespace jackal_aic::sim {
namespace {

using Complex = std::complex<double>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kActionPeriod = 0.02;  // s, between samples and between actions
constexpr int kSteps = 20;              // of DriveTrain::kStep in a period
constexpr int kWarmUp = 150;            // periods until belief and path are steady
constexpr int kPeriods = 400;           // of an answer
constexpr int kTail = 50;               // last periods, in which it has to have faded
constexpr double kAmplitude = 1e-3;     // rad/s; far below every limit
constexpr double kFading = 0.9;         // of a second in the middle of an answer, at its end
constexpr double kRounding = 1e-9;      // rad/s: rounding
constexpr int kFrequencies = 300;
constexpr double kLowest = 0.5;  // rad/s
constexpr double kSpeed = 0.5;   // m/s
constexpr int kMoment = 10;      // steps from a sample to a disturbance

/// Speed of a wheel per period, from kWarmUp on [rad/s].
struct Answer {
  std::vector<double> samples, commands;
};

/// A wheel of a linear robot.
class LinearWheel {
 public:
  LinearWheel(const PlantModel& robot, double radius)
      : drive_train_(withoutLimit(robot), radius), commands_(robot.dead_time) {}

  double speed() const { return x_(0); }
  void disturb(double input) { x_(2) = input; }
  void step(double command) { drive_train_.step(x_, commands_.step(command)); }

 private:
  DriveTrain drive_train_;
  CommandsUnderWay commands_;
  Eigen::Vector3d x_ = Eigen::Vector3d::Zero();
};

/// Drives two wheels, with an impulse [rad/s] on a sample of the right one. @returns left and right.
std::array<Answer, 2> simulate(VelocityController& controller, const PlantModel& robot, double radius, double impulse) {
  LinearWheel left(robot, radius), right = left;
  std::array<Answer, 2> answers;
  controller.setSetPoint({kSpeed, 0.0, 0.0});
  for (int k = 0; k < kWarmUp + kPeriods; ++k) {
    Observation y;
    y.stamp = k * kActionPeriod;
    y.valid.yaw_rate = false;  // a gyro would couple the wheels
    y.wheel_left = left.speed();
    y.wheel_right = right.speed() + (k == kWarmUp ? impulse : 0.0);
    controller.observe(y);
    controller.updateBelief();
    const WheelCommand command = controller.updateAction();
    if (k >= kWarmUp) {
      answers[0].samples.push_back(y.wheel_left);
      answers[0].commands.push_back(command.left);
      answers[1].samples.push_back(y.wheel_right);
      answers[1].commands.push_back(command.right);
    }
    for (int i = 0; i < kSteps; ++i) {
      left.step(command.left);
      right.step(command.right);
      if (i + 1 < kSteps) controller.updateBelief();
    }
  }
  return answers;
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

using Frequencies = Eigen::Array<double, kFrequencies + 1, 1>;

/// Frequencies up to half the rate of the samples [rad/s].
const Frequencies& frequencies() {
  static const Frequencies list = [] {
    Frequencies omega;
    for (int i = 0; i <= kFrequencies; ++i) {
      omega(i) = kLowest * std::pow(M_PI / kActionPeriod / kLowest, static_cast<double>(i) / kFrequencies);
    }
    return omega;
  }();
  return list;
}

/// A function of the frequencies.
struct Spectrum {
  Frequencies real = Frequencies::Zero(), imaginary = Frequencies::Zero();

  Complex operator()(int i) const { return {real(i), imaginary(i)}; }
};

/// S(e^(i omega T)) = sum of y_k e^(-i omega T k), by Horner's scheme for all frequencies at once.
Spectrum transform(const std::vector<double>& samples) {
  static const Frequencies cosine = (kActionPeriod * frequencies()).cos(),
                           sine = -(kActionPeriod * frequencies()).sin();
  Spectrum sum;
  for (auto y = samples.rbegin(); y != samples.rend(); ++y) {
    const Frequencies real = sum.real * cosine - sum.imaginary * sine + *y;
    sum.imaginary = sum.real * sine + sum.imaginary * cosine;
    sum.real = real;
  }
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
  const Spectrum spectrum = transform(samples);
  Complex before = 0.0;
  double omega_before = 0.0, part = 0.0;
  for (int i = 0; i <= kFrequencies; ++i) {
    const double omega = frequencies()(i);
    const Complex sensitivity = spectrum(i), loop = 1.0 / sensitivity - 1.0;
    figures.peak_sensitivity = std::max(figures.peak_sensitivity, std::abs(sensitivity));
    if (i > 0 && crosses(before.imag(), loop.imag(), part)) {
      const double real = before.real() + part * (loop.real() - before.real());
      if (real < 0.0 && real > -1.0) figures.gain_margin = std::min(figures.gain_margin, -1.0 / real);
    }
    if (i > 0 && crosses(std::abs(before) - 1.0, std::abs(loop) - 1.0, part)) {
      const double at = omega_before + part * (omega - omega_before);
      const double angle = std::arg(before + part * (loop - before));
      figures.delay_margin = std::min(figures.delay_margin, (angle + M_PI) / at);
    }
    before = loop;
    omega_before = omega;
  }
  // At half the rate of the samples L is real.
  if (before.real() < 0.0 && before.real() > -1.0) {
    figures.gain_margin = std::min(figures.gain_margin, -1.0 / before.real());
  }
}

/// Integral of the absolute error after a unit step of the motors' input, kMoment steps behind a sample. Without a
/// command it shows in the samples as d; the loop answers the sample of each period k by its commands c after an
/// impulse, u_k = sum of c_(k-j) d_j. @param after_impulse c.
double iaeOf(const std::vector<double>& after_impulse, const PlantModel& robot, double radius) {
  LinearWheel uncontrolled(robot, radius), wheel = uncontrolled;
  std::vector<double> commands(after_impulse.size());
  double sum = 0.0;
  for (std::size_t k = 0; k < commands.size(); ++k) {
    const double sample = uncontrolled.speed();
    for (std::size_t j = k; j < commands.size(); ++j) commands[j] += after_impulse[j - k] * sample;
    for (int i = 0; i < kSteps; ++i) {
      if (i == kMoment && k == 0) {
        wheel.disturb(1.0);
        uncontrolled.disturb(1.0);
      }
      sum += DriveTrain::kStep * std::abs(wheel.speed());
      wheel.step(commands[k]);
      uncontrolled.step(0.0);
    }
  }
  return sum;
}

}  // namespace

PlantModel withoutLimit(PlantModel model) {
  model.acceleration_limit = 1e9;
  return model;
}

LoopFigures loopFigures(const ControllerMaker& make, const PlantModel& robot, const GeometryParameters& geometry) {
  const auto answers = simulate(*make(), robot, geometry.wheel_radius, kAmplitude);
  const Answer &undisturbed = answers[0], &after_impulse = answers[1];
  const std::vector<double> samples = perAmplitude(after_impulse.samples, undisturbed.samples);
  LoopFigures figures{fades(ripple(undisturbed.samples), kRounding) && fades(samples, kRounding / kAmplitude),
                      kInfinity,
                      0.0,
                      0.0,
                      kInfinity,
                      kInfinity};
  if (!figures.stable) return figures;
  describeRobustness(samples, figures);
  const std::vector<double> commands = perAmplitude(after_impulse.commands, undisturbed.commands);
  double power = 0.0;
  for (const double u : commands) power += u * u;
  figures.noise = std::sqrt(power);
  figures.iae = iaeOf(commands, robot, geometry.wheel_radius);
  return figures;
}

double leastLinearIae(const PlantModel& robot, const GeometryParameters& geometry) {
  const DriveTrain drive_train(withoutLimit(robot), geometry.wheel_radius);
  Eigen::Vector3d x(0.0, 0.0, 1.0);
  const double t_1 = (kSteps - kMoment) * DriveTrain::kStep + robot.dead_time;
  // IAE ≥ ∫₀^t₁ |e₀| dt
  double sum = 0.0;
  for (long k = std::lround(t_1 / DriveTrain::kStep); k > 0; --k) {
    sum += DriveTrain::kStep * std::abs(x(0));
    drive_train.step(x, 0.0);
  }
  return sum;
}

}  // namespace jackal_aic::sim
