#include "parameters/learned_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/yaml.hpp"

namespace jackal_aic {
namespace {

constexpr double kAlphaRange = 2.0, kTrackRange = 4.001;  // to the configured ones; the widest robot.track_range
constexpr double kLargest = 1e6;                          // of a coefficient or a covariance
constexpr std::size_t kCoefficients = 4, kTriangle = kCoefficients * (kCoefficients + 1) / 2;

/// Slip as it stands in the file.
struct KeptSlip {
  SlipState slip, configured;
  std::vector<double> turn_coefficients{};  // empty: nothing known
  std::vector<double> turn_covariance{};    // lower triangle, row by row
};

template <class Visitor>
void describeFields(Visitor& v, KeptSlip& p) {
  const double alpha = p.configured.slip_factor, track = p.configured.effective_track;
  v.field("slip_factor", p.slip.slip_factor, {alpha / kAlphaRange, alpha * kAlphaRange}, "", Presence::required);
  v.field("effective_track", p.slip.effective_track, {track / kTrackRange, track * kTrackRange}, "m",
          Presence::required);
  v.field("turn_coefficients", p.turn_coefficients, {-kLargest, kLargest}, kCoefficients, "", Presence::optional);
  v.field("turn_covariance", p.turn_covariance, {-kLargest, kLargest}, kTriangle, "", Presence::optional);
}

/// A model in words, by the keys below `configured`; the drive train may be empty.
std::array<std::pair<const char*, std::string>, 2> wordsOf(const LearnedModel& model) {
  return {
      {{"slip",
        fmt::format("effective track {:g} m, slip factor {:g}", model.slip.effective_track, model.slip.slip_factor)},
       {"drive_train",
        !model.timing ? "" : fmt::format("dead time {:g} s, lag {:g} s", model.timing->dead_time, model.timing->lag)}}};
}

/// @throws ParameterError if there are too few numbers, or if Turn would not take them.
std::optional<TurnCoefficients> turnOf(const KeptSlip& p) {
  if (p.turn_coefficients.empty() && p.turn_covariance.empty()) return std::nullopt;
  if (p.turn_coefficients.size() != kCoefficients || p.turn_covariance.size() != kTriangle) {
    throw ParameterError(
        fmt::format("slip.turn_coefficients and slip.turn_covariance have {} and {} numbers: must be {} and {}",
                    p.turn_coefficients.size(), p.turn_covariance.size(), kCoefficients, kTriangle));
  }
  TurnCoefficients turn;
  turn.mean = Eigen::Map<const Eigen::Vector4d>(p.turn_coefficients.data());
  auto next = p.turn_covariance.begin();
  for (int i = 0; i < turn.mean.size(); ++i) {
    for (int j = 0; j <= i; ++j) turn.covariance(i, j) = turn.covariance(j, i) = *next++;
  }
  Turn(p.configured, 1.0).setState({p.slip.effective_track, p.slip.slip_factor, turn});  // refuses impossible ones
  return turn;
}

std::string textOf(const LearnedModel& learned, const LearnedModel& configured) {
  KeptSlip kept{learned.slip, configured.slip};
  const TurnCoefficients turn = learned.slip.turn ? *learned.slip.turn : *Turn(learned.slip, 1.0).state().turn;
  kept.turn_coefficients.assign(turn.mean.data(), turn.mean.data() + turn.mean.size());
  for (int i = 0; i < turn.mean.size(); ++i) {
    for (int j = 0; j <= i; ++j) kept.turn_covariance.push_back(turn.covariance(i, j) + 0.0);  // no -0
  }
  std::string text = "# What the predictive controller learned; read at its start, rewritten while it runs.\n" +
                     yamlBlock("slip", kept);
  const auto& timing = learned.timing;  // a robot may be slower than the range of learning
  if (timing && timing->dead_time <= kLongestTiming.dead_time && timing->lag <= kLongestTiming.lag) {
    text += yamlBlock("drive_train", *timing);
  }
  text += "configured:\n";
  for (const auto& [key, words] : wordsOf(configured)) {
    if (!words.empty()) text += fmt::format("  {}: {}\n", key, yamlQuoted(words));
  }
  return text;
}

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw ParameterError("slip.file = " + jackal_aic::quoted(path) + ": " + what);
}

}  // namespace

std::string describe(const LearnedModel& model) {
  const auto words = wordsOf(model);
  return words[0].second + (model.timing ? ", " + words[1].second : "");
}

std::optional<LearnedModel> readLearnedFile(const std::string& path, const LearnedModel& configured) {
  std::error_code unknown;
  if (std::filesystem::status(path, unknown).type() == std::filesystem::file_type::not_found) return std::nullopt;
  try {
    ParameterMap map;
    addYamlFile(path, map);
    for (const auto& [key, now] : wordsOf(configured)) {
      std::string then = now;
      ParameterReader(map, "configured").field(key, then, Presence::optional);
      if (then != now) throw ParameterError(fmt::format("learned with {}, configured with {} now", then, now));
    }
    const KeptSlip read = readParameters(map, "slip", KeptSlip{configured.slip, configured.slip});
    LearnedModel learned{{read.slip.effective_track, read.slip.slip_factor, turnOf(read)}};
    if (map.hasSection("drive_train")) learned.timing = readParameters<DriveTrainTiming>(map, "drive_train");
    map.refuseUnknown();
    return learned;
  } catch (const ParameterError& error) {
    fail(path, error.what());
  }
}

void writeLearnedFile(const std::string& path, const LearnedModel& learned, const LearnedModel& configured) {
  const std::string fresh = path + ".new", text = textOf(learned, configured);
  const int file = open(fresh.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) fail(path, std::string("cannot be written: ") + std::strerror(errno));
  errno = ENOSPC;  // where only a part is written
  const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && fsync(file) == 0;
  const std::string reason = std::strerror(errno);
  close(file);
  if (!written) fail(path, "cannot be written: " + reason);
  if (std::rename(fresh.c_str(), path.c_str()) != 0) {
    fail(path, std::string("cannot be replaced: ") + std::strerror(errno));
  }
}

bool putAside(const std::string& path) {
  std::error_code failure;
  if (!std::filesystem::is_regular_file(path, failure)) return false;
  std::filesystem::rename(path, path + ".old", failure);
  return !failure;
}

}  // namespace jackal_aic
