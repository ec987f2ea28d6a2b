#include "predictive_structure.hpp"

#include "conversions.hpp"

namespace jackal_aic {

PredictiveStructure::PredictiveStructure(ros::NodeHandle& node, const DriveLoop& loop)
    : controller_(*loop.predictive()),
      belief_publisher_(node.advertise<geometry_msgs::TwistWithCovarianceStamped>("jackal_AIC/belief", 10)) {}

ControllerState PredictiveStructure::state() const { return stateMessage(controller_); }

SensorGeneralized PredictiveStructure::measurement() const {
  return sensorMessage(GeneralizedSensor(controller_.measurement().vector()));
}

void PredictiveStructure::publish(const std_msgs::Header& header) {
  geometry_msgs::TwistWithCovarianceStamped message = beliefMessage(controller_);
  message.header = header;
  belief_publisher_.publish(message);
}

}  // namespace jackal_aic
