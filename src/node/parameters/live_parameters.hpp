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

#include <array>
#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "jackal_aic/predictive/learned_model.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "parameters/node_parameters.hpp"

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
  /// @param node the controller's namespace; @param section of the parameters in it; @param running gains at the start;
  /// @param adopt called for every change, throws ParameterError to refuse it. What was taken over or refused is logged
  /// by name, and the client of a refused change gets the running gains back.
  GainServer(const ros::NodeHandle& node, const std::string& section, const Parameters& running,
             std::function<void(const Parameters& wanted)> adopt)
      : section_(section), running_(running), adopt_(std::move(adopt)), server_({node, section}) {
    server_.setConfigMin(rangeOf(running_, &Bounds::low, Config::__getMin__()));
    server_.setConfigMax(rangeOf(running_, &Bounds::high, Config::__getMax__()));
    server_.setCallback([this](Config& config, std::uint32_t level) {
      if (level != ~0u) onRequest(settingsOf(config));  // ~0: the server calls when it gets its callback
      NamedValues now;
      for (const Field& field : fieldsOf(running_)) now[field.name] = field.value;
      config = withSettings(config, now);
    });
  }

 private:
  void onRequest(const NamedValues& asked) {
    ParameterMap map;
    std::string changes;
    for (const Field& field : fieldsOf(running_)) {
      const auto found = asked.find(field.name);
      const ParameterValue& wanted = found == asked.end() ? field.value : found->second;
      map.set((section_.empty() ? "" : section_ + ".") + field.name, wanted);
      if (wanted == field.value) continue;
      changes += fmt::format("{}{} {} -> {}", changes.empty() ? "" : ", ", field.name, describe(field.value),
                             describe(wanted));
    }
    if (changes.empty()) return;
    try {
      const Parameters wanted = readParameters(map, section_, running_);
      adopt_(wanted);
      running_ = wanted;
      ROS_INFO("Changed %s", changes.c_str());
    } catch (const ParameterError& error) {
      ROS_ERROR("Refused %s: %s", changes.c_str(), error.what());
    }
  }

  std::string section_;
  Parameters running_;
  std::function<void(const Parameters& wanted)> adopt_;
  dynamic_reconfigure::Server<Config> server_;
};

/// Changes of a drive loop from the serving threads to the driving one; learned model and rest the other way.
class LoopExchange {
 public:
  explicit LoopExchange(const DriveLoop& loop) { send(loop); }

  // For the serving threads:
  /// Hands a change over. A restored model has its values in range, gains are certified. @throws ParameterError if the
  /// loop has not taken the last changes.
  void request(const decltype(DriveInput::what)& change);
  LearnedModel learned() const;                      ///< recent learned model
  bool atRest() const { return at_rest_; }           ///< the last command was zero within the noise
  void enable(bool enabled) { enabled_ = enabled; }  ///< permits driving, or holds the robot

  // For the driving thread; they do not wait:
  /// Applies the changes to the loop; allocates only where the loop does (DriveLoop::adoptGains() of the thesis'
  /// structure). True if the loop was restarted.
  bool apply(DriveLoop& loop, double now);
  void send(const DriveLoop& loop);          ///< hands over what the other threads may read
  bool enabled() const { return enabled_; }  ///< driving is permitted

 private:
  mutable std::mutex mutex_;  // of the serving threads; the driving one only tries it
  boost::lockfree::spsc_queue<DriveInput, boost::lockfree::capacity<32>> changes_;
  LearnedModel learned_{};
  std::atomic<bool> at_rest_{true}, enabled_{true};
};

/// Certifies the gains on the plant model and logs the result. Then serves the changes of the running structure in a
/// namespace until it is destroyed; the baseline has none. thesis: dynamic_reconfigure of the gains in `controller`;
/// predictive: in `predictive` and `sensors`, and the services freeze_learning (std_srvs/SetBool), which stops and
/// resumes learning, and save_learned_model (std_srvs/Trigger), which writes the learned file at once. With such a file
/// (slip.file), written every 10 s, what was learned outlives the process; a file that cannot be read or written is a
/// warning.
class LiveParameterServer {
 public:
  /// @param node the namespace; @param parameters of the node; @param loop has to outlive the server.
  LiveParameterServer(ros::NodeHandle node, const NodeParameters& parameters, LoopExchange& loop);
  ~LiveParameterServer();
  LiveParameterServer(const LiveParameterServer&) = delete;
  LiveParameterServer& operator=(const LiveParameterServer&) = delete;

 private:
  bool learns() const { return predictive_gains_ && !parameters_.slip_file.empty(); }  // into a file
  void adopt(const Gains& wanted);
  void readLearned();
  std::string writeLearned() const;
  bool onFreeze(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);
  bool onSave(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);

  NodeParameters parameters_;  // with the gains in force
  LoopExchange& loop_;
  LearnedModel configured_;
  ros::Timer writing_;  // of the learned file
  ros::ServiceServer freeze_service_, save_service_;
  std::optional<GainServer<ControllerParameters, ControllerGainsConfig>> thesis_gains_;
  std::optional<GainServer<PredictiveParameters, PredictiveGainsConfig>> predictive_gains_;
  std::optional<GainServer<SensorNoise, SensorNoiseConfig>> variances_;
};

/// Serves enable and reset in a namespace. enable (std_srvs/SetBool): false brakes the robot and holds it at rest
/// (StopCause::disabled), true permits driving again, by restart_after_stop. reset (std_srvs/Trigger) restarts a robot
/// at rest (DriveLoop::start()). It forgets motion and faults, and keeps the learned model, the reported status and the
/// pose of the odometry.
std::array<ros::ServiceServer, 2> serveDriving(ros::NodeHandle node, LoopExchange& loop);

}  // namespace jackal_aic
