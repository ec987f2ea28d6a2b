#include "jackal_aic/faults/body_monitor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/gravity.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic::faults {
namespace {

struct Entry {
  const char* text;
  double rate, time;  // how often it begins [1/s], and how long it lasts on average [s]
};

constexpr std::array<Entry, kHypotheses> kEntries{{
    {"healthy", 0.0, HUGE_VAL},
    {"the body slides", 0.05, 0.3},     // a sill, a jolt, ice
    {"struck by a kerb", 0.001, 0.15},  // and the tyres take it back
    {"other ground", 0.0, 3.0},         // begins as a slide; then its slip is the usual one
    {"gyro glitch", 1e-4, 0.03},
    {"moved from outside", 0.01, 2.0},  // of a robot that is to stand
    {"gyro frozen", 1e-5, 100.0},       // a fault: one in a day of driving, until it is repaired
    {"gyro offset", 1e-5, 100.0},
    {"gyro offset", 1e-5, 100.0},
    {"gyro reversed", 1e-5, 100.0},
    {"accelerometer frozen", 1e-5, 100.0},
    {"accelerometer offset", 1e-5, 100.0},
    {"IMU upside down", 1e-5, 100.0},
}};

constexpr double kEndsOnGround = 0.25;  // share of slides that end on another ground
constexpr double kLeastRate = 1e-7;     // at which anything begins whatever else is believed [1/s]

constexpr double kMounted = 1e-3;  // chance that an IMU is mounted in another way than tf says, of each way

// How large they are.
constexpr double kOffsetScale = 1.0;       // standard deviation of an offset of the gyro [rad/s]
constexpr double kStrike = 0.2;            // standard deviation of a strike [rad/s]
constexpr double kOtherSlip = 0.4;         // standard deviation of another ground's slip, relative
constexpr double kBodyAcceleration = 1.5;  // of a body that does not follow its wheels [rad/s^2], and the same by
constexpr double kHandling = 10.0;         // of a body that somebody moves [rad/s^2]
constexpr double kTurnChange = 2.0;        // the turn that the wheels ask for [1/s]

// Share of samples in which the accelerometer is jolted: of a ground before it is known, where the body slides, and
// where it is struck. The first is learned.
constexpr double kJolts = 0.02, kJoltsSliding = 0.3, kJoltsStruck = 0.8, kJoltsMoved = 0.95;
constexpr double kJoltsMemory = 20.0;  // s
constexpr double kOutliers = 1e-3;     // share of samples of the gyro that are anything at all

// Decision. Costs are multiples of that of a wrong name.
constexpr double kFalseAlarm = 10.0;  // of a verdict where nothing is wrong
constexpr double kOverlooked = 20.0;  // of a fault that is taken for motion from outside
constexpr double kWaiting = 2.5;      // of a second without a verdict
constexpr double kDoubt = 0.9;        // probability of a fault from which waiting costs
constexpr double kCertainty = 0.99;   // probability by which a verdict is withdrawn
constexpr double kSureOdds = 5.0;     // ln of the odds by which a sensor counts again
constexpr double kMostOdds = 10.0;

constexpr double kDeadZone = 0.05;  // largest yaw rate for which drivers publish zero instead [rad/s]
constexpr double kSteepest = 0.7;   // of gravity: 45 degrees
constexpr double kLever = 0.3;      // of the IMU off the centre of the turn, standard deviation [m]

// Time for which a body goes on rocking, or somebody may only seem to let go [s].
constexpr double kShaken = thresholds::kMotionMemory;

constexpr double kNone = 1e-300;  // least probability

double half(double a, double b) { return logMixture(0.5, a, b); }

}  // namespace

