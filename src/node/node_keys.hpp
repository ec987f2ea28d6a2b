#pragma once

/// @file
/// Keys of a whole node's configuration for programs that run its controller without a node.

#include <algorithm>
#include <string>

#include "node_parameters.hpp"

namespace jackal_aic {

/// Reads, and checks, what a node's configuration has beside gains, geometry, gate and drive train, so that only
/// unknown keys are left in the map. @throws ParameterError as the node does.
inline void readRestOfNode(ParameterMap& map) {
  readParameters<RobotNames>(map, "robot");
  readParameters<OdometryParameters>(map, "odometry");
  readParameters<FaultParameters>(map, "faults");
  readParameters<LossPolicyParameters>(map, "on_loss");
  OutputMode output{};
  bool allow_other_publishers{};
  ParameterReader reader(map, "");
  reader.field("output", output, kOutputModeNames, Presence::optional);
  reader.field("allow_other_publishers", allow_other_publishers, Presence::optional);
  const auto keys = map.keys();
  const bool predictive =
      std::any_of(keys.begin(), keys.end(), [](const std::string& key) { return key.rfind("predictive.", 0) == 0; });
  std::string slip_file;
  if (predictive) ParameterReader(map, "slip").field("file", slip_file, Presence::optional);
}

}  // namespace jackal_aic
