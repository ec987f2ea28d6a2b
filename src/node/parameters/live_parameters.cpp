#include "parameters/live_parameters.hpp"

#include <optional>
#include <variant>

#include "jackal_aic/certificate/certificate.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/thresholds.hpp"
#include "parameters/learned_file.hpp"

namespace jackal_aic {
namespace {

const ros::Duration kKeepPeriod(10.0);  // of writing the learned file

std::string describe(const LearnedModel& learned) {
  std::string text =
      fmt::format("effective track {:g} m, slip factor {:g}", learned.slip.effective_track, learned.slip.slip_factor);
  if (learned.timing) {
    text += fmt::format(", dead time {:.3f} s, lag {:.3f} s", learned.timing->dead_time, learned.timing->lag);
  }
  return text;
}

void logCertificate(const LinearLoop& loop) {
  const Certificate certificate = certify(loop);
  const auto level = certificate.keeps(MarginBounds{}) ? ros::console::levels::Info : ros::console::levels::Warn;
  ROS_LOG(level, ROSCONSOLE_DEFAULT_NAME, "%s", advice(certificate, loop).c_str());
}

/// Refuses gains that are unstable, and warns of those with a thin margin.
void requireStableGains(const LinearLoop& loop) {
  requireStable(loop);
  const Certificate certificate = certify(loop);
  if (!certificate.keeps(MarginBounds{})) ROS_WARN("%s", advice(certificate, loop).c_str());
}

class ThesisServer : public LiveParameterServer {
 public:
  ThesisServer(const ros::NodeHandle& node, const NodeParameters& parameters, const ControllerParameters& gains,
               LoopExchange& loop)
      : geometry_(parameters.geometry),
        loop_(loop),
        gain_server_(node, "controller", gains, [this](const auto& wanted) { adopt(wanted); }) {
    if (parameters.plant_model) plant_ = drivenModel(*parameters.plant_model);
    if (!plant_) {
      ROS_INFO("No plant model: checked the stability of the belief update only, not of the closed loop");
      return;
    }
    logCertificate(LinearLoop(gains, geometry_, *plant_));
  }

 private:
  void adopt(const ControllerParameters& wanted) {
    validate(wanted, geometry_);
    if (plant_) requireStableGains(LinearLoop(wanted, geometry_, *plant_));
    loop_.adoptGains(wanted);
  }

  GeometryParameters geometry_;
  std::optional<PlantModel> plant_;
  LoopExchange& loop_;
  GainServer<ControllerParameters, ControllerGainsConfig> gain_server_;
};

/// Gains are certified on the robot that the controller believes in.
class PredictiveServer : public LiveParameterServer {
 public:
  PredictiveServer(const ros::NodeHandle& node, const NodeParameters& parameters, const PredictiveParameters& gains,
                   LoopExchange& loop)
      : model_(drivenModel(parameters.plant_model.value())),
        gains_(gains),
        loop_(loop),
        configured_(loop.learned()),
        path_(parameters.slip_file),
        freeze_service_(ros::NodeHandle(node).advertiseService("freeze_learning", &PredictiveServer::onFreeze, this)),
        save_service_(ros::NodeHandle(node).advertiseService("save_learned_model", &PredictiveServer::onSave, this)),
        gain_server_(node, "predictive", gains, [this](const auto& wanted) { adoptGains(wanted); }),
        variance_server_(node, "sensors", gains, [this](const auto& wanted) { adoptVariances(wanted); }) {
    logCertificate(LinearLoop(gains, model_, model_));
    if (path_.empty()) return;
    read();
    if (write().empty()) ROS_INFO("Learned file %s: %s", path_.c_str(), describe(loop_.learned()).c_str());
  }

  ~PredictiveServer() override {
    if (!path_.empty()) write();
  }

  void keep(const ros::Time& now) override {
    if (path_.empty() || (now >= kept_ && now - kept_ < kKeepPeriod)) return;
    kept_ = now;
    write();
  }

 private:
  /// The robot drives although the file cannot be used.
  void read() {
    try {
      if (const auto kept = readLearnedFile(path_, configured_)) loop_.setLearned(*kept);
    } catch (const ParameterError& error) {
      const std::string aside = putAside(path_) ? ", and the file is now " + path_ + ".old" : "";
      ROS_WARN("%s. Learning starts from the configuration%s", error.what(), aside.c_str());
    }
  }

  /// Returns why it failed, after a warning: a robot drives without the file, which the next attempt may write.
  std::string write() const {
    try {
      writeLearnedFile(path_, loop_.learned(), configured_);
      return "";
    } catch (const ParameterError& error) {
      ROS_WARN("%s: the learned model is not saved", error.what());
      return error.what();
    }
  }

