#include "jackal_aic/model/traction_belief.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/gravity.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

constexpr double kWindow = 1.0;                  // W [s]; also the longest undecided slide
constexpr double kJoltTime = 0.1;                // time in which a collision stops the body [s]
constexpr double kDominant = 0.8;                // fraction of a change of speed that one cause has to explain
constexpr double kCollision = 0.3;               // W_c [s]
constexpr double kSensorMemory = 5.0;            // T_b, and of lambda [s]
constexpr double kUnknownOffset = 0.5;           // bound of b before it is learned [m/s^2]
constexpr double kSlopeAcceleration = 0.2;       // a larger mean of a is gravity on a slope of 1.2 degrees [m/s^2]
constexpr double kMeanTime = 0.015;              // of a mean from which vibration is learned [s]
constexpr double kLargestVarianceRatio = 25.0;   // largest lambda and growth of vibration; a larger one is a motion
constexpr double kNoiseBound = 6.0;              // standard deviations of D that noise may cause
constexpr double kLeastError = 0.15;             // largest D on tyres that grip [m/s]
constexpr double kStoppedFraction = 0.3;         // believed / former speed of a body that was stopped, at most
constexpr double kReboundFraction = 1.3;         // largest change in a collision / former speed
constexpr double kUnmeasuredAcceleration = 5.0;  // bound of an acceleration that was not measured [m/s^2]
constexpr double kWheelDelay = 0.05;             // delay of the wheels' measurement behind the body's [s]
constexpr double kScaleError = 0.1;              // error / Delta v_w, of the accelerometer's scale and of pitching
constexpr double kCentreDistance = 0.2;          // bound of the unknown shift of the turning centre [m]
constexpr double kStraightAcceleration = 0.02;   // negligible centripetal acceleration [m/s^2]
constexpr double kMetSpeed = 0.02;               // |x_dot - v_w| of a body that follows its wheels again [m/s]
constexpr double kSteadyTime = 0.2;              // time for which body and wheels keep their speed [s]
constexpr double kSteadyChange = 0.03;           // change of a kept speed, without noise [m/s]
constexpr double kTurningWheels = 0.08;          // least speed of wheels that turn [m/s]
constexpr double kHeldTurn = 0.3;                // largest yaw rate of a body that is held [rad/s]
constexpr double kRecentTime = 0.4;              // a reversing turn passes zero, or a released body follows, in it [s]
constexpr double kDecisionTime = 0.5;            // after it the nearer hypothesis is taken [s]
constexpr double kExpectedFraction = 0.5;        // bound of an expected change / of any change
constexpr double kLongestSlide = 3.0;            // a longer slide is an error of the accelerometer [s]
constexpr double kSmallerOfTwo = 0.44;       // mean of the smaller of two successive squared differences / their mean
constexpr double kVibrationMargin = 2.0;     // on the variance of vibration, uncertain after half a second
constexpr double kLargestCorrelation = 0.6;  // of rho
// Attitude filters.
constexpr double kSignThreshold = 0.025;    // a smaller acceleration has no sign [m/s^2]
constexpr double kFilterMemory = 30.0;      // [s]
constexpr double kLeastImprovement = 0.05;  // decrease of the misfit from which a filter is assumed

}  // namespace

/// The kind of attitude filter that explains the accelerations better than no filter, if any.
std::optional<std::size_t> TractionBelief::filter() const {
  const std::size_t better = filters_[0].misfit < filters_[1].misfit ? 0 : 1;
  return filters_[better].misfit + kLeastImprovement < misfit_ ? std::optional(better) : std::nullopt;
}

/// w, or its integral, from the value per g of each kind.
double TractionBelief::hidden(const std::array<double, 2>& by_gain) const {
  const auto kind = filter();
  return kind ? filters_[*kind].gain() * by_gain[*kind] : 0.0;
}

TractionBelief::Change TractionBelief::sinceThen(const Past& then) const {
  const std::array<double, 2> by_gain = {now_.hidden[0] - then.hidden[0], now_.hidden[1] - then.hidden[1]};
  const double wheels = now_.wheels - then.wheels, body = now_.body - then.body;
  return {now_.time - then.time,       wheels,  body + hidden(by_gain), now_.variance - then.variance,
          now_.turning - then.turning, by_gain, wheels - body};
}

