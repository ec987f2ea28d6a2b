#include "jackal_aic/faults/yaw_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace jackal_aic {
namespace {

constexpr double kResolution = 1e-7;  // rad/s; smaller changes are no noise

/// Largest rate for which drivers publish exactly zero instead [rad/s]: a robot that stands or drives straight turns by
/// less, and zeros that repeat do not show a frozen gyro.
constexpr double kDeadZone = 0.05;

/// Time for which a gyro that lives does not read zero in a turn beyond that [s].
constexpr double kMissedTurn = 0.3;

/// Time over which a change of the motion makes the slip uncertain [s].
constexpr double kMemory = 0.5;

/// A forward acceleration takes grip from the tyres and changes the slip at once. What changes the speed by kGripScale
/// within kGripMemory (2 m/s^2) makes 1/b_hat uncertain by one slip_deviation.
constexpr double kGripMemory = 0.05;  // s
constexpr double kGripScale = 0.1;    // m/s

/// Change of the motion within kMemory up to which it is none, and how long it has to stay so until the bias is
/// learned.
constexpr double kNoChange = 0.02;  // m/s
constexpr double kSettled = 0.2;    // s

/// Fastest change of the turn that the ground can bring about on a body of this kind [rad/s^2], the same by the turn
/// that the wheels ask for [1/s], and what noise adds, in standard deviations of one sample.
constexpr double kFastestChange = 4.0;
constexpr double kFastestShare = 8.0;
constexpr double kNoise = 5.0;

/// Distance at which a jump has ended: the controller turns the wheels after a gyro that jumped, and the more the
/// motion changes the less is known of the turn.
constexpr double kJumpEnd = 0.8;

/// A robot of four rigid wheels rocks from one to another of them where the ground is uneven, which changes its turn at
/// once, by as much as this, relative, until it rocks back. Such jumps, which end by themselves, are remembered [s];
/// the more there were, the longer the next one may last, up to a limit [s].
constexpr double kRocking = 0.6;
constexpr double kJoltMemory = 600.0;
constexpr double kTimePerJolt = 0.25;
constexpr double kLongestJolt = 1.0;

/// Change of the turn by which one ground differs from another, by the turn that the wheels ask for: up to that of
/// wheels that do not slip sideways, whose track is two thirds of the effective one.
constexpr double kOtherGround = 0.45;

/// Angle by which the ground turns a body against its wheels, as it passes a sill or grazes a kerb [rad], the same in
/// multiples of the bound [s], since a robot whose gyro or slip is known badly is on bad ground, and how long that
/// takes at most [s].
constexpr double kTurnByGround = 0.05;
constexpr double kTurnByBadGround = 0.3;
constexpr double kLongestTurnByGround = 1.0;

/// Number of remembered jolts, and vibration [m/s^2], of ground that may turn the body twice as far.
constexpr double kManyJolts = 4.0;
constexpr double kRoughVibration = 2.0;

/// Turn against the wheels that a sliding body may have, by the turn that they ask for.
constexpr double kAgainst = 0.15;

/// A creeping robot that a sill or a kerb holds on one side turns about it, while its wheels go on: by this much, in
/// multiples of the turn that the forward speed on one side would ask for. Up to this speed [m/s] no accelerometer
/// feels that.
constexpr double kAboutOneSide = 2.0;
constexpr double kCreep = 0.2;

/// Difference of the tyres' radii, relative: as usual, and the largest; and the time over which the bias is learned
/// again that they seem to be, where the speed changes [s].
constexpr double kUnlikeTyres = 0.01;
constexpr double kUnlikeTyresAtMost = 0.03;
constexpr double kTyresMemory = 1.0;

/// Time of turning after which c of TurnAgreement tells the sign of a gyro [s], and c beyond which it is one or the
/// other.
constexpr double kSignTime = 0.5;
constexpr double kSign = 0.5;

/// Standard deviation of the bias of a gyro that was found faulty [rad/s].
constexpr double kFaultyBias = 0.5;

/// Standard deviations of the bias by which it is said to be too large, or not; and of the prediction by which the
/// robot should turn.
constexpr double kSure = 2.0;

/// Time of agreement after which a slip within a plausible factor of the one at the start clears the gyro [s].
constexpr double kLongAgreement = 10.0;
constexpr double kPlausibleSlope = 1.8;

YawBeliefParameters beliefParameters(const FaultParameters& p) {
  YawBeliefParameters belief;
  belief.gyro_variance = p.gyro_variance;
  belief.slip_deviation = p.slip_deviation;
  belief.bias_deviation = 0.5 * p.largest_bias;
  return belief;
}

/// A jolt of the ground turns the body for some samples: to tell a fault takes more of them than of an encoder.
PersistenceParameters slower(PersistenceParameters p) {
  constexpr int kTimes = 2, kLargestWindow = 64;
  p.fault_window = std::min(kTimes * p.fault_window, kLargestWindow);
  p.fault_samples = std::min(kTimes * p.fault_samples, p.fault_window);
  return p;
}

}  // namespace

