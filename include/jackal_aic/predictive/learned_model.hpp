#pragma once

/// @file
/// The model that the predictive controller learns while it drives.

#include <optional>

#include "jackal_aic/predictive/drive_train_learning.hpp"
#include "jackal_aic/predictive/turn.hpp"

namespace jackal_aic {

/// The part that is kept for the next start.
struct LearnedModel {
  SlipState slip;                                         ///< turn of the body with its wheels
  std::optional<DriveTrainTiming> timing = std::nullopt;  ///< of the wheels; empty: as configured
};

}  // namespace jackal_aic
