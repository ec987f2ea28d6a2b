#include "jackal_aic/faults/wheel_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

/// Largest standard deviation of a predicted speed [rad/s]. With a larger one, reached without measurements, a dead
/// encoder would agree.
constexpr double kLargestDeviation = 0.3;

/// Time that counts as the recent past of a wheel [s]: the belief learns a gain error in it, a motor that has its power
/// follows its command within it, and chance makes no three spikes in it.
constexpr double kMemory = 0.5;

/// Largest factor of the variance of an error: ten times the configured standard deviation.
constexpr double kMostNoise = 100.0;

/// Share of the width of the reachable interval that counts as motion between two samples.
constexpr double kUnderWay = 0.25;

/// Motion that a working encoder must show in addition: at least [rad/s], and relative to its speed.
constexpr double kLeastMotion = 0.02;
constexpr double kDrift = 0.01;

/// Largest step of an encoder [rad/s]; a larger change is motion.
constexpr double kCoarsestStep = 0.2;

/// Least mean acceleration between two renewals of a held encoder value for a wheel that follows its command [rad/s^2].
/// A heavy robot on sticky ground may not reach more.
constexpr double kSlowestRamp = 2.0;

/// Least change of an encoder beyond its noise [rad/s].
constexpr double kHeldMotion = 0.1;

/// ln of the odds of repetitions from which an encoder is frozen: faults begin once in a day of driving, with one of
/// 50 samples a second, and a false alarm costs ten times as much as a second.
constexpr double kSilent = 18.0;

/// Uncertainty of a measurement outside the reachable interval, in multiples of its distance from the interval.
constexpr double kDoubtful = 5.0;

/// A wheel is behind if the commanded speed exceeds this multiple of its speed, plus an offset [rad/s], for kMemory.
/// The offset of a wheel at rest: a motor with 0.8 of its gain and a deadband of 0.5 rad/s starts at 1.25 rad/s.
constexpr double kBehind = 2.0;
constexpr double kAnyBehind = 1.5;
constexpr double kAnyBehindAtRest = 1.25;

/// Steady-state error of an assumed model: of the gain, relative, and the offset of a motor with stock gains [rad/s].
constexpr double kAssumedGain = 0.25;
constexpr double kAssumedOffset = 0.5;

constexpr double kLongestSpike = 0.05;  // s; a longer outlier may be a motion

/// Range of the drive train. A lag above that of motors approximates a ramp, or ground that holds a heavy robot. Then
/// only the sum of dead time and lag is known. An assumed one: half to twice the dead time and the lag, and more lag
/// for a soft velocity loop.
DriveTrainRange driveTrainRange(const FaultParameters& p, const PlantModel& model) {
  constexpr double kLagOfMotors = 0.1, kSoftLoop = 0.3;  // s
  const double beyond = std::max(0.0, model.lag - kLagOfMotors);
  const double timing = thresholds::kSure * p.dead_time_deviation + 0.5 * beyond;
  DriveTrainRange range{
      timing, timing, model.lag - 0.5 * beyond, model.lag + beyond, p.slowest_acceleration, p.fastest_acceleration};
  if (model.identified) return range;
  range.earlier += 0.5 * model.dead_time;
  range.later += model.dead_time;
  range.shortest_lag = 0.5 * model.lag;
  range.longest_lag = 2.0 * model.lag + kSoftLoop;
  return range;
}

WheelBeliefParameters beliefParameters(const FaultParameters& p) {
  WheelBeliefParameters belief;
  belief.measurement_variance = p.wheel_variance;
  belief.dead_time_deviation = p.dead_time_deviation;
  return belief;
}

}  // namespace

WheelMonitor::WheelMonitor(const FaultParameters& parameters, const PlantModel& model, double wheel_radius)
    : parameters_(parameters),
      reachable_(model, wheel_radius, driveTrainRange(parameters, model)),
      belief_(model, wheel_radius, beliefParameters(parameters), 0.0),
      identified_(model.identified),
      persistence_(parameters.recovery_time),
      bound_(1.0 / std::sqrt(parameters.false_alarm_rate)),
      motors_(model.acceleration_limit / wheel_radius) {}

void WheelMonitor::forget() {
  noise_ = faults::kUnknownNoise;
  repetition_ = {};
  missed_motion_ = {};
  hold_ = {};
  silence_ = quantum_ = change_ = misfit_ = 0.0;
  start(0.0);
}

