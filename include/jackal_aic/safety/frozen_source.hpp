#pragma once

/// @file
/// Detects a source that repeats its last sample with fresh stamps, like the stock driver after the motors' controller
/// died.

#include <Eigen/Core>

namespace jackal_aic {

/// Watches the samples of one source. Noise, and an encoder's position on the move, never repeat exactly, so a longer
/// exact repetition is frozen. Times are those of arrival, because the stamps of a frozen source are wrong. Nothing
/// allocates.
class FrozenSource {
 public:
  /// The values that are compared, up to 8; unused ones stay zero.
  using Sample = Eigen::Matrix<double, 8, 1>;

  /// @param longest time for which a sample may repeat exactly [s]; 0 switches the watch off.
  explicit FrozenSource(double longest) : longest_(longest) {}

  /// Takes a sample that arrived at `time` [s]. @param may_repeat true while exact repetition is normal, as for
  /// encoders at rest.
  void update(double time, const Sample& sample, bool may_repeat);

  /// True if the last sample has repeated beyond the longest time.
  bool frozen() const { return frozen_; }

  /// Forgets everything.
  void reset() { *this = FrozenSource(longest_); }

 private:
  double longest_;
  bool any_ = false;
  bool frozen_ = false;
  double changed_ = 0.0;  // time of the last sample that differed from the one before, or was allowed to repeat
  Sample last_ = Sample::Zero();
};

}  // namespace jackal_aic
