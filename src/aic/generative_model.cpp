#include "jackal_aic/aic/generative_model.hpp"

namespace jackal_aic {

GenerativeModel::GenerativeModel(const ControllerParameters& controller, const GeometryParameters& geometry)
    : tau(controller.tau),
      order_precision(noisePrecision(controller.orders, controller.noise_smoothness)),
      coloured(controller.noise_smoothness > 0.0) {
  const SkidSteerKinematics kinematics(geometry);
  sensory_map = kinematics.sensoryMap();
  forward_model = kinematics.forwardModel();

  const int columns = controller.orders + 1;
  state_precision.resize(kBodySize, columns);
  sensory_precision.resize(kSensorSize, columns);
  for (int i = 0; i < columns; ++i) {
    const int order = coloured ? 0 : i;
    state_precision.col(i).setConstant(1.0 / controller.state_variances[order]);
    sensory_precision.col(i).setConstant(1.0 / controller.sensory_variances[order]);
  }
}

GeneralizedBody GenerativeModel::weighted(const GeneralizedBody& state_error) const {
  const GeneralizedBody weighted = state_precision.cwiseProduct(state_error);
  return coloured ? GeneralizedBody(weighted.lazyProduct(order_precision)) : weighted;
}

GeneralizedSensor GenerativeModel::weighted(const GeneralizedSensor& sensory_error) const {
  const GeneralizedSensor weighted = sensory_precision.cwiseProduct(sensory_error);
  return coloured ? GeneralizedSensor(weighted.lazyProduct(order_precision)) : weighted;
}

}  // namespace jackal_aic
