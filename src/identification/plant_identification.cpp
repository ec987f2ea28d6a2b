#include "jackal_aic/identification/plant_identification.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "wheel_fit.hpp"

namespace jackal_aic {
namespace {

using namespace identification;

constexpr double kLeastCommand = 0.5;       // rad/s, commands below this excite nothing
constexpr int kLeastSteps = 2;              // changes of the command
constexpr std::size_t kLeastSamples = 100;  // wheel samples, 2 s at 50 Hz
constexpr double kLeastDifference = 0.5;    // rad/s between the sides, to count as a turn
constexpr int kLeastTurnSamples = 25;
// Range of effective track / wheel radius, for a slip factor of 1. Skid-steer robots have about 6. Their wheels are
// further apart than one is high, and a turn makes the track at most five times as wide.
constexpr double kSmallestTrack = 2.0, kLargestTrack = 20.0;
constexpr double kGap = 0.5;            // s without wheel speeds or without commands, at which a recording is cut
constexpr double kLeastStretch = 1.5;   // s, shortest usable part between two gaps
constexpr double kUnknownStart = 0.6;   // s at the start of a part, in which commands act that were sent before it
constexpr double kLeastMotion = 0.05;   // wheel speed / command (RMS), below which a wheel never turns
constexpr double kOpposed = -0.5;       // correlation of wheel and command, below which one of them is inverted
constexpr double kExchanged = 0.3;      // correlation by which the other side's command explains a wheel better
constexpr double kLeastRSquared = 0.9;  // share of the variance of the wheel speeds that the model has to explain
constexpr double kClipped = 0.9;        // sum of squares with / without clipping, below which the motors are clipped
constexpr double kUnexplained = 0.5;    // residual / deviation of the wheel speeds, above which a block is cut
constexpr double kUnusual = 5.0;        // residual / median residual of the blocks, above which a block is cut
constexpr double kLeastOffset = 0.05;   // rad/s, least offset that is reported
constexpr double kLargestUnexplained = 0.5;  // share of the time

using Component = double WheelCommand::*;

template <class Sample>
void checkSeries(const std::vector<Sample>& series, const char* name, std::size_t least) {
  if (series.size() < least) {
    throw IdentificationError(fmt::format("{}: {} samples, at least {} are needed", name, series.size(), least));
  }
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (!std::isfinite(series[i].time)) throw IdentificationError(std::string(name) + ": a stamp is not finite");
    if (i > 0 && series[i].time < series[i - 1].time) {
      throw IdentificationError(fmt::format("{}: stamps are not monotonic ({:.3f} s is followed by {:.3f} s)", name,
                                            series[i - 1].time, series[i].time));
    }
  }
}

void checkValue(const char* name, double time, double value, double largest) {
  if (!std::isfinite(value)) {
    throw IdentificationError(fmt::format("{} at {:.3f} s: a value is not finite", name, time));
  }
  if (std::abs(value) <= largest) return;
  throw IdentificationError(
      fmt::format("{} = {:g} rad/s at {:.3f} s: must be within +-{:g} rad/s", name, value, time, largest));
}

void checkValues(const DriveRecording& recording) {
  constexpr double kFastestWheel = 1e4, kFastestTurn = 1e3;  // rad/s; no robot is as fast
  for (const auto& c : recording.commands) {
    for (const double value : {c.command.left, c.command.right})
      checkValue("wheel commands", c.time, value, kFastestWheel);
  }
  for (const auto& w : recording.wheels) {
    for (const double value : {w.speed.left, w.speed.right}) checkValue("wheel speeds", w.time, value, kFastestWheel);
  }
  for (const auto& y : recording.yaw) checkValue("yaw rate", y.time, y.yaw_rate, kFastestTurn);
}

/// Median of some values; 0 without any.
double medianOf(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Replaces values that jump away from those before and behind them, and back, by the median of the five around them.
/// @param value the value of a sample; @param least smallest jump beyond any noise. @returns the number of spikes.
template <class Sample, class Value>
std::size_t mendSpikes(std::vector<Sample>& series, double least, const Value& value) {
  constexpr std::size_t kSide = 2;    // samples of a median on either side
  constexpr double kUnlikely = 12.0;  // least distance from the local median, in median distances
  constexpr std::size_t kRare = 20;   // samples for each spike; more frequent jumps are no spikes
  if (series.size() <= 2 * kSide) return 0;
  std::vector<Sample> mended = series;
  const auto medianAt = [&](std::size_t i) {
    std::vector<double> around;
    for (std::size_t j = i - kSide; j <= i + kSide; ++j) around.push_back(value(mended[j]));
    return medianOf(std::move(around));
  };
  std::vector<double> distances;
  for (std::size_t i = kSide; i + kSide < series.size(); ++i) {
    distances.push_back(std::abs(value(mended[i]) - medianAt(i)));
  }
  const double bound = std::max(least, kUnlikely * medianOf(std::move(distances)));
  std::size_t spikes = 0;
  for (std::size_t i = kSide; i + kSide < series.size(); ++i) {
    const double median = medianAt(i);  // of the values before, without their spikes
    if (std::abs(value(mended[i]) - median) <= bound) continue;
    value(mended[i]) = median;
    ++spikes;
  }
  if (spikes * kRare > series.size()) return 0;
  series = std::move(mended);
  return spikes;
}

/// A recording without its spikes, with a remark on them.
DriveRecording withoutSpikes(DriveRecording recording) {
  constexpr double kLeastWheel = 0.5, kLeastYaw = 0.2;  // rad/s
  std::size_t wheels = 0;
  for (const Component side : {&WheelCommand::left, &WheelCommand::right}) {
    wheels += mendSpikes(
        recording.wheels, kLeastWheel, [side](auto& sample) -> auto& { return sample.speed.*side; });
  }
  const std::size_t yaw = mendSpikes(
      recording.yaw, kLeastYaw, [](auto& sample) -> auto& { return sample.yaw_rate; });
  const auto remark = [&](std::size_t spikes, const char* name, std::size_t samples) {
    if (spikes == 0) return;
    recording.remarks.push_back(fmt::format("spikes: {} of {} {} left out", spikes, samples, name));
  };
  remark(wheels, "wheel speeds", 2 * recording.wheels.size());
  remark(yaw, "yaw rates", recording.yaw.size());
  return recording;
}

/// The times of two series that do not overlap; empty if they do.
template <class One, class Other>
std::string apartText(const std::vector<One>& one, const std::vector<Other>& other) {
  if (one.empty() || other.empty()) return "";
  if (one.front().time <= other.back().time && other.front().time <= one.back().time) return "";
  return fmt::format("do not overlap in time ({:.3f} to {:.3f} s, {:.3f} to {:.3f} s)", one.front().time,
                     one.back().time, other.front().time, other.back().time);
}

/// Changes of one side's command.
int commandSteps(const DriveRecording& recording, Component side) {
  int steps = 0;
  double previous = 0.0;
  for (const auto& sample : recording.commands) {
    const double command = sample.command.*side;
    if (std::abs(command - previous) < kLeastCommand) continue;
    ++steps;
    previous = command;
  }
  return steps;
}

/// Both sides share one drive train, so both have to be excited.
void checkExcitation(const DriveRecording& recording) {
  const int left = commandSteps(recording, &WheelCommand::left), right = commandSteps(recording, &WheelCommand::right);
  if (left >= kLeastSteps && right >= kLeastSteps) return;
  const char* side = left >= kLeastSteps ? " of the right wheels" : right >= kLeastSteps ? " of the left wheels" : "";
  throw IdentificationError(
      fmt::format("wheel commands: no excitation{} ({} steps of {:g} rad/s or more, at least {} are needed)", side,
                  std::min(left, right), kLeastCommand, kLeastSteps));
}

/// A stretch of constant command that the wheel had time to answer.
struct Plateau {
  double command;  ///< [rad/s]
  double speed;    ///< mean measured wheel speed at its end [rad/s]
};

/// Plateaus of one wheel: commands held for at least 0.8 s, answered by the mean over their last 0.2 s.
std::vector<Plateau> plateaus(const DriveRecording& recording, Component side) {
  constexpr double kHeld = 0.8, kMean = 0.2;
  std::vector<Plateau> found;
  for (std::size_t i = 0; i < recording.commands.size();) {
    const double command = recording.commands[i].command.*side;
    std::size_t end = i;
    while (end < recording.commands.size() && recording.commands[end].command.*side == command) ++end;
    const double stop = end < recording.commands.size() ? recording.commands[end].time : recording.wheels.back().time;
    if (std::abs(command) >= kLeastCommand && stop - recording.commands[i].time >= kHeld) {
      double sum = 0.0;
      int count = 0;
      auto wheels = std::upper_bound(recording.wheels.begin(), recording.wheels.end(), stop - kMean,
                                     [](double time, const WheelSample& sample) { return time < sample.time; });
      for (; wheels != recording.wheels.end() && wheels->time <= stop; ++wheels) {
        sum += wheels->speed.*side;
        ++count;
      }
      if (count > 0) found.push_back({command, sum / count});
    }
    i = end;
  }
  return found;
}

/// Wheel speed at which the motors may be clipped: where the fastest plateaus fall short of the gain of the slower
/// ones. Infinite if none does. Plateaus are few and noisy: a fit has to confirm it.
double clippedSpeed(const DriveRecording& recording) {
  std::vector<Plateau> all = plateaus(recording, &WheelCommand::left);
  const auto right = plateaus(recording, &WheelCommand::right);
  all.insert(all.end(), right.begin(), right.end());
  if (all.size() < 2) return HUGE_VAL;
  std::sort(all.begin(), all.end(),
            [](const Plateau& a, const Plateau& b) { return std::abs(a.command) < std::abs(b.command); });
  const auto ratio = [](const Plateau& p) { return p.speed / p.command; };
  const double slow = ratio(all.front()), fast = ratio(all.back());
  return fast < 0.93 * slow ? std::abs(all.back().speed) : HUGE_VAL;
}

/// Remarks on unexplained driving and on clipped motors.
void remarkOnCommands(const DriveRecording& recording, double speed_limit, std::vector<std::string>& remarks) {
  double fastest = 0.0, slowest = 0.0;
  for (const auto& sample : recording.commands) {
    fastest = std::max({fastest, sample.command.left, sample.command.right});
    slowest = std::min({slowest, sample.command.left, sample.command.right});
  }
  if (slowest > -kLeastCommand) remarks.push_back("one-sided: the wheels were only driven forward");
  if (fastest < kLeastCommand) remarks.push_back("one-sided: the wheels were only driven backward");
  if (std::isfinite(speed_limit)) {
    remarks.push_back(
        fmt::format("clipped: the wheels did not get beyond {:g} rad/s although up to {:g} rad/s were "
                    "commanded; the gain holds below the clipping",
                    speed_limit, std::max(fastest, -slowest)));
  }
}

/// The parts of a recording between its gaps; parts that are too short are left out, with a remark.
std::vector<Stretch> stretchesOf(const DriveRecording& recording, std::vector<std::string>& remarks) {
  const auto& wheels = recording.wheels;
  const auto& commands = recording.commands;
  std::vector<Stretch> stretches;
  int gaps = 0;
  double used = 0.0;
  std::size_t next = 0;  // command behind those sent up to now
  const double first = std::max(wheels.front().time, commands.front().time);
  std::size_t i = 0;
  while (i < wheels.size() && wheels[i].time < first) ++i;
  while (i < wheels.size()) {
    while (next < commands.size() && commands[next].time <= wheels[i].time) ++next;
    Stretch stretch;
    stretch.begin = i;
    stretch.commands.push_back(commands[next - 1]);
    double last_command = commands[next - 1].time;
    for (; i < wheels.size(); ++i) {
      if (i > stretch.begin && wheels[i].time - wheels[i - 1].time > kGap) break;
      bool silent = false;
      for (; next < commands.size() && commands[next].time <= wheels[i].time; ++next) {
        silent = silent || commands[next].time - last_command > kGap;
        if (silent) break;
        last_command = commands[next].time;
        if (!(commands[next].command == stretch.commands.back().command)) stretch.commands.push_back(commands[next]);
      }
      if (silent || wheels[i].time - last_command > kGap) break;
    }
    stretch.end = i;
    if (stretch.end > stretch.begin) {
      const double length = wheels[stretch.end - 1].time - wheels[stretch.begin].time;
      if (length >= kLeastStretch) {
        used += length;
        stretches.push_back(std::move(stretch));
      }
    }
    if (i >= wheels.size()) break;
    ++gaps;
    // Advances to the first wheel sample with a fresh command.
    for (; i < wheels.size(); ++i) {
      while (next < commands.size() && commands[next].time <= wheels[i].time) ++next;
      if (wheels[i].time - commands[next - 1].time <= kGap) break;
    }
  }
  if (gaps > 0) {
    remarks.push_back(
        fmt::format("cut: {} gap{} of more than {:g} s in the wheel speeds or the commands; {:.1f} s used", gaps,
                    gaps == 1 ? "" : "s", kGap, used));
  }
  if (stretches.empty()) {
    throw IdentificationError(fmt::format(
        "wheel speeds and commands: no {:g} s together without a gap of {:g} s or more", kLeastStretch, kGap));
  }
  return stretches;
}

/// Mean of the intervals that are about as long as the median one; 0 without any. [s]
double usualInterval(const std::vector<double>& intervals) {
  if (intervals.empty()) return 0.0;
  const double median = medianOf(intervals);
  double sum = 0.0, count = 0.0;
  for (const double interval : intervals) {
    if (interval < 0.5 * median || interval > 1.5 * median) continue;
    sum += interval;
    count += 1.0;
  }
  return sum / count;
}

/// Time between the samples of a series [s].
template <class Sample>
double samplePeriod(const std::vector<Sample>& series) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < series.size(); ++i) {
    if (series[i].time > series[i - 1].time) intervals.push_back(series[i].time - series[i - 1].time);
  }
  return usualInterval(intervals);
}

