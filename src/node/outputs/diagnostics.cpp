#include "outputs/diagnostics.hpp"

#include <fmt/format.h>
#include <ros/console.h>

#include <algorithm>
#include <utility>

#include "process/wall_times.hpp"

namespace jackal_aic {
namespace {

/// A remedy as the next sentence, or an empty text.
std::string sentence(const char* remedy) { return *remedy == '\0' ? "" : std::string(". ") + remedy; }

/// True before the first action step after a start or restart.
bool undecided(const DriveLoopStatus& status) {
  return status.decision.status == DriveStatus::idle && status.decision.cause == StopCause::none;
}

}  // namespace

bool StatusReport::update(const DriveLoopStatus& status, const std::string& contender) {
  const DriveLoopStatus before = std::exchange(status_, status);
  const std::string reason_before = std::exchange(reason_, jackal_aic::reason(status, contender));
  const bool decided =
      status.decision.status != before.decision.status || status.decision.cause != before.decision.cause;
  if (status.rejected_measurements != before.rejected_measurements) {
    refused("measurement whose stamp is not later than the last one, or ahead of the clock",
            status.rejected_measurements);
  }
  if (status.rejected_set_points != before.rejected_set_points) {
    refused("set point that is not finite, or far beyond the limits", status.rejected_set_points);
  }
  if (status.scaled_set_points > 0 && before.scaled_set_points == 0) {
    ROS_WARN(
        "Set point beyond the limits (%g m/s, %g rad/s): %g m/s, %g rad/s is driven. Told once; the diagnostics count",
        status.scaled_from.forward, status.scaled_from.yaw_rate, status.scaled_to.forward, status.scaled_to.yaw_rate);
  }
  if (status.dropped_periods != before.dropped_periods) {
    ROS_WARN_THROTTLE(1.0, "Control loop overrun: skipped %llu periods (machine busy?)",
                      static_cast<unsigned long long>(status.dropped_periods - before.dropped_periods));
  }
  const bool stopped = decided && logDecision(before);
  if (status.fault != before.fault) logFault(before.fault, stopped);
  if (status.loss != logged_loss_) logLoss(stopped);
  logClearedCause(before);
  return (decided || reason_ != reason_before) &&
         !undecided(status);  // why it is idle is reported with the next action step
}

void StatusReport::refused(const std::string& what, std::uint32_t count) {
  ROS_WARN_THROTTLE(1.0, "Rejected %s (%u so far)", what.c_str(), count);
}

void StatusReport::logFault(Fault before, bool stopped) {
  if (isFault(before) && !isFault(status_.fault)) ROS_INFO("Fault cleared: %s", text(before));
  if (status_.fault == Fault::moved) {
    ROS_INFO("The robot is %s", text(status_.fault));
  } else if (status_.fault == Fault::stuck) {
    ROS_WARN("The robot %s. %s", text(status_.fault), remedy(status_.fault));
  } else if (isFault(status_.fault)) {
    if (!stopped) ROS_WARN("Fault: %s. %s", text(status_.fault), remedy(status_.fault));
  } else if (status_.fault != Fault::none) {
    ROS_WARN_THROTTLE(10.0, "Noticed: %s. %s", text(status_.fault, status_.share).c_str(), remedy(status_.fault));
  }
}

/// @param stopped the stop was logged, with its reason.
void StatusReport::logLoss(bool stopped) {
  if (status_.loss == Loss::none) {
    ROS_INFO("Cleared: %s", text(logged_loss_));
  } else if (isFault(status_.fault)) {
    return;  // which names the loss and its reason
  } else if (!stopped) {
    ROS_WARN("Sensors: %s. %s", text(status_.loss), remedy(status_.loss));
  }
  logged_loss_ = status_.loss;
}

void StatusReport::logClearedCause(const DriveLoopStatus& before) const {
  const GateDecision& decision = status_.decision;
  if (!decision.unacknowledged || (before.decision.unacknowledged && before.decision.cause == decision.cause)) return;
  const std::string pause = set_point_deadline_ > 0.0 ? fmt::format(", or pause for {:g} s,", set_point_deadline_) : "";
  ROS_INFO("Cleared: %s. Send a zero set point%s to drive on", text(decision.cause), pause.c_str());
}

void StatusReport::logStop(const char* what) {
  const StopCause cause = status_.decision.cause;
  logged_stop_ = status_.decision.status == DriveStatus::braking ? cause : StopCause::none;
  const char* to_do = isFault(status_.fault)       ? remedy(status_.fault)
                      : status_.loss != Loss::none ? remedy(status_.loss)
                                                   : remedy(cause);
  const auto level = severity(cause) == Severity::fault ? ros::console::levels::Error : ros::console::levels::Warn;
  ROS_LOG(level, ROSCONSOLE_DEFAULT_NAME, "%s: %s", what, (reason_ + sentence(to_do)).c_str());
}

/// True if a stop was logged.
bool StatusReport::logDecision(const DriveLoopStatus& before) {
  const StopCause cause = status_.decision.cause;
  const bool logged = logged_stop_ == cause && before.decision.status == DriveStatus::braking;
  const DriveStatus now = status_.decision.status;
  // The end of the set points is the usual end of a drive, logged once at rest. The end of the node has its own
  // message.
  const bool usual = cause == StopCause::set_point_late || cause == StopCause::shutdown;
  const bool stopping = now == DriveStatus::braking;
  logged_stop_ = stopping ? logged_stop_ : StopCause::none;
  if (now == DriveStatus::driving) {
    ROS_INFO("Driving");
  } else if (now == DriveStatus::stopped && before.decision.status == DriveStatus::idle) {
    // At a start nothing has stopped, so only missing inputs are logged.
    ROS_INFO("Waiting: %s", (reason_ + sentence(remedy(cause))).c_str());
  } else if (now == DriveStatus::stopped && cause == StopCause::set_point_late) {
    ROS_INFO("Stopped: no set point for %g s", set_point_deadline_);
  } else if (!logged && (now == DriveStatus::faulted || (now != DriveStatus::idle && !usual))) {
    logStop(stopping ? "Stopping" : "Stopped");
    return true;
  }
  return false;
}

void StatusReport::diagnoseStatus(diagnostic_updater::DiagnosticStatusWrapper& status) const {
  using diagnostic_msgs::DiagnosticStatus;
  if (undecided(status_)) return status.summary(DiagnosticStatus::WARN, "no action step yet");
  const DriveStatus now = status_.decision.status;
  const bool sound = !isFault(status_.fault) && status_.loss == Loss::none;
  const bool usual =
      now == DriveStatus::idle || (now == DriveStatus::driving && (status_.handed_over || reason_.empty()));
  status.level = now == DriveStatus::faulted ? DiagnosticStatus::ERROR
                 : usual && sound            ? DiagnosticStatus::OK
                                             : DiagnosticStatus::WARN;
  status.message = now != DriveStatus::driving ? reason_
                   : reason_.empty()           ? "driving"
                   : usual && sound            ? reason_
                                               : "driving with a fault: " + reason_;
}

void StatusReport::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status, const std::string& missing,
                            const std::string& no_subscriber) const {
  diagnoseStatus(status);
  const auto warn = [&status](const std::string& message) {
    status.summary(std::max<std::uint8_t>(status.level, status.WARN), message);
  };
  if (!missing.empty() && status_.decision.status == DriveStatus::idle) warn(status.message + "; " + missing);
  if (!no_subscriber.empty()) {
    // Commands without a subscriber drive nothing, and resting motors would look like a hand-over.
    const bool drives = status_.decision.status == DriveStatus::driving && status.level == status.OK;
    warn(drives ? no_subscriber : status.message + "; " + no_subscriber);
  }
  status.add("Rejected set points", status_.rejected_set_points);
  status.add("Set points beyond the limits", status_.scaled_set_points);
  status.add("Dropped action periods", status_.dropped_periods);
  status.add("Clock resets", status_.clock_resets);
  status.add("Brakes", status_.brakes);
  status.add("Faults", status_.faults);
  status.add("Faults detected", status_.faults_detected);
  if (status_.suspicion.probability > 0.0) status.add("Hypothesis", status_.suspicion.text());
  status.add("Fault detection", isFault(status_.fault) ? text(status_.fault) : text(status_.loss));
}

