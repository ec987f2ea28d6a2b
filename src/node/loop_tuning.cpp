#include "loop_tuning.hpp"

#include <fmt/format.h>
#include <ros/service_server.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <chrono>
#include <optional>
#include <string>
#include <variant>

#include "gain_server.hpp"
#include "jackal_aic/certificate/certificate.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "slip_file.hpp"

namespace jackal_aic {
namespace {

const ros::Duration kKeepPeriod(10.0);                  // of writing the slip file
constexpr std::chrono::milliseconds kDiskPatience(15);  // of a request, during which a node does not drive

std::string describe(const LearnedModel& learned) {
  std::string text =
      fmt::format("effective track {:g} m, slip factor {:g}", learned.slip.effective_track, learned.slip.slip_factor);
  if (learned.timing) {
    text += fmt::format(", dead time {:.3f} s, lag {:.3f} s", learned.timing->dead_time, learned.timing->lag);
  }
  return text;
}

void tellCertificate(const LinearLoop& loop) {
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

/// The baseline has no gains to change, and learns nothing.
class NoTuning : public LoopTuning {
 public:
  void keep(const ros::Time&) override {}
};

class ThesisTuning : public LoopTuning {
 public:
  ThesisTuning(const ros::NodeHandle& node, const NodeParameters& parameters, const ControllerParameters& gains,
               LoopChanges& loop)
      : geometry_(parameters.geometry),
        loop_(loop),
        gain_server_({node, "controller"}, gains, [this](const auto& wanted) { adopt(wanted); }) {
    if (parameters.plant_model) plant_ = drivenModel(*parameters.plant_model);
    if (!plant_) {
      ROS_INFO("No plant model: checked the stability of the belief update only, not of the closed loop");
      return;
    }
    tellCertificate(LinearLoop(gains, geometry_, *plant_));
  }

  void keep(const ros::Time&) override {}

 private:
  void adopt(const ControllerParameters& wanted) {
    requireInRange(wanted, "controller");
    validate(wanted, geometry_);
    if (plant_) requireStableGains(LinearLoop(wanted, geometry_, *plant_));
    loop_.adoptGains(wanted);
  }

  GeometryParameters geometry_;
  std::optional<PlantModel> plant_;
  LoopChanges& loop_;
  GainServer<ControllerParameters, ControllerGainsConfig> gain_server_;
};

/// Gains are certified on a robot that is as the controller believes.
class PredictiveTuning : public LoopTuning {
 public:
  PredictiveTuning(const ros::NodeHandle& node, const NodeParameters& parameters, const PredictiveParameters& gains,
                   LoopChanges& loop)
      : model_(drivenModel(parameters.plant_model.value())),
        gains_(gains),
        loop_(loop),
        freeze_service_(ros::NodeHandle(node).advertiseService("freeze_learning", &PredictiveTuning::onFreeze, this)),
        save_service_(ros::NodeHandle(node).advertiseService("save_learned_model", &PredictiveTuning::onSave, this)),
        gain_server_({node, "predictive"}, gains, [this](const auto& wanted) { adoptGains(wanted); }),
        variance_server_({node, "sensors"}, gains, [this](const auto& wanted) { adoptVariances(wanted); }) {
    tellCertificate(LinearLoop(gains, model_, model_));
    if (!parameters.slip_file.empty()) openSlipFile(parameters.slip_file);
  }

  ~PredictiveTuning() override {
    if (!slip_writer_) return;
    slip_writer_->write(loop_.learned());
    slip_writer_->finish();
    if (!slip_writer_->failure().empty()) ROS_ERROR("%s", slip_writer_->failure().c_str());
  }

  void keep(const ros::Time& now) override {
    const bool due = now < slip_kept_ || now - slip_kept_ >= kKeepPeriod;
    if (!slip_writer_ || !due) return;
    slip_writer_->write(loop_.learned());
    slip_kept_ = now;
    tellFailure();
  }

 private:
  void openSlipFile(const std::string& path) {
    const LearnedModel told = loop_.learned();
    LearnedModel learned = told;
    if (const auto kept = readSlipFile(path, told)) {
      loop_.setLearned(learned = kept->learned);
      if (!kept->left_out.empty())
        ROS_WARN("Ignored part of the learned file %s: %s", path.c_str(), kept->left_out.c_str());
    }
    slip_path_ = path;
    slip_writer_.emplace(path, learned, told);
    if (!tellFailure()) ROS_INFO("Learned file %s: %s", path.c_str(), describe(learned).c_str());
  }

  /// A robot drives without the file, which the next attempt may write. True if the last one failed.
  bool tellFailure() const {
    const std::string failure = slip_writer_->failure();
    if (!failure.empty()) ROS_WARN("%s: what is learned is not kept", failure.c_str());
    return !failure.empty();
  }

  bool onFreeze(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
    loop_.freezeLearning(request.data);
    response.success = true;
    response.message = (request.data ? "frozen: " : "learning: ") + describe(loop_.learned());
    return true;
  }

  bool onSave(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
    if (!slip_writer_) {
      response.message = "slip.file is not set: what is learned is kept nowhere";
      return true;
    }
    const LearnedModel learned = loop_.learned();
    slip_writer_->write(learned);
    const std::optional<std::string> failure = slip_writer_->outcome(kDiskPatience);
    response.success = !failure || failure->empty();
    response.message = response.success ? slip_path_ + ": " + describe(learned) : *failure;
    if (!failure) response.message += "; the disk is slow, it is still being written";
    return true;
  }

  void adoptGains(PredictiveParameters wanted) {
    static_cast<SensorNoise&>(wanted) = gains_;
    requireInRange(wanted, "predictive");
    adopt(wanted);
  }

  void adoptVariances(const SensorNoise& wanted) {
    requireInRange(wanted, "sensors");
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
  LoopChanges& loop_;
  std::string slip_path_;
  std::optional<SlipWriter> slip_writer_;  // with a slip file
  ros::Time slip_kept_;                    // when the writer last got what was learned
  ros::ServiceServer freeze_service_;
  ros::ServiceServer save_service_;
  GainServer<PredictiveParameters, PredictiveGainsConfig> gain_server_;
  GainServer<SensorNoise, SensorNoiseConfig> variance_server_;
};

}  // namespace

std::unique_ptr<LoopTuning> makeTuning(const ros::NodeHandle& node, const NodeParameters& parameters,
                                       LoopChanges& loop) {
  if (const auto* gains = std::get_if<PredictiveParameters>(&parameters.controller)) {
    return std::make_unique<PredictiveTuning>(node, parameters, *gains, loop);
  }
  if (const auto* gains = std::get_if<ControllerParameters>(&parameters.controller)) {
    return std::make_unique<ThesisTuning>(node, parameters, *gains, loop);
  }
  return std::make_unique<NoTuning>();
}

}  // namespace jackal_aic
