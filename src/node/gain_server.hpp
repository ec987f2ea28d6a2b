#pragma once

/// @file
/// Changing gains and settings while the controller runs, through dynamic_reconfigure.

#include <dynamic_reconfigure/server.h>
#include <fmt/format.h>
#include <jackal_aic/ControllerGainsConfig.h>
#include <jackal_aic/PredictiveGainsConfig.h>
#include <jackal_aic/SensorNoiseConfig.h>
#include <ros/ros.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/predictive/predictive_parameters.hpp"

namespace jackal_aic {

/// Calls visit(name, gain, setting) for each gain of the thesis' structure that can be changed while it runs.
template <class Parameters, class Visit>
void visitGains(Parameters& gains, ControllerGainsConfig& config, const Visit& visit) {
  visit("tau", gains.tau, config.tau);
  visit("kappa_mu", gains.kappa_mu, config.kappa_mu);
  visit("kappa_a", gains.kappa_a, config.kappa_a);
}

/// As above, for the predictive structure.
template <class Parameters, class Visit>
void visitGains(Parameters& gains, PredictiveGainsConfig& config, const Visit& visit) {
  visit("belief_learning_rate", gains.belief_learning_rate, config.belief_learning_rate);
  visit("action_learning_rate", gains.action_learning_rate, config.action_learning_rate);
  visit("reference_time", gains.reference_time, config.reference_time);
  visit("speed_process_noise", gains.speed_process_noise, config.speed_process_noise);
  visit("yaw_process_noise", gains.yaw_process_noise, config.yaw_process_noise);
  visit("disturbance_process_noise", gains.disturbance_process_noise, config.disturbance_process_noise);
  visit("dead_time_deviation", gains.dead_time_deviation, config.dead_time_deviation);
  visit("learn_track", gains.learn_track, config.learn_track);
  visit("learn_drive_train", gains.learn_drive_train, config.learn_drive_train);
  visit("yaw_delay_deviation", gains.yaw_delay_deviation, config.yaw_delay_deviation);
  visit("slip_excitation", gains.slip_excitation, config.slip_excitation);
  visit("turning_centre", gains.turning_centre, config.turning_centre);
}

/// The variances of the measurements, which the predictive structure takes while it runs.
template <class Parameters, class Visit>
void visitGains(Parameters& sensors, SensorNoiseConfig& config, const Visit& visit) {
  visit("wheel_variance", sensors.wheel_variance, config.wheel_variance);
  visit("gyro_variance", sensors.gyro_variance, config.gyro_variance);
  visit("accelerometer_variance", sensors.accelerometer_variance, config.accelerometer_variance);
}

/// The lower or the upper ends of the ranges of parameters (describeFields) as a config, for clients to be shown.
/// @param side &Bounds::low or &Bounds::high; @param config keeps what has no range.
template <class Config, class Parameters>
Config rangeOf(const Parameters& parameters, double Bounds::*side, Config config) {
  const std::vector<Field> fields = fieldsOf(parameters);
  visitGains(parameters, config, [&](const char* name, const auto&, auto& setting) {
    const auto field = std::find_if(fields.begin(), fields.end(), [&](const Field& f) { return f.name == name; });
    if (field == fields.end() || !field->bounds) return;
    setting = static_cast<std::decay_t<decltype(setting)>>((*field->bounds).*side);
  });
  return config;
}

/// Offers parameters in a namespace, by default the private one in which the YAML has them. One that is out of its
/// range (describeFields) is refused, not clamped: rqt_reconfigure shows the range, and keeps to it by itself.
template <class Parameters, class Config>
class GainServer {
 public:
  /// Takes wanted gains over in the place of the running ones. Throws ParameterError with the reason why it does not.
  using Adopt = std::function<void(const Parameters& wanted)>;

  /// @param node its namespace; @param running gains at the start; @param adopt called for every change. What was taken
  /// over or refused is logged by name, and the client of a refused change gets the running gains back.
  GainServer(const ros::NodeHandle& node, const Parameters& running, Adopt adopt)
      : running_(running), adopt_(std::move(adopt)), server_(node) {
    showRanges();
    server_.setCallback([this](Config& config, std::uint32_t level) {
      if (level != kAtStart) onRequest(config);
      showRunning(config);
    });
  }

 private:
  static constexpr std::uint32_t kAtStart = ~0u;  // level with which the server calls when it gets its callback

  void onRequest(Config& config) {
    Parameters wanted = running_;
    std::string changes, refused;
    visitGains(wanted, config, [&](const char* name, auto& gain, auto& setting) {
      if (setting == gain) return;
      refused += fmt::format("{}{} = {} (stays {})", refused.empty() ? "" : ", ", name, setting, gain);
      gain = setting;
      changes += fmt::format(" {} = {}", name, gain);
    });
    if (changes.empty()) return;
    try {
      adopt_(wanted);
      running_ = wanted;
      ROS_INFO("Changed:%s", changes.c_str());
    } catch (const ParameterError& error) {
      ROS_ERROR("Refused %s: %s", refused.c_str(), error.what());
    }
  }

  void showRunning(Config& config) const {
    visitGains(running_, config, [](const char*, const auto& gain, auto& setting) { setting = gain; });
  }

  void showRanges() {
    Config low, high;
    server_.getConfigMin(low);
    server_.getConfigMax(high);
    server_.setConfigMin(rangeOf(running_, &Bounds::low, low));
    server_.setConfigMax(rangeOf(running_, &Bounds::high, high));
  }

  Parameters running_;
  Adopt adopt_;
  dynamic_reconfigure::Server<Config> server_;
};

}  // namespace jackal_aic