/// The oldest state within a time; without one, the present.
const TractionBelief::Past& TractionBelief::within(double time) const {
  // States are at least kSpacing apart, which bounds their number.
  std::size_t i = std::min(remembered_, static_cast<std::size_t>(time / kSpacing) + 2);
  const auto before = [&](std::size_t number) -> const Past& {
    return past_[(newest_ + kRemembered - number) % kRemembered];
  };
  while (i > 0 && now_.time - before(i - 1).time > time + thresholds::kRounding) --i;
  return i > 0 ? before(i - 1) : now_;
}

TractionBelief::Change TractionBelief::since(double time) const { return sinceThen(within(time)); }

TractionBelief::Change TractionBelief::sinceOldest() const { return sinceThen(past_[oldest()]); }

std::size_t TractionBelief::oldest() const { return (newest_ + kRemembered + 1 - remembered_) % kRemembered; }

/// Forgets values older than the window.
void TractionBelief::remember() {
  while (remembered_ > 1 && now_.time - past_[oldest()].time > kWindow + thresholds::kRounding) --remembered_;
  if (remembered_ > 0 && now_.time - past_[newest_].time < kSpacing) return;
  newest_ = (newest_ + 1) % kRemembered;
  past_[newest_] = now_;
  remembered_ = std::min(remembered_ + 1, kRemembered);
}

/// Uses means over a time: successive samples of a fast accelerometer hardly differ under a shake of tens of
/// milliseconds.
void TractionBelief::learnNoise(double acceleration, double variance, double step) {
  latest_ = acceleration;
  mean_.change += step * acceleration;
  mean_.time += step;
  if (mean_.time > kMeanTime) learnVibration(std::exchange(mean_, {}), variance);
  variance_rate_ = std::max(step * variance, vibration_rate_);
  now_.variance += step * variance_rate_;
}

void TractionBelief::learnVibration(Mean mean, double variance) {
  const double acceleration = mean.change / mean.time;
  means_[++newest_mean_ % means_.size()] = acceleration;
  const auto before = [&](std::size_t means) { return means_[(newest_mean_ - means) % means_.size()]; };
  const double share = mean.time / (mean.time + thresholds::kNoiseMemory);
  // The smaller of two differences in a row: a body that begins to accelerate makes one.
  const auto learn = [&](double& vibration, std::size_t lag) {
    const double last = acceleration - before(lag), earlier = before(lag) - before(2 * lag);
    const double smaller = 0.5 * std::min(last * last, earlier * earlier) / kSmallerOfTwo;
    vibration += share * (std::min(smaller, kLargestVarianceRatio * std::max(vibration, variance)) - vibration);
  };
  learn(quick_, 1);
  learn(slow_, 3);
  // Noise with the correlation rho of successive values has (1 + rho)/(1 - rho) times the variance of its mean.
  const double rho = std::clamp(1.0 - quick_ / slow_, 0.0, kLargestCorrelation);
  vibration_rate_ = mean.time * kVibrationMargin * slow_ * (1.0 + rho) / (1.0 - rho);
}

/// D of wheels that may have changed since they were measured last [m/s].
double TractionBelief::unseenChange() const { return std::max(0.0, hold_ - kWheelDelay) * thresholds::kGrip; }

/// D by an offset that is not learned yet [m/s].
double TractionBelief::unknownOffset(double time) const { return offset_known_ ? 0.0 : kUnknownOffset * time; }

double TractionBelief::bound(const Change& change) const {
  return kNoiseBound * std::sqrt(factor_ * change.variance) + kWheelDelay * std::min(fastest_, thresholds::kGrip) +
         unseenChange() + unknownOffset(change.time) + kScaleError * std::abs(change.wheels) +
         kCentreDistance * change.turning;
}

bool TractionBelief::surprises(const Change& change) const {
  const double error = std::abs(change.error());
  return error > kLeastError && error > bound(change);
}