YawMonitor::YawMonitor(const FaultParameters& parameters, double effective_track)
    : parameters_(parameters),
      belief_(effective_track, beliefParameters(parameters)),
      alternative_(belief_),
      forward_change_(kMemory),
      difference_change_(kMemory),
      timing_(parameters.yaw_delay_deviation),
      grip_(kGripMemory),
      persistence_(slower(parameters.persistence())),
      repetition_(parameters.frozen_samples),
      bound_(chebyshevBound(1, parameters.false_alarm_rate)) {}

void YawMonitor::predict(const double* forward_rates, const double* difference_rates, std::size_t number, double step) {
  RecentChange forward_change = forward_change_, difference_change = difference_change_;
  TimingVariance timing = timing_, grip = grip_;
  // The belief of before a fault waits as it was for the gyro to agree with it again.
  YawBelief& waiting = state() == ChannelState::faulty ? alternative_ : belief_;
  YawBelief belief = waiting;
  double settled = settled_;
  const double slope = belief_.slope();
  for (std::size_t i = 0; i < number; ++i) {
    forward_change.add(forward_rates[i], step);
    difference_change.add(difference_rates[i], step);
    timing.add(slope * difference_rates[i], step);
    grip.add(forward_rates[i], step);
    const double changed = std::abs(forward_change.value()) + std::abs(difference_change.value());
    settled = changed < kNoChange ? settled + step : 0.0;
    const double turn = kUnlikeTyres * slope * forward_change.value();
    belief.predict(changed / YawBelief::kMotionScale, kMemory, step, turn);
  }
  forward_change_ = forward_change;
  difference_change_ = difference_change;
  timing_ = timing;
  grip_ = grip;
  waiting = belief;
  settled_ = settled;
}

