#pragma once

/// @file
/// The predictive controller in the node.

#include <ros/publisher.h>
#include <ros/service_server.h>
#include <std_srvs/SetBool.h>

#include <optional>
#include <string>

#include "controller_structure.hpp"
#include "gain_server.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"
#include "slip_file.hpp"

namespace jackal_aic {

/// Publishes the belief, an estimate of odometry grade, on jackal_AIC/belief
/// (geometry_msgs/TwistWithCovarianceStamped). Service ~freeze_learning (std_srvs/SetBool) stops and resumes the
/// learning of the slip. With a slip file, what was learned outlives the node.
class PredictiveStructure : public ControllerStructure {
 public:
  /// Opens the topic in the namespace of `node`. @param slip_file path, or empty; @param loop whose controller has
  /// these gains; it has to outlive the structure. @throws ParameterError if the slip file cannot be read or written.
  PredictiveStructure(ros::NodeHandle& node, const PredictiveParameters& gains, const std::string& slip_file,
                      DriveLoop& loop);

  /// Keeps the slip for the next start.
  ~PredictiveStructure() override;

  ControllerState state() const override;
  SensorGeneralized measurement() const override;
  void publish(const std_msgs::Header& header) override;

 private:
  void reportCertificate(const PredictiveParameters& gains) const;
  void openSlipFile(const std::string& path);
  void keepSlip(const ros::Time& now);
  void adoptGains(PredictiveParameters wanted);
  void adoptVariances(const SensorNoise& wanted);
  void adopt(const PredictiveParameters& wanted);
  bool onFreezeLearning(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);

  DriveLoop& loop_;
  const PredictiveController& controller_;  // of the loop; its gains are certified on a robot that is as it believes
  PredictiveParameters gains_;              // in force
  std::optional<SlipWriter> slip_writer_;   // with a slip file
  ros::Time slip_kept_;                     // when the writer last got the slip
  ros::Publisher belief_publisher_;
  ros::ServiceServer freeze_service_;
  GainServer<PredictiveParameters, PredictiveGainsConfig> gain_server_;
  GainServer<SensorNoise, SensorNoiseConfig> variance_server_;
};

}  // namespace jackal_aic
