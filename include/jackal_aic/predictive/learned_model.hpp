#pragma once

/// @file
/// What the predictive controller learns about its robot while it drives.

#include <optional>

#include "jackal_aic/predictive/drive_train_learning.hpp"
#include "jackal_aic/predictive/slip_belief.hpp"

namespace jackal_aic {

/// All that has to be kept for the next start.
struct LearnedModel {
  SlipState slip;                                         ///< how the body follows its wheels
  std::optional<DriveTrainTiming> timing = std::nullopt;  ///< how late the wheels follow their commands; empty: as told
};

}  // namespace jackal_aic