void WheelMonitor::start(double speed, bool commands_known) {
  belief_.reset(speed);
  if (commands_known) {
    reachable_.seed(speed, steadyMisfit(speed));
  } else {
    reachable_.start(speed);
  }
  held_ = {{speed, speed}, {speed, speed}, -HUGE_VAL};
  intervals_.fill(held_);
  last_speed_ = measured_ = speed;
  frozen_ = suspect_ = recovering_ = jumped_ = false;
  behind_ = spikes_ = outlier_time_ = rise_ = fall_ = 0.0;
  persistence_.reset();
}

void WheelMonitor::follow(double speed) {
  belief_.reset(speed);
  reachable_.start(speed);
  last_speed_ = speed;  // a belief that is the measurement explains none of its noise
}

/// Steady-state model error at a speed.
double WheelMonitor::steadyMisfit(double speed) const {
  return identified_ ? thresholds::kSure * parameters_.gain_deviation * std::abs(speed)
                     : kAssumedGain * std::abs(speed) + kAssumedOffset;
}

/// Speeds of any drive train in the range, with its steady-state error.
Range WheelMonitor::steady() const {
  const auto [low, high] = held_.reachable;
  return {low - steadyMisfit(low), high + steadyMisfit(high)};
}

WheelRates WheelMonitor::predict(double command) {
  const Range rates = reachable_.predict(command);
  belief_.predictActing(reachable_.acting());
  rise_ += rates.high * DriveTrain::kStep;
  fall_ += rates.low * DriveTrain::kStep;
  change_ = keptAfter(DriveTrain::kStep, kMemory) * change_ + belief_.acceleration() * DriveTrain::kStep;
  return {belief_.acceleration(), rates};
}

double WheelMonitor::speedVariance() const {
  return std::min(belief_.covariance()(0, 0), square(kLargestDeviation)) + resolutionVariance();
}

/// Variance of rounding. It does not average out at a constant speed.
double WheelMonitor::resolutionVariance() const { return square(quantum_) / 12.0; }

/// Possible speeds: the belief plus the distance of the slowest and the fastest drive train from the model. Where
/// stiction may hold the wheel, rest is possible too.
Range WheelMonitor::possible() const {
  const auto [slowest, fastest] = reachable_.speeds();
  const double offset = belief_.speed() - reachable_.nominal();
  Range possible{slowest + offset, fastest + offset};
  if (slowest > kStiction || fastest < -kStiction) return possible;
  possible.low = std::min({possible.low, slowest, 0.0});
  possible.high = std::max({possible.high, fastest, 0.0});
  return possible;
}

/// A held value may be any speed that was possible since it was renewed, or before, over the time that it averages.
void WheelMonitor::holdIntervals(double step) {
  clock_ += step;
  newest_ = (newest_ + 1) % intervals_.size();
  held_ = {possible(), reachable_.speeds(), clock_};
  intervals_[newest_] = held_;
  if (hold_.longest() == 0.0) return;
  const double earliest = clock_ - hold_.longest() - thresholds::kRounding;
  for (std::size_t i = 1; i < intervals_.size(); ++i) {
    const Intervals& old = intervals_[(newest_ + intervals_.size() - i) % intervals_.size()];
    if (old.time < earliest) break;
    held_.possible = hull(held_.possible, old.possible);
    held_.reachable = hull(held_.reachable, old.reachable);
  }
}

faults::Normal WheelMonitor::turns(bool measured) const {
  if (!measured) {
    const Range range = hold_.longest() > 0.0 ? held_.possible : possible();
    return {belief_.speed(), speedVariance() + square(range.width())};
  }
  // The belief, which has less noise, moved to within the deviation of the measurement. Held values and values outside
  // the reachable interval are uncertain.
  const double variance = parameters_.wheel_variance + resolutionVariance(), deviation = std::sqrt(variance);
  const auto beyond = [](double error, double most) { return Range{-most, most}.outside(error); };
  const double off = beyond(measured_ - belief_.speed(), deviation), held = hold_.held() > 0.0 ? off : 0.0;
  const double doubt = kDoubtful * beyond(error_, thresholds::kSure * deviation);
  return {belief_.speed() + off, variance + square(held) + square(doubt)};
}