/// Rate of fresh wheel speeds: a driver that reads its motors less often than it publishes repeats them.
struct Sampling {
  double period = 0.0;                                  ///< of the samples [s]
  double renewal = 0.0;                                 ///< of the measurements [s]
  bool held() const { return renewal > 1.5 * period; }  ///< samples repeat a measurement
  /// Largest difference between the age of a measurement and the mean age, which is part of the dead time [s].
  double doubt() const { return held() ? 0.5 * (renewal + period) : 0.0; }
};

/// Encoders in coarse steps repeat slow changes, too. Only between two changes of more than some steps, as while a
/// wheel comes to speed, is a repeated value a held one.
Sampling samplingOf(const std::vector<WheelSample>& wheels) {
  constexpr double kSteps = 4.0;
  constexpr std::size_t kLeast = 10;
  const auto change = [&](std::size_t i) {
    return (wheels[i].speed.vector() - wheels[i - 1].speed.vector()).cwiseAbs().eval();
  };
  double step = HUGE_VAL;  // smallest change, rad/s
  for (std::size_t i = 1; i < wheels.size(); ++i) {
    for (const double side : change(i)) step = side > 0.0 ? std::min(step, side) : step;
  }
  std::vector<double> intervals;
  double last = -HUGE_VAL;  // time of the change before, if it was a large one
  for (std::size_t i = 1; i < wheels.size(); ++i) {
    const double most = change(i).maxCoeff();
    if (most <= 0.0) continue;
    const bool large = most > kSteps * step;
    if (large && std::isfinite(last)) intervals.push_back(wheels[i].time - last);
    last = large ? wheels[i].time : -HUGE_VAL;
  }
  const double period = samplePeriod(wheels);
  return {period, intervals.size() < kLeast ? period : usualInterval(intervals)};
}

