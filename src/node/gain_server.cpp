#include "gain_server.hpp"

#include <ros/ros.h>

#include <cstdint>
#include <utility>

namespace jackal_aic {
namespace {

constexpr std::uint32_t kAtStart = ~0u;  // level with which the server calls when it gets its callback

}  // namespace

GainServer::GainServer(const ControllerParameters& running, Adopt adopt)
    : running_(running), adopt_(std::move(adopt)), server_(ros::NodeHandle("~controller")) {
  server_.setCallback([this](ControllerGainsConfig& config, std::uint32_t level) {
    level == kAtStart ? showRunning(config) : onRequest(config);
  });
}

void GainServer::onRequest(ControllerGainsConfig& config) {
  ControllerParameters wanted = running_;
  wanted.tau = config.tau;
  wanted.kappa_mu = config.kappa_mu;
  wanted.kappa_a = config.kappa_a;
  if (wanted.tau == running_.tau && wanted.kappa_mu == running_.kappa_mu && wanted.kappa_a == running_.kappa_a) return;
  try {
    adopt_(wanted);
    running_ = wanted;
    ROS_INFO("Changed gains: tau = %g s, kappa_mu = %g, kappa_a = %g", wanted.tau, wanted.kappa_mu, wanted.kappa_a);
  } catch (const ParameterError& error) {
    ROS_ERROR("Refused gains, the running ones stay: %s", error.what());
  }
  showRunning(config);
}

void GainServer::showRunning(ControllerGainsConfig& config) const {
  config.tau = running_.tau;
  config.kappa_mu = running_.kappa_mu;
  config.kappa_a = running_.kappa_a;
}

}  // namespace jackal_aic