BodyMonitor::BodyMonitor(const FaultParameters& parameters, double effective_track, bool on_box)
    : parameters_(parameters),
      on_box_(on_box),
      yaw_(parameters, effective_track, on_box),
      mirrored_(yaw_),
      shifted_(yaw_.withOffset(kOffsetScale)),
      begun_(shifted_),
      forward_(parameters.accelerometer_variance, kSteepest * kGravity, kLever),
      vertical_(parameters.accelerometer_variance, (1.0 - kSteepest) * kGravity, 0.0),
      gyro_offset_(square(kOffsetScale), parameters.largest_bias),
      slip_offset_(square(kOtherSlip / effective_track)),
      jolts_(kJolts),
      sign_(-std::log(kMounted)) {
  restart();
  alpha_[kUpsideDown] = kMounted;
  alpha_[kHealthy] -= kMounted;
}

void BodyMonitor::forget() {
  alpha_.fill(0.0);
  alpha_[kHealthy] = 1.0;
  said_ = kHealthy;
  suspicious_ = good_ = 0.0;
}

void BodyMonitor::restart() {
  forget();
  gyro_ = accelerometer_ = Excluded{};
  alpha_[kGyroReversed] = probabilityOf(-sign_);
  alpha_[kHealthy] -= alpha_[kGyroReversed];
  since_jolt_ = kShaken;
  start();
}

void BodyMonitor::start() {
  yaw_.restart();
  mirrored_.restart();
  shifted_.restart();
  compared_ = false;
  difference_change_ = forward_change_ = 0.0;
}

void BodyMonitor::predict(double forward_rate, const Range& possible, double difference_rate, double step) {
  const double fading = step / thresholds::kFollowing;
  forward_change_ += forward_rate * step;
  difference_change_ += difference_rate * step;
  lowest_ = std::min(possible.low, lowest_ - fading * lowest_);
  highest_ = std::max(possible.high, highest_ - fading * highest_);
  rate_ = forward_rate;
}

const char* text(Hypothesis hypothesis) { return kEntries[hypothesis].text; }

std::string Suspicion::text() const {
  return fmt::format("{}{}, {:.2f}", hypothesis == kHealthy ? "" : "perhaps: ", faults::text(hypothesis), probability);
}

Suspicion BodyMonitor::mostLikely() const {
  for (const Excluded* sensor : {&gyro_, &accelerometer_}) {
    if (*sensor) return {sensor->fault, sensor->probability()};
  }
  return likeliest(kHealthy);
}

/// The likeliest from a hypothesis on; both offsets of the gyro are one fault.
Suspicion BodyMonitor::likeliest(Hypothesis first) const {
  Probabilities alpha = alpha_;
  alpha[kGyroOffset] += std::exchange(alpha[kGyroShifted], 0.0);
  const auto best = std::max_element(alpha.begin() + first, alpha.end());
  return {static_cast<Hypothesis>(best - alpha.begin()), *best};
}

double BodyMonitor::gyroFaulty() const {
  if (gyro_) return gyro_.probability();
  return alpha_[kGyroGlitch] + alpha_[kGyroFrozen] + alpha_[kGyroOffset] + alpha_[kGyroShifted] +
         alpha_[kGyroReversed] + alpha_[kUpsideDown];
}

double BodyMonitor::accelerometerFaulty() const {
  if (accelerometer_) return accelerometer_.probability();
  return alpha_[kAccelerometerFrozen] + alpha_[kAccelerometerOffset] + alpha_[kUpsideDown];
}

bool BodyMonitor::shaken() const { return since_jolt_ < kShaken || alpha_[kStruck] > 0.5; }

/// A sample of the gyro against its prediction.
struct BodyMonitor::GyroSample {
  double value, change;      // yaw rate, and since the last sample [rad/s]
  double error, last_error;  // e, and that of the last sample [rad/s]
  double variance;           // S of the error [(rad/s)^2]
  double free;               // of the change of a body that turns by itself [(rad/s)^2]
  double asked;              // yaw rate by the wheels [rad/s]

  /// Change of the error, by which an offset begins.
  Normal jump() const { return {error - last_error, free}; }
};

