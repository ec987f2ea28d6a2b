#include "jackal_aic/predictive/drive_train_learning.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kChange = 0.3;   // rad/s; of a command beyond which a wheel does not rest
constexpr double kLongest = 2.0;  // s; of a change, after which it is learned from as far as it has come
constexpr double kWashout = 0.3;  // s; T_w
constexpr double kTransient =
    1.0;  // s; after a motion of which nothing is known, until the washout filter has forgotten it
constexpr double kMemory = 0.7;          // weight of a change of the commands beside the next
constexpr double kExcess = 8.0;          // of variances, because what is left of eps is no white noise
constexpr double kUnexplained = 0.01;    // of the squares of a motion; a model that leaves more did not make it
constexpr double kNoise = 4.0;           // variances of the encoders, which nothing explains
constexpr double kLeastRamp = 0.5;       // of the acceleration limit, from which on an acceleration tells of it
constexpr double kFarthest = 1.5;        // standard deviations of theta, of a Gauss-Newton step
constexpr double kBeyondDoubt = 3.0;     // standard deviations
constexpr double kLeastChange = 0.009;   // s, of dead time or lag; a smaller one makes no difference
constexpr double kLargestDoubt = 0.008;  // s; standard deviation of a dead time that is taken over
constexpr double kShortestLag = 0.002;   // s; below it the speed does not depend on the lag
constexpr double kSlowest = 0.01;        // rad/s; of a command whose wheel turns
// Range of theta.
constexpr double kLeastShare = 0.3;
constexpr double kGainRange = 1.5;
constexpr double kLargestOffset = 1.0;  // rad/s
// Standard deviations of delta and theta.
constexpr double kDeadTimeDeviation = 0.08;  // s
constexpr double kLagDeviation = 0.0015;     // s
constexpr double kLagPart = 0.15;            // of the lag, beside
constexpr double kShareDeviation = 0.1;
constexpr double kGainDeviation = 0.1;
constexpr double kOffsetDeviation = 0.3;  // rad/s

enum Parameter { kLag, kShare, kGain, kOffset };

double squared(double x) { return x * x; }

}  // namespace

DriveTrainLearning::DriveTrainLearning(const PlantModel& model, double wheel_radius, double wheel_variance)
    : model_(model), radius_(wheel_radius), wheel_variance_(wheel_variance), timing_{model.dead_time, model.lag} {
  setTiming(timing_);
}

void DriveTrainLearning::setTiming(const DriveTrainTiming& timing) {
  timing_ = timing;
  lag_ = told_lag_ = std::max(timing.lag, kShortestLag);
  limit_share_ = gain_share_ = 1.0;
  offset_ = 0.0;
  memory_.fill({});
  linearise();
  forgetMotion();
}

void DriveTrainLearning::forgetMotion() {
  state_ = State::unknown;
  forgetChange();
}

void DriveTrainLearning::forgetChange() {
  sums_.fill({});
  samples_ = motion_ = 0.0;
}

void DriveTrainLearning::linearise() {
  rest_ = std::exp(-kStep / lag_);
  limit_ = limit_share_ * model_.acceleration_limit / radius_;
}

// ---- predict

void DriveTrainLearning::predict(const WheelVector& given, const WheelVector& speed) {
  const bool changes = (given - resting_).cwiseAbs().maxCoeff() > kChange;
  if (state_ == State::settled && !changes) return;
  if (state_ != State::changing) start(speed);
  if (changes) resting_ = given;
  settled_time_ = changes ? 0.0 : settled_time_ + DriveTrain::kStep;
  changing_time_ += DriveTrain::kStep;
  given_ += given;
  if (++ticks_ < kTicks) return;
  newest_ = (newest_ + 1) % kHistory;
  step(left_, given_(0) / kTicks);
  step(right_, given_(1) / kTicks);
  ticks_ = 0;
  given_.setZero();
}

void DriveTrainLearning::start(const WheelVector& speed) {
  changing_time_ = state_ == State::settled ? 0.0 : -kTransient;
  settled_time_ = 0.0;
  ticks_ = 0;
  given_.setZero();
  state_ = State::changing;
  start(left_, resting_(0), speed(0));
  start(right_, resting_(1), speed(1));
}

void DriveTrainLearning::start(Prediction& wheel, double given, double speed) const {
  wheel.speed.setZero();
  wheel.correction.setZero();
  wheel.filtered.setZero();
  wheel.history.fill(Speeds::Zero());
  wheel.speed(0) = wheel.measured = speed;
  wheel.measured_lately.start(speed);
  wheel.predicted_lately.start(speed);
  wheel.limited = false;
  wheel.measured_filtered = 0.0;
  wheel.steady = speed - gain_share_ * model_.gain * given;
}

