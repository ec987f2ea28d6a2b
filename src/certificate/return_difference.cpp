#include "return_difference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hessenberg.hpp"

namespace jackal_aic {
namespace {

using Complex = std::complex<double>;

constexpr double kPi = 3.14159265358979323846;
constexpr double kLowest = 1e-6;  // frequency, per common period
constexpr double kTurn = 0.25;    // rad, by which F turns at most from one point to the next
constexpr double kLeast = 1e-7;   // step of the frequency, beside a zero or pole on the unit circle
constexpr int kMostSteps = 60;    // to a zero between two points; ten suffice
constexpr double kPrecision = 1e-12;

/// All of a map that are not 0; empty if they are not finite.
std::vector<Complex> eigenvaluesBesideZero(const Eigen::MatrixXd& map) {
  if (!map.allFinite()) return {};
  std::vector<Complex> all;
  for (const Complex& eigenvalue : eigenvaluesOf(hessenbergForm(map))) {
    if (eigenvalue != 0.0) all.push_back(eigenvalue);
    if (eigenvalue.imag() != 0.0) all.push_back(std::conj(eigenvalue));
  }
  return all;
}

}  // namespace

ReturnDifference::ReturnDifference(const Eigen::MatrixXd& open, const Eigen::MatrixXd& closed)
    : zeros_(eigenvaluesBesideZero(closed)), poles_(eigenvaluesBesideZero(open)) {}

bool ReturnDifference::known() const { return !zeros_.empty() && !poles_.empty(); }

/// F = Π (1 − μ_i / z) / Π (1 − λ_i / z), |d ln F / dω| <= Σ |μ_i| / |z − μ_i| + Σ |λ_i| / |z − λ_i|
ReturnDifference::Point ReturnDifference::at(double frequency) const {
  const Complex z = std::polar(1.0, frequency);
  double rate = 0.0;
  const auto product_over = [&](const std::vector<Complex>& eigenvalues) {
    Complex value = 1.0;
    for (const Complex& eigenvalue : eigenvalues) {
      const Complex factor = 1.0 - eigenvalue * std::conj(z);
      value *= factor;
      rate += std::sqrt(std::norm(eigenvalue) / std::norm(factor));
    }
    return value;
  };
  const Complex above = product_over(zeros_), below = product_over(poles_);
  return {frequency, above / below, rate};
}

/// Points where a curve over F, which changes by no more than F does, is zero. Where F turns by kTurn it is taken to
/// have one zero at most, and none where F cannot get as far.
template <class Curve>
std::vector<ReturnDifference::Point> ReturnDifference::zerosOf(const Curve& curve) const {
  std::vector<Point> zeros;
  Point low = at(kLowest);
  double before = curve(low.value);
  while (low.frequency < kPi) {
    // |F(ω + h) − F(ω)| <= |F| t / (1 − t), t = h |d ln F / dω|, for a pole or zero beside which h is short
    const double distance = std::abs(before / std::abs(low.value));
    const double turn = std::max(kTurn, distance / (1.0 + distance));
    Point high = at(std::min(low.frequency + std::max(turn / low.rate, kLeast), kPi));
    const Point next = high;
    double after = curve(high.value);
    const double there = after;
    if ((before > 0.0) != (after > 0.0)) {
      // Regula falsi; an end that stays for a second time counts half (Illinois).
      int stayed = 0;  // steps for which the high end stayed, negative: the low one
      for (int i = 0; i < kMostSteps && high.frequency - low.frequency > kPrecision * high.frequency; ++i) {
        const Point middle = at((low.frequency * after - high.frequency * before) / (after - before));
        const double value = curve(middle.value);
        if ((value > 0.0) == (before > 0.0)) {
          low = middle;
          before = value;
          stayed = std::max(stayed, 0) + 1;
          if (stayed > 1) after *= 0.5;
        } else {
          high = middle;
          after = value;
          stayed = std::min(stayed, 0) - 1;
          if (stayed < -1) before *= 0.5;
        }
        if (value == 0.0) break;
      }
      zeros.push_back(std::abs(before) < std::abs(after) ? low : high);
    }
    low = next;
    before = there;
  }
  return zeros;
}

std::vector<double> ReturnDifference::criticalGains() const {
  std::vector<Point> real = zerosOf([](const Complex& value) { return value.imag(); });
  real.push_back(at(0.0));
  real.push_back(at(kPi));
  std::vector<double> gains;
  for (const Point& point : real) {
    const double gain = 1.0 / (1.0 - point.value.real());
    if (gain > 0.0 && std::isfinite(gain)) gains.push_back(gain);
  }
  return gains;
}

double ReturnDifference::criticalDelay(double least) const {
  double shortest = std::numeric_limits<double>::infinity();
  for (const Point& point : zerosOf([](const Complex& value) { return std::abs(1.0 - value) - 1.0; })) {
    // d = (arg L + 2 π m) / ω
    const double turn = 2.0 * kPi / point.frequency, delay = std::arg(1.0 - point.value) / point.frequency;
    shortest = std::min(shortest, delay + turn * std::ceil((least - delay) / turn));
  }
  return shortest;
}

}  // namespace jackal_aic