/// Sample rate of a controller, rounded so that a certificate finds a common period with the action [Hz].
double sensorRate(const DriveRecording& recording, const Sampling& sampling) {
  constexpr double kNear = 0.025, kSlowest = 1.0, kFastest = 1000.0;  // of the rate; Hz
  const double period = std::max(sampling.period, samplePeriod(recording.yaw));
  const double rate = std::clamp(1.0 / std::max(period, 1e-6), kSlowest, kFastest);
  for (const double step : {50.0, 25.0, 10.0, 5.0, 2.0, 1.0}) {
    const double round = step * std::round(rate / step);
    if (std::abs(round - rate) <= kNear * rate) return round;
  }
  return std::round(10.0 * rate) / 10.0;
}

/// Which samples a fit can count: those whose commands are known.
std::vector<char> knownSamples(const DriveRecording& recording, const std::vector<Stretch>& stretches) {
  std::vector<char> counts(recording.wheels.size(), kNeither);
  for (const Stretch& stretch : stretches) {
    const double start = recording.wheels[stretch.begin].time + kUnknownStart;
    for (std::size_t i = stretch.begin; i < stretch.end; ++i)
      counts[i] = recording.wheels[i].time >= start ? kBoth : kNeither;
  }
  return counts;
}

/// Remarks on held wheel speeds; refuses those that are too few measurements.
void checkHeld(const DriveRecording& recording, const Sampling& sampling, std::vector<std::string>& remarks) {
  if (!sampling.held()) return;
  const std::string held = fmt::format("the wheel speeds are renewed every {:.3f} s only, in samples every {:.3f} s",
                                       sampling.renewal, sampling.period);
  const auto measurements =
      std::lround(static_cast<double>(recording.wheels.size()) * sampling.period / sampling.renewal);
  if (measurements < static_cast<long>(kLeastSamples)) {
    throw IdentificationError(
        fmt::format("{}: {} measurements, at least {} are needed", held, measurements, kLeastSamples));
  }
  remarks.push_back(
      fmt::format("held: {}: the dead time is for values of mean age, its interval covers fresh values", held));
}