BodyMonitor::GyroEvidence BodyMonitor::weighGyro(double yaw_rate, const WheelMotion& wheels, double step) {
  const Normal& x = wheels.difference;
  const double v = wheels.forward.mean, s = yaw_.slope(), last_error = gyro_error_;
  gyro_error_ = yaw_rate - yaw_.mean(x.mean, v);
  gyro_variance_ = yaw_.variance(x, v);
  turning_ = yaw_.leastTurn(x) > kDeadZone;
  const double free = square(step) * (square(kBodyAcceleration) + square(kTurnChange * s * x.mean)) +
                      square(s * difference_change_) + 2.0 * yaw_.noise();
  const GyroSample y{yaw_rate, yaw_rate - yaw_rate_, gyro_error_, last_error, gyro_variance_, free, s * x.mean};
  GyroEvidence g;
  weighMotion(y, wheels, step, g.of);
  weighOffset(y, g.of[kGyroOffset]);
  weighShift(y, wheels, step, g.of);
  weighReversal(y, wheels, step, g);
  g.of[kGyroGlitch] = g.of[kGyroOffset];
  g.of[kAccelerometerFrozen] = g.of[kAccelerometerOffset] = g.of[kHealthy];
  g.of[kUpsideDown] = g.of[kGyroReversed];
  g.of[kGyroFrozen] = {kImpossible, kImpossible};
  weighRepetition(y, wheels.turn, g);
  return g;
}

/// What the body does.
void BodyMonitor::weighMotion(const GyroSample& y, const WheelMotion& wheels, double step, Densities& g) {
  const double e = y.error, S = y.variance;
  const double usual = logStudent(square(e), S), any = std::log(kOutliers) + logNormal(e, square(kOffsetScale));
  gyro_outlier_ = any > usual;
  g[kHealthy].stays = g[kHealthy].begins = logSum(usual, any);
  g[kSlides].stays = logNormal(y.change, y.free);
  g[kSlides].begins = logNormal(e, y.free + S);  // from where its wheels had it
  // The tyres take it back, or another wheel holds it. What happened while the wheels did not tell is unknown.
  const double half_taken_back = -0.5 * std::expm1(-step / kEntries[kStruck].time) * y.last_error;
  g[kStruck].stays = logNormal(y.jump().mean + half_taken_back, y.free + square(half_taken_back));
  g[kStruck].begins = logNormal(e, square(compared_ ? kStrike : kOffsetScale) + S);
  g[kOtherGround].stays = slip_offset_.stays(e, S, wheels.difference.mean);
  // No body jumps: the new slip is what it has come to.
  g[kOtherGround].begins = g[kSlides].stays - 0.5 * square(e) / (S + square(kOtherSlip * y.asked));
  // No ground turns a body against its wheels.
  const double against = 0.5 * square(turnAgainst(y) / (0.5 * kOtherSlip));
  g[kOtherGround].stays -= against;
  g[kOtherGround].begins -= against;
  g[kMoved].stays = logNormal(y.change, square(kHandling * step) + 2.0 * yaw_.noise());
  g[kMoved].begins = logNormal(e, square(kOffsetScale) + S);
}

/// Part of the turn that the wheels ask for which the body makes against them: 0 or less.
double BodyMonitor::turnAgainst(const GyroSample& y) const {
  return std::abs(y.asked) > thresholds::kTurning ? std::min((y.value - yaw_.bias()) / y.asked, 0.0) : 0.0;
}

void BodyMonitor::weighOffset(const GyroSample& y, Evidence& g) {
  g.stays = gyro_offset_.stays(y.error, y.variance);
  // Where the body does not follow its wheels, an offset shows as a jump.
  const double sliding = compared_ ? std::min(1.0, kNone + alpha_[kSlides] + alpha_[kStruck]) : kNone;
  const Normal level{y.error, y.variance}, jump = y.jump();
  const double of_level = gyro_offset_.begins(level.mean, level.variance),
               of_jump = gyro_offset_.begins(jump.mean, jump.variance);
  g.begins = logMixture(sliding, of_level, of_jump);
  gyro_begins_ = std::log(sliding) + of_jump > std::log1p(-sliding) + of_level ? jump : level;
}