std::optional<TractionBelief::Change> TractionBelief::collision() const {
  if (jolt_ <= kDominant * kLeastError) return std::nullopt;
  const Change change = since(kCollision);
  // The collision may have stopped the wheels too, and thrown the body back.
  const double before = std::max(std::abs(now_.wheels), std::abs(now_.wheels - change.wheels));
  const bool stopped = std::abs(now_.wheels - change.error()) < kStoppedFraction * before;
  // Late sensors also cause an error, which ends with their delay. Most of a collision lies within kJoltTime, where the
  // integral of vibration is smaller than over the whole change.
  const double noise = kNoiseBound * std::sqrt(factor_ * change.variance * std::min(1.0, kJoltTime / change.time));
  // On ground that rocks a turning robot, the turning centre jumps from one side to the other.
  const double turn = kCentreDistance * std::sqrt(change.turning / change.time);
  const double least = std::max({kLeastError, noise, turn, unseenChange(), unknownOffset(change.time)}),
               error = std::abs(change.error());
  const bool struck = error > least && jolt_ > std::max(noise, kDominant * error);
  return stopped && struck ? std::optional(change) : std::nullopt;
}

std::optional<TractionBelief::Change> TractionBelief::againstRolling(const Change& window) const {
  if (listened_ < 0.5 * kWindow) return std::nullopt;
  if (const auto change = collision()) return change;
  const double by_wheels = window.error() < 0.0 ? -window.wheels : window.wheels;
  if (by_wheels > kDominant * std::abs(window.error()) && surprises(window) && !hiddenByFilter(window)) return window;
  return std::nullopt;
}

/// True if an attitude filter of a possible gain explains the window.
bool TractionBelief::hiddenByFilter(const Change& window) const {
  const double allowed = std::max(kLeastError, bound(window));
  for (std::size_t kind = 0; kind < filters_.size(); ++kind) {
    const double gain = filters_[kind].gain(), doubt = thresholds::kSure * std::sqrt(filters_[kind].variance());
    const double most = window.unfiltered - std::max(0.0, gain - doubt) * window.hidden[kind];
    const double least = window.unfiltered - (gain + doubt) * window.hidden[kind];
    if (most * least < 0.0 || std::min(std::abs(most), std::abs(least)) < allowed) return true;
  }
  return false;
}

/// Learns from a window in which the wheels roll.
void TractionBelief::learnFilters(const Change& window, double step) {
  const double sigma = 0.5 * std::max(kLeastError, bound(window)), kept = keptAfter(step, kFilterMemory);
  const double D = window.unfiltered / sigma;
  average(misfit_, D * D, step, kFilterMemory);
  for (std::size_t kind = 0; kind < filters_.size(); ++kind) {
    AttitudeFilter& filter = filters_[kind];
    const double slope = window.hidden[kind] / sigma, left = D - filter.gain() * slope;
    average(filter.misfit, left * left, step, kFilterMemory);
    filter.information = kept * filter.information + step / kWindow * slope * slope;
    filter.evidence = std::max(0.0, kept * filter.evidence + step / kWindow * slope * D);
  }
}

void TractionBelief::predict(double step) {
  if (traction_ == Traction::slides) speed_ += step * std::clamp(latest_, -kGravity, kGravity);
}

void TractionBelief::correct(double wheels, double acceleration, double variance, double yaw_rate, double since_last) {
  // An exactly repeated acceleration carries no information. The next value is the mean since then.
  const double variance_before = now_.variance;
  if (acceleration == std::exchange(measured_, acceleration)) {
    miss(wheels, since_last);
    repeated_ += now_.variance - variance_before;
    return;
  }
  now_.variance -= std::exchange(repeated_, 0.0);
  const double step = since_last + std::exchange(missed_, 0.0);
  if (step > kLongestStep) return reset(wheels);
  const double a = acceleration - turning_centre_ * yaw_rate * yaw_rate - (filter() ? 0.0 : offset_);
  const double gap = corrected_speed_ - now_.wheels;
  fastest_ = std::max(fastest_ * thresholds::kMotionMemory / (step + thresholds::kMotionMemory),
                      std::abs(wheels - now_.wheels) / step);
  learnNoise(a, variance, step);
  listened_ += step;
  const double turned = step * yaw_rate * yaw_rate;
  now_ = {now_.time + step, wheels, now_.body + step * a, now_.variance, now_.turning + turned, now_.hidden};
  for (std::size_t kind = 0; kind < filters_.size(); ++kind) {
    now_.hidden[kind] += step * filters_[kind].tilt;
    filters_[kind].tilt += step * (kind == 0 ? a : std::clamp(a / kSignThreshold, -1.0, 1.0));
  }
  latest_ = a + hidden({filters_[0].tilt, filters_[1].tilt});
  remember();
  jolt_ = std::max(jolt_ * kCollision / (step + kCollision), std::abs(since(std::max(kJoltTime, 2.0 * step)).body));
  switch (traction_) {
    case Traction::rolls:
      roll(step);
      break;
    case Traction::slides:
      slide(gap, latest_, step);
      break;
    case Traction::stands:
      stand(step);
      break;
  }
  corrected_speed_ = speed_;
}

