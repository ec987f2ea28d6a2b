#include "thesis_structure.hpp"

#include "conversions.hpp"
#include "jackal_aic/certificate/advice.hpp"

namespace jackal_aic {

ThesisStructure::ThesisStructure(const ControllerParameters& gains, const GeometryParameters& geometry,
                                 const std::optional<PlantModel>& plant_model, ActiveInferenceController& controller)
    : geometry_(geometry),
      plant_model_(plant_model),
      controller_(controller),
      gain_server_("controller", gains, [this](const auto& wanted, const auto& running) { adopt(wanted, running); }) {
  reportCertificate(gains);
}

void ThesisStructure::reportCertificate(const ControllerParameters& gains) const {
  if (!plant_model_) {
    ROS_INFO("No plant model: of the gains, only the belief update was checked for stability");
    return;
  }
  const Certificate certificate = certify(gains, geometry_, *plant_model_);
  const std::string text = advice(certificate, gains, geometry_, *plant_model_);
  const auto level = certificate.keeps(MarginBounds{}) ? ros::console::levels::Info : ros::console::levels::Warn;
  ROS_LOG(level, ROSCONSOLE_DEFAULT_NAME, "%s", text.c_str());
}

void ThesisStructure::adopt(const ControllerParameters& wanted, const ControllerParameters& running) {
  requireInRange(wanted);
  validate(wanted, geometry_);
  if (plant_model_) {
    requireStable(wanted, geometry_, *plant_model_, &running);
    const std::string thin = thinMargin(LinearLoop(wanted, geometry_, *plant_model_));
    if (!thin.empty()) ROS_WARN("Gains with a thin margin: %s", thin.c_str());
  }
  controller_.adoptGains(wanted, geometry_);
}

ControllerState ThesisStructure::state() const {
  ControllerState message = stateMessage(controller_);
  message.effective_track = geometry_.effective_track;
  message.slip_factor = geometry_.slip_factor;
  return message;
}

SensorGeneralized ThesisStructure::measurement() const { return sensorMessage(controller_.measurement()); }

}  // namespace jackal_aic
