#include "predictive_structure.hpp"

#include <fmt/format.h>

#include "conversions.hpp"
#include "jackal_aic/certificate/advice.hpp"

namespace jackal_aic {
namespace {

const ros::Duration kKeepPeriod(10.0);  // of writing the slip file

std::string describe(const SlipState& slip) {
  return fmt::format("effective track {:g} m, slip factor {:g}", slip.effective_track, slip.slip_factor);
}

}  // namespace

PredictiveStructure::PredictiveStructure(ros::NodeHandle& node, const PredictiveParameters& gains,
                                         const std::string& slip_file, DriveLoop& loop)
    : loop_(loop),
      controller_(dynamic_cast<const PredictiveController&>(loop.controller())),
      gains_(gains),
      belief_publisher_(node.advertise<geometry_msgs::TwistWithCovarianceStamped>("jackal_AIC/belief", 10)),
      freeze_service_(
          ros::NodeHandle("~").advertiseService("freeze_learning", &PredictiveStructure::onFreezeLearning, this)),
      gain_server_(ros::NodeHandle("~predictive"), gains,
                   [this](const auto& wanted, const auto&) { adoptGains(wanted); }),
      variance_server_(ros::NodeHandle("~sensors"), gains,
                       [this](const auto& wanted, const auto&) { adoptVariances(wanted); }) {
  reportCertificate(gains);
  if (!slip_file.empty()) openSlipFile(slip_file);
}

PredictiveStructure::~PredictiveStructure() {
  if (!slip_writer_) return;
  slip_writer_->write(controller_.slip());
  slip_writer_->finish();
  if (!slip_writer_->failure().empty()) ROS_ERROR("%s", slip_writer_->failure().c_str());
}

void PredictiveStructure::reportCertificate(const PredictiveParameters& gains) const {
  const PlantModel& model = controller_.model();
  const PredictiveCertificate certificate = certify(gains, model, model);
  const std::string text = advice(certificate, gains, model, model);
  const auto level = certificate.keeps(MarginBounds{}) ? ros::console::levels::Info : ros::console::levels::Warn;
  ROS_LOG(level, ROSCONSOLE_DEFAULT_NAME, "%s", text.c_str());
}

void PredictiveStructure::openSlipFile(const std::string& path) {
  if (const auto kept = readSlipFile(path, controller_.slip())) loop_.setSlip(*kept, ros::Time::now().toSec());
  slip_writer_.emplace(path, controller_.slip());
  ROS_INFO("Slip kept in %s: %s", path.c_str(), describe(controller_.slip()).c_str());
}

void PredictiveStructure::keepSlip(const ros::Time& now) {
  const bool due = now < slip_kept_ || now - slip_kept_ >= kKeepPeriod;
  if (!slip_writer_ || !due) return;
  slip_writer_->write(controller_.slip());
  slip_kept_ = now;
  const std::string failure = slip_writer_->failure();
  if (!failure.empty()) ROS_WARN("%s", failure.c_str());
}

bool PredictiveStructure::onFreezeLearning(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
  loop_.freezeLearning(request.data, ros::Time::now().toSec());
  response.success = true;
  response.message = (request.data ? "frozen: " : "learning: ") + describe(controller_.slip());
  return true;
}

void PredictiveStructure::adoptGains(PredictiveParameters wanted) {
  static_cast<SensorNoise&>(wanted) = gains_;
  requireInRange(wanted, "predictive");
  adopt(wanted);
}

void PredictiveStructure::adoptVariances(const SensorNoise& wanted) {
  requireInRange(wanted, "sensors");
  PredictiveParameters gains = gains_;
  static_cast<SensorNoise&>(gains) = wanted;
  adopt(gains);
}

void PredictiveStructure::adopt(const PredictiveParameters& wanted) {
  validate(wanted);
  const PlantModel& model = controller_.model();
  requireStable(wanted, model, model, &gains_);
  const std::string thin = thinMargin(PredictiveLinearLoop(wanted, model, model));
  if (!thin.empty()) ROS_WARN("Gains with a thin margin: %s", thin.c_str());
  loop_.adoptGains(wanted, ros::Time::now().toSec());
  gains_ = wanted;
}

ControllerState PredictiveStructure::state() const { return stateMessage(controller_); }

SensorGeneralized PredictiveStructure::measurement() const {
  return sensorMessage(GeneralizedSensor(controller_.measurement().vector()));
}

void PredictiveStructure::publish(const std_msgs::Header& header) {
  geometry_msgs::TwistWithCovarianceStamped message = beliefMessage(controller_);
  message.header = header;
  belief_publisher_.publish(message);
  keepSlip(header.stamp);
}

}  // namespace jackal_aic
