#include "jackal_aic/predictive/drive_train_fit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {

void DriveTrainSums::add(const DriveTrainSums& other, double weight) {
  curvature += weight * other.curvature;
  slope += weight * other.slope;
  squares += weight * other.squares;
}

DriveTrainSums DriveTrainSums::around(double change) const {
  // epsilon <- epsilon - psi change
  const Eigen::Vector2d moved = curvature.col(0) * change;
  return {curvature, slope - moved, squares + change * (moved(0) - 2.0 * slope(0))};
}

DriveTrainSums DriveTrainSums::withoutGain() const {
  const double bend = curvature(0, 0);
  if (!(bend > 0.0)) return *this;
  const Eigen::Vector2d along = curvature.col(0) / bend;
  return {curvature - along * curvature.row(0), slope - along * slope(0), squares - slope(0) * slope(0) / bend};
}

DriveTrainFit::DriveTrainFit(const PlantModel& model, double lag, double limit)
    : model_gain_(model.gain),
      integral_(model.velocity_loop_integral),
      lag_(lag),
      limit_(limit),
      rest_(std::exp(-kStep / lag)) {}

void DriveTrainFit::restart(const WheelVector& given) {
  for (std::size_t side = 0; side < wheels_.size(); ++side) {
    Wheel& wheel = wheels_[side];
    wheel.speed = input(given(static_cast<Eigen::Index>(side)));
    wheel.correction.setZero();
    wheel.filtered.setZero();
    std::fill(wheel.history.begin(), wheel.history.end(), Speeds::Zero());
  }
}

void DriveTrainFit::become(const DriveTrainFit& other, double limit) {
  *this = other;
  limit_ = limit;
}

void DriveTrainFit::setGain(double gain) {
  const double change = gain - std::exchange(gain_, gain);
  for (Wheel& wheel : wheels_) {
    for (Speeds* speeds : {&wheel.speed, &wheel.correction, &wheel.filtered}) (*speeds)(0) += change * (*speeds)(1);
    for (Speeds& speeds : wheel.history) speeds(0) += change * speeds(1);
  }
  for (Sums* sums : {&present, &memory}) {
    for (DriveTrainSums& each : *sums) each = each.around(change);
  }
}

DriveTrainFit::Speeds DriveTrainFit::input(double given) const {
  // r = γ g v − o sign(v) at θ_0, and its derivatives
  const double turning = std::abs(given) > thresholds::kRest ? std::copysign(1.0, given) : 0.0;
  return {gain_ * model_gain_ * given, model_gain_ * given, -turning};
}

void DriveTrainFit::step(const WheelVector& given) {
  static const double decay = std::exp(-kStep / kWashout), half = std::sqrt(decay);
  newest_ = (newest_ + 1) % kHistory;
  for (std::size_t side = 0; side < wheels_.size(); ++side) {
    Wheel& wheel = wheels_[side];
    const Speeds r = input(given(static_cast<Eigen::Index>(side)));
    const Speeds drive = r + wheel.correction - wheel.speed;
    const Speeds before = wheel.speed;
    // Exact for a constant r, e = r + z − w: at the limit L for a time t, until |e| = L T, then free; with
    // q = e^(−(h−t)/T)
    //     w ← w ± L t + (1 − q) e_t,    ∂w/∂e = 1 − q
    const double e = drive(0), end = limit_ * lag_;
    const double limited = std::clamp(std::abs(e) / limit_ - lag_, 0.0, kStep), free = kStep - limited;
    const double q = limited > 0.0 ? std::exp(-free / lag_) : rest_, e_t = std::clamp(e, -end, end);
    wheel.speed += (1.0 - q) * drive;
    wheel.speed(0) = before(0) + std::copysign(limit_ * limited, e) + (1.0 - q) * e_t;
    // z ← z + k ∫(r − w) dt while it is free, by the trapezoidal rule
    wheel.correction += integral_ * free * (r - 0.5 * (before + wheel.speed));
    wheel.filtered = decay * wheel.filtered + half * (wheel.speed - before);
    wheel.history[newest_] = wheel.filtered;
  }
}

void DriveTrainFit::observe(const WheelVector& filtered, const WheelVector& weight, double part) {
  for (std::size_t side = 0; side < wheels_.size(); ++side) {
    const auto& history = wheels_[side].history;
    const double y = filtered(static_cast<Eigen::Index>(side)), w = weight(static_cast<Eigen::Index>(side));
    // The run is at the time of a step, the measurement between two of them.
    for (std::size_t i = 0; i < kGrid; ++i) {
      const std::size_t at = (newest_ + kHistory - 2 * i) % kHistory;
      const std::size_t after = i > 0 ? (at + 1) % kHistory : at;
      const Speeds then = history[at] + part * (history[after] - history[at]);
      const double error = y - then(0);
      const Eigen::Vector2d sensitivity = then.tail<2>().transpose();
      DriveTrainSums& sums = present[i];
      sums.curvature.noalias() += w * sensitivity * sensitivity.transpose();
      sums.slope += w * error * sensitivity;
      sums.squares += w * error * error;
    }
  }
}

}  // namespace jackal_aic
