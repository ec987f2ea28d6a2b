#include "jackal_aic/predictive/drive_train_learning.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "jackal_aic/model/robot_range.hpp"
#include "jackal_aic/model/square.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

// The grid of lags.
constexpr double kShortestLag = 0.005;  // s; a shorter one looks the same
constexpr double kLagRatio = 1.67;      // of a lag and the next; the longest is 0.5 s

// A motion.
constexpr double kLongest = 2.0;           // s, of a motion that does not settle
constexpr double kApart = 0.015;           // s; least between measurements that count
constexpr double kTurn = 0.3;              // share of a turn, from which a motion is one
constexpr double kMemory = 0.9;            // weight of a motion / weight of the next
constexpr double kSamplesPerValue = 8.0;   // n_0
constexpr double kJitter = 0.002;          // s; deviation of the time of a measurement
constexpr double kModelError = 0.02;       // of any model, relative to the motion
constexpr double kUnexplained = 0.1;       // the same, above which a motion has another cause
constexpr double kNoise = 2.0;             // deviations of the encoders, which nothing explains
constexpr double kLeastGainChange = 0.03;  // of an identified gamma
constexpr double kSureOdds = 0.5 * thresholds::kSure * thresholds::kSure;  // difference of F that chance does not reach

constexpr int kClearlyLess = 2;  // index of a share of the limit, 0.63

// Standard deviations of the prior, and range.
constexpr double kDeadTimeDeviation = 0.08;  // s
constexpr double kShareDeviation = 0.3;
constexpr double kGainDeviation = 0.12;  // of one between 0.8 and 1.2

double lagOf(double index) { return kShortestLag * std::pow(kLagRatio, index); }

double indexOf(double lag) { return std::log(std::max(lag, kShortestLag) / kShortestLag) / std::log(kLagRatio); }

}  // namespace

DriveTrainLearning::DriveTrainLearning(const PlantModel& model, double wheel_radius, double wheel_variance)
    : wheel_radius_(wheel_radius),
      wheel_variance_(wheel_variance),
      identified_(model.identified),
      least_limit_(kShares.back() * model.acceleration_limit),
      limit_(model.acceleration_limit) {
  for (int lag = 0; lag < kLags; ++lag) {
    for (std::size_t run = 0; run < kShares.size(); ++run) fits_.emplace_back(model, lagOf(lag), limit(run));
  }
  setTiming({model.dead_time, model.lag, model.acceleration_limit});
}

void DriveTrainLearning::setTiming(const DriveTrainTiming& timing) {
  timing_ = timing;
  for (DriveTrainFit& fit : fits_) fit.setGain(timing.gain_share);
  timing_.acceleration_limit = std::max(least_limit_, timing.acceleration_limit);
  expected_ = timing_;
  largest_limit_ = identified_ ? timing_.acceleration_limit : kLongestTiming.acceleration_limit;
  turns_memory_.fill(0.0);
  for (DriveTrainFit& fit : fits_) fit.memory.fill({});
  setLimit(timing_.acceleration_limit, 0);
  resetMotion();
}

bool DriveTrainLearning::withdrawGain() {
  resetMotion();
  if (timing_.gain_share == 1.0) return false;
  for (DriveTrainFit& fit : fits_) {
    for (DriveTrainSums& sums : fit.memory) sums = sums.withoutGain();
    fit.setGain(1.0);
  }
  timing_.gain_share = 1.0;
  return true;
}

void DriveTrainLearning::resetMotion() {
  unknown_ = thresholds::kSure * DriveTrainFit::kWashout;  // until the filter has forgotten what was before
  moving_ = false;
  for (DriveTrainFit& fit : fits_) {
    fit.restart(resting_);
    fit.present.fill({});
  }
  beginMotion();
  samples_ = motion_ = lasted_ = 0.0;
  variance_ = wheel_variance_;
}

// ---- run

void DriveTrainLearning::predict(const WheelVector& given) {
  constexpr double part = DriveTrain::kStep / DriveTrainFit::kStep;
  given_ += part * given;
  part_ += part;
  if (part_ < 1.0 - thresholds::kRounding) return;
  for (DriveTrainFit& fit : fits_) fit.step(given_);
  watch(given_);
  part_ = 0.0;
  given_.setZero();
}