  bool onFreeze(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
    loop_.freezeLearning(request.data);
    response.success = true;
    response.message = (request.data ? "frozen: " : "learning: ") + describe(loop_.learned());
    return true;
  }

  bool onSave(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
    const std::string failure = path_.empty() ? "slip.file is not set: there is no file to write" : write();
    response.success = failure.empty();
    response.message = failure.empty() ? path_ + ": " + describe(loop_.learned()) : failure;
    return true;
  }

  void adoptGains(PredictiveParameters wanted) {
    static_cast<SensorNoise&>(wanted) = gains_;
    adopt(wanted);
  }

  void adoptVariances(const SensorNoise& wanted) {
    PredictiveParameters gains = gains_;
    static_cast<SensorNoise&>(gains) = wanted;
    adopt(gains);
  }

  void adopt(const PredictiveParameters& wanted) {
    validate(wanted);
    requireStableGains(LinearLoop(wanted, model_, model_));
    loop_.adoptGains(wanted);
    gains_ = wanted;
  }

  PlantModel model_;
  PredictiveParameters gains_;  // in force
  LoopExchange& loop_;
  LearnedModel configured_;
  std::string path_;  // of the learned file; empty: none
  ros::Time kept_;    // time of the last write
  ros::ServiceServer freeze_service_;
  ros::ServiceServer save_service_;
  GainServer<PredictiveParameters, PredictiveGainsConfig> gain_server_;
  GainServer<SensorNoise, SensorNoiseConfig> variance_server_;
};

}  // namespace

void LoopExchange::setLearned(const LearnedModel& learned) {
  const std::lock_guard<std::mutex> lock(requests_);
  wanted_model_.write(learned_ = learned);
}

LearnedModel LoopExchange::learned() const {
  const std::lock_guard<std::mutex> lock(requests_);
  if (const LearnedModel* believed = believed_model_.read()) learned_ = *believed;
  return learned_;
}

void LoopExchange::apply(DriveLoop& loop, double now) {
  if (const ControllerParameters* gains = thesis_gains_.read()) loop.adoptGains(*gains, now);
  if (const PredictiveParameters* gains = predictive_gains_.read()) loop.adoptGains(*gains, now);
  if (const LearnedModel* learned = wanted_model_.read()) loop.setLearned(*learned, now);
  if (const bool* frozen = frozen_.read()) loop.freezeLearning(*frozen, now);
}

void LoopExchange::send(const DriveLoop& loop) {
  if (loop.predictive() != nullptr) believed_model_.write(loop.predictive()->learned());
}

std::unique_ptr<LiveParameterServer> serveLiveParameters(const ros::NodeHandle& node, const NodeParameters& parameters,
                                                         LoopExchange& loop) {
  if (const auto* gains = std::get_if<PredictiveParameters>(&parameters.controller)) {
    return std::make_unique<PredictiveServer>(node, parameters, *gains, loop);
  }
  // A robot's file may name it with any preset.
  if (!parameters.slip_file.empty()) ROS_WARN("slip.file is not used: only preset:=predictive learns");
  if (const auto* gains = std::get_if<ControllerParameters>(&parameters.controller)) {
    return std::make_unique<ThesisServer>(node, parameters, *gains, loop);
  }
  return std::make_unique<LiveParameterServer>();
}

DriveServices::DriveServices(const ros::NodeHandle& node, Actions actions)
    : actions_(std::move(actions)),
      enable_service_(ros::NodeHandle(node).advertiseService("enable", &DriveServices::onEnable, this)),
      reset_service_(ros::NodeHandle(node).advertiseService("reset", &DriveServices::onReset, this)) {}

bool DriveServices::resting(const WheelCommand& command) {
  return command.vector().cwiseAbs().maxCoeff() < thresholds::kRest;
}

bool DriveServices::onEnable(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
  actions_.enable(request.data);
  response.success = true;
  response.message = request.data ? "enabled" : "disabled: the robot brakes, and stands until it is enabled again";
  ROS_INFO("Service enable: %s", response.message.c_str());
  return true;
}

bool DriveServices::onReset(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  response.success = actions_.at_rest();
  if (response.success) actions_.reset();
  response.message =
      response.success ? "restarted; the learned model is kept" : "the robot is being driven: stop it first";
  ROS_INFO("Service reset: %s", response.message.c_str());
  return true;
}

}  // namespace jackal_aic