/// An offset that slip and ground could explain for a while. Its filter learns what it would have without them.
void BodyMonitor::weighShift(const GyroSample& y, const WheelMotion& wheels, double step, Densities& g) {
  const Normal& x = wheels.difference;
  const double v = wheels.forward.mean, least = parameters_.largest_bias;
  const auto learn = [&](YawPrediction& filter) {  // ln of the factor by which |b| > least is more likely then
    const double before = filter.logBeyond(least);
    filter.learn(y.value, x, v, step, follows() * measuredAnew(y.value));
    return filter.logBeyond(least) - before;
  };
  const double error = y.value - shifted_.mean(x.mean, v);
  // With the noise of the healthy one: a filter that believes in less slip would have less of it.
  const double stays = logStudent(square(error), y.variance) + learn(shifted_);
  begun_ = yaw_.withOffset(kOffsetScale);
  const double first = logNormal(y.value - begun_.mean(x.mean, v), begun_.variance(x, v));
  // While the robot moves, samples that are near each other have the same error: they are one.
  const double part = wheels.turn ? std::min(1.0, step / thresholds::kFollowing) : 1.0, healthy = g[kHealthy].stays;
  g[kGyroShifted] = {healthy + part * (stays - healthy), first + learn(begun_)};
}

void BodyMonitor::weighReversal(const GyroSample& y, const WheelMotion& wheels, double step, GyroEvidence& g) {
  // On a straight line a gyro of the wrong sign agrees with everybody; a body that does not turn shows no sign either.
  const double healthy = g.of[kHealthy].stays;
  g.reversed = healthy;
  g.of[kGyroReversed] = {healthy, logNormal(y.value + yaw_rate_, y.free)};  // no body jumps, but the sign does
  if (!turning_) return;
  const Normal& x = wheels.difference;
  const double v = wheels.forward.mean, read = y.value - yaw_.bias();
  // Mounted so from the start, or since a sample.
  const double reversed = std::max(logStudent(square(-y.value - mirrored_.mean(x.mean, v)), mirrored_.variance(x, v)),
                                   logStudent(square(-y.value - yaw_.mean(x.mean, v)), y.variance));
  g.reversed = read * x.mean < 0.0 && std::abs(read) > kDeadZone ? reversed : std::min(reversed, healthy);
  // A body that slides goes on as it did, so the samples of the ground's memory are one. It does not do so for long.
  const double slides = g.of[kSlides].stays, swing = 0.5 * square(std::max(turnAgainst(y), -1.0));
  const double part = std::min(1.0, step / YawPrediction::kGroundMemory);
  g.of[kGyroReversed].stays = std::min(g.reversed, slides + part * (g.reversed - (slides - swing)));
}

/// Repetitions, which a frozen gyro alone explains. A value is left behind where the prediction has gone away from it
/// since it is new. A driver may have a dead zone: its zeros say nothing of a robot that need not turn.
void BodyMonitor::weighRepetition(const GyroSample& y, bool moving, GyroEvidence& g) {
  const bool repeats = gyro_repetition_.repeats(y.value), zero = y.value == 0.0;
  const double predicted = y.value - y.error;
  if (!repeats) predicted_ = predicted;
  const auto far = [&y](double distance) { return square(distance) > kLargestRatio * y.variance; };
  const bool left = zero ? turning_ : far(y.error) && far(predicted - predicted_);
  gyro_kind_ = left ? Repetition::under_way : moving ? Repetition::moving : Repetition::rest;
  const double chance = repeats && zero && !turning_ ? 0.0 : gyro_repetition_.logChance(y.value, gyro_kind_);
  double best = g.reversed;
  for (const Evidence& p : g.of) best = std::max({best, p.stays, p.begins});
  const auto repeated = [&](double& p) {
    p = chance + (repeats ? logUnless(gyro_repetition_.held(y.value), p - best) : p);
  };
  repeated(g.reversed);
  for (Evidence& p : g.of) {
    repeated(p.stays);
    repeated(p.begins);
  }
  double frozen = zero ? logNormal(0.0, yaw_.noise()) + chance : kImpossible;
  if (repeats) frozen = zero ? std::log(0.5) : 0.0;
  g.of[kGyroFrozen] = {frozen, frozen};
}