/// Likeness of a wheel speed and the command of a side some time before.
struct Likeness {
  double correlation = 0.0;  ///< of the two, about zero
  double gain = 1.0;         ///< wheel speed / command
  double motion = 0.0;       ///< RMS of the wheel's speed / RMS of the command; infinite without a command
};

/// Likeness at the delay at which it is largest.
Likeness likeness(const WheelFit& fit, Component wheel, Component command) {
  constexpr double kDelayStep = 0.04, kLongestDelay = 0.5;  // s
  Likeness best;
  for (double delay = 0.0; delay <= kLongestDelay; delay += kDelayStep) {
    double uu = 0.0, uw = 0.0, ww = 0.0;
    for (const Stretch& stretch : fit.stretches) {
      std::size_t next = 0;
      for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
        const double sent = fit.wheels[i].time - delay;
        while (next < stretch.commands.size() && stretch.commands[next].time <= sent) ++next;
        if (fit.counts[i] == 0 || next == 0) continue;
        const double u = stretch.commands[next - 1].command.*command, w = fit.wheels[i].speed.*wheel;
        uu += u * u;
        uw += u * w;
        ww += w * w;
      }
    }
    if (uu <= 0.0) return {0.0, 1.0, HUGE_VAL};
    const double correlation = uw / std::sqrt(uu * std::max(ww, 1e-12));
    if (std::abs(correlation) > std::abs(best.correlation)) best = {correlation, uw / uu, std::sqrt(ww / uu)};
  }
  return best;
}

/// Refuses wheels that never turn, turn the other way, or follow the other side's command. @return initial gain of the
/// search.
double checkWheels(const WheelFit& fit) {
  const Component left = &WheelCommand::left, right = &WheelCommand::right;
  const Likeness l = likeness(fit, left, left), r = likeness(fit, right, right);
  const bool left_still = l.motion < kLeastMotion, right_still = r.motion < kLeastMotion;
  if (left_still || right_still) {
    throw IdentificationError(
        fmt::format("{} never turn although they are commanded (motors off, emergency stop, or another topic?)",
                    left_still && right_still ? "the wheels"
                    : left_still              ? "the left wheels"
                                              : "the right wheels"));
  }
  const Likeness lr = likeness(fit, left, right), rl = likeness(fit, right, left);
  if (lr.correlation > std::abs(l.correlation) + kExchanged && rl.correlation > std::abs(r.correlation) + kExchanged) {
    throw IdentificationError(fmt::format(
        "left and right are exchanged: each side's wheels follow the other side's command (correlation {:.2f}, with "
        "their own {:.2f})",
        std::min(lr.correlation, rl.correlation), std::max(l.correlation, r.correlation)));
  }
  const bool left_opposed = l.correlation < kOpposed, right_opposed = r.correlation < kOpposed;
  if (left_opposed || right_opposed) {
    throw IdentificationError(
        fmt::format("{} turn against their commands (correlation {:.2f}): wheels or commands are "
                    "inverted",
                    left_opposed && right_opposed ? "the wheels"
                    : left_opposed                ? "the left wheels"
                                                  : "the right wheels",
                    std::min(l.correlation, r.correlation)));
  }
  return std::clamp(0.5 * (l.gain + r.gain), 0.2, 2.5);
}

/// A block of time of a fit.
struct Block {
  std::size_t begin, end;  ///< samples
  double squares = 0.0;    ///< sum of the squared residuals [rad^2/s^2]
  int values = 0;          ///< residuals that count
  double rms() const { return std::sqrt(squares / values); }
};

std::vector<Block> blocksOf(const WheelFit& fit, const Eigen::VectorXd& r) {
  std::vector<Block> blocks;
  for (const Stretch& stretch : fit.stretches) {
    double block_end = -HUGE_VAL;
    for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
      if (fit.counts[i] == 0) continue;
      if (fit.wheels[i].time >= block_end) {
        blocks.push_back({i, i});
        block_end = fit.wheels[i].time + kBlock;
      }
      Block& block = blocks.back();
      block.end = i + 1;
      block.squares += r.segment<2>(static_cast<Eigen::Index>(2 * i)).squaredNorm();
      block.values += 2;
    }
  }
  return blocks;
}

