#include "slip_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "jackal_aic/config/yaml_text.hpp"

namespace jackal_aic {
namespace {

constexpr double kRange = SlipBelief::kRange * (1.0 + 1e-6);  // a bound is read again in spite of its rounding

/// Slip while it is read, with the ranges in which the belief stays.
struct BoundedSlip {
  SlipState slip;
  SlipState configured;
};

template <class Visitor>
void describeFields(Visitor& v, BoundedSlip& p) {
  v.field("slip_factor", p.slip.slip_factor, {p.configured.slip_factor / kRange, p.configured.slip_factor * kRange}, "",
          Presence::required);
  // The belief bounds alpha and the ratio alpha / b_hat.
  const double track = p.configured.effective_track * p.slip.slip_factor / p.configured.slip_factor;
  v.field("effective_track", p.slip.effective_track, {track / kRange, track * kRange}, "m", Presence::required);
}

[[noreturn]] void fail(const std::string& path, const char* what) {
  throw ParameterError("slip.file = '" + path + "': " + what + ": " + std::strerror(errno));
}

std::string yamlText(const SlipState& slip) {
  return "# Slip as the predictive controller learned it; read at its start, rewritten while it runs.\n" +
         yamlBlock("slip", BoundedSlip{slip, slip});
}

/// Writes a file and waits until it is on the disk.
void writeThrough(const std::string& path, const std::string& text) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) return fail(path, "cannot be written");
  const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && fsync(file) == 0;
  close(file);
  if (!written) fail(path, "cannot be written");
}

}  // namespace

std::optional<SlipState> readSlipFile(const std::string& path, const SlipState& configured) {
  if (!std::filesystem::exists(path)) return std::nullopt;
  try {
    ParameterMap map;
    addYamlFile(path, map);
    const SlipState slip = readParameters<BoundedSlip>(map, "slip", {configured, configured}).slip;
    map.refuseUnknown();
    return slip;
  } catch (const ParameterError& error) {
    throw ParameterError("slip.file = '" + path + "': " + error.what());
  }
}

void writeSlipFile(const std::string& path, const SlipState& slip) {
  const std::string fresh = path + ".new";
  writeThrough(fresh, yamlText(slip));
  if (std::rename(fresh.c_str(), path.c_str()) != 0) fail(path, "cannot be replaced");
}

SlipWriter::SlipWriter(std::string path, const SlipState& slip) : path_(std::move(path)) {
  writeSlipFile(path_, slip);
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

void SlipWriter::write(const SlipState& slip) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    due_ = slip;
  }
  changed_.notify_one();
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
    const SlipState slip = *std::exchange(due_, std::nullopt);
    lock.unlock();
    std::string failure;
    try {
      writeSlipFile(path_, slip);
    } catch (const ParameterError& error) {
      failure = error.what();
    }
    lock.lock();
    failure_ = failure;
  }
}

}  // namespace jackal_aic
