#include "jackal_aic/predictive/drive_train_learning.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "jackal_aic/model/robot_range.hpp"
#include "jackal_aic/model/square.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

constexpr std::size_t steps(double time) { return static_cast<std::size_t>(time / DriveTrainFit::kStep + 0.5); }

constexpr double kChange = 0.3;                            // rad/s; a larger command moves a wheel
constexpr std::size_t kUnnoticedSteps = steps(0.06);       // start of a change of the commands, before it is detected
constexpr std::size_t kSettled = steps(0.6);               // after the dead time, until the wheels have settled
constexpr std::size_t kLongest = steps(2.0);               // of a change; a longer one is used as far as it has come
constexpr std::size_t kTransient = steps(1.0);             // until the filter has forgotten an unknown earlier motion
constexpr double kResting = 0.1 / DriveTrainFit::kStep;    // steps before a change; their mean is the initial speed
constexpr double kSpacing = 0.015 / DriveTrainFit::kStep;  // steps; least between measurements that are kept
constexpr int kReviewed = 2;                               // measurements of a run in an inner step
constexpr double kOtherLags[] = {0.0, 0.9, -0.9, 0.0};     // additional starts of a review, of ln T
constexpr double kOtherShares[] = {1.0, 1.0, 1.0, 0.5};    // the same, of lambda
constexpr int kMostRuns = 10;
constexpr double kStepReduction = 0.3;     // factor on a step that did not reduce F
constexpr double kSmallStep = 0.05;        // standard deviations of theta; a smaller step ends the search
constexpr double kMemory = 0.7;            // weight of a change of the commands / weight of the next
constexpr double kSamplesPerValue = 8.0;   // n_0
constexpr double kTurn = 0.3;              // share of a turn, above which a change does not count for the lag
constexpr double kUnexplained = 0.01;      // largest residual of a motion that the model explains, of its squares
constexpr double kNoise = 4.0;             // variances of the encoders, which nothing explains
constexpr double kLeastGainChange = 0.03;  // least relevant change of gamma
constexpr double kLargestDoubt = 0.008;    // s; largest standard deviation of an adopted dead time
constexpr double kShortestLag = 0.002;     // s; below it the speed does not depend on the lag
constexpr double kBoundPrecision = 1e9;    // precision of a parameter at its bound
constexpr double kLeastLimit = 0.5;        // least learned acceleration limit / assumed one
constexpr double kTrialRatio = 2.0;        // tried acceleration / followed acceleration
constexpr double kRamp = 0.1 / DriveTrainFit::kStep;  // steps over which a followed acceleration is measured
constexpr double kFollowedShare = 0.9;                // least lambda of motors that follow
constexpr double kRampTolerance = 0.4;  // relative difference between the commands' ramp and that of the limit
// Range of theta.
constexpr double kLeastShare = 0.3;
constexpr double kLargestOffset = 1.0;  // rad/s
// Standard deviations of delta and theta.
constexpr double kDeadTimeDeviation = 0.08;  // s
constexpr double kLogLagDeviation = 0.7;     // also the range in which the parabola of F is valid
constexpr double kShareDeviation = 0.3;
constexpr double kGainDeviation = 0.1;
constexpr double kOffsetDeviation = 0.3;  // rad/s

DriveTrainVector bounded(const DriveTrainVector& theta) {
  return {std::clamp(theta(kLogLag), std::log(kShortestLag), std::log(kLongestTiming.lag)),
          std::clamp(theta(kLimitShare), kLeastShare, 1.0), std::clamp(theta(kGainShare), 1.0 / kGainRange, kGainRange),
          std::clamp(theta(kOffset), 0.0, kLargestOffset)};
}

}  // namespace

DriveTrainLearning::DriveTrainLearning(const PlantModel& model, double wheel_radius, double wheel_variance)
    : wheel_radius_(wheel_radius),
      wheel_variance_(wheel_variance),
      identified_(model.identified),
      least_limit_(model.identified ? model.acceleration_limit : kLeastLimit * model.acceleration_limit),
      fit_(model, wheel_radius) {
  setTiming({model.dead_time, model.lag, model.acceleration_limit});
}

