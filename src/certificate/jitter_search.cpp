#include "jackal_aic/certificate/jitter_search.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace jackal_aic {
namespace {

using Eigen::MatrixXd;

constexpr int kPoints = 3;            // phases and delays of a period: none, half of the longest, the longest
constexpr int kLongestSequence = 10;  // periods
constexpr double kDelayStep = 0.005;  // s, of the margin

/// Draws periods of a loop.
class Adversary {
 public:
  Adversary(const LinearLoop& loop, const Jitter& jitter) : jitter_(jitter) {
    // In addition to lost samples, a sample may be a period late by its phase.
    std::vector<std::optional<Eigen::Vector3d>> gains{std::nullopt};
    for (const Eigen::Vector3d& gain : loop.irregularGains(jitter.lost_samples + 2)) gains.emplace_back(gain);
    gains_ = static_cast<int>(gains.size()) - 1;
    const double phase = loop.longestPhase() / (kPoints - 1), delay = jitter.extra_delay / (kPoints - 1);
    for (const auto& gain : gains) {
      for (int i = 0; i < kPoints * kPoints; ++i) {
        maps_.push_back(
            loop.jitteredMap({1.0, delay * (i / kPoints), phase * (i % kPoints)}, gain, jitter.extra_delay));
      }
    }
  }

  /// Growth per period of a repeated sequence.
  double growth() {
    const int length = 1 + below(kLongestSequence);
    MatrixXd product = MatrixXd::Identity(maps_.front().rows(), maps_.front().rows());
    int lost = 0;
    for (int i = 0; i < length; ++i) {
      // The last period has a sample, so that the sequence can be repeated.
      const bool loses = lost < jitter_.lost_samples && i + 1 < length && below(2) == 0;
      lost = loses ? lost + 1 : 0;
      const int gain = loses ? 0 : 1 + below(gains_);
      product =
          (maps_[static_cast<std::size_t>((gain * kPoints + below(kPoints)) * kPoints + below(kPoints))] * product)
              .eval();
    }
    return std::pow(product.eigenvalues().cwiseAbs().maxCoeff(), 1.0 / length);
  }

 private:
  int below(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }

  Jitter jitter_;
  int gains_;
  std::vector<MatrixXd> maps_;  // by gain (0: lost), delay and phase
  std::mt19937_64 random_{1};
};

}  // namespace

double worstGrowth(const LinearLoop& loop, const Jitter& jitter, int sequences) {
  Adversary adversary(loop, jitter);
  double worst = 0.0;
  for (int i = 0; i < sequences; ++i) worst = std::max(worst, adversary.growth());
  return worst;
}

JitterMargins jitterMargins(const LinearLoop& loop) {
  const auto holds = [&](const Jitter& jitter) { return worstGrowth(loop, jitter) < kStabilityLimit; };
  JitterMargins margins;
  margins.any_phase = holds({});
  const auto steps = static_cast<int>(std::lround(kLongestJitter / kDelayStep));
  for (int i = 1; margins.any_phase && i <= steps && holds({kDelayStep * i, 0}); ++i) margins.delay = kDelayStep * i;
  for (int i = 1; margins.any_phase && i <= kMostLost && holds({0.0, i}); ++i) margins.lost = i;
  return margins;
}

}  // namespace jackal_aic