void DriveTrainLearning::step(Prediction& wheel, double given) const {
  const double turning = std::abs(given) > kSlowest ? std::copysign(1.0, given) : 0.0;
  Speeds input;
  input << gain_share_ * model_.gain * given - offset_ * turning + wheel.steady, 0.0, 0.0, model_.gain * given,
      -turning;
  const Speeds drive = input + wheel.correction - wheel.speed;
  const Speeds before = wheel.speed;
  // Exact for a constant r = γ g v − o sign(v) + d, e = r + z − w: at the limit for a time t, until |e| = L T, then
  // free; with q = e^(−(h−t)/T)
  //     w ← w ± L t + (1 − q) e_t,    ∂w/∂e = 1 − q,    ∂w/∂T = −e_t q (h−t)/T²,    ∂w/∂L = ± q t
  const double e = drive(0), end = limit_ * lag_;
  const double limited = std::clamp(std::abs(e) / limit_ - lag_, 0.0, kStep), free = kStep - limited;
  const double q = limited > 0.0 ? std::exp(-free / lag_) : rest_, e_t = std::clamp(e, -end, end);
  wheel.speed += (1.0 - q) * drive;
  wheel.speed(0) = before(0) + std::copysign(limit_ * limited, e) + (1.0 - q) * e_t;
  wheel.speed(1 + kLag) -= e_t * q * free / squared(lag_);
  wheel.speed(1 + kShare) += std::copysign(q * limited * limit_ / limit_share_, e);
  wheel.limited = wheel.limited || limited > 0.0;
  // z ← z + k ∫(r − w) dt while it is free, by the trapezoidal rule
  wheel.correction += model_.velocity_loop_integral * free * (input - 0.5 * (before + wheel.speed));
  static const double decay = std::exp(-kStep / kWashout), half = std::sqrt(decay);
  wheel.filtered = decay * wheel.filtered + half * (wheel.speed - before);
  wheel.history[newest_] = wheel.filtered;
}

// ---- correct

std::optional<DriveTrainTiming> DriveTrainLearning::correct(const WheelVector& measured, double step) {
  if (state_ != State::changing || step <= 0.0) return std::nullopt;
  observe(left_, measured(0), step);
  observe(right_, measured(1), step);
  if (changing_time_ < 0.0) return std::nullopt;
  samples_ += 2.0;
  if (!settles() && changing_time_ < kLongest) return std::nullopt;
  if (settles()) state_ = State::settled;
  changing_time_ = 0.0;
  return learn();
}

void DriveTrainLearning::observe(Prediction& wheel, double measured, double step) {
  const double decay = std::exp(-step / kWashout);
  wheel.measured_filtered = decay * wheel.measured_filtered + std::sqrt(decay) * (measured - wheel.measured);
  wheel.measured = measured;
  if (changing_time_ < 0.0) return;
  wheel.measured_lately.add(measured, step);
  wheel.predicted_lately.add(wheel.speed(0), step);
  // The prediction is at the time of a step, the measurement between two of them.
  const double part = static_cast<double>(ticks_) / kTicks;
  for (std::size_t i = 0; i < kGrid; ++i) {
    const std::size_t at = (newest_ + kHistory - i) % kHistory, after = i > 0 ? (at + 1) % kHistory : at;
    const Speeds then = wheel.history[at] + part * (wheel.history[after] - wheel.history[at]);
    const double error = wheel.measured_filtered - then(0);
    const Vector sensitivity = then.tail<kParameters>().transpose();
    sums_[i].curvature.noalias() += sensitivity.lazyProduct(sensitivity.transpose());
    sums_[i].slope += error * sensitivity;
    sums_[i].squares += squared(error);
  }
  motion_ += squared(wheel.measured_filtered);
}

// ---- learn

DriveTrainLearning::Vector DriveTrainLearning::deviations() const {
  return {kLagDeviation + kLagPart * lag_, kShareDeviation, kGainDeviation, kOffsetDeviation};
}

DriveTrainLearning::Minimum DriveTrainLearning::minimum(const Sums& sums) const {
  // θ − θ_0 = (Σψψ'/Σ + Π_0)⁻¹ (Σψε/Σ − Π_0 (θ_0 − θ_1)), θ_1 with the lag that was told
  const Vector precision = deviations().cwiseAbs2().cwiseInverse();
  Matrix curvature = sums.curvature;
  curvature.diagonal() += precision;
  Vector slope = sums.slope;
  const double learned = lag_ - told_lag_;
  slope(kLag) -= precision(kLag) * learned;
  const Vector change = curvature.ldlt().solve(slope);
  return {change, 0.5 * (sums.squares + precision(kLag) * squared(learned) - change.dot(slope))};
}

double DriveTrainLearning::freeEnergy(int i) const {
  const double late = i * kStep - timing_.dead_time;
  return minimum(memory_[static_cast<std::size_t>(i)]).free_energy + 0.5 * squared(late / kDeadTimeDeviation);
}

int DriveTrainLearning::best() const {
  int best = 0;
  double least = freeEnergy(0);
  for (int i = 1; i < kGrid; ++i) {
    const double candidate = freeEnergy(i);
    if (candidate < least) least = candidate, best = i;
  }
  return best;
}

