#include "jackal_aic/aic/generative_model.hpp"

#include "jackal_aic/model/skid_steer_kinematics.hpp"

namespace jackal_aic {

GenerativeModel::GenerativeModel(const ControllerParameters& controller, const GeometryParameters& geometry) {
  tau = controller.tau;
  const SkidSteerKinematics kinematics(geometry);
  sensory_map = kinematics.sensoryMap();
  forward_model = kinematics.forwardModel();

  const int columns = controller.orders + 1;
  state_precision.resize(kBodySize, columns);
  sensory_precision.resize(kSensorSize, columns);
  for (int i = 0; i < columns; ++i) {
    state_precision.col(i).setConstant(1.0 / controller.state_variances[i]);
    sensory_precision.col(i).setConstant(1.0 / controller.sensory_variances[i]);
  }
}

}  // namespace jackal_aic
