#pragma once

/// @file
/// Changes of a running controller: gains and sensor variances through dynamic_reconfigure, and services. Shared by the
/// node and the controller of ros_control. The thread that serves the requests certifies gains, so the driving thread
/// does not wait.

#include <dynamic_reconfigure/server.h>
#include <fmt/format.h>
#include <jackal_aic/ControllerGainsConfig.h>
#include <jackal_aic/PredictiveGainsConfig.h>
#include <jackal_aic/SensorNoiseConfig.h>
#include <ros/ros.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "jackal_aic/predictive/learned_model.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "parameters/node_parameters.hpp"
#include "process/latest.hpp"

namespace jackal_aic {

/// Values by the names that parameters and settings of dynamic_reconfigure share.
using NamedValues = std::map<std::string, ParameterValue>;

/// The settings of a config.
template <class Config>
NamedValues settingsOf(const Config& config) {
  dynamic_reconfigure::Config message;
  config.__toMessage__(message);
  NamedValues values;
  for (const auto& setting : message.doubles) values[setting.name] = setting.value;
  for (const auto& setting : message.bools) values[setting.name] = static_cast<bool>(setting.value);
  return values;
}

/// A config with other values of the settings that are named.
template <class Config>
Config withSettings(Config config, const NamedValues& values) {
  dynamic_reconfigure::Config message;
  config.__toMessage__(message);
  for (auto& setting : message.doubles) {
    if (values.count(setting.name) > 0) setting.value = std::get<double>(values.at(setting.name));
  }
  for (auto& setting : message.bools) {
    if (values.count(setting.name) > 0) setting.value = std::get<bool>(values.at(setting.name));
  }
  config.__fromMessage__(message);
  return config;
}

/// The lower or upper bounds of parameters (describeFields) as a config for clients. @param side &Bounds::low or
/// &Bounds::high; @param config fields without a range stay.
template <class Config, class Parameters>
Config rangeOf(const Parameters& parameters, double Bounds::*side, const Config& config) {
  NamedValues ends;
  for (const Field& field : fieldsOf(parameters)) {
    if (field.bounds) ends[field.name] = (*field.bounds).*side;
  }
  return withSettings(config, ends);
}

/// Offers the parameters of a config in a namespace, by default the private one in which the YAML has them. A value out
/// of its range (describeFields) is refused, not clamped; rqt_reconfigure shows the range and keeps within it.
template <class Parameters, class Config>
class GainServer {
 public:
  /// Adopts gains. Throws ParameterError with the reason of a refusal.
  using Adopt = std::function<void(const Parameters& wanted)>;

  /// @param node the controller's namespace; @param section of the parameters in it; @param running gains at the start;
  /// @param adopt called for every change. What was taken over or refused is logged by name, and the client of a
  /// refused change gets the running gains back.
  GainServer(const ros::NodeHandle& node, const std::string& section, const Parameters& running, Adopt adopt)
      : section_(section), running_(running), adopt_(std::move(adopt)), server_({node, section}) {
    Config low, high;
    server_.getConfigMin(low);
    server_.getConfigMax(high);
    server_.setConfigMin(rangeOf(running_, &Bounds::low, low));
    server_.setConfigMax(rangeOf(running_, &Bounds::high, high));
    server_.setCallback([this](Config& config, std::uint32_t level) {
      constexpr std::uint32_t kAtStart = ~0u;  // the server calls when it gets its callback
      if (level != kAtStart) onRequest(settingsOf(config));
      NamedValues now;
      for (const Field& field : fieldsOf(running_)) now[field.name] = field.value;
      config = withSettings(config, now);
    });
  }

 private:
  void onRequest(const NamedValues& asked) {
    ParameterMap map;
    std::string changes, refused;
    for (const Field& field : fieldsOf(running_)) {
      const auto found = asked.find(field.name);
      const ParameterValue& wanted = found == asked.end() ? field.value : found->second;
      map.set((section_.empty() ? "" : section_ + ".") + field.name, wanted);
      if (wanted == field.value) continue;
      const std::string change = field.name + " = " + describe(wanted);
      refused += fmt::format("{}{} (stays {})", refused.empty() ? "" : ", ", change, describe(field.value));
      changes += " " + change;
    }
    if (changes.empty()) return;
    try {
      const Parameters wanted = readParameters(map, section_, running_);
      adopt_(wanted);
      running_ = wanted;
      ROS_INFO("Changed:%s", changes.c_str());
    } catch (const ParameterError& error) {
      ROS_ERROR("Refused %s: %s", refused.c_str(), error.what());
    }
  }

