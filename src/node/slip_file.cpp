#include "slip_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "jackal_aic/config/yaml_text.hpp"

namespace jackal_aic {
namespace {

constexpr double kRounding = 1.0 + 1e-6;  // a bound is read again in spite of it
constexpr double kAlphaRange = 2.0 * kRounding;
constexpr double kTurnRange = 4.0 * kRounding;  // the widest robot.track_range; the belief keeps to that of the robot

constexpr std::size_t kCoefficients = 4;
constexpr std::size_t kTriangle = kCoefficients * (kCoefficients + 1) / 2;
constexpr double kLargest = 1e6;  // of a coefficient or a covariance

/// Slip while it is read, with the ranges in which the belief stays.
struct BoundedSlip {
  SlipState slip;
  SlipState configured;
  std::vector<double> turn_coefficients;  ///< empty: nothing known
  std::vector<double> turn_covariance;    ///< lower triangle, row by row
};

template <class Visitor>
void describeFields(Visitor& v, BoundedSlip& p) {
  const double alpha = p.configured.slip_factor;
  v.field("slip_factor", p.slip.slip_factor, {alpha / kAlphaRange, alpha * kAlphaRange}, "", Presence::required);
  // The belief bounds the ratio alpha / b_hat.
  const double track = p.configured.effective_track * p.slip.slip_factor / alpha;
  v.field("effective_track", p.slip.effective_track, {track / kTurnRange, track * kTurnRange}, "m", Presence::required);
  v.field("turn_coefficients", p.turn_coefficients, {-kLargest, kLargest}, kCoefficients, "", Presence::optional);
  v.field("turn_covariance", p.turn_covariance, {-kLargest, kLargest}, kTriangle, "", Presence::optional);
}

/// What a controller had been told of the slip.
struct ToldSlip {
  double slip_factor = 1.0;
  double effective_track = 1.0;  // m
};

template <class Visitor>
void describeFields(Visitor& v, ToldSlip& p) {
  v.field("slip_factor", p.slip_factor, {1e-3, 1e3}, "", Presence::required);
  v.field("effective_track", p.effective_track, {1e-3, 1e3}, "m", Presence::required);
}

/// And of the drive train, which may be slower than what is learned.
struct ToldTiming {
  double dead_time = 0.0;  // s
  double lag = 0.0;        // s
};

template <class Visitor>
void describeFields(Visitor& v, ToldTiming& p) {
  v.field("dead_time", p.dead_time, {0.0, 10.0}, "s", Presence::required);
  v.field("lag", p.lag, {0.0, 10.0}, "s", Presence::required);
}

bool isLearned(const DriveTrainTiming& timing) {
  return timing.dead_time <= kLongestTiming.dead_time && timing.lag <= kLongestTiming.lag;
}

/// As written and read again.
bool alike(double a, double b) { return std::abs(a - b) <= 1e-6 * std::max(std::abs(a), std::abs(b)); }

/// @throws ParameterError if there are too few numbers, or if TurnModel would not take them.
std::optional<TurnCoefficients> turnOf(const BoundedSlip& p) {
  if (p.turn_coefficients.empty() && p.turn_covariance.empty()) return std::nullopt;
  if (p.turn_coefficients.size() != kCoefficients || p.turn_covariance.size() != kTriangle) {
    throw ParameterError(
        fmt::format("slip.turn_coefficients and slip.turn_covariance have {} and {} numbers: must be {} and {}",
                    p.turn_coefficients.size(), p.turn_covariance.size(), kCoefficients, kTriangle));
  }
  TurnCoefficients turn;
  std::size_t next = 0;
  for (int i = 0; i < turn.mean.size(); ++i) {
    turn.mean(i) = p.turn_coefficients[static_cast<std::size_t>(i)];
    for (int j = 0; j <= i; ++j) turn.covariance(i, j) = turn.covariance(j, i) = p.turn_covariance[next++];
  }
  TurnModel(1.0).setCoefficients(turn);
  return turn;
}

BoundedSlip bounded(const SlipState& slip) {
  BoundedSlip p{slip, slip, {}, {}};
  const TurnCoefficients turn = slip.turn.value_or(TurnModel(slip.slip_factor / slip.effective_track).coefficients());
  for (int i = 0; i < turn.mean.size(); ++i) {
    p.turn_coefficients.push_back(turn.mean(i));
    for (int j = 0; j <= i; ++j) p.turn_covariance.push_back(turn.covariance(i, j) + 0.0);  // no -0
  }
  return p;
}

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw ParameterError("slip.file = " + quoted(path) + ": " + what);
}

[[noreturn]] void failBy(const std::string& path, const char* what) {
  fail(path, std::string(what) + ": " + std::strerror(errno));
}

std::string yamlText(const LearnedModel& learned, const LearnedModel& told) {
  std::string text = "# What the predictive controller learned; read at its start, rewritten while it runs.\n" +
                     yamlBlock("slip", bounded(learned.slip));
  if (learned.timing && isLearned(*learned.timing)) text += yamlBlock("drive_train", *learned.timing);
  text += yamlBlock("told_slip", ToldSlip{told.slip.slip_factor, told.slip.effective_track});
  if (told.timing) text += yamlBlock("told_drive_train", ToldTiming{told.timing->dead_time, told.timing->lag});
  return text;
}

/// Writes a file and waits until it is on the disk.
void writeThrough(const std::string& path, const std::string& text) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) return failBy(path, "cannot be written");
  errno = ENOSPC;  // where only a part is written
  const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && fsync(file) == 0;
  close(file);
  if (!written) failBy(path, "cannot be written");
}