void YawMonitor::check(double yaw_rate, const DifferenceSpeed& x, bool moving, const SampleStep& step,
                       const Shock& shock) {
  const bool was_faulty = state() == ChannelState::faulty;
  compare(yaw_rate, x);
  distance_ = distance(error_, variance_);
  frozen_ = isFrozen(yaw_rate, x, moving, step.time);
  watchJumps(yaw_rate, x.value, step.time, shock.push);
  forward_lately_ = std::max(std::abs(x.forward), forward_lately_ * kTyresMemory / (step.time + kTyresMemory));
  // Wheels on the way to an unknown speed do not tell which turn they ask for.
  if (x.value * x.value > x.variance) agreement_of_sign_.update(yaw_rate, belief_.slope() * x.value, step.time);
  if (agreement_of_sign_.turned() > kSignTime && std::abs(agreement_of_sign_.value()) > kSign) {
    reversed_ = agreement_of_sign_.value() < 0.0;
  }
  const bool wrong_for_good = frozen_ || reversed();
  const bool off = distance_ > 1.0 || jumped_;
  const bool sliding = off && !was_faulty && (shock.jolt || slides(x));
  const bool biased = this->biased();
  bool suspect = (off && !sliding) || wrong_for_good || biased;
  if (was_faulty) {
    agreement_ = distanceFrom(alternative_, yaw_rate, x) <= 1.0 ? agreement_ + step.time : 0.0;
    suspect = suspect && (wrong_for_good || !explained(yaw_rate, x));
  }
  sumUp(suspect, step.time);
  persistence_.update(suspect, true, step.time, biased || !byGround(shock.vibration));
  if (wrong_for_good) persistence_.declareFaulty();

  // A gyro that may be frozen at zero does not show how the robot turns.
  const bool zero_in_a_turn = yaw_rate == 0.0 && std::abs(predicted(x)) > kDeadZone;
  if (state() == ChannelState::ok && !sliding && !shock.jolt && !zero_in_a_turn) {
    if (was_faulty && (distance_ > 1.0 || biased)) {
      belief_ = alternative_;
      compare(yaw_rate, x);
    }
    learned_.learn(error_, variance_, step.share);
    // At rest its errors are its noise.
    const double lasts = moving ? step.time : std::numeric_limits<double>::infinity();
    belief_.correct(yaw_rate, x.value, x.variance, learned_.factor(), settled_ > kSettled, lasts);
  } else if (state() == ChannelState::faulty) {
    if (!was_faulty) {
      alternative_ = belief_;
      agreement_ = 0.0;
    }
    if (!was_faulty || distanceFrom(alternative_, yaw_rate, x) > 1.0) alternative_.inflate(kFaultyBias);
    alternative_.correct(yaw_rate, x.value, x.variance, learned_.factor());
  }
}

/// By more than any dead zone.
bool YawMonitor::shouldTurn(const DifferenceSpeed& x) const {
  return std::abs(predicted(x)) - kSure * std::sqrt(learned_.factor() * variance_) > kDeadZone;
}

/// A value that was found frozen is, until it changes.
bool YawMonitor::isFrozen(double yaw_rate, const DifferenceSpeed& x, bool moving, double step) {
  const bool was_frozen = frozen_ && yaw_rate == last_;
  const bool zero = yaw_rate == 0.0, in_dead_zone = zero && !shouldTurn(x);
  zero_in_a_turn_ = zero && !in_dead_zone ? zero_in_a_turn_ + step : 0.0;
  const bool silent = repetition_.update(yaw_rate, moving, in_dead_zone, kResolution);
  const bool missed = parameters_.frozen_samples > 0 && zero_in_a_turn_ > kMissedTurn;
  return was_frozen || silent || missed;
}

/// Adds what is suspect to the turn that nothing explains.
void YawMonitor::sumUp(bool suspect, double step) {
  if (!persistence_.suspecting()) unexplained_ = Unexplained{};
  if (!suspect) return;
  unexplained_.angle += error_ * step;
  unexplained_.distance += std::copysign(distance_, error_) * step;
  unexplained_.time += step;
}

bool YawMonitor::byGround(double vibration) const {
  if (unexplained_.time == 0.0) return true;
  const double rough = 1.0 + std::min(jolts_ / kManyJolts + vibration / kRoughVibration, 1.0);
  const bool far = std::abs(unexplained_.angle) > rough * kTurnByGround &&
                   std::abs(unexplained_.distance) > rough * kTurnByBadGround;
  return !far && unexplained_.time < kLongestTurnByGround;
}

void YawMonitor::restart() {
  settled_ = jump_time_ = jolts_ = forward_lately_ = zero_in_a_turn_ = 0.0;
  jumped_ = frozen_ = reversed_ = false;
  agreement_of_sign_ = {};
  persistence_.reset();
}

double YawMonitor::noise() const { return kNoise * std::sqrt(learned_.factor() * parameters_.gyro_variance); }