  std::string section_;
  Parameters running_;
  Adopt adopt_;
  dynamic_reconfigure::Server<Config> server_;
};

/// Latest change of each kind of a drive loop, from the serving threads to the driving one.
class LoopExchange {
 public:
  // From any thread except the driving one:
  void adoptGains(const ControllerParameters& gains) { hand(thesis_gains_, gains); }      ///< certified gains
  void adoptGains(const PredictiveParameters& gains) { hand(predictive_gains_, gains); }  ///< certified gains
  void setLearned(const LearnedModel& learned);                ///< restored model, its values in range
  void freezeLearning(bool frozen) { hand(frozen_, frozen); }  ///< stops (true) or resumes learning
  LearnedModel learned() const;                                ///< recent learned model

  /// Applies the requests to the loop. For the driving thread; does not lock, and allocates only where the loop does
  /// (DriveLoop::adoptGains() of the thesis' structure).
  void apply(DriveLoop& loop, double now);

  /// Hands the learned model over to the other threads; for the driving thread, as apply().
  void send(const DriveLoop& loop);

 private:
  template <class T>
  void hand(Latest<T>& slot, const T& value) {
    const std::lock_guard<std::mutex> lock(requests_);
    slot.write(value);
  }

  mutable std::mutex requests_;  // between these threads
  Latest<ControllerParameters> thesis_gains_;
  Latest<PredictiveParameters> predictive_gains_;
  Latest<LearnedModel> wanted_model_;
  Latest<bool> frozen_;
  mutable Latest<LearnedModel> believed_model_;
  mutable LearnedModel learned_{};  // the last read model
};

/// Serves the changes of the structure that runs until it is destroyed; the baseline has none.
class LiveParameterServer {
 public:
  virtual ~LiveParameterServer() = default;

  /// To be called regularly by the serving thread: writes the learned file every 10 s, if there is one.
  virtual void keep(const ros::Time&) {}
};

/// Certifies the gains on the plant model and logs the result. Then serves the changes of the running structure in a
/// namespace. thesis: dynamic_reconfigure of the gains in `controller`; predictive: in `predictive` and `sensors`, and
/// the services freeze_learning (std_srvs/SetBool), which stops and resumes learning, and save_learned_model
/// (std_srvs/Trigger), which writes the learned file at once. With such a file (slip.file) what was learned outlives
/// the process; a file that cannot be read or written is a warning.
/// @param node the namespace; @param parameters of the node; @param loop has to outlive what is returned.
std::unique_ptr<LiveParameterServer> serveLiveParameters(const ros::NodeHandle& node, const NodeParameters& parameters,
                                                         LoopExchange& loop);

/// Serves enable and reset in a namespace. enable (std_srvs/SetBool): false brakes the robot and holds it at rest
/// (StopCause::disabled), true permits driving again, by restart_after_stop. reset (std_srvs/Trigger) restarts a robot
/// at rest (DriveLoop::start()). It forgets motion and faults, and keeps the learned model, the reported status and the
/// pose of the odometry.
class DriveServices {
 public:
  /// Actions of the owner.
  struct Actions {
    std::function<void(bool enabled)> enable;  ///< permits driving, or holds the robot
    std::function<bool()> at_rest;             ///< resting() holds for the command
    std::function<void()> reset;               ///< restarts
  };

  /// @param node the namespace; @param actions that carry out the requests.
  DriveServices(const ros::NodeHandle& node, Actions actions);

  DriveServices(const DriveServices&) = delete;
  DriveServices& operator=(const DriveServices&) = delete;

  /// True for a command of zero within the noise.
  static bool resting(const WheelCommand& command);

 private:
  bool onEnable(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);
  bool onReset(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);

  Actions actions_;
  ros::ServiceServer enable_service_;
  ros::ServiceServer reset_service_;
};

}  // namespace jackal_aic
