#include "jackal_aic/model/traction_belief.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/gravity.hpp"
#include "jackal_aic/model/square.hpp"

namespace jackal_aic {
namespace {

using thresholds::kPatience, thresholds::kSure;

constexpr double kWindow = 1.0;           // in which wheels that lose the body show it [s]
constexpr double kJolt = 0.1;             // time in which a collision stops the body [s]
constexpr double kStopped = 0.3;          // speed left to a body that was stopped, or rebounds / former speed
constexpr double kLongestSlide = 3.0;     // a longer one is an error of the accelerometer [s]
constexpr double kHeldTurn = 0.3;         // largest yaw rate of a body that is held [rad/s]
constexpr double kMargin = 12.0;          // on the variance of noise, learned from a few correlated values
constexpr double kLeastDeviation = 0.05;  // sigma_0, of the change of the speed of tyres that grip [m/s]
constexpr double kDelay = 0.02;           // tau, of the wheels' measurement behind the body's [s]
constexpr double kScale = 0.04;           // kappa, of the accelerometer's scale and of pitching
constexpr double kCentre = 0.1;           // sigma_l, of the turning centre [m]
constexpr double kOffset = 0.4;           // of b before it is learned [m/s^2]
constexpr double kShare = 0.5;            // of f before it is learned
constexpr double kFastestFilter = 3.0;    // of w_1, a Madgwick filter of gain 0.15 [m/s^3]
constexpr double kFilterTime = 4.0;       // of w_2, a Mahony filter of gain 0.25 [s]

}  // namespace

Eigen::Matrix3d TractionBelief::Errors::covariance() const {
  Eigen::Matrix3d all = information;
  all.diagonal() += Eigen::Vector3d(1.0 / square(kOffset), 1.0 / square(kShare), 1.0 / square(kShare));
  return all.inverse();
}

bool TractionBelief::Errors::isRefuted() const {
  const double known = information.bottomRightCorner<2, 2>().trace();
  return known > 1.0 / square(kShare) && misfit > square(kSure) * known;
}

bool TractionBelief::Errors::isFilterPresent() const {
  if (isRefuted()) return false;
  const Eigen::Vector2d f = value.tail<2>();
  const Eigen::Matrix2d P = covariance().bottomRightCorner<2, 2>();
  return f.dot(P.inverse() * f) > square(kSure);
}

/// Delta v.
double TractionBelief::change(const Integrals& window) const {
  return window.body - window.errors.offset() * window.time + window.errors.believedTilt(window.tilt);
}

TractionBelief::Integrals TractionBelief::Integrals::operator-(const Integrals& then) const {
  return {time - then.time,     wheels - then.wheels, body - then.body, rested - then.rested, driven - then.driven,
          turned - then.turned, tilt - then.tilt,     then.errors,      then.motion,          then.doubt};
}

/// Change over the longest window within a time [s] that began in a motion.
TractionBelief::Integrals TractionBelief::since(double time, std::optional<Traction> motion) const {
  Integrals then = now_;
  for (std::size_t i = 0; i < remembered_; ++i) {
    const Integrals& past = past_[(newest_ + kRemembered - i) % kRemembered];
    if (now_.time - past.time > time + thresholds::kRounding) break;
    if (!motion || past.motion == *motion) then = past;
  }
  return now_ - then;
}

void TractionBelief::remember() {
  if (remembered_ > 0 && now_.time - past_[newest_].time < kSpacing) return;
  Integrals now = now_;
  now.motion = traction_;
  if (traction_ == Traction::rolls) {
    const Integrals window = since(kWindow, Traction::rolls);
    now.doubt = std::max(0.0, square(error(window)) - variance(window));
    if (!explains(window)) now.motion = Traction::slides;
  }
  newest_ = (newest_ + 1) % kRemembered;
  past_[newest_] = now;
  remembered_ = std::min(remembered_ + 1, kRemembered);
}

/// Learns R from the differences of successive blocks, which cancel a constant acceleration, that of the body if it
/// stands, of wheels and body if it rolls. Blocks are longer than most vibration is correlated.
void TractionBelief::learnNoise(double least) {
  const Integrals block = now_ - block_;
  if (block.time < kJolt) return;
  block_ = now_;
  const double gap = (block.wheels - block.body) / block.time, body = block.body / block.time;
  const double jump =
      std::min(std::abs(gap - std::exchange(last_gap_, gap)), std::abs(body - std::exchange(last_body_, body)));
  const double rate = 0.5 * square(jump) * block.time, last = std::exchange(last_rate_, rate);
  if (now_.time < 3.0 * kJolt) return;  // no two blocks before it
  const double speed_squared = block.driven / block.time;
  const bool moved = speed_squared > square(thresholds::kSlow);
  double& noise = moved ? noise_in_motion_ : noise_at_rest_;
  average(noise, std::min(std::min(rate, last) / (moved ? speed_squared : 1.0), square(kSure) * noise), block.time,
          thresholds::kNoiseMemory);
  if (!moved) noise = std::max(noise, least);
}

/// c R.
double TractionBelief::noise(const Integrals& window) const {
  return kMargin * (noise_at_rest_ * window.rested + noise_in_motion_ * window.driven);
}

/// S of an exact accelerometer.
double TractionBelief::noiseVariance(const Integrals& window) const { return noise(window) + square(kLeastDeviation); }

/// True if noise explains a change.
bool TractionBelief::keeps(double change, const Integrals& window) const {
  return std::abs(change) < std::sqrt(noiseVariance(window));
}

/// S without that of b and f.
double TractionBelief::modelVariance(const Integrals& window) const {
  const double late = kDelay * fastest_ + std::max(0.0, hold_ - kDelay) * thresholds::kGrip / kSure;
  const double turn = window.turned / std::max(window.time, kJolt) + square(window.turned);
  return noiseVariance(window) + square(late) + square(kScale * window.wheels) + square(kCentre) * turn;
}

/// S. Half of a filter's share is uncertain, as it may be of another kind; all of one that is not significant.
double TractionBelief::variance(const Integrals& window) const {
  const Errors& errors = window.errors;
  Eigen::Vector3d part = window.errorsPart();
  if (errors.isRefuted()) part.tail<2>().setZero();
  const double kind = errors.isRefuted() ? 0.0 : (errors.isFilterPresent() ? 0.5 : 1.0) * errors.tilt(window.tilt);
  return modelVariance(window) + part.dot(errors.covariance() * part) + square(kind) + window.doubt;
}

/// Learns b and f from a window; successive ones overlap, so that each counts by its share of a window.
void TractionBelief::learn(const Integrals& window, double step) {
  Errors& errors = now_.errors;
  const Eigen::Vector3d part = window.errorsPart();
  const Eigen::Vector3d weight = step / (std::max(window.time, kJolt) * modelVariance(window)) * part;
  const double kept = keptAfter(step, thresholds::kSensorMemory);
  const double error = window.body - window.wheels - part.dot(errors.value);
  errors.information = (kept * errors.information + weight * part.transpose()).eval();
  errors.misfit = kept * errors.misfit + weight.tail<2>().dot(part.tail<2>()) * square(error) / modelVariance(window);
  errors.value += errors.covariance() * weight * error;
  errors.value.tail<2>() = errors.value.tail<2>().cwiseMax(0.0).cwiseMin(1.0);
}

/// True if rolling explains a window.
bool TractionBelief::explains(const Integrals& window) const {
  return square(error(window)) <= square(kSure) * variance(window);
}

/// True if an accelerometer mounted the wrong way round explains a window better than what misses e by so much [m/s].
bool TractionBelief::isReversed(const Integrals& window, double miss) const {
  return proof_ < (square(miss) - square(error(window) - 2.0 * window.wheels)) / (2.0 * variance(window));
}

/// True if wheels that lost the body explain a window, and rolling does not.
bool TractionBelief::spins(const Integrals& window) const {
  const double e = error(window), beyond = std::abs(e) - std::copysign(1.0, e) * window.wheels;
  return !explains(window) && beyond < std::sqrt(noiseVariance(window)) && !isReversed(window, std::max(0.0, beyond));
}

/// True if a collision explains a window, and rolling does not. It may have stopped the wheels too.
bool TractionBelief::struck(const Integrals& window) const {
  const double e = error(window);
  const double before = std::max(std::abs(now_.wheels), std::abs(now_.wheels - window.wheels));
  const double left = std::abs(now_.wheels - e);
  return left < kStopped * before && !isReversed(window, left) && jolt_ > (1.0 - kStopped) * std::abs(e) &&
         std::abs(e) > kSure * std::sqrt(variance(window));
}

/// A body that is held does not turn.
bool TractionBelief::turns() const {
  const Integrals lately = since(kPatience);
  return lately.turned > square(kHeldTurn) * lately.time;
}

void TractionBelief::predict(double step) {
  if (traction_ == Traction::slides) speed_ += step * std::clamp(latest_, -kGravity, kGravity);
}

void TractionBelief::correct(double wheels, double acceleration, double variance, double yaw_rate, double since_last) {
  // An exactly repeated acceleration carries no information. The next value is the mean since then.
  if (acceleration == std::exchange(measured_, acceleration)) return miss(since_last);
  const double step = since_last + std::exchange(missed_, 0.0);
  if (since_last == 0.0 || step > thresholds::kGap) {
    now_.wheels = wheels;
    remembered_ = 0;
    become(Traction::rolls, wheels);
    return remember();
  }
  const double a = acceleration - turning_centre_ * square(yaw_rate), by_wheels = (wheels - now_.wheels) / step;
  tilt_(0) += std::clamp(by_wheels - tilt_(0), -kFastestFilter * step, kFastestFilter * step);
  average(tilt_(1), by_wheels, step, kFilterTime);
  fastest_ =
      std::max(fastest_ * keptAfter(step, thresholds::kMotionMemory), std::min(std::abs(by_wheels), thresholds::kGrip));
  latest_ = a - now_.errors.offset() + now_.errors.believedTilt(tilt_);
  const bool moves = std::abs(wheels) > thresholds::kSlow;
  now_ = {now_.time + step,
          wheels,
          now_.body + step * a,
          now_.rested + (moves ? 0.0 : step),
          now_.driven + (moves ? step * square(wheels) : 0.0),
          now_.turned + step * square(yaw_rate),
          now_.tilt + step * tilt_,
          now_.errors};
  if (traction_ != Traction::slides) learnNoise(step * variance);
  jolt_ = std::max(jolt_ * keptAfter(step, kPatience), std::abs(change(since(std::max(kJolt, 2.0 * step)))));
  speed_ = corrected_speed_ + step * latest_;
  if (traction_ == Traction::rolls)
    roll(step);
  else if (traction_ == Traction::slides)
    slide();
  else
    stand(step);
  corrected_speed_ = speed_;
  remember();
}

void TractionBelief::miss(double step) {
  missed_ += step;
  if (missed_ > thresholds::kGap) restart();
}

void TractionBelief::roll(double step) {
  speed_ = now_.wheels;
  const Integrals window = since(kWindow, Traction::rolls);
  for (const double time : {kJolt, kPatience, kWindow}) {
    const Integrals lately = since(time, Traction::rolls);
    if (struck(lately)) return leave(now_.wheels - error(lately), lately);
    // When the wheels lost the body is unknown: maybe before that.
    if (spins(lately)) return leave(now_.wheels - error(window), window);
  }
  if (unexplained_ && window.time == 0.0) return learnJump(since(kPatience));
  unexplained_ = !explains(window);
  if (!unexplained_ && window.time > kPatience - thresholds::kRounding) impossible_ = false;
  proof_ +=
      step / std::max(window.time, kJolt) * 2.0 * window.wheels * (window.wheels - error(window)) / variance(window);
  learn(window, step);
}

/// A body that its wheels and obstacles move has a speed between rest and those of its wheels, or rebounds.
bool TractionBelief::possible(double speed, const Integrals& window) const {
  auto [slowest, quickest] = std::minmax({0.0, now_.wheels, now_.wheels - window.wheels});
  for (std::size_t i = 0; i < remembered_; ++i) {
    const double wheels = past_[(newest_ + kRemembered - i) % kRemembered].wheels;
    slowest = std::min(slowest, wheels);
    quickest = std::max(quickest, wheels);
  }
  const double margin = std::hypot(kSure * std::sqrt(noiseVariance(window)), kStopped * (quickest - slowest));
  return slowest - margin < speed && speed < quickest + margin;
}

/// Explains a window by a jump of b.
void TractionBelief::learnJump(const Integrals& window) {
  now_.errors.value(0) = window.errors.offset() - error(window) / window.time;
  now_.errors.information.row(0).setZero();
  now_.errors.information.col(0).setZero();
  become(Traction::rolls, now_.wheels);
}

void TractionBelief::leave(double speed, const Integrals& window) {
  traction_ = Traction::slides;
  speed_ = speed;
  variance_ = variance(window);
  // What the motion taught is taken back.
  now_.errors = window.errors;
  left_ = now_ - window;
  noticed_ = now_;
}

void TractionBelief::slide() {
  const Integrals all = now_ - left_, lately = since(kPatience);
  variance_ = variance(all);
  const Integrals since_noticed = now_ - noticed_;
  if (!possible(speed_, all)) {
    if (std::exchange(impossible_, true)) return learnJump(lately);
    return become(Traction::rolls, now_.wheels);
  }
  if (since_noticed.time < kPatience) return;
  // Friction moves the body to the speed of its wheels and no further.
  const double gap = speed_ - now_.wheels, first = speed_ - change(since_noticed) - noticed_.wheels;
  if (gap * first <= 0.0) return become(Traction::rolls, now_.wheels);
  const bool steady = keeps(change(lately), lately), met = std::abs(gap) < std::sqrt(variance_);
  const bool held = square(gap) - square(speed_) > variance_ && std::abs(now_.wheels) > thresholds::kSlow && !turns();
  // The integral may miss a standing body by a standard deviation, or by what the accelerometer has proved.
  const bool near = square(speed_) < std::max(1.0, 2.0 * proof_) * variance_;
  if (held && near && steady && !isReversed(all, std::abs(speed_))) return become(Traction::stands, 0.0);
  const bool follows = keeps(error(lately), lately) && (steady || met);
  if (follows || since_noticed.time > kLongestSlide) become(Traction::rolls, now_.wheels);
}

void TractionBelief::stand(double step) {
  speed_ = 0.0;
  if (turns() || std::abs(now_.wheels) < thresholds::kSlow) return become(Traction::rolls, now_.wheels);
  Integrals window;
  for (const double time : {kJolt, kPatience, kWindow}) {
    window = since(time, Traction::stands);
    window.wheels = 0.0;  // of the body
    window.tilt.setZero();
    const double moved = change(window);
    if (std::abs(moved) > kSure * std::sqrt(variance(window))) return leave(moved, window);
  }
  learn(window, step);
  // Vibration would hide that the body moves.
  if (noise(window) > square(kStopped * now_.wheels)) become(Traction::rolls, now_.wheels);
}

void TractionBelief::become(Traction traction, double speed) {
  traction_ = traction;
  speed_ = corrected_speed_ = speed;
  variance_ = 0.0;
  unexplained_ = false;
  block_ = now_;
}

void TractionBelief::restart() {
  missed_ = thresholds::kGap;
  become(Traction::rolls, now_.wheels);
}

}  // namespace jackal_aic