/// Away from where it should be, faster than a body can.
bool YawMonitor::jumps(double yaw_rate, double x, double step) const {
  if (distance_ <= 1.0) return false;
  const double fastest = std::max(kFastestChange, kFastestShare * std::abs(belief_.slope() * x));
  const double by = yaw_rate - last_;
  return by * error_ > 0.0 && std::abs(by) > fastest * step + noise();
}

/// A body that the ground throws round goes on from sample to sample, where a gyro jumps from one to the next.
bool YawMonitor::goesOn() const { return std::copysign(1.0, jumped_by_) * error_ - std::abs(jumped_by_) > noise(); }

void YawMonitor::watchJumps(double yaw_rate, double x, double step, bool pushed) {
  const bool jumped = jumped_;
  jumped_ = jumped_ ? distance_ > kJumpEnd : jumps(yaw_rate, x, step);
  if (jumped_ && !jumped) {
    jumped_by_ = error_;
    thrown_ = false;
  }
  // The sample that felt the push may come before or after the one that saw the turn.
  if (pushed && jump_time_ < kAtOnce) jumped_ = false;
  if (jumped_ && jump_time_ < kAtOnce && goesOn()) thrown_ = true;
  jolts_ += (jumped && !jumped_ ? 1.0 : 0.0) - jolts_ * step / kJoltMemory;
  jump_time_ = jumped_ ? jump_time_ + step : 0.0;
  last_ = yaw_rate;
}

bool YawMonitor::slides(const DifferenceSpeed& x) const {
  const double speed = std::abs(x.forward);
  const double part = error_ / (belief_.slope() * x.value);  // of what the wheels ask for
  const bool rocks =
      jumped_ && jump_time_ < std::min(kTimePerJolt * jolts_, kLongestJolt) && std::abs(part) <= kRocking;
  if (rocks || (jumped_ && !thrown_)) return rocks;
  const bool held_at_one_side = speed < kCreep && std::abs(error_) < kAboutOneSide * belief_.slope() * speed;
  return held_at_one_side || (part >= -(1.0 + kAgainst) && part <= kOtherGround);
}

bool YawMonitor::biased() const {
  const double by_tyres = kUnlikeTyresAtMost * belief_.slope() * forward_lately_;
  return std::abs(belief_.bias()) - kSure * std::sqrt(belief_.biasVariance()) > parameters_.largest_bias + by_tyres;
}

bool YawMonitor::explained(double yaw_rate, const DifferenceSpeed& x) const {
  if (distanceFrom(alternative_, yaw_rate, x) > 1.0) return false;
  const double slope = alternative_.relativeSlope();
  const double unsure = kSure * std::sqrt(alternative_.biasVariance());
  const bool by_slip = std::abs(alternative_.bias()) + unsure < parameters_.largest_bias;
  const bool for_long = agreement_ > kLongAgreement && std::max(slope, 1.0 / slope) < kPlausibleSlope &&
                        std::abs(alternative_.bias()) < parameters_.largest_bias;
  return by_slip || for_long;
}

double YawMonitor::variance(const YawBelief& belief, const DifferenceSpeed& x) const {
  const double skid = parameters_.slip_deviation * belief.slope() * x.value / kGripScale;
  return belief.variance(x.value, x.variance) + timing_.value() + skid * skid * grip_.value();
}

void YawMonitor::compare(double yaw_rate, const DifferenceSpeed& x) {
  error_ = belief_.error(yaw_rate, x.value);
  variance_ = variance(belief_, x);
}

double YawMonitor::distance(double error, double variance) const {
  return std::sqrt(learned_.squaredDistance(error, variance)) / bound_;
}

double YawMonitor::distanceFrom(const YawBelief& belief, double yaw_rate, const DifferenceSpeed& x) const {
  return distance(belief.error(yaw_rate, x.value), variance(belief, x));
}

}  // namespace jackal_aic
