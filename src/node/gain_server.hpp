#pragma once

/// @file
/// Changing gains while the controller runs, through dynamic_reconfigure.

#include <dynamic_reconfigure/server.h>
#include <jackal_aic/ControllerGainsConfig.h>

#include <functional>

#include "jackal_aic/parameters.hpp"

namespace jackal_aic {

/// Offers tau, kappa_mu and kappa_a in the private namespace `~controller`, where the YAML has them.
class GainServer {
 public:
  /// Takes wanted gains over. Throws ParameterError with the reason why it does not.
  using Adopt = std::function<void(const ControllerParameters& wanted)>;

  /// @param running gains at the start; @param adopt called for every change. A refused one is logged with its reason,
  /// and whoever asked for it gets the running gains back.
  GainServer(const ControllerParameters& running, Adopt adopt);

 private:
  void onRequest(ControllerGainsConfig& config);
  void showRunning(ControllerGainsConfig& config) const;

  ControllerParameters running_;
  Adopt adopt_;
  dynamic_reconfigure::Server<ControllerGainsConfig> server_;
};

}  // namespace jackal_aic