/// Sum of the squared deviations of the wheel speeds that count from their mean.
double totalSquares(const WheelFit& fit) {
  WheelVector sum = WheelVector::Zero(), squares = WheelVector::Zero();
  double count = 0.0;
  for (std::size_t i = 0; i < fit.wheels.size(); ++i) {
    if (fit.counts[i] == 0) continue;
    const WheelVector w = fit.wheels[i].speed.vector();
    sum += w;
    squares += w.cwiseProduct(w);
    count += 1.0;
  }
  return (squares - sum.cwiseProduct(sum) / std::max(count, 1.0)).sum();
}

/// Cuts the blocks that the commands do not explain, and their neighbours: another source drives, or the robot is
/// pushed or held. Returns their time [s].
double cutUnexplained(WheelFit& fit, const Theta& theta) {
  const auto blocks = blocksOf(fit, fit.residuals(theta));
  std::vector<double> rms;
  for (const Block& block : blocks) rms.push_back(block.rms());
  if (rms.empty()) return 0.0;
  const double deviation = std::sqrt(totalSquares(fit) / std::max(1.0, static_cast<double>(fit.size())));
  const double largest = std::max(kUnexplained * deviation, kUnusual * medianOf(rms));
  double cut = 0.0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const std::size_t first = i > 0 ? i - 1 : 0, last = std::min(i + 1, blocks.size() - 1);
    bool cuts = false;
    for (std::size_t k = first; k <= last; ++k) cuts = cuts || rms[k] > largest;
    if (!cuts) continue;
    const Block& block = blocks[i];
    std::fill(fit.counts.begin() + static_cast<std::ptrdiff_t>(block.begin),
              fit.counts.begin() + static_cast<std::ptrdiff_t>(block.end), 0);
    cut += fit.wheels[block.end - 1].time - fit.wheels[block.begin].time;
  }
  return cut;
}

/// Fits, cuts the driving that the commands do not explain, and fits again. @param clipped speed at which the motors
/// may be clipped [rad/s].
Theta fitExplained(WheelFit& fit, double gain, double clipped, std::vector<std::string>& remarks) {
  constexpr int kRounds = 3;
  const double all = static_cast<double>(fit.size());
  Theta theta = searchLeastSquares(fit, gain, true);
  if (std::isfinite(clipped)) {
    const double free = fit.residuals(theta).squaredNorm();
    fit.speed_limit = clipped;
    const Theta with_clipping = searchLeastSquares(fit, gain, true);
    const bool confirmed = fit.residuals(with_clipping).squaredNorm() < kClipped * free;
    if (confirmed) theta = with_clipping;
    if (!confirmed) fit.speed_limit = HUGE_VAL;
  }
  double cut = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    const double more = cutUnexplained(fit, theta);
    if (more <= 0.0) break;
    cut += more;
    const double left_out = 1.0 - static_cast<double>(fit.size()) / all;
    if (left_out > kLargestUnexplained) {
      throw IdentificationError(fmt::format(
          "the commands do not explain the driving in {:.0f} % of the recording (at most {:.0f} % may be cut)",
          100.0 * left_out, 100.0 * kLargestUnexplained));
    }
    theta = searchLeastSquares(fit, gain, true);
  }
  if (cut > 0.0) remarks.push_back(fmt::format("cut: {:.1f} s of driving that the commands do not explain", cut));
  return theta;
}

/// Refuses estimates at the end of the range searched, and wheels that answer before their commands.
void checkRange(const FitResult& found) {
  const auto refuse = [](const char* name, double value, const char* unit) {
    throw IdentificationError(fmt::format(
        "{}: the estimate is at the end of the range searched, {:.4g}{}: the recording does not fit the model", name,
        value, unit));
  };
  const Theta low = lowest(), high = highest();
  const auto at = [&](int i, double bound) { return std::abs(found.theta[i] - bound) < 1e-4 * (high[i] - low[i]); };
  if (found.theta[kDeadTime] + found.half_width[kDeadTime] < 0.0 || at(kDeadTime, low[kDeadTime])) {
    throw IdentificationError(fmt::format(
        "the wheels answer before their commands (dead time {:.4f} +- {:.4f} s): stamps of the wheel speeds "
        "and times of the commands are not of one clock",
        found.theta[kDeadTime], found.half_width[kDeadTime]));
  }
  if (at(kDeadTime, high[kDeadTime])) refuse("dead time", high[kDeadTime], " s");
  if (at(kLag, high[kLag])) refuse("lag", high[kLag], " s");
  if (at(kGain, low[kGain])) refuse("gain", low[kGain], "");
  if (at(kGain, high[kGain])) refuse("gain", high[kGain], "");
  if (at(kLogLimit, low[kLogLimit])) refuse("acceleration limit", std::exp(low[kLogLimit]), " m/s^2");
  if (at(kOffset, low[kOffset])) refuse("offset", low[kOffset], " rad/s");
  if (at(kOffset, high[kOffset])) refuse("offset", high[kOffset], " rad/s");
}

/// A part of a drive, to be compared with the rest.
struct Part {
  const char* name;
  FitResult found;
};
using Parts = std::array<Part, 2>;

/// A part's fit. The uncertain age of values [s] widens its intervals of dead time and lag.
FitResult fitLate(const WheelFit& part, const Theta& theta, double doubt, bool fit_offset = false) {
  FitResult found = fitPart(part, theta, fit_offset);
  found.half_width[kDeadTime] += doubt;
  found.half_width[kLag] += doubt;
  return found;
}