BodyMonitor::AccelerationEvidence BodyMonitor::weighAcceleration(const Observation& y, const WheelMotion& wheels,
                                                                 double step) {
  const Repetition::Kind kind = wheels.turn ? Repetition::moving : Repetition::rest;
  // What the drive train may do explains all of an error within its range.
  const double yaw_rate = y.valid.yaw_rate ? y.yaw_rate : 0.0;
  const double left = y.acceleration_x - rate_ - forward_.beside(yaw_rate);
  const double possible = std::clamp(left, std::min(0.0, lowest_ - rate_), std::max(0.0, highest_ - rate_));
  const double doubt = square(kPaceDoubt * rate_) + wheels.forward.variance / square(thresholds::kFollowing),
               v = wheels.forward.mean;
  const AxisEvidence x = forward_.weigh(y.acceleration_x, left - possible, doubt, v, yaw_rate, kind, step);
  AccelerationEvidence a{x, kImpossible};
  if (y.acceleration_z) {
    // A message that is published again repeats all of its axes: that is one event.
    const bool again = forward_.repeats(y.acceleration_x) && vertical_.repeats(*y.acceleration_z);
    AxisEvidence z = vertical_.weigh(*y.acceleration_z, *y.acceleration_z - kGravity - vertical_.beside(0.0), 0.0, v,
                                     0.0, kind, step);
    if (again) z = AxisEvidence{};
    // An IMU upside down reads the forward acceleration backwards, or does not, by the axis about which it is turned.
    a.upside_down = half(x.healthy, forward_.logDensity(forward_.error() + 2.0 * (rate_ + forward_.beside(yaw_rate)))) +
                    vertical_.logDensity(*y.acceleration_z + kGravity);
    a.frozen = std::max({x.frozen + z.healthy, x.healthy + z.frozen, x.frozen + z.frozen});
    // An offset of one axis or of both.
    const auto either = [](double x_wrong, double x_ok, double z_wrong, double z_ok) {
      return logSum(logSum(x_wrong + z_ok, x_ok + z_wrong), x_wrong + z_wrong) - std::log(3.0);
    };
    a.offset = either(x.offset, x.healthy, z.offset, z.healthy);
    a.offset_begins = either(x.offset_begins, x.healthy, z.offset_begins, z.healthy);
    a.healthy += z.healthy;
    a.jolted += z.jolted;
  }
  return a;
}

/// What the ground does to a turn lasts, so that the samples of its memory are one.
void BodyMonitor::weighSign(const GyroEvidence& g, double step) {
  if (!turning_) return;
  const double part = std::min(1.0, step / YawPrediction::kGroundMemory), most = -std::log(kLeastRate);
  sign_ = std::clamp(sign_ + part * (g.of[kHealthy].stays - g.reversed), -most, most);
}