double DriveTrainLearning::leastSquares(double variance) const {
  double least = HUGE_VAL;
  for (const Sums& sums : sums_) {
    const Vector change = minimum(sums.over(variance)).change;
    least = std::min(least, sums.squares - 2.0 * change.dot(sums.slope) + change.dot(sums.curvature * change));
  }
  return least;
}

bool DriveTrainLearning::learnLimit() {
  const double limit = model_.acceleration_limit / radius_;
  double measured = 0.0, predicted = 0.0;
  bool limited = false;
  for (Prediction* wheel : {&left_, &right_}) {
    measured = std::max(measured, wheel->measured_lately.fastest);
    predicted = std::max(predicted, wheel->predicted_lately.fastest);
    limited = limited || wheel->limited;
    wheel->measured_lately.fastest = wheel->predicted_lately.fastest = 0.0;
    wheel->limited = false;
  }
  if (predicted < kLeastRamp * limit_share_ * limit) return true;
  const bool slower = measured < (1.0 - kShareDeviation) * predicted;
  const bool faster = limited && measured > (1.0 + kShareDeviation) * predicted;
  const double share = std::clamp(measured / limit, kLeastShare, 1.0);
  if ((!slower && !faster) || share == limit_share_) return true;
  limit_share_ = share;
  return false;
}

std::optional<DriveTrainTiming> DriveTrainLearning::learn() {
  std::optional<DriveTrainTiming> taken;
  if (learnLimit()) {
    taken = learnTiming();
  } else {
    linearise();
  }
  forgetChange();
  return taken;
}

std::optional<DriveTrainTiming> DriveTrainLearning::learnTiming() {
  const double left = leastSquares(wheel_variance_);
  const double variance = std::max(wheel_variance_, left / samples_);
  const bool explained = left < std::max(kNoise * wheel_variance_ * samples_, kUnexplained * motion_);
  const auto remembered = memory_;
  for (std::size_t i = 0; i < kGrid; ++i) memory_[i].add(sums_[i].over(kExcess * variance));
  const int i = std::clamp(best(), 1, kGrid - 2);
  // A parabola through the least F and its neighbours.
  const double before = freeEnergy(i - 1), at = freeEnergy(i), after = freeEnergy(i + 1);
  const double bend = before - 2.0 * at + after;
  const double dead_time = kStep * (i + std::clamp(0.5 * (before - after) / bend, -1.0, 1.0));
  const Sums& sums = memory_[static_cast<std::size_t>(i)];
  const double lag_variance = sums.curvature.inverse()(kLag, kLag);
  // Farther away than what was believed is no Gauss-Newton step, and no dead time that goes with it.
  Vector change = minimum(sums).change;
  const double distance = change.cwiseAbs().cwiseQuotient(deviations()).maxCoeff();
  if (!explained || distance > kFarthest) memory_ = remembered;
  if (distance > kFarthest) change *= kFarthest / distance;
  relinearise(change);
  const bool taken =
      explained && distance <= kFarthest && bend > 0.0 &&
      takeOver({std::clamp(dead_time, 0.0, kLongestTiming.dead_time), lag_}, squared(kStep) / bend, lag_variance);
  for (Sums& kept : memory_) kept = kept.over(1.0 / kMemory);
  return taken ? std::optional(timing_) : std::nullopt;
}

bool DriveTrainLearning::takeOver(const DriveTrainTiming& timing, double dead_time_variance, double lag_variance) {
  if (dead_time_variance > squared(kLargestDoubt)) return false;
  // How late the wheels are shows well; how much of it is a lag only where motions begin and end.
  const double later = timing.lag - timing_.lag, together = timing.dead_time - timing_.dead_time + later;
  const auto beyondDoubt = [](double by, double deviation) {
    return std::abs(by) > std::max(kLeastChange, kBeyondDoubt * deviation);
  };
  if (!beyondDoubt(together, std::sqrt(dead_time_variance)) &&
      !beyondDoubt(later, std::max(std::sqrt(lag_variance), deviations()(kLag)))) {
    return false;
  }
  timing_ = timing;
  return true;
}

void DriveTrainLearning::relinearise(const Vector& change) {
  const Vector before(lag_, limit_share_, gain_share_, offset_);
  lag_ = std::clamp(lag_ + change(kLag), kShortestLag, kLongestTiming.lag);
  limit_share_ = std::clamp(limit_share_ + change(kShare), kLeastShare, 1.0);
  gain_share_ = std::clamp(gain_share_ + change(kGain), 1.0 / kGainRange, kGainRange);
  offset_ = std::clamp(offset_ + change(kOffset), 0.0, kLargestOffset);
  const Vector taken = Vector(lag_, limit_share_, gain_share_, offset_) - before;
  // Around the new θ_0: ε ← ε − ψ'Δθ
  for (Sums& sums : memory_) {
    sums.squares += taken.dot(sums.curvature * taken) - 2.0 * taken.dot(sums.slope);
    sums.slope -= sums.curvature * taken;
  }
  linearise();
}

}  // namespace jackal_aic