double WheelMonitor::variance() const {
  return speedVariance() + parameters_.wheel_variance + square(parameters_.gain_deviation * change_);
}

/// No wheel jumps: from one sample to the next its drive train, and a load that is as strong as its motors, change its
/// speed by no more than this. A faster motor may be where the newest command leads. Of a speed that was not known
/// better, or that the assumed gain explains, a jump says nothing.
bool WheelMonitor::jumps(double measurement, double step) const {
  if (step <= 0.0) return false;
  const double samples = 1.0 + hold_.longest() / step, by_load = step * motors_;
  const double noise =
      thresholds::kSure * std::sqrt(2.0 * (noise_ * parameters_.wheel_variance + resolutionVariance()));
  const double change = measurement - measured_, commanded = reachable_.commanded();
  const Range possible{samples * (fall_ - by_load) - noise, samples * (rise_ + by_load) + noise};
  const Range known = hull(reachable_.speeds(), {commanded, commanded});
  const double doubt = known.width() + kAssumedGain * std::abs(belief_.speed());
  return possible.outside(change) != 0.0 && std::abs(known.outside(measurement)) > doubt;
}

/// Distance from what is possible; of a wheel that jumped, from the belief, because no uncertain model explains that.
double WheelMonitor::errorOf(double measurement) const {
  if (jumped_) return beyondUsual(measurement, {belief_.speed(), belief_.speed()});
  const double error = beyondUsual(measurement, held_.possible);
  if (identified_) return error;
  const double assumed = steady().outside(measurement);
  return std::abs(assumed) < std::abs(error) ? assumed : error;
}

void WheelMonitor::compare(double measurement, double step) {
  const double since_renewed = hold_.held() + step;
  hold_.update(measurement, std::max(thresholds::kSure * quantum_, kHeldMotion), step);
  holdIntervals(step);
  if (jumps(measurement, step)) {
    jumped_ = true;
    misfit_ = 0.0;  // what was learned before does not explain it
  }
  rise_ = fall_ = 0.0;
  error_ = errorOf(measurement);
  distance_ = std::abs(error_) / (bound_ * std::sqrt(noise_ * variance()));
  if (distance_ <= 1.0) jumped_ = false;
  frozen_ = isFrozen(measurement, step);
  behind_ = isBehind(measurement) ? behind_ + step : 0.0;
  suspect_ = distance_ > 1.0 || frozen_ || behind_ > kMemory + 2.0 * hold_.longest();
  countSpikes(step);
  waits_ = measurement == measured_ && hold_.held() <= hold_.longest();
  const double progress = 0.5 * parameters_.slowest_acceleration * motors_;
  const double least = hold_.longest() > 0.0 ? std::min(progress, kSlowestRamp) : progress;
  const bool follows = waits_ ? recovering_ : comesNearer(measured_, measurement) > least * since_renewed;
  recovering_ = follows || isAhead(measurement);
  measured_ = measurement;
}

/// An outlier that is over after a sample or two is none of the wheel, which cannot turn so fast.
void WheelMonitor::countSpikes(double step) {
  spikes_ *= keptAfter(step, kMemory);
  const double lasted = std::exchange(outlier_time_, suspect_ ? outlier_time_ + step : 0.0);
  if (!suspect_ && lasted > 0.0 && lasted < kLongestSpike) spikes_ += 1.0;
}

/// The wheel has less than half of the speed of the slowest drive train. The belief alone would absorb a slow loss as a
/// disturbance.
bool WheelMonitor::isBehind(double measurement) const {
  const auto [low, high] = held_.reachable;
  const double least = low > 0.0 ? low : std::min(high, 0.0);
  const double followed = least > 0.0 ? measurement : -measurement;
  const double any = std::abs(measurement) < thresholds::kRest ? kAnyBehindAtRest : kAnyBehind;
  return std::abs(least) > kBehind * std::max(0.0, followed) + any;
}

/// The wheel leads its prediction towards the commanded speed: its motor is stronger or faster than its model.
bool WheelMonitor::isAhead(double measurement) const {
  if (!suspect_ || frozen_ || std::abs(measurement) < thresholds::kMoving) return false;
  const double commanded = reachable_.commanded();
  return error_ > 0.0 ? measurement <= commanded : measurement >= commanded;
}

/// Progress towards the prediction between two measurements.
double WheelMonitor::comesNearer(double before, double now) const { return error_ < 0.0 ? now - before : before - now; }