void DriveTrainLearning::setTiming(const DriveTrainTiming& timing) {
  timing_ = timing;
  timing_.acceleration_limit = identified_ ? least_limit_ : std::max(least_limit_, timing.acceleration_limit);
  fit_.setAccelerationLimit(timing_.acceleration_limit);
  largest_limit_ = kLongestTiming.acceleration_limit;
  expected_log_lag_ = std::log(std::max(timing.lag, kShortestLag));
  theta_ << expected_log_lag_, 1.0, 1.0, 0.0;
  memory_.fill({});
  resetMotion();
}

bool DriveTrainLearning::withdrawGain() {
  resetMotion();
  if (theta_(kGainShare) == 1.0) return false;
  theta_(kGainShare) = 1.0;
  for (DriveTrainSums& kept : memory_) kept = kept.marginalised(kGainShare);
  return std::exchange(timing_.gain_share, 1.0) != 1.0;
}

void DriveTrainLearning::resetMotion() {
  state_ = State::unknown;
  known_ = step_;
  reviewing_ = false;
  learned_.reset();
}

// ---- keep

void DriveTrainLearning::predict(const WheelVector& given) {
  for (int i = 0; reviewing_ && i < kReviewed; ++i) review();
  given_ += given;
  if (++ticks_ < kTicks) return;
  commands_[step_ % kCommands] = given_ / kTicks;
  watch(commands_[step_ % kCommands]);
  ++step_;
  ticks_ = 0;
  given_.setZero();
}

void DriveTrainLearning::watch(const WheelVector& given) {
  const bool changes = (given - resting_).cwiseAbs().maxCoeff() > kChange;
  if (state_ == State::settled && !changes) return;
  if (changes) resting_ = given;
  settled_ = changes ? 0 : settled_ + 1;
  if (state_ == State::changing) return;
  const bool rested = state_ == State::settled;
  first_ = rested ? std::max(known_, step_ - kUnnoticedSteps) : step_;
  counted_ = rested ? first_ : step_ + kTransient;
  state_ = State::changing;
}

std::optional<DriveTrainTiming> DriveTrainLearning::correct(const WheelVector& measured, double step) {
  if (step <= 0.0) return std::nullopt;
  const double time = static_cast<double>(step_) + static_cast<double>(ticks_) / kTicks;
  if (sample_ == 0 || time - samples_[(sample_ - 1) % kSamples].time >= kSpacing) {
    samples_[sample_++ % kSamples] = {measured, time};
  }
  if (!identified_ && !reviewing_ && openLimit()) learned_ = timing_;
  if (state_ == State::changing && step_ > counted_ && (settles() || step_ - counted_ >= kLongest)) endChange();
  return std::exchange(learned_, std::nullopt);
}

bool DriveTrainLearning::settles() const { return settled_ >= kSettled + steps(timing_.dead_time); }

void DriveTrainLearning::endChange() {
  const std::size_t first = first_, counted = counted_, last_change = step_ - settled_;
  if (settles()) {
    state_ = State::settled;
  } else {
    first_ = step_ - kTransient;
    counted_ = step_;
  }
  // Without a change while measurements count, they show only the rest of the last motion; after a long time without
  // measurements its beginning is lost.
  if (reviewing_ || first == 0 || last_change < counted || step_ - first > 2 * kLongest) return;
  change_ = {};
  change_.first = first;
  change_.counted = counted;
  change_.end_sample = sample_;
  change_.resting = restingSpeed(first, change_.first_sample);
  change_.turns = turnShare(first) > kTurn;
  best_.free_energy = HUGE_VAL;
  runs_ = 0;
  reviewing_ = true;
  run(theta_);
}

/// Share of a turn in a change of the commands: 0 on a straight line, 1 turning in place.
double DriveTrainLearning::turnShare(std::size_t first) const {
  double difference = 0.0, sum = 0.0;
  for (std::size_t i = first; i < step_; ++i) {
    const WheelVector change = commands_[i % kCommands] - commands_[(first - 1) % kCommands];
    difference = std::max(difference, std::abs(change(1) - change(0)));
    sum = std::max(sum, std::abs(change(1) + change(0)));
  }
  return difference > 0.0 ? difference / (difference + sum) : 0.0;
}