/// Fits of each side alone.
Parts sides(const WheelFit& fit, const Theta& theta, double doubt) {
  const auto only = [&](Counted side) {
    WheelFit part = fit;
    for (char& counts : part.counts) counts &= side;
    return fitLate(part, theta, doubt);
  };
  return {Part{"left", only(kLeft)}, Part{"right", only(kRight)}};
}

/// Separate fits of forward and backward turning wheels, by the sign in the common fit.
Parts directions(const WheelFit& fit, const Theta& theta, double doubt) {
  const auto speeds = fit.simulate(theta);
  const auto only = [&](double sign) {
    WheelFit part = fit;
    for (std::size_t i = 0; i < speeds.size(); ++i) {
      if (sign * speeds[i].left <= 0.0) part.counts[i] &= ~kLeft;
      if (sign * speeds[i].right <= 0.0) part.counts[i] &= ~kRight;
    }
    return fitLate(part, theta, doubt);
  };
  return {Part{"forward", only(1.0)}, Part{"backward", only(-1.0)}};
}

/// Fit of the fresh samples: the first of each held value, whose stamp may be late by up to a sample.
FitResult freshOnes(const WheelFit& fit, const Theta& theta, const Sampling& sampling, bool fit_offset) {
  WheelFit part = fit;
  double renewed = fit.wheels.front().time;  // s
  for (std::size_t i = 1; i < fit.wheels.size(); ++i) {
    // A measurement may be equal to the one before.
    const bool due = fit.wheels[i].time - renewed > sampling.renewal - 0.5 * sampling.period;
    const bool fresh = due || !(fit.wheels[i].speed == fit.wheels[i - 1].speed);
    if (fresh) renewed = fit.wheels[i].time;
    if (!fresh) part.counts[i] = kNeither;
  }
  return fitLate(part, theta, sampling.period, fit_offset);
}

/// True if two parts differ in a parameter by more than their intervals and by a relevant amount.
bool differ(const Parts& parts, int parameter) {
  constexpr std::array<double, 3> kRelevant{0.01, 0.02, 0.03};  // s, s, 1
  const FitResult &a = parts[0].found, &b = parts[1].found;
  const double difference = std::abs(a.theta[parameter] - b.theta[parameter]);
  return difference >
         std::max(kRelevant[static_cast<std::size_t>(parameter)], a.half_width[parameter] + b.half_width[parameter]);
}

bool differ(const Parts& parts) { return differ(parts, kDeadTime) || differ(parts, kLag) || differ(parts, kGain); }

/// Estimates in which parts are compared, by index of a Theta.
std::array<Estimate*, 3> compared(Identification& result) { return {&result.dead_time, &result.lag, &result.gain}; }

/// Widens an interval over that of a part.
void cover(const FitResult& part, int parameter, Estimate& estimate) {
  const double distance = std::abs(part.theta[parameter] - estimate.value);
  estimate.half_width = std::max(estimate.half_width, distance + part.half_width[parameter]);
}

/// Widens the intervals over both parts where they differ, and says so.
void coverBoth(const Parts& parts, Identification& result) {
  constexpr std::array<const char*, 3> kNames{"dead time", "lag", "gain"}, kUnits{" s", " s", ""};
  const auto estimates = compared(result);
  std::vector<std::string> differences;
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    const auto parameter = static_cast<int>(i);
    if (!differ(parts, parameter)) continue;
    for (const Part& part : parts) cover(part.found, parameter, *estimates[i]);
    differences.push_back(fmt::format("{} {:.3f} and {:.3f}{}", kNames[i], parts[0].found.theta[parameter],
                                      parts[1].found.theta[parameter], kUnits[i]));
  }
  if (differences.empty()) return;
  result.remarks.push_back(fmt::format("{} and {} differ: {}; the intervals cover both", parts[0].name, parts[1].name,
                                       fmt::join(differences, ", ")));
}

/// Yaw rate at a time, between the samples before and after it or, where one is missing, that of the nearest.
class YawAt {
 public:
  explicit YawAt(const std::vector<YawSample>& samples) : samples_(samples) {}

  /// False without a sample near the time. @param time [s], not before that of the last call.
  bool at(double time, double& yaw_rate) {
    constexpr double kNear = 0.03, kLongest = 0.15;  // s to the nearest sample, and between two
    if (samples_.empty()) return false;
    while (next_ < samples_.size() && samples_[next_].time < time) ++next_;
    const bool before = next_ > 0, after = next_ < samples_.size();
    if (before && after && samples_[next_].time - samples_[next_ - 1].time <= kLongest) {
      const YawSample &a = samples_[next_ - 1], &b = samples_[next_];
      const double share = b.time > a.time ? (time - a.time) / (b.time - a.time) : 1.0;
      yaw_rate = a.yaw_rate + share * (b.yaw_rate - a.yaw_rate);
      return true;
    }
    if (after && samples_[next_].time - time <= kNear) return yaw_rate = samples_[next_].yaw_rate, true;
    if (before && time - samples_[next_ - 1].time <= kNear) return yaw_rate = samples_[next_ - 1].yaw_rate, true;
    return false;
  }

 private:
  const std::vector<YawSample>& samples_;
  std::size_t next_ = 0;  // first sample at the time or behind it
};

/// Reading of a gyro without a turn.
struct GyroBias {
  double value = 0.0;     ///< [rad/s]
  double variance = 0.0;  ///< of it [(rad/s)^2]
};

