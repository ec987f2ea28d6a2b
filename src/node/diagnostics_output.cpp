#include "diagnostics_output.hpp"

#include <ros/console.h>

#include <utility>

namespace jackal_aic {
namespace {

/// Wall time after which missing sensors are reported [s].
constexpr double kSensorPatience = 3.0;

/// Wall time in which a subscriber finds the commands at the start [s].
constexpr double kConnection = 2.0;

}  // namespace

DiagnosticsOutput::DiagnosticsOutput(std::string controller, std::string set_point_topic, double set_point_deadline)
    : controller_(std::move(controller)), set_point_topic_(std::move(set_point_topic)), report_(set_point_deadline) {
  updater_.setHardwareID("jackal");
  updater_.add("Active inference controller", this, &DiagnosticsOutput::fill);
}

void DiagnosticsOutput::look(const DriveLoopStatus& status, const std::string& contender, const Figures& figures) {
  const bool changed = reason_.update(status, contender) || status.decision.status != last_status_;
  last_status_ = status.decision.status;
  const Look look{++looks_, status, contender};
  // Changes are reported in their order. Of counters the newest value is enough.
  if (changed || untold_) untold_ = !changes_.push(look);
  newest_.write(look);
  figures_.write(figures);
}

bool DiagnosticsOutput::tell(const Look& look) {
  if (look.number <= told_looks_) return false;
  told_looks_ = look.number;
  last_told_status_ = look.status.decision.status;
  return report_.update(look.status, look.contender);
}

void DiagnosticsOutput::announce() {
  if (ready_told_ || !counted_) return;
  if (last_told_status_ == DriveStatus::driving) ready_told_ = true;  // which is reported itself
  if (told_.missing.worst() == StopCause::none && !ready_told_) {
    ready_told_ = true;
    ROS_INFO("Ready (%s). Waiting for set points on %s", controller_.c_str(), set_point_topic_.c_str());
  }
  if (ready_told_ || missing_told_ || (ros::WallTime::now() - started_).toSec() < kSensorPatience) return;
  missing_told_ = true;
  const bool no_wheels = told_.missing.hasAny({StopCause::wheels_missing});
  const bool no_imu = told_.missing.hasAny({StopCause::imu_missing});
  ROS_WARN("No %s yet: start the robot's bringup, or the simulation, first",
           no_wheels && no_imu ? "wheel speeds (joint_states) and no IMU data (imu/data)"
           : no_wheels         ? "wheel speeds (joint_states)"
                               : "IMU data (imu/data)");
}

void DiagnosticsOutput::publish(const std::string& unheard) {
  if (unheard.empty()) heard_ = ros::WallTime::now();
  unheard_ = unheard;
  const StopCause missing = told_.missing.worst();
  if (const Figures* figures = figures_.read()) {
    told_ = *figures;
    counted_ = true;
  }
  report_.settle();
  bool changed = told_.missing.worst() != missing;
  changes_.consume_all([&](const Look& look) { changed = tell(look) || changed; });
  if (const Look* look = newest_.read()) changed = tell(*look) || changed;
  announce();
  // Changes are reported at once, not with the next period.
  changed ? updater_.force_update() : updater_.update();
}

void DiagnosticsOutput::fill(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const bool lasted = (ros::WallTime::now() - heard_).toSec() > kConnection;
  report_.diagnose(status, told_.missing, lasted ? unheard_ : "");
  status.add("Rejected measurements", told_.rejected_measurements);
  status.add("Master reachable", told_.master_reachable ? "yes" : "no");
  status.add("Free energy", told_.free_energy);
}

}  // namespace jackal_aic
