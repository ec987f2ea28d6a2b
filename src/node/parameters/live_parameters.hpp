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

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "jackal_aic/predictive/learned_model.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "parameters/node_parameters.hpp"
#include "process/latest.hpp"

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

/// The lower or upper bounds of parameters (describeFields) as a config for clients. @param side &Bounds::low or
/// &Bounds::high; @param config fields without a range stay.
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
  /// Adopts gains. Throws ParameterError with the reason of a refusal.
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

/// Latest change of each kind of a drive loop, from the serving threads to the driving one.
class LoopExchange {
 public:
  // From any thread except the driving one:
  void adoptGains(const ControllerParameters& gains) { hand(thesis_gains_, gains); }      ///< that are certified
  void adoptGains(const PredictiveParameters& gains) { hand(predictive_gains_, gains); }  ///< that are certified
  void setLearned(const LearnedModel& learned);                ///< restored model, its values in range
  void freezeLearning(bool frozen) { hand(frozen_, frozen); }  ///< stops (true) or resumes learning
  LearnedModel learned() const;                                ///< recent learned model

  /// Applies the requests to the loop. For the driving thread; does not lock, and allocates only where the loop does
  /// (DriveLoop::adoptGains() of the thesis' structure).
  void apply(DriveLoop& loop, double now);

  /// Hands the learned model over to the other threads; for the driving thread, as apply().
  void tell(const DriveLoop& loop);

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
/// the process.
/// @param node the namespace; @param parameters of the node; @param loop has to outlive what is returned.
/// @throws ParameterError if the learned file cannot be read; one that cannot be written is a warning.
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