/// Yaw rate at standing wheels, by a straight line through the samples with slow wheels, so that slow turns do not
/// count as bias.
GyroBias gyroBias(const DriveRecording& recording) {
  constexpr double kSlowTurn = 0.2;  // rad/s
  constexpr double kUnknown = 0.02;  // rad/s, standard deviation of the bias without any rest
  double n = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0, syy = 0.0;
  std::size_t k = 0;
  for (const auto& sample : recording.yaw) {
    while (k + 1 < recording.wheels.size() && recording.wheels[k + 1].time <= sample.time + 1e-6) ++k;
    const WheelCommand& speed = recording.wheels[k].speed;
    if (speed.vector().cwiseAbs().maxCoeff() > kSlowTurn) continue;
    const double x = speed.right - speed.left;
    n += 1.0;
    sx += x;
    sy += sample.yaw_rate;
    sxx += x * x;
    sxy += x * sample.yaw_rate;
    syy += sample.yaw_rate * sample.yaw_rate;
  }
  if (n < kLeastTurnSamples) return {0.0, kUnknown * kUnknown};
  const double spread = n * sxx - sx * sx;
  const double slope = spread > 0.0 ? (n * sxy - sx * sy) / spread : 0.0;
  const double bias = (sy - slope * sx) / n;
  const double squares = std::max(0.0, syy - bias * sy - slope * sxy);  // of the residuals
  return {bias, squares / (n - 2.0) * (spread > 0.0 ? sxx / spread : 1.0 / n)};
}

/// Effective track of one turn direction by least squares of yaw = r alpha (omega_R - omega_L) / b.
/// @param rolling_radius r alpha [m].
Estimate effectiveTrack(const DriveRecording& recording, double rolling_radius, const GyroBias& bias,
                        double direction) {
  struct Pair {
    double time, x, y;
  };
  std::vector<Pair> pairs;
  int turns = 0;  // samples of wheels that turn
  double sx = 0.0, sxx = 0.0, sxy = 0.0, syy = 0.0;
  YawAt yaw(recording.yaw);
  for (const auto& wheels : recording.wheels) {
    const double difference = wheels.speed.right - wheels.speed.left;
    double yaw_rate = 0.0;
    if (direction * difference < kLeastDifference) continue;
    ++turns;
    if (!yaw.at(wheels.time, yaw_rate)) continue;
    pairs.push_back({wheels.time, rolling_radius * difference, yaw_rate - bias.value});
    const Pair& pair = pairs.back();
    sx += pair.x;
    sxx += pair.x * pair.x;
    sxy += pair.x * pair.y;
    syy += pair.y * pair.y;
  }
  const double smallest = kSmallestTrack * rolling_radius, largest = kLargestTrack * rolling_radius;
  const bool correlated = sxy > -kOpposed * std::sqrt(sxx * syy);
  const std::string apart = apartText(recording.wheels, recording.yaw);
  Estimate track;
  if (recording.yaw.empty()) {
    track.unknown = recording.yaw_unknown;
  } else if (!apart.empty()) {
    track.unknown = "wheel speeds and IMU data " + apart;
  } else if (turns < kLeastTurnSamples) {
    track.unknown = fmt::format("no turn to the {} ({} samples of one, at least {} are needed)",
                                direction > 0 ? "left" : "right", turns, kLeastTurnSamples);
  } else if (pairs.size() < kLeastTurnSamples) {
    track.unknown =
        fmt::format("no IMU data within 0.15 s of turns to the {} but for {} samples, at least {} are needed",
                    direction > 0 ? "left" : "right", pairs.size(), kLeastTurnSamples);
  } else if (sxy < kOpposed * std::sqrt(sxx * syy) && sxy * largest < -sxx) {
    track.unknown = "the yaw rate is opposed to the wheels (IMU upside down, or left and right exchanged?)";
  } else if (sxy * smallest >= sxx || (correlated && sxy * largest <= sxx)) {
    track.unknown = fmt::format(
        "{:.4g} m, must be within {:.3g} to {:.3g} m ({:g} to {:g} wheel radii): is the gyro in rad/s, mounted as "
        "said, "
        "and the wheel radius right?",
        sxx / sxy, smallest, largest, kSmallestTrack, kLargestTrack);
  } else if (sxy * largest <= sxx) {
    track.unknown = "the yaw rate does not follow the wheels (robot on blocks?)";
  } else {
    const double slope = sxy / sxx;  // 1/b
    double meat = 0.0, blocks = 0.0, squares = 0.0;
    forEachBlock(pairs, [&](std::size_t begin, std::size_t end) {
      double score = 0.0;
      for (std::size_t i = begin; i < end; ++i) {
        const double residual = pairs[i].y - slope * pairs[i].x;
        score += pairs[i].x * residual;
        squares += residual * residual;
      }
      meat += score * score;
      blocks += 1.0;
    });
    const double freedom = std::max(1.0, blocks - 1.0);
    const double white = squares / static_cast<double>(pairs.size() - 1) / sxx;
    const double of_bias = bias.variance * sx * sx / (sxx * sxx);
    const double variance = std::max(meat * blocks / freedom / (sxx * sxx), white) + of_bias;
    track.value = 1.0 / slope;
    track.half_width = studentQuantile(freedom) * std::sqrt(variance) / (slope * slope);
  }
  return track;
}

/// An estimate with its interval; unknown if the recording does not depend on it, or its interval is wider than its
/// value. @param resolution an interval up to this width is always accepted.
Estimate estimate(double value, double half_width, double resolution = 0.02) {
  Estimate result{value, half_width, ""};
  if (!std::isfinite(half_width) || half_width > std::max(std::abs(value), resolution)) {
    result.unknown = "the recording does not depend on it";
  }
  return result;
}