DiagnosticsOutput::DiagnosticsOutput(std::string preset, std::string set_point_topic, double set_point_deadline)
    : preset_(std::move(preset)), set_point_topic_(std::move(set_point_topic)), report_(set_point_deadline) {
  updater_.setHardwareID("jackal");
  updater_.add("Active inference controller", this, &DiagnosticsOutput::fill);
}

void DiagnosticsOutput::announce() {
  if (ready_logged_) return;
  const bool drives = reported_->status.decision.status == DriveStatus::driving;  // which is reported itself
  ready_logged_ = drives || reported_->missing.empty();
  if (ready_logged_ && !drives) {
    ROS_INFO("Ready (%s). Waiting for set points on %s", preset_.c_str(), set_point_topic_.c_str());
  } else if (!ready_logged_ && (ros::WallTime::now() - started_).toSec() > kConnectionTime) {
    ROS_WARN_ONCE("%s: start the robot's bringup, or the simulation, first", reported_->missing.c_str());
  }
}

void DiagnosticsOutput::publish() {
  bool changed = false;
  snapshots_.consume_all([&](const Snapshot& snapshot) {
    changed = report_.update(snapshot.status, snapshot.around.contender) || changed || !reported_ ||
              snapshot.missing != reported_->missing;
    reported_ = snapshot;
    if (snapshot.around.no_subscriber.empty()) connected_ = ros::WallTime::now();
  });
  if (reported_) announce();
  // Changes are reported at once, not with the next period.
  changed ? updater_.force_update() : updater_.update();
}

void DiagnosticsOutput::fill(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const bool lasted = (ros::WallTime::now() - connected_).toSec() > kConnectionTime;
  const Snapshot snapshot = reported_.value_or(Snapshot{});
  report_.diagnose(status, snapshot.missing, lasted ? snapshot.around.no_subscriber : "");
  status.add("Rejected measurements", snapshot.status.rejected_measurements + snapshot.around.rejected);
  status.add("Master reachable", snapshot.master_reachable ? "yes" : "no");
}

}  // namespace jackal_aic
