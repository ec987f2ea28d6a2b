#include "thesis_structure.hpp"

#include "conversions.hpp"
#include "jackal_aic/certificate/advice.hpp"

namespace jackal_aic {

ThesisStructure::ThesisStructure(const ControllerParameters& gains, const GeometryParameters& geometry, DriveLoop& loop)
    : geometry_(geometry),
      loop_(loop),
      controller_(dynamic_cast<const ActiveInferenceController&>(loop.controller())),
      gain_server_(ros::NodeHandle("~controller"), gains,
                   [this](const auto& wanted, const auto& running) { adopt(wanted, running); }) {
  reportCertificate(gains);
}

void ThesisStructure::reportCertificate(const ControllerParameters& gains) const {
  const std::optional<PlantModel>& plant = controller_.plantModel();
  if (!plant) {
    ROS_INFO("No plant model: of the gains, only the belief update was checked for stability");
    return;
  }
  const Certificate certificate = certify(gains, geometry_, *plant);
  const std::string text = advice(certificate, gains, geometry_, *plant);
  const auto level = certificate.keeps(MarginBounds{}) ? ros::console::levels::Info : ros::console::levels::Warn;
  ROS_LOG(level, ROSCONSOLE_DEFAULT_NAME, "%s", text.c_str());
}

void ThesisStructure::adopt(const ControllerParameters& wanted, const ControllerParameters& running) {
  requireInRange(wanted);
  validate(wanted, geometry_);
  if (const std::optional<PlantModel>& plant = controller_.plantModel()) {
    requireStable(wanted, geometry_, *plant, &running);
    const std::string thin = thinMargin(LinearLoop(wanted, geometry_, *plant));
    if (!thin.empty()) ROS_WARN("Gains with a thin margin: %s", thin.c_str());
  }
  loop_.adoptGains(wanted, ros::Time::now().toSec());
}

ControllerState ThesisStructure::state() const {
  ControllerState message = stateMessage(controller_);
  message.effective_track = geometry_.effective_track;
  message.slip_factor = geometry_.slip_factor;
  return message;
}

SensorGeneralized ThesisStructure::measurement() const { return sensorMessage(controller_.measurement()); }

}  // namespace jackal_aic