void BodyMonitor::judgeExcludedGyro(double yaw_rate, const GyroEvidence& g, double step) {
  if (gyro_.fault == kGyroOffset && turning_) {
    against_ = std::clamp(against_ + g.reversed - g.of[kGyroOffset].stays, -kMostOdds, kMostOdds);
    if (against_ > kSureOdds) gyro_ = {kGyroReversed, -kMostOdds, 0.0};
  }
  const bool reversed = gyro_.fault == kGyroReversed || gyro_.fault == kUpsideDown;
  const bool frozen = gyro_.fault == kGyroFrozen && gyro_repetition_.repeats(yaw_rate);  // until it changes
  const double faulty = reversed ? g.reversed : g.of[gyro_.fault].stays;
  // On a straight line it agrees with either sign, so it counts again only with a known one.
  if (sign_ < kSureOdds) gyro_.good = 0.0;
  if (!reversed || turning_) {
    gyro_.weigh(frozen ? kImpossible : g.of[kHealthy].stays, faulty, step, parameters_.recovery_time);
  }
  gyro_offset_.update(gyro_error_, gyro_variance_, 0.0);
}

void BodyMonitor::judgeExcludedAccelerometer(const AccelerationEvidence& a, double step) {
  const double faulty = accelerometer_.fault == kAccelerometerFrozen ? a.frozen
                        : accelerometer_.fault == kUpsideDown        ? a.upside_down
                                                                     : a.offset;
  accelerometer_.weigh(a.healthy, faulty, step, parameters_.recovery_time);
}

void BodyMonitor::check(const Observation& y, const WheelMotion& wheels, double step) {
  const bool reads = y.valid.yaw_rate && step > 0.0, accelerates = y.valid.acceleration && step > 0.0;
  const bool judged = reads && (wheels.trusted || on_box_) && !wheels.pushed;
  yaw_.predict(wheels.difference.mean, difference_change_, forward_change_, step);
  mirrored_.predict(wheels.difference.mean, difference_change_, forward_change_, step);
  shifted_.predict(wheels.difference.mean, difference_change_, forward_change_, step);
  since_jolt_ += step;
  const GyroEvidence g = judged ? judgeGyro(y.yaw_rate, wheels, step) : GyroEvidence{};
  const AccelerationEvidence a = accelerates ? judgeAcceleration(y, wheels, step) : AccelerationEvidence{};
  if (step > 0.0) compare(g.of, a, wheels.to_stand, step);
  if (judged) learnGyro(y.yaw_rate, wheels, step);
  if (reads) {
    if (!judged) {
      yaw_.restart();
      shifted_.restart();
    }
    yaw_rate_ = y.yaw_rate;
    compared_ = judged && !gyro_;
  }
  if (accelerates) learnAcceleration(y.acceleration_z.has_value(), step);
  difference_change_ = forward_change_ = 0.0;
  decide(step);
}

/// Evidence of the gyro; none while it is excluded.
BodyMonitor::GyroEvidence BodyMonitor::judgeGyro(double yaw_rate, const WheelMotion& wheels, double step) {
  const GyroEvidence g = weighGyro(yaw_rate, wheels, step);
  weighSign(g, step);
  if (!gyro_) return g;
  judgeExcludedGyro(yaw_rate, g, step);
  return {};
}

/// Evidence of the accelerometer; none while it is excluded or the robot is pushed.
BodyMonitor::AccelerationEvidence BodyMonitor::judgeAcceleration(const Observation& y, const WheelMotion& wheels,
                                                                 double step) {
  if (wheels.pushed || said_ == kMoved) {
    forward_.widen();
    vertical_.widen();
  }
  const AccelerationEvidence a = weighAcceleration(y, wheels, step);
  const double jolted = 1.0 / (1.0 + (1.0 / jolts_ - 1.0) * std::exp(a.healthy - a.jolted));
  if (jolted > 0.5) since_jolt_ = 0.0;
  average(jolts_, jolted, step, kJoltsMemory);
  jolts_ = std::clamp(jolts_, kJolts, kJoltsSliding);
  const bool excluded = static_cast<bool>(accelerometer_);
  if (excluded) judgeExcludedAccelerometer(a, step);
  return excluded || wheels.pushed ? AccelerationEvidence{} : a;
}