bool WheelMonitor::isFrozen(double measurement, double step) {
  // That a wheel at rest repeats its value says nothing.
  const bool may_rest = std::abs(measurement) < thresholds::kMoving;
  // While the speed changes, alternating changes are motion and not noise.
  const auto [low, high] = reachable_.speeds();
  const double explained = std::max(std::abs(belief_.speed() - last_speed_), kUnderWay * (high - low));
  const bool repeats = repetition_.repeats(measurement);
  const auto kind = faults::Repetition::moving;  // noise at rest is that of a wheel that turns
  silence_ = repeats && !may_rest ? silence_ - repetition_.logChance(measurement, kind) : 0.0;
  repetition_.update(measurement, explained, kind, faults::probabilityOf(kSilent - silence_), may_rest);
  const bool silent = silence_ > kSilent && repetition_.run() >= parameters_.frozen_samples;
  quantum_ = std::min(repetition_.resolution(), kCoarsestStep);
  const double least = repeats ? leastMissed(measurement) : 0.0;
  // A wheel that sticks at a small command misses no motion until it has to turn.
  if (std::abs(measurement) < thresholds::kRest && reachable_.largest() < kStiction) missed_motion_.restart(low, high);
  const bool missed = missed_motion_.update(measurement, repeats, low, high, least, step, hold_.longest());
  return parameters_.frozen_samples > 0 && (silent || missed);
}

/// Motion that a working encoder must show [rad/s].
double WheelMonitor::leastMissed(double measurement) const {
  // Before the resolution is known, assume the coarsest.
  const double quantum = quantum_ > 0.0 ? quantum_ : kCoarsestStep;
  return std::max({thresholds::kSure * quantum, kLeastMotion, kDrift * std::abs(measurement)}) +
         thresholds::kSure * std::sqrt(misfit_);
}

void WheelMonitor::freezeWithTheOther() {
  const int samples = parameters_.frozen_samples;
  if (samples > 0 && silence_ > 0.0 && repetition_.run() >= samples) frozen_ = suspect_ = true;
}

bool WheelMonitor::slowed() const {
  const double part = measured_ / speed();
  return part > 0.5 && part < 1.0;
}

void WheelMonitor::forgive() {
  belief_.reset(measured_);
  reachable_.seed(measured_);
  persistence_.reset();
  jumped_ = false;
}

void WheelMonitor::conclude(double measurement, double step) {
  // A held value is one measurement, however often it is published.
  if (!(suspect_ && waits_)) persistence_.update(suspect_, std::abs(belief_.speed()) > thresholds::kMoving, step);
  if (frozen_) persistence_.declareFaulty();
  last_speed_ = belief_.speed();
  if (state() != ChannelState::ok) return;
  const double variance = this->variance();
  learnMisfit(measurement, variance, step);
  const double width = held_.possible.width();
  const double deviation = std::sqrt(noise_ * variance);
  if (width < thresholds::kSure * deviation) {
    average(noise_, square(measurement - belief_.speed()) / variance, step, thresholds::kNoiseMemory);
    noise_ = std::clamp(noise_, 1.0, kMostNoise);
  }
  // A wide interval of possible speeds makes the measurement less informative about the drive train, and so does one
  // that no drive train in the range reaches: it would be taken for a disturbance.
  belief_.correct(measurement, square(width) + square(kDoubtful * beyondUsual(measurement, steady())));
  last_speed_ = belief_.speed();
}

/// Distance of a measurement from speeds, beyond the usual misfit.
double WheelMonitor::beyondUsual(double measurement, const Range& speeds) const {
  const double usual = std::max(0.0, thresholds::kSure * std::sqrt(misfit_) - kSpeedRange);
  return Range{speeds.low - usual, speeds.high + usual}.outside(measurement);
}

/// Mean square distance of a moving wheel from the reachable interval, without noise. A wheel at rest is not used.
void WheelMonitor::learnMisfit(double measurement, double variance, double step) {
  if (std::abs(measurement) < thresholds::kMoving) return;
  const auto [low, high] = held_.reachable;
  const double noise = thresholds::kSure * std::sqrt(variance);
  const double misfit = Range{low - noise, high + noise}.outside(measurement);
  average(misfit_, square(misfit), step, thresholds::kSensorMemory);
}

}  // namespace jackal_aic