/// Follows the commands of the present motion.
void DriveTrainLearning::watch(const WheelVector& given) {
  const bool changes = (given - resting_).cwiseAbs().maxCoeff() > kSpeedRange;
  settled_ = changes ? 0.0 : settled_ + DriveTrainFit::kStep;
  if (changes) resting_ = given;
  moving_ = moving_ || (changes && unknown_ <= 0.0);
  const WheelVector change = given - before_;
  turn_ = std::max(turn_, std::abs(change(1) - change(0)));
  straight_ = std::max(straight_, std::abs(change(1) + change(0)));
}

/// What the wheels do from here on is another motion: whether it is a turn is seen anew.
void DriveTrainLearning::beginMotion() {
  before_ = resting_;
  turn_ = straight_ = 0.0;
}

bool DriveTrainLearning::turns() const { return turn_ > kTurn * (turn_ + straight_); }

bool DriveTrainLearning::correct(const WheelVector& measured, double step) {
  if (step <= 0.0) return false;
  const double decay = std::exp(-step / DriveTrainFit::kWashout);
  const WheelVector change = measured - std::exchange(measured_, measured);
  filtered_ = decay * filtered_ + std::sqrt(decay) * change;
  // A late or early measurement errs by the change of the speed meanwhile.
  const WheelVector jitter = kJitter / step * change;
  weight_ = (1.0 + jitter.array().square() / wheel_variance_).inverse();
  unknown_ -= step;
  const bool stands = resting_.isZero(0.0) && settled_ > 0.0 && measured.cwiseAbs().maxCoeff() < thresholds::kRest;
  if (stands) unknown_ = std::min(unknown_, 0.0);
  if (settled_ > 2.0 * thresholds::kPatience + timing_.dead_time) {
    const bool changed = samples_ > 0.0 && endMotion();
    beginMotion();
    moving_ = false;
    return changed;
  }
  if (!moving_) return false;
  lasted_ += step;
  since_counted_ += step;
  if (since_counted_ < kApart) return false;
  since_counted_ = 0.0;
  count();
  bool changed = takeOver(false);
  changed = raiseLimit() || changed;
  if (lasted_ > kLongest) {
    changed = endMotion() || changed;
    beginMotion();
  }
  return changed;
}

/// Counts the last measurement.
void DriveTrainLearning::count() {
  for (DriveTrainFit& fit : fits_) fit.observe(filtered_, weight_, part_);
  samples_ += weight_.sum();
  motion_ += weight_.dot(filtered_.cwiseAbs2());
  compare();
}

/// Remembers the present motion. True if the timing changed.
bool DriveTrainLearning::endMotion() {
  bool changed = false;
  if (explained()) {
    changed = takeOver(true);
    changed = lowerLimit() || changed;
    const bool turn = turns();
    const double share = weight();
    for (std::size_t i = 0; turn && i < turns_memory_.size(); ++i) {
      double least = HUGE_VAL;
      for (const DriveTrainFit& fit : fits_) least = std::min(least, presentEnergy(fit, i));
      turns_memory_[i] = kMemory * (turns_memory_[i] + least);
    }
    for (DriveTrainFit& fit : fits_) {
      for (std::size_t i = 0; i < fit.memory.size(); ++i) {
        DriveTrainSums sums;
        sums.add(fit.memory[i], kMemory);
        if (!turn) sums.add(fit.present[i], kMemory * share);
        fit.memory[i] = sums;
      }
    }
  }
  for (DriveTrainFit& fit : fits_) fit.present.fill({});
  samples_ = motion_ = lasted_ = 0.0;
  variance_ = wheel_variance_;
  return changed;
}

// ---- compare

/// Weight of the present motion in F.
double DriveTrainLearning::weight() const { return 1.0 / (kSamplesPerValue * variance_); }

/// A drive train of the grid explains the present motion.
bool DriveTrainLearning::explained() const {
  return variance_ * samples_ <= std::max(square(kNoise) * wheel_variance_ * samples_, square(kUnexplained) * motion_);
}