void TractionBelief::miss(double wheels, double step) {
  missed_ += step;
  now_.variance += step * step * kUnmeasuredAcceleration * kUnmeasuredAcceleration;
  if (missed_ > kLongestStep) reset(wheels);
}

void TractionBelief::roll(double step) {
  speed_ = now_.wheels;
  const Change window = sinceOldest();
  if (const auto change = againstRolling(window)) return switchToSlide(now_.wheels - change->error(), *change);
  if (std::abs(window.wheels) > kSteadyChange) learnFilters(window, step);
  // In a turn the mean of a belongs to an unknown turning centre.
  const bool straight = kCentreDistance * window.turning < kStraightAcceleration * window.time;
  const bool keeps = window.time > 0.5 * kWindow && std::abs(window.wheels) < kSteadyChange && straight;
  if (!keeps) return;
  // An attitude filter reports the offset as tilt.
  if (!filter()) learnOffset(window, step);
  for (AttitudeFilter& filter : filters_) filter.tilt *= keptAfter(step, kWindow);
  // A slide hidden by a possible attitude filter is not noise.
  if (std::abs(now_.wheels) < kTurningWheels || surprises(window)) return;
  const double squared = window.error() * window.error() / window.variance;
  factor_ = std::clamp(factor_ + step / (step + kSensorMemory) * (squared - factor_), 1.0, kLargestVarianceRatio);
}

/// Learns b from a window of constant wheel speed.
void TractionBelief::learnOffset(const Change& window, double step) {
  // db/dt = (mean of a)/T_b
  if (offset_known_) {
    offset_ += step / (step + kSensorMemory) * window.body / window.time;
    return;
  }
  // The wheels may not show the latest motion of the body yet.
  const Change unseen = since(hold_ + kWheelDelay);
  const double time = window.time - unseen.time;
  if (time < kSteadyTime) return;
  offset_known_ = true;
  const double mean = (window.body - unseen.body) / time;
  // A smaller mean is the accelerometer's error and is learned slowly; a slope is taken as a whole.
  if (std::abs(mean) < kSlopeAcceleration) return;
  offset_ += mean;
  resetPast();
}

/// Friction brings a sliding body nearer to its wheels, and an obstacle throws it back by a part of its speed. A larger
/// gap is an error of the accelerometer.
bool TractionBelief::possible(double gap) const {
  return std::abs(gap) <=
         kReboundFraction * std::abs(gap_at_first_) + wheels_away_ + kLeastError + kNoiseBound * std::sqrt(variance_);
}

void TractionBelief::learnJumpOfOffset() {
  // b <- b + (mean of a - dv_w/dt) since then
  const Change change = since(surprise_ + sliding_);
  offset_ -= change.error() / change.time;
  switchToRoll();
}

