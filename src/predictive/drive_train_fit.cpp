#include "jackal_aic/predictive/drive_train_fit.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kWashout = 0.3;    // s; T_w
constexpr double kSlowest = 0.01;   // rad/s; least command under which a wheel turns
constexpr double kRateTime = 0.02;  // s; averaging time of an acceleration, about a sample

}  // namespace

void DriveTrainFit::reset(const DriveTrainVector& theta, const WheelVector& given, const WheelVector& measured) {
  theta_ = theta;
  lag_ = std::exp(theta(kLogLag));
  rest_ = std::exp(-kStep / lag_);
  limit_ = theta(kLimitShare) * model_.acceleration_limit / radius_;
  reset(left_, given(0), measured(0));
  reset(right_, given(1), measured(1));
  sums_.fill({});
  samples_ = motion_ = acceleration_ = 0.0;
}

void DriveTrainFit::reset(Wheel& wheel, double given, double measured) const {
  wheel.speed = input(given);
  wheel.correction.setZero();
  wheel.filtered.setZero();
  wheel.history.fill(Speeds::Zero());
  wheel.measured = measured;
  wheel.measured_filtered = wheel.rate = 0.0;
}

DriveTrainFit::Speeds DriveTrainFit::input(double given) const {
  // r = γ g v − o sign(v), and its derivatives
  const double turning = std::abs(given) > kSlowest ? std::copysign(1.0, given) : 0.0;
  Speeds input;
  input << theta_(kGainShare) * model_.gain * given - theta_(kOffset) * turning, 0.0, 0.0, model_.gain * given,
      -turning;
  return input;
}

void DriveTrainFit::step(const WheelVector& given) {
  newest_ = (newest_ + 1) % kHistory;
  step(left_, given(0));
  step(right_, given(1));
}

void DriveTrainFit::step(Wheel& wheel, double given) {
  const Speeds r = input(given);
  const Speeds drive = r + wheel.correction - wheel.speed;
  const Speeds before = wheel.speed;
  // Exact for a constant r, e = r + z − w: at the limit for a time t, until |e| = L T, then free; with
  // q = e^(−(h−t)/T)
  //     w ← w ± L t + (1 − q) e_t,    ∂w/∂e = 1 − q,    ∂w/∂ln T = −e_t q (h−t)/T,    ∂w/∂L = ± q t
  const double e = drive(0), end = limit_ * lag_;
  const double limited = std::clamp(std::abs(e) / limit_ - lag_, 0.0, kStep), free = kStep - limited;
  const double q = limited > 0.0 ? std::exp(-free / lag_) : rest_, e_t = std::clamp(e, -end, end);
  wheel.speed += (1.0 - q) * drive;
  wheel.speed(0) = before(0) + std::copysign(limit_ * limited, e) + (1.0 - q) * e_t;
  wheel.speed(1 + kLogLag) -= e_t * q * free / lag_;
  wheel.speed(1 + kLimitShare) += std::copysign(q * limited * limit_ / theta_(kLimitShare), e);
  // z ← z + k ∫(r − w) dt while it is free, by the trapezoidal rule
  wheel.correction += model_.velocity_loop_integral * free * (r - 0.5 * (before + wheel.speed));
  static const double decay = std::exp(-kStep / kWashout), half = std::sqrt(decay);
  wheel.filtered = decay * wheel.filtered + half * (wheel.speed - before);
  wheel.rate += kStep / kRateTime * ((wheel.speed(0) - before(0)) / kStep - wheel.rate);
  acceleration_ = std::max(acceleration_, radius_ * std::abs(wheel.rate));
  wheel.history[newest_] = wheel.filtered;
}

void DriveTrainFit::observe(const WheelVector& measured, double step, double part, bool counts) {
  const double decay = std::exp(-step / kWashout), half = std::sqrt(decay);
  const auto filter = [&](Wheel& wheel, double y) {
    wheel.measured_filtered = decay * wheel.measured_filtered + half * (y - wheel.measured);
    wheel.measured = y;
  };
  filter(left_, measured(0));
  filter(right_, measured(1));
  if (!counts) return;
  observe(left_, part);
  observe(right_, part);
  samples_ += 2.0;
}

void DriveTrainFit::observe(Wheel& wheel, double part) {
  // The prediction is at the time of a step, the measurement between two of them.
  for (std::size_t i = 0; i < kGrid; ++i) {
    const std::size_t at = (newest_ + kHistory - i) % kHistory, after = i > 0 ? (at + 1) % kHistory : at;
    const Speeds then = wheel.history[at] + part * (wheel.history[after] - wheel.history[at]);
    const double error = wheel.measured_filtered - then(0);
    const DriveTrainVector sensitivity = then.tail<kDriveTrainParameters>().transpose();
    sums_[i].curvature.noalias() += sensitivity.lazyProduct(sensitivity.transpose());
    sums_[i].slope += error * sensitivity;
    sums_[i].squares += error * error;
  }
  motion_ += wheel.measured_filtered * wheel.measured_filtered;
}

}  // namespace jackal_aic