WheelVector DriveTrainLearning::restingSpeed(std::size_t first, std::size_t& first_sample) const {
  const auto begin = static_cast<double>(first);
  const auto of = [this](std::size_t i) { return samples_[i % kSamples]; };
  first_sample = sample_;
  while (first_sample > 0 && sample_ - first_sample < kSamples && of(first_sample - 1).time > begin) --first_sample;
  WheelVector sum = WheelVector::Zero();
  int count = 0;
  for (std::size_t i = first_sample; i > 0 && of(i - 1).time > begin - kResting && sample_ - i < kSamples; --i) {
    sum += of(i - 1).speed;
    ++count;
  }
  return count > 0 ? WheelVector(sum / count) : of(first_sample).speed;
}

// ---- review

void DriveTrainLearning::run(const DriveTrainVector& theta) {
  fit_.reset(bounded(theta), commands_[(change_.first - 1) % kCommands], change_.resting);
  change_.next_step = change_.first;
  change_.next_sample = change_.first_sample;
  change_.last_time = static_cast<double>(change_.first);
}

void DriveTrainLearning::review() {
  if (change_.next_sample == change_.end_sample) return judge();
  const Sample& sample = samples_[change_.next_sample++ % kSamples];
  const auto until = static_cast<std::size_t>(sample.time);
  for (; change_.next_step < until; ++change_.next_step) fit_.step(commands_[change_.next_step % kCommands]);
  fit_.observe(sample.speed, (sample.time - change_.last_time) * kStep, sample.time - static_cast<double>(until),
               sample.time > static_cast<double>(change_.counted));
  change_.last_time = sample.time;
}

/// Ends a run and continues from the best one.
void DriveTrainLearning::judge() {
  const double free_energy = freeEnergy(fit_);
  const bool better = free_energy < best_.free_energy;
  if (better) best_ = {fit_.theta(), free_energy, fit_.sums(), fit_.samples(), fit_.motion(), fit_.acceleration()};
  ++runs_;
  if (runs_ < static_cast<int>(std::size(kOtherLags))) {
    DriveTrainVector other = theta_;
    other(kLogLag) += kOtherLags[runs_];
    other(kLimitShare) *= kOtherShares[runs_];
    return run(other);
  }
  next_ = better || runs_ == static_cast<int>(std::size(kOtherLags)) ? newtonStep()
                                                                     : DriveTrainVector(kStepReduction * next_);
  const bool small = next_.cwiseAbs().cwiseQuotient(deviations()).maxCoeff() < kSmallStep;
  if (!small && runs_ < kMostRuns) return run(best_.theta + next_);
  learn();
  reviewing_ = false;
}

DriveTrainVector DriveTrainLearning::deviations() const {
  return {kLogLagDeviation, kShareDeviation, kGainDeviation, kOffsetDeviation};
}

/// theta_1
DriveTrainVector DriveTrainLearning::expected() const {
  return {expected_log_lag_, theta_(kLimitShare), theta_(kGainShare), theta_(kOffset)};
}

double DriveTrainLearning::freeEnergy(const DriveTrainFit& fit) const {
  const DriveTrainVector change = fit.theta() - theta_;
  const double n = fit.samples();
  double least = HUGE_VAL;
  for (std::size_t i = 0; i < DriveTrainFit::kGrid; ++i) {
    const double variance = std::max(wheel_variance_, fit.sums()[i].squares / n);
    const double late = static_cast<double>(i) * kStep - timing_.dead_time;
    least = std::min(least, 0.5 * (n / kSamplesPerValue * std::log(variance) + memory_[i].around(change).squares +
                                   square(late / kDeadTimeDeviation)));
  }
  return least + 0.5 * (fit.theta() - expected()).cwiseQuotient(deviations()).squaredNorm();
}

/// Residual sum of squares of the best run, after its Gauss-Newton step.
double DriveTrainLearning::leastSquares() const {
  double least = HUGE_VAL;
  for (const DriveTrainSums& sums : best_.sums) {
    DriveTrainMatrix curvature = sums.curvature / wheel_variance_;
    curvature.diagonal() += deviations().cwiseAbs2().cwiseInverse();
    const DriveTrainVector change = curvature.ldlt().solve(sums.slope / wheel_variance_);
    least = std::min(least, sums.around(change).squares);
  }
  return least;
}