/// Updates the probabilities of the hypotheses. @param p densities of the gyro.
void BodyMonitor::compare(Densities p, const AccelerationEvidence& a, bool to_stand, double step) {
  const auto jolted = [&a](double share) { return logMixture(share, a.healthy, a.jolted); };
  const double jolts = jolted(jolts_), slides = jolted(kJoltsSliding), no_jolt = std::log1p(-jolts_);
  const auto add = [&p](Hypothesis h, double stays, double begins) {
    p[h].stays += stays;
    p[h].begins += begins;
  };
  for (const Hypothesis h :
       {kHealthy, kOtherGround, kGyroGlitch, kGyroFrozen, kGyroOffset, kGyroShifted, kGyroReversed}) {
    add(h, jolts, jolts);
  }
  add(kSlides, slides, slides);
  add(kStruck, slides, jolted(kJoltsStruck));
  // A push is a constant force, so the acceleration may have an offset. The gyro has to see the motion.
  add(kMoved, half(slides, a.offset), half(jolted(kJoltsMoved), a.offset_begins));
  add(kAccelerometerFrozen, no_jolt + a.frozen, no_jolt + a.frozen);
  add(kAccelerometerOffset, no_jolt + a.offset, no_jolt + a.offset_begins);
  add(kUpsideDown, no_jolt + a.upside_down, no_jolt + a.upside_down);
  filter(p, to_stand, step);
}

/// Probability that the body follows its wheels, and the gyro shows it.
double BodyMonitor::follows() const {
  return alpha_[kHealthy] + alpha_[kOtherGround] + alpha_[kAccelerometerFrozen] + alpha_[kAccelerometerOffset];
}

/// Probability that a yaw rate was measured now, and not held by the gyro or its driver's dead zone.
double BodyMonitor::measuredAnew(double yaw_rate) const {
  return yaw_rate == 0.0 && turning_ ? 0.0 : 1.0 - gyro_repetition_.held(yaw_rate);
}

void BodyMonitor::learnGyro(double yaw_rate, const WheelMotion& wheels, double step) {
  if (gyro_) return gyro_repetition_.update(yaw_rate, 0.0, gyro_kind_, 0.0);
  const double x = wheels.difference.mean, v = wheels.forward.mean;
  const double agrees = follows();
  gyro_offset_.update(gyro_error_, gyro_variance_, fresh_[kGyroOffset], gyro_begins_);
  shifted_.mix(begun_, fresh_[kGyroShifted]);
  slip_offset_.update(gyro_error_, gyro_variance_, fresh_[kOtherGround], x);
  yaw_.widen(std::sqrt(alpha_[kOtherGround] * fresh_[kOtherGround]) * kOtherSlip);
  const double measured = measuredAnew(yaw_rate);
  yaw_.learn(yaw_rate, wheels.difference, v, step, agrees * measured);
  mirrored_.learn(-yaw_rate, wheels.difference, v, step, measured, false);
  if (yaw_rate == 0.0 && !turning_) return gyro_repetition_.pass(yaw_rate);
  gyro_repetition_.update(yaw_rate, std::abs(yaw_.slope() * difference_change_), gyro_kind_, agrees);
}

void BodyMonitor::learnAcceleration(bool vertical, double step) {
  const bool excluded = static_cast<bool>(accelerometer_);
  const double healthy = excluded ? 0.0 : 1.0 - accelerometerFaulty() - alpha_[kMoved], explained = std::abs(rate_);
  forward_.learn(explained, highest_ - lowest_, healthy, fresh_[kAccelerometerOffset], excluded, step);
  if (vertical) vertical_.learn(explained, 0.0, healthy, fresh_[kAccelerometerOffset], excluded, step);
}

/// Probability that nothing is wrong, and nobody moves the robot.
double BodyMonitor::noFault() const { return std::accumulate(alpha_.begin(), alpha_.begin() + kMoved, 0.0); }