void leaveOutOtherSlip(KeptModel& kept, const SlipState& then, const SlipState& now) {
  if (alike(then.effective_track, now.effective_track) && alike(then.slip_factor, now.slip_factor)) return;
  kept.learned.slip = now;
  kept.left_out =
      fmt::format("slip (told an effective track of {:g} m and a slip factor of {:g} then, {:g} m and {:g} now)",
                  then.effective_track, then.slip_factor, now.effective_track, now.slip_factor);
}

void leaveOutOtherTiming(KeptModel& kept, const DriveTrainTiming& then, const DriveTrainTiming& now) {
  if (!kept.learned.timing || (alike(then.dead_time, now.dead_time) && alike(then.lag, now.lag))) return;
  kept.learned.timing.reset();
  if (!kept.left_out.empty()) kept.left_out += "; ";
  kept.left_out += fmt::format("dead time and lag (told {:g} s and {:g} s then, {:g} s and {:g} s now)", then.dead_time,
                               then.lag, now.dead_time, now.lag);
}

}  // namespace

std::optional<KeptModel> readSlipFile(const std::string& path, const LearnedModel& told) {
  std::error_code unknown;
  if (std::filesystem::status(path, unknown).type() == std::filesystem::file_type::not_found) return std::nullopt;
  try {
    ParameterMap map;
    addYamlFile(path, map);
    SlipState configured{told.slip.effective_track, told.slip.slip_factor};
    if (map.hasSection("told_slip")) {
      const auto then = readParameters<ToldSlip>(map, "told_slip");
      configured = {then.effective_track, then.slip_factor};
    }
    auto timing_then = told.timing;
    if (map.hasSection("told_drive_train")) {
      const auto then = readParameters<ToldTiming>(map, "told_drive_train");
      timing_then = {then.dead_time, then.lag};
    }
    auto read = readParameters<BoundedSlip>(map, "slip", {configured, configured, {}, {}});
    KeptModel kept{{read.slip, std::nullopt}, ""};
    if (map.hasSection("drive_train")) kept.learned.timing = readParameters<DriveTrainTiming>(map, "drive_train");
    map.refuseUnknown();
    kept.learned.slip.turn = turnOf(read);
    leaveOutOtherSlip(kept, configured, told.slip);
    if (timing_then && told.timing) leaveOutOtherTiming(kept, *timing_then, *told.timing);
    return kept;
  } catch (const ParameterError& error) {
    fail(path, error.what());
  }
}

void writeSlipFile(const std::string& path, const LearnedModel& learned, const LearnedModel& told) {
  const std::string fresh = path + ".new";
  writeThrough(fresh, yamlText(learned, told));
  if (std::rename(fresh.c_str(), path.c_str()) != 0) failBy(path, "cannot be replaced");
}

SlipWriter::SlipWriter(std::string path, const LearnedModel& learned, const LearnedModel& told)
    : path_(std::move(path)), told_(told) {
  writeNow(learned);
  thread_ = std::thread(&SlipWriter::run, this);
}

void SlipWriter::finish() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ending_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void SlipWriter::write(const LearnedModel& learned) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    due_ = learned;
  }
  changed_.notify_one();
}

std::optional<std::string> SlipWriter::outcome(std::chrono::milliseconds patience) {
  std::unique_lock<std::mutex> lock(mutex_);
  if (!written_.wait_for(lock, patience, [this] { return !due_ && !writing_; })) return std::nullopt;
  return failure_;
}

std::string SlipWriter::failure() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return failure_;
}

void SlipWriter::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return due_ || ending_; });
    if (!due_) return;
    const LearnedModel learned = *std::exchange(due_, std::nullopt);
    writing_ = true;
    lock.unlock();
    writeNow(learned);
    lock.lock();
    writing_ = false;
    written_.notify_all();
  }
}

void SlipWriter::writeNow(const LearnedModel& learned) {
  std::string failure;
  try {
    writeSlipFile(path_, learned, told_);
  } catch (const ParameterError& error) {
    failure = error.what();
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  failure_ = failure;
}

}  // namespace jackal_aic