DriveTrainVector DriveTrainLearning::newtonStep() const {
  const double variance = kSamplesPerValue * std::max(wheel_variance_, leastSquares() / best_.samples);
  const DriveTrainVector precision = deviations().cwiseAbs2().cwiseInverse(), far = expected() - best_.theta;
  DriveTrainVector step = DriveTrainVector::Zero();
  double least = HUGE_VAL;
  for (std::size_t i = 0; i < DriveTrainFit::kGrid; ++i) {
    DriveTrainSums sums = memory_[i].around(best_.theta - theta_);
    sums.add(best_.sums[i].over(variance));
    // θ − θ_0 = (Σψψ'/Σ + Π_0)⁻¹ (Σψε/Σ + Π_0 (θ_1 − θ_0)); a parameter at its bound stays there
    DriveTrainVector pinned = precision;
    const DriveTrainVector slope = sums.slope + precision.cwiseProduct(far);
    DriveTrainVector change;
    for (int pass = 0; pass < 2; ++pass) {
      DriveTrainMatrix curvature = sums.curvature;
      curvature.diagonal() += pinned;
      change = curvature.ldlt().solve(slope);
      const DriveTrainVector outside = best_.theta + change - bounded(best_.theta + change);
      for (int k = 0; k < kDriveTrainParameters; ++k) pinned(k) = outside(k) != 0.0 ? kBoundPrecision : pinned(k);
    }
    const double late = static_cast<double>(i) * kStep - timing_.dead_time;
    const double free_energy = 0.5 * (sums.squares - change.dot(slope) + square(late / kDeadTimeDeviation));
    if (free_energy < least) least = free_energy, step = change;
  }
  step(kLogLag) = std::clamp(step(kLogLag), -kLogLagDeviation, kLogLagDeviation);
  return step;
}

// ---- learn

void DriveTrainLearning::learn() {
  const double left = leastSquares(), variance = std::max(wheel_variance_, left / best_.samples);
  const bool explained = left <= std::max(kNoise * wheel_variance_ * best_.samples, kUnexplained * best_.motion);
  DriveTrainVector change = best_.theta - theta_;
  // An unexplained change keeps only its limit, from which the next search starts.
  if (!explained) change(kLogLag) = change(kGainShare) = change(kOffset) = 0.0;
  if (change_.turns) change(kLogLag) = change(kGainShare) = 0.0;
  const bool same = std::abs(change(kLogLag)) < kLogLagDeviation;
  for (DriveTrainSums& kept : memory_) kept = same ? kept.around(change) : DriveTrainSums{};
  theta_ += change;
  if (!explained) return;
  for (std::size_t i = 0; i < memory_.size(); ++i) {
    const DriveTrainSums& sums = best_.sums[i];
    memory_[i].add(
        (change_.turns ? sums.marginalised(kLogLag).marginalised(kGainShare) : sums).over(kSamplesPerValue * variance));
  }
  learned_ = takenOver();
  for (DriveTrainSums& kept : memory_) kept = kept.over(1.0 / kMemory);
  if (!identified_ && learnLimit()) learned_ = timing_;
}

/// True if the acceleration limit changed.
bool DriveTrainLearning::learnLimit() {
  const double now = timing_.acceleration_limit, share = theta_(kLimitShare);
  const bool followed = share >= kFollowedShare;
  if (!followed) largest_limit_ = std::max(least_limit_, share * now);
  const double limit = followed ? std::min(kTrialRatio * best_.acceleration, largest_limit_) : largest_limit_;
  if (limit == now || (followed && limit < now)) return false;
  setLimit(limit);
  return true;
}