void BodyMonitor::filter(const Densities& p, bool to_stand, double step) {
  const auto impossible = [&](int h) {
    switch (h) {
      case kSlides:
        return on_box_;
      case kStruck:
        return on_box_ || to_stand;
      case kMoved:
        return !to_stand;
      case kGyroFrozen:
      case kAccelerometerFrozen:
        return parameters_.frozen_samples == 0;
      default:
        return false;
    }
  };
  const auto leaving = [&](int h) {
    return h == kMoved && !to_stand ? alpha_[h] : alpha_[h] * std::min(1.0, step / kEntries[h].time);
  };
  const double no_fault = noFault(), grounds = kEndsOnGround * leaving(kSlides);
  double back = kLeastRate - grounds;
  for (int h = kHealthy + 1; h < kHypotheses; ++h) back += leaving(h);
  Probabilities next;
  double top = -std::numeric_limits<double>::infinity();
  for (int h = 0; h < kHypotheses; ++h) {
    const double rate = impossible(h) ? 0.0 : kEntries[h].rate;
    const double in = h == kHealthy       ? std::max(back, kLeastRate)
                      : h == kOtherGround ? grounds
                      : rate > 0.0        ? (no_fault * rate + kLeastRate) * step
                                          : 0.0;
    const double remains = h == kHealthy ? alpha_[h] : alpha_[h] - leaving(h);
    const double begun = std::log(in + kNone) + p[h].begins, stayed = std::log(remains + kNone) + p[h].stays;
    next[h] = logSum(begun, stayed);
    fresh_[h] = std::exp(begun - next[h]);
    top = std::max(top, next[h]);
  }
  // Sensors of a robot that is moved are not judged: what they see is its motion.
  if (said_ == kMoved) {
    for (int h = kGyroGlitch; h < kHypotheses; ++h)
      if (h != kMoved) next[h] = -std::numeric_limits<double>::infinity();
  }
  double sum = 0.0;
  for (double& probability : next) sum += probability = std::exp(probability - top);
  for (int h = 0; h < kHypotheses; ++h) alpha_[h] = next[h] / sum;
}

void BodyMonitor::decide(double step) {
  if (said_ == kMoved) {
    good_ = alpha_[kMoved] < 1.0 - kCertainty ? good_ + step : 0.0;
    if (good_ < kShaken) return;
    said_ = kHealthy;
  }
  good_ = 0.0;
  const double no_fault = noFault();
  suspicious_ = 1.0 - no_fault > kDoubt ? suspicious_ + step : 0.0;
  if (suspicious_ == 0.0) return;
  const auto [best, probability] = likeliest(kMoved);
  const double others = 1.0 - no_fault - probability;
  const double risk = kFalseAlarm * no_fault + (best == kMoved ? kOverlooked : 1.0) * others;
  if (risk >= kWaiting * suspicious_) return;
  if (best == kMoved) {
    said_ = kMoved;
  } else {
    exclude(best);
  }
}

void BodyMonitor::exclude(Hypothesis verdict) {
  if (verdict == kGyroOffset && alpha_[kGyroShifted] > alpha_[kGyroOffset]) {
    gyro_offset_ = Offset(square(kOffsetScale), parameters_.largest_bias);  // against what is learned until now
  }
  const Excluded excluded{verdict, -kMostOdds, 0.0};
  const bool of_gyro = verdict <= kGyroReversed;
  if (of_gyro || verdict == kUpsideDown) gyro_ = excluded;
  if (verdict == kGyroOffset) against_ = -kMostOdds;
  if (!of_gyro) {
    accelerometer_ = excluded;
    forward_.widen();
    vertical_.widen();
  }
  forget();
}

void BodyMonitor::Excluded::weigh(double healthy, double faulty, double step, double recovery_time) {
  odds = std::clamp(odds + healthy - faulty, -kMostOdds, kMostOdds);
  good = odds > kSureOdds ? good + step : 0.0;
  if (good >= recovery_time) *this = Excluded{};
}

}  // namespace jackal_aic::faults
