#include "parameters/live_parameters.hpp"

#include <variant>

#include "jackal_aic/certificate/certificate.hpp"
#include "jackal_aic/model/thresholds.hpp"
#include "parameters/learned_file.hpp"

namespace jackal_aic {
namespace {

const ros::Duration kWritingPeriod(10.0);  // of the learned file

void logCertificate(const NodeParameters& parameters) {
  if (!parameters.plant_model) {
    ROS_INFO("No plant model: checked the stability of the belief update only, not of the closed loop");
    return;
  }
  const LinearLoop loop = closedLoop(parameters, drivenModel(*parameters.plant_model));
  const Certificate certificate = certify(loop);
  const auto level = certificate.keeps(MarginBounds{}) ? ros::console::levels::Info : ros::console::levels::Warn;
  ROS_LOG(level, ROSCONSOLE_DEFAULT_NAME, "%s", advice(certificate, loop).c_str());
}

}  // namespace

void LoopExchange::request(const decltype(DriveInput::what)& change) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!changes_.push({0.0, change})) throw ParameterError("the controller does not run, and takes no further changes");
  if (const auto* restored = std::get_if<LearnedInput>(&change)) learned_ = restored->learned;
}

LearnedModel LoopExchange::learned() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return learned_;
}

bool LoopExchange::apply(DriveLoop& loop, double now) {
  bool restarted = false;
  changes_.consume_all([&](DriveInput& change) {
    change.now = now;
    loop.take(change);
    restarted = restarted || std::holds_alternative<StartInput>(change.what);
  });
  return restarted;
}

void LoopExchange::send(const DriveLoop& loop) {
  at_rest_ = loop.command().vector().cwiseAbs().maxCoeff() < thresholds::kRest;
  const std::unique_lock<std::mutex> lock(mutex_, std::try_to_lock);  // a later call hands it over
  if (lock && loop.predictive() != nullptr) learned_ = loop.predictive()->learned();
}

LiveParameterServer::LiveParameterServer(ros::NodeHandle node, const NodeParameters& parameters, LoopExchange& loop)
    : parameters_(parameters), loop_(loop), configured_(loop.learned()) {
  if (const auto* gains = std::get_if<ControllerParameters>(&parameters.controller)) {
    thesis_gains_.emplace(node, "controller", *gains, [this](const auto& wanted) { adopt(wanted); });
    // A robot's file may name it with any preset.
    if (!parameters.slip_file.empty()) ROS_WARN("slip.file is not used: only preset:=predictive learns");
  } else if (const auto* predictive = std::get_if<PredictiveParameters>(&parameters.controller)) {
    predictive_gains_.emplace(node, "predictive", *predictive, [this](PredictiveParameters wanted) {
      static_cast<SensorNoise&>(wanted) = std::get<PredictiveParameters>(parameters_.controller);
      adopt(wanted);
    });
    variances_.emplace(node, "sensors", *predictive, [this](const SensorNoise& wanted) {
      auto gains = std::get<PredictiveParameters>(parameters_.controller);
      static_cast<SensorNoise&>(gains) = wanted;
      adopt(gains);
    });
    freeze_service_ = node.advertiseService("freeze_learning", &LiveParameterServer::onFreeze, this);
    save_service_ = node.advertiseService("save_learned_model", &LiveParameterServer::onSave, this);
    if (learns()) {
      readLearned();
      writing_ = node.createTimer(kWritingPeriod, [this](const ros::TimerEvent&) { writeLearned(); });
    }
  }
  if (thesis_gains_ || predictive_gains_) logCertificate(parameters);
}

LiveParameterServer::~LiveParameterServer() {
  if (learns()) writeLearned();
}

void LiveParameterServer::adopt(const Gains& wanted) {
  NodeParameters changed = parameters_;
  std::visit([&](const auto& gains) { changed.controller = gains; }, wanted);
  requireStable(changed);
  logCertificate(changed);
  loop_.request(GainsInput{wanted});
  parameters_.controller = changed.controller;
}

/// The robot drives although the file cannot be used.
void LiveParameterServer::readLearned() {
  const std::string& path = parameters_.slip_file;
  try {
    if (const auto kept = readLearnedFile(path, configured_)) loop_.request(LearnedInput{*kept});
  } catch (const ParameterError& error) {
    const std::string aside = putAside(path) ? ", and the file is now " + path + ".old" : "";
    ROS_WARN("%s. Learning starts from the configuration%s", error.what(), aside.c_str());
  }
  if (writeLearned().empty()) ROS_INFO("Learned file %s: %s", path.c_str(), describe(loop_.learned()).c_str());
}

/// Returns why it failed, after a warning: a robot drives without the file, which the next attempt may write.
std::string LiveParameterServer::writeLearned() const {
  try {
    writeLearnedFile(parameters_.slip_file, loop_.learned(), configured_);
    return "";
  } catch (const ParameterError& error) {
    ROS_WARN("%s: the learned model is not saved", error.what());
    return error.what();
  }
}

bool LiveParameterServer::onFreeze(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
  loop_.request(LearningInput{static_cast<bool>(request.data)});
  response.success = true;
  response.message = (request.data ? "frozen: " : "learning: ") + describe(loop_.learned());
  return true;
}

bool LiveParameterServer::onSave(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  const std::string failure = learns() ? writeLearned() : "slip.file is not set: there is no file to write";
  response.success = failure.empty();
  response.message = failure.empty() ? parameters_.slip_file + ": " + describe(loop_.learned()) : failure;
  return true;
}

std::array<ros::ServiceServer, 2> serveDriving(ros::NodeHandle node, LoopExchange& loop) {
  using std_srvs::SetBool;
  using std_srvs::Trigger;
  const auto enable = [&loop](SetBool::Request& request, SetBool::Response& response) {
    loop.enable(request.data);
    response.success = true;
    response.message = request.data ? "enabled" : "disabled: the robot brakes, and stands until it is enabled again";
    ROS_INFO("Service enable: %s", response.message.c_str());
    return true;
  };
  const auto reset = [&loop](Trigger::Request&, Trigger::Response& response) {
    response.success = loop.atRest();
    if (response.success) loop.request(StartInput{});
    response.message =
        response.success ? "restarted; the learned model is kept" : "the robot is being driven: stop it first";
    ROS_INFO("Service reset: %s", response.message.c_str());
    return true;
  };
  return {node.advertiseService<SetBool::Request, SetBool::Response>("enable", enable),
          node.advertiseService<Trigger::Request, Trigger::Response>("reset", reset)};
}

}  // namespace jackal_aic