/// Raises the limit during a ramp that the wheels follow, before the end of the change. True if the limit changed.
bool DriveTrainLearning::openLimit() {
  std::size_t i = sample_ - 1;
  const Sample& now = samples_[i % kSamples];
  while (i > 0 && sample_ - i < kSamples && now.time - samples_[i % kSamples].time < kRamp) --i;
  const Sample& before = samples_[i % kSamples];
  const double steps = now.time - before.time;
  if (state_ != State::changing || steps < kRamp || steps > 2.0 * kRamp) return false;
  const WheelVector asked =
      commands_[(step_ - 1) % kCommands] - commands_[static_cast<std::size_t>(before.time) % kCommands];
  const WheelVector followed = now.speed - before.speed;
  const double ramp = timing_.acceleration_limit / wheel_radius_ * steps * kStep;
  // Both wheels have to follow. An encoder that shows far more than commanded is wrong and does not count.
  bool ramps = false;
  for (int side = 0; side < 2; ++side) {
    if (std::abs(std::abs(asked(side)) / ramp - 1.0) > kRampTolerance) continue;
    const double share = followed(side) / std::copysign(ramp, asked(side));
    if (share < kFollowedShare || share > kGainRange) return false;
    ramps = true;
  }
  const double limit = std::min(kTrialRatio * timing_.acceleration_limit, largest_limit_);
  if (!ramps || limit <= timing_.acceleration_limit) return false;
  setLimit(limit);
  return true;
}

/// Sets another acceleration limit [m/s^2], and resets the share of the last one.
void DriveTrainLearning::setLimit(double limit) {
  timing_.acceleration_limit = limit;
  fit_.setAccelerationLimit(limit);
  theta_(kLimitShare) = 1.0;
  for (DriveTrainSums& kept : memory_) kept = kept.marginalised(kLimitShare);
}

std::optional<DriveTrainTiming> DriveTrainLearning::takenOver() {
  const int i = std::clamp(bestDeadTime(), 1, DriveTrainFit::kGrid - 2);
  // A parabola through the least F and its neighbours.
  const Minimum before = minimum(i - 1), at = minimum(i), after = minimum(i + 1);
  const double bend = before.free_energy - 2.0 * at.free_energy + after.free_energy;
  const double variance = square(kStep) / bend;
  if (bend <= 0.0 || variance > square(kLargestDoubt)) return std::nullopt;
  const double offset = std::clamp(0.5 * (before.free_energy - after.free_energy) / bend, -1.0, 1.0);
  const DriveTrainTiming found{std::clamp(kStep * (i + offset), 0.0, kLongestTiming.dead_time),
                               std::exp(theta_(kLogLag)), timing_.acceleration_limit, theta_(kGainShare)};
  // Change of the lag with the dead time, and significance of the lag at a known dead time.
  const double along = found.lag * (after.change(kLogLag) - before.change(kLogLag)) / (2.0 * kStep);
  const double alone = square(found.lag) * at.log_lag_variance;
  const auto beyondDoubt = [](double by, double of_variance) {
    return std::abs(by) > std::max(DriveTrainFit::kStep, thresholds::kSure * std::sqrt(of_variance));
  };
  const double later = found.dead_time - timing_.dead_time, slower = found.lag - timing_.lag;
  const double stronger = std::abs(found.gain_share - timing_.gain_share);
  const bool gain = stronger > std::max(kLeastGainChange, thresholds::kSure * std::sqrt(at.gain_variance));
  if (!gain && !beyondDoubt(later, variance) && !beyondDoubt(slower, alone + square(along) * variance) &&
      !beyondDoubt(later + slower, alone + square(1.0 + along) * variance)) {
    return std::nullopt;
  }
  timing_ = found;
  return found;
}

DriveTrainLearning::Minimum DriveTrainLearning::minimum(int i) const {
  const DriveTrainSums& sums = memory_[static_cast<std::size_t>(i)];
  const DriveTrainVector precision = deviations().cwiseAbs2().cwiseInverse();
  DriveTrainMatrix curvature = sums.curvature;
  curvature.diagonal() += precision;
  const DriveTrainVector slope = sums.slope + precision.cwiseProduct(expected() - theta_);
  const auto solver = curvature.ldlt();
  const DriveTrainVector change = solver.solve(slope);
  const double late = i * kStep - timing_.dead_time;
  return {change, 0.5 * (sums.squares - slope.dot(change) + square(late / kDeadTimeDeviation)),
          solver.solve(DriveTrainVector::Unit(kLogLag))(kLogLag),
          solver.solve(DriveTrainVector::Unit(kGainShare))(kGainShare)};
}

int DriveTrainLearning::bestDeadTime() const {
  int best = 0;
  double least = HUGE_VAL;
  for (int i = 0; i < DriveTrainFit::kGrid; ++i) {
    const double candidate = minimum(i).free_energy;
    if (candidate < least) least = candidate, best = i;
  }
  return best;
}

}  // namespace jackal_aic
