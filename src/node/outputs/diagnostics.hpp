#pragma once

/// @file
/// State of the drive loop as log lines, when it changes, and as diagnostics. The texts are those of the core
/// (reason(), text(), remedy()).

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/time.h>

#include <boost/lockfree/spsc_queue.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "jackal_aic/safety/drive_loop.hpp"
#include "outputs/state_output.hpp"

namespace jackal_aic {

/// Logs what has changed between two updates of the status.
class StatusReport {
 public:
  /// @param set_point_deadline age at which a set point stops the robot [s]; 0: never.
  explicit StatusReport(double set_point_deadline = 0.0) : set_point_deadline_(set_point_deadline) {}

  /// Logs the changes of an action step; a fault that stops the robot is one line. @param contender other publisher of
  /// commands, if known. True if the reason for not driving has changed, so that diagnostics are due.
  bool update(const DriveLoopStatus& status, const std::string& contender);

  /// Logs a refused message. @param count number of refused messages.
  static void refused(const std::string& what, std::uint32_t count);

  /// Level, reason and counters of the last update. @param missing sources without a message since the start, in
  /// words, reported while it is idle. @param no_subscriber text if the commands have no subscriber; else empty.
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status, const std::string& missing = {},
                const std::string& no_subscriber = {}) const;

 private:
  bool logDecision(const DriveLoopStatus& before);
  void logStop(const char* what);
  void logFault(Fault before, bool stopped);
  void logLoss(bool stopped);
  void logClearedCause(const DriveLoopStatus& before) const;
  void diagnoseStatus(diagnostic_updater::DiagnosticStatusWrapper& status) const;

  double set_point_deadline_;
  DriveLoopStatus status_;
  Loss logged_loss_ = Loss::none;            // and not over yet
  StopCause logged_stop_ = StopCause::none;  // for which the robot brakes
  std::string reason_;                       // reason(DriveLoopStatus)
};

/// Log lines and /diagnostics of the node, in another thread than the driving one.
class DiagnosticsOutput {
 public:
  /// What is reported.
  struct Snapshot {
    DriveLoopStatus status;
    Surroundings around;
    std::string missing;  ///< as in StatusReport::diagnose()
    bool master_reachable = true;
  };

  /// @param preset its name; @param set_point_topic resolved name; @param set_point_deadline as StatusReport.
  DiagnosticsOutput(std::string preset, std::string set_point_topic, double set_point_deadline);

  /// In the thread that drives: hands over what is to be reported. While the other thread is seconds late, snapshots
  /// are dropped; a later one has the changes.
  void post(const Snapshot& snapshot) { snapshots_.push(snapshot); }

  /// In the other thread: logs changes, and publishes periodically and after changes.
  void publish();

 private:
  void announce();
  void fill(diagnostic_updater::DiagnosticStatusWrapper& status);

  boost::lockfree::spsc_queue<Snapshot, boost::lockfree::capacity<256>> snapshots_;

  // Of the other thread.
  std::string preset_, set_point_topic_;
  ros::WallTime started_ = ros::WallTime::now();
  bool ready_logged_ = false;
  StatusReport report_;
  std::optional<Snapshot> reported_;
  ros::WallTime connected_ = ros::WallTime::now();  // last time that the commands had a subscriber, or the start
  diagnostic_updater::Updater updater_;
};

}  // namespace jackal_aic