/// Least F along theta = (gamma, o), within its range.
DriveTrainLearning::Minimum DriveTrainLearning::minimum(const DriveTrainSums& sums) const {
  const double gain = timing_.gain_share;  // gamma_0
  Eigen::Matrix2d C = sums.curvature;
  C.diagonal() += Eigen::Vector2d(1.0 / square(kGainDeviation), 1.0 / square(kSpeedRange));
  const Eigen::Vector2d slope = sums.slope + Eigen::Vector2d((1.0 - gain) / square(kGainDeviation), 0.0);
  const Eigen::Matrix2d covariance = C.inverse();
  Eigen::Vector2d change = covariance * slope;
  change(1) = std::clamp(change(1), 0.0, thresholds::kSure * kSpeedRange);
  change(0) = (slope(0) - C(0, 1) * change(1)) / C(0, 0);
  change(0) = std::clamp(change(0), 1.0 / kGainRange - gain, kGainRange - gain);
  const double squares = sums.squares + square((1.0 - gain) / kGainDeviation);
  return {0.5 * (squares + change.dot(C * change) - 2.0 * change.dot(slope)), gain + change(0), covariance(0, 0)};
}

/// F of the present motion alone, without a prior of delta, T and lambda.
double DriveTrainLearning::presentEnergy(const DriveTrainFit& fit, std::size_t late) const {
  DriveTrainSums sums;
  sums.add(fit.present[late], weight());
  return minimum(sums).free_energy;
}

/// F of every drive train.
void DriveTrainLearning::compare() {
  const bool turn = turns();
  const double share = weight();
  by_share_.fill(HUGE_VAL);
  std::array<double, DriveTrainFit::kGrid> of_turn;  // F of the present turn
  of_turn.fill(turn ? HUGE_VAL : 0.0);
  double least = HUGE_VAL, squares = 0.0;  // F with the present motion, and twice that of the motion alone
  for (int lag = 0; lag < kLags; ++lag) {
    const double slower = (lag - indexOf(expected_.lag)) * std::log(kLagRatio);  // ln T has a deviation of 1
    for (std::size_t i = 0; i < DriveTrainFit::kGrid; ++i) {
      const double later =
          (static_cast<double>(i) * DriveTrainFit::kSpacing - expected_.dead_time) / kDeadTimeDeviation;
      Minimum best{HUGE_VAL};
      for (std::size_t run = 0; run < kShares.size(); ++run) {
        const DriveTrainFit& fit = this->fit(lag, run);
        const double weaker = (1.0 - kShares[run]) / kShareDeviation;
        const double prior = 0.5 * (square(slower) + square(later) + square(weaker)) + turns_memory_[i];
        DriveTrainSums all = fit.memory[i];
        all.add(fit.present[i], share);
        Minimum found = minimum(all);
        found.free_energy += prior;
        by_share_[run] = std::min(by_share_[run], found.free_energy);
        if (found.free_energy < least) {
          least = found.free_energy;
          squares = 2.0 * presentEnergy(fit, i);
        }
        if (turn) {
          of_turn[i] = std::min(of_turn[i], presentEnergy(fit, i));
          found = minimum(fit.memory[i]);
          found.free_energy += prior;
        }
        if (found.free_energy < best.free_energy) best = found;
      }
      minima_[static_cast<std::size_t>(lag)][i] = best;
    }
  }
  for (auto& of_lag : minima_) {
    for (std::size_t i = 0; i < of_lag.size(); ++i) of_lag[i].free_energy += of_turn[i];
  }
  variance_ = std::max({wheel_variance_, squares / share / samples_, square(kModelError) * motion_ / samples_});
}