void TractionBelief::slide(double gap_before, double acceleration, double step) {
  sliding_ += step;
  speed_ = corrected_speed_ + step * acceleration;
  variance_ += variance_rate_ * step;
  wheels_away_ += std::abs(speed_ - now_.wheels - gap_before - step * acceleration);
  const double gap = speed_ - now_.wheels;
  // While the robot accelerates, a collision may be detected before it is over.
  if (sliding_ <= kCollision && collision()) surprise_ = std::min(surprise_, kCollision);
  const bool collided = surprise_ <= kCollision + thresholds::kRounding;
  // A body that rebounds may pass the speed of the wheels, which the collision stopped too.
  const bool passed = gap_before * gap <= 0.0 || gap_at_first_ * gap <= 0.0;
  const bool met = (passed || std::abs(gap) < kMetSpeed) && (!collided || sliding_ > kCollision);
  const bool unknown = kCentreDistance * (now_.turning - turning_before_) > std::max(kLeastError, std::abs(gap));
  if (met || unknown) return switchToRoll();
  if (!possible(gap)) return learnJumpOfOffset();
  const Change quiet = since(kSteadyTime);
  const bool keeps = sliding_ > kSteadyTime && std::abs(quiet.body) < kSteadyChange + std::sqrt(quiet.variance);
  const bool late = sliding_ > kLongestSlide;
  if (!keeps && !late) return;
  const double wheels = std::abs(now_.wheels);
  const double stopped = sliding_ > kDecisionTime ? 0.5 : kStoppedFraction;
  // The present noise counts, because it may have grown when the slide began; a collision adds noise.
  const double noise = kNoiseBound * std::sqrt(factor_ * variance_rate_ * surprise_);
  const bool sure = (collided || std::abs(gap) > noise) && !stillTurning();
  if (sure && wheels > kTurningWheels && std::abs(speed_) < stopped * wheels) return switchToStand();
  if (late || (!sure && sliding_ > kWindow) ||
      (std::abs(quiet.wheels) < kSteadyChange && std::abs(gap) < kStoppedFraction * wheels))
    switchToRoll();
}

/// A body that is held does not turn.
bool TractionBelief::stillTurning() const {
  const Change lately = since(kRecentTime);
  return lately.turning > kHeldTurn * kHeldTurn * lately.time;
}

void TractionBelief::stand(double step) {
  const Change window = sinceOldest();
  const bool unknown = kCentreDistance * window.turning > std::max(kLeastError, std::abs(now_.wheels));
  if (unknown || stillTurning() || std::abs(now_.wheels) < kTurningWheels) return switchToRoll();
  // Once the obstacle gives way, the body reaches the speed of its wheels.
  const Change lately = since(kRecentTime);
  if (comesToItsWheels(window) || comesToItsWheels(lately)) return switchToRoll();
  // Vibration may hide that the body moves.
  hidden_ = leastToCome(lately) > (1.0 - kStoppedFraction) * std::abs(now_.wheels) ? hidden_ + step : 0.0;
  if (hidden_ > kLongestSlide) return switchToRoll();
  if (std::abs(window.body) < std::max(kLeastError, bound(window))) return;
  const bool follows = std::abs(window.error()) < 0.5 * std::abs(window.wheels);
  follows ? switchToRoll() : switchToSlide(window.body, window);
}

/// Least change of speed of a body that comes to its wheels [m/s].
double TractionBelief::leastToCome(const Change& change) const {
  return std::max(kLeastError, kExpectedFraction * bound(change));
}

bool TractionBelief::comesToItsWheels(const Change& change) const {
  const bool there = std::abs(change.body - now_.wheels) < kStoppedFraction * std::abs(now_.wheels);
  return there && std::abs(change.body) > leastToCome(change);
}

void TractionBelief::switchToRoll() {
  traction_ = Traction::rolls;
  speed_ = now_.wheels;
  variance_ = 0.0;
  resetPast();
}

void TractionBelief::switchToSlide(double speed, const Change& surprise) {
  traction_ = Traction::slides;
  speed_ = speed;
  variance_ = surprise.variance;
  surprise_ = surprise.time;
  sliding_ = wheels_away_ = 0.0;
  gap_at_first_ = speed - now_.wheels;
  turning_before_ = now_.turning;
}

void TractionBelief::switchToStand() {
  traction_ = Traction::stands;
  speed_ = variance_ = hidden_ = 0.0;
  resetPast();
}

void TractionBelief::resetPast() {
  remembered_ = 0;
  remember();
}

void TractionBelief::restart() {
  missed_ = kNever;
  switchToRoll();
}

void TractionBelief::reset(double wheels) {
  now_.wheels = corrected_speed_ = wheels;
  switchToRoll();
}

}  // namespace jackal_aic