/// The acceleration limit, if the fitted wheels ever reached it; else the largest acceleration they reached, as a lower
/// bound.
Estimate accelerationLimit(const WheelFit& fit, const FitResult& found) {
  const double limit = std::exp(found.theta[kLogLimit]);
  double largest = 0.0;  // of the fitted motion, without noise
  const auto speeds = fit.simulate(found.theta);
  for (const Stretch& stretch : fit.stretches) {
    for (std::size_t i = stretch.begin + 1; i < stretch.end; ++i) {
      const double step = fit.wheels[i].time - fit.wheels[i - 1].time;
      if (step <= 0.0) continue;
      const double change = (speeds[i].vector() - speeds[i - 1].vector()).cwiseAbs().maxCoeff();
      largest = std::max(largest, fit.radius * change / step);
    }
  }
  Estimate result = estimate(limit, limit * found.half_width[kLogLimit]);
  if (!result.known()) {
    result.value = largest;
    result.unknown = "never reached; at least the largest acceleration seen";
  }
  return result;
}

}  // namespace

Identification identifyDriveTrain(const DriveRecording& recorded, double wheel_radius, double slip_factor) {
  checkSeries(recorded.commands, "wheel commands", 2);
  checkSeries(recorded.wheels, "wheel speeds", kLeastSamples);
  checkSeries(recorded.yaw, "yaw rate", 0);
  checkValues(recorded);
  const DriveRecording recording = withoutSpikes(recorded);
  const std::string apart = apartText(recording.wheels, recording.commands);
  if (!apart.empty()) throw IdentificationError("wheel speeds and commands " + apart);
  checkExcitation(recording);

  Identification result;
  result.remarks = recording.remarks;
  WheelFit fit{recording.wheels, stretchesOf(recording, result.remarks), {}, wheel_radius};
  const Sampling sampling = samplingOf(recording.wheels);
  checkHeld(recording, sampling, result.remarks);
  fit.counts = knownSamples(recording, fit.stretches);
  const double gain = checkWheels(fit);
  Theta theta = fitExplained(fit, gain, clippedSpeed(recording), result.remarks);
  remarkOnCommands(recording, fit.speed_limit, result.remarks);
  FitResult found = withIntervals(fit, theta, true);
  std::string no_offset;  // why none is known
  if (found.half_width[kOffset] > kLeastCommand) {
    no_offset = "the commands are of one speed only; the gain holds at this speed";
  } else if (differ(directions(fit, theta, sampling.doubt()))) {
    no_offset = "forward and backward differ; the gain is fitted without an offset";
  }
  if (!no_offset.empty()) {
    theta = searchLeastSquares(fit, gain, false);
    found = withIntervals(fit, theta, false);
  }
  result.residual = std::sqrt(fit.residuals(theta).squaredNorm() / static_cast<double>(fit.size()));
  result.r_squared = 1.0 - fit.residuals(theta).squaredNorm() / totalSquares(fit);
  if (!(result.r_squared >= kLeastRSquared)) {
    throw IdentificationError(
        fmt::format("the model leaves {:.0f} % of the variance of the wheel speeds (R^2 = {:.3f}, at least {:g} is "
                    "needed): the wheels do not follow these commands",
                    100.0 * (1.0 - result.r_squared), result.r_squared, kLeastRSquared));
  }
  checkRange(found);

  // Times are resolved by the interval between measurements.
  const double resolution = std::max(0.02, sampling.renewal);
  result.dead_time = estimate(std::max(0.0, theta[kDeadTime]), found.half_width[kDeadTime], resolution);
  result.lag = estimate(theta[kLag], found.half_width[kLag], resolution);
  result.gain = estimate(theta[kGain], found.half_width[kGain]);
  result.offset = {theta[kOffset], no_offset.empty() ? found.half_width[kOffset] : 0.0, no_offset};
  if (sampling.held()) {
    const FitResult fresh = freshOnes(fit, theta, sampling, no_offset.empty());
    const auto estimates = compared(result);
    for (std::size_t i = 0; i < estimates.size(); ++i) cover(fresh, static_cast<int>(i), *estimates[i]);
    if (no_offset.empty()) cover(fresh, kOffset, result.offset);
  }
  coverBoth(sides(fit, theta, sampling.doubt()), result);
  coverBoth(directions(fit, theta, sampling.doubt()), result);
  if (no_offset.empty() && theta[kOffset] > std::max(kLeastOffset, result.offset.half_width)) {
    result.remarks.push_back(
        fmt::format("offset: the wheels turn {:.2f} rad/s slower than gain times command, and stand below a command of "
                    "{:.2f} rad/s",
                    theta[kOffset], theta[kOffset] / theta[kGain]));
  }
  result.acceleration_limit = accelerationLimit(fit, found);
  const GyroBias bias = gyroBias(recording);
  result.track_left = effectiveTrack(recording, wheel_radius * slip_factor, bias, 1.0);
  result.track_right = effectiveTrack(recording, wheel_radius * slip_factor, bias, -1.0);
  const auto speeds = fit.simulate(theta);
  for (std::size_t i = 0; i < speeds.size(); ++i) result.fitted.push_back({recording.wheels[i].time, speeds[i]});
  result.sensor_rate = sensorRate(recording, sampling);
  result.duration = recording.wheels.back().time - recording.wheels.front().time;
  return result;
}

}  // namespace jackal_aic