/// Takes over the vertex of a paraboloid through the least F in (delta, ln T), and its gain. During a motion the lag
/// stays: until a ramp ends, a longer dead time looks the same, and a lag too long would let the robot overshoot. What
/// was identified stays until a difference is relevant and chance does not explain it. True if the timing changed.
bool DriveTrainLearning::takeOver(bool ended) {
  if (!explained()) return false;
  // The present lag lies between two of the grid.
  const double index = std::clamp(indexOf(timing_.lag), 0.0, kLags - 1.001);
  const int known = static_cast<int>(index);
  const auto of = [&](int lag, int late) -> const Minimum& {
    return minima_[static_cast<std::size_t>(lag)][static_cast<std::size_t>(late)];
  };
  const auto between = [&](double below, double above) { return below + (index - known) * (above - below); };
  const auto at = [&](int lag, int late) {
    return ended ? of(lag, late).free_energy : between(of(known, late).free_energy, of(known + 1, late).free_energy);
  };
  int lag = 1, late = 1;
  for (int j = 1; j + 1 < DriveTrainFit::kGrid; ++j) {
    for (int i = 1; i + 1 < kLags; ++i) {
      if (at(i, j) < at(lag, late)) lag = i, late = j;
    }
  }
  // F by the indices of dead time and lag, about the least one.
  const auto about = [&](int later, int slower) { return at(lag + slower, late + later) - at(lag, late); };
  const Eigen::Vector2d gradient(0.5 * (about(1, 0) - about(-1, 0)), 0.5 * (about(0, 1) - about(0, -1)));
  const double across = 0.25 * (about(1, 1) - about(1, -1) - about(-1, 1) + about(-1, -1));
  Eigen::Matrix2d H;
  H << about(1, 0) + about(-1, 0), across, across, ended ? about(0, 1) + about(0, -1) : 1.0;
  if (H(0, 0) <= 0.0 || H.determinant() <= 0.0) return false;
  const Eigen::Vector2d vertex = (-H.inverse() * gradient).cwiseMax(-1.0).cwiseMin(1.0);
  DriveTrainTiming found = timing_;
  if (ended) found.lag = std::min(lagOf(lag + vertex(1)), kLongestTiming.lag);
  found.dead_time = std::clamp(DriveTrainFit::kSpacing * (late + vertex(0)), 0.0, kLongestTiming.dead_time);
  const Eigen::Vector2d away((timing_.dead_time - found.dead_time) / DriveTrainFit::kSpacing,
                             indexOf(timing_.lag) - indexOf(found.lag));
  const double later = found.dead_time - timing_.dead_time, slower = found.lag - timing_.lag;
  const bool relevant =
      std::max({std::abs(later), std::abs(later + slower), 0.5 * std::abs(slower)}) > 0.5 * DriveTrainFit::kSpacing;
  if (identified_ && (!relevant || 0.5 * away.dot(H * away) < kSureOdds)) found = timing_;
  const Minimum& below = of(ended ? lag : known, late);
  const double gain = ended ? below.gain : between(below.gain, of(known + 1, late).gain);
  const double least_change =
      identified_ ? std::max(kLeastGainChange, std::sqrt(2.0 * kSureOdds * below.gain_variance)) : 0.0;
  if (std::abs(gain - timing_.gain_share) > least_change) {
    found.gain_share = gain;
    for (DriveTrainFit& fit : fits_) fit.setGain(gain);
  }
  const bool changed =
      found.dead_time != timing_.dead_time || found.lag != timing_.lag || found.gain_share != timing_.gain_share;
  timing_ = found;
  return changed;
}

/// Tries a higher acceleration limit once the wheels follow the present one and not clearly less. True if it changed.
bool DriveTrainLearning::raiseLimit() {
  const double limit = std::min(limit_ / kShares.back(), largest_limit_);
  const double of_less = *std::min_element(by_share_.begin() + kClearlyLess, by_share_.end());
  if (!explained() || of_less - by_share_[0] < kSureOdds || limit <= limit_) return false;
  return setLimit(limit, 0);
}

/// Takes a lower acceleration limit at the end of a motion: during a ramp, a small gain looks the same. True if it
/// changed.
bool DriveTrainLearning::lowerLimit() {
  const auto best = static_cast<std::size_t>(std::min_element(by_share_.begin(), by_share_.end()) - by_share_.begin());
  if (by_share_[0] - by_share_[best] < kSureOdds) return false;
  double share = kShares[best];
  if (best + 1 < kShares.size()) {
    // The grid is even in ln lambda.
    const double above = by_share_[best - 1] - by_share_[best], below = by_share_[best + 1] - by_share_[best];
    share *= std::pow(kShares[1], 0.5 * (above - below) / (above + below));
  }
  largest_limit_ = std::max(least_limit_, share * limit_);
  return largest_limit_ < limit_ && setLimit(largest_limit_, best);
}

/// Sets the limit that the motors seem to have [m/s^2], which the runs of one share have followed so far. True if the
/// timing changed: an identified limit stays.
bool DriveTrainLearning::setLimit(double limit, std::size_t same) {
  limit_ = limit;
  for (int lag = 0; lag < kLags; ++lag) {
    fit(lag, 0).become(fit(lag, same), this->limit(0));
    for (std::size_t run = 1; run < kShares.size(); ++run) fit(lag, run).become(fit(lag, 0), this->limit(run));
  }
  if (!identified_) timing_.acceleration_limit = limit;
  return !identified_;
}

}  // namespace jackal_aic
