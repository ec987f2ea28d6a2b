#pragma once

/// @file
/// Log lines and diagnostics of the node, by another thread than the one that drives.

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/time.h>

#include <boost/lockfree/spsc_queue.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "jackal_aic/safety/drive_loop.hpp"
#include "latest.hpp"
#include "status_report.hpp"

namespace jackal_aic {

/// Tells of a drive loop: log lines when it changes, and /diagnostics.
class DiagnosticsOutput {
 public:
  /// What is reported in addition to the status.
  struct Figures {
    std::uint32_t rejected_measurements = 0;
    double free_energy = 0.0;
    bool master_reachable = true;
    StopCauses missing;  ///< as in StatusReport::diagnose()
  };

  /// @param controller name of the preset, or of the structure; @param set_point_topic resolved name;
  /// @param set_point_deadline as StatusReport.
  DiagnosticsOutput(std::string controller, std::string set_point_topic, double set_point_deadline);

  /// In the thread that drives: hands over what is to be reported. Every change of what keeps the robot from driving
  /// is reported, unless more come than the other thread can take. @param contender as in StatusReport::update().
  void look(const DriveLoopStatus& status, const std::string& contender, const Figures& figures);

  /// In the thread that drives: why the robot is not driven.
  const std::string& reason() const { return reason_.text(); }

  /// In the other thread: logs what has changed, and publishes if it is time to, or if something has changed.
  /// @param unheard as in StatusReport::diagnose(); it is reported when it has lasted.
  void publish(const std::string& unheard);

 private:
  static constexpr std::size_t kWaiting = 64;  // changes that may wait

  struct Look {
    std::uint64_t number = 0;  // in their order
    DriveLoopStatus status;
    std::string contender;
  };

  bool tell(const Look& look);
  void announce();
  void fill(diagnostic_updater::DiagnosticStatusWrapper& status);

  // Of the thread that drives.
  StopReason reason_;
  std::uint64_t looks_ = 0;
  std::optional<DriveStatus> last_status_;
  bool untold_ = false;  // a change that did not fit

  boost::lockfree::spsc_queue<Look, boost::lockfree::capacity<kWaiting>> changes_;
  Latest<Look> newest_;
  Latest<Figures> figures_;

  // Of the other thread.
  std::string controller_;
  std::string set_point_topic_;
  ros::WallTime started_ = ros::WallTime::now();
  bool ready_told_ = false;
  bool missing_told_ = false;
  bool counted_ = false;  // figures have come
  StatusReport report_;
  std::uint64_t told_looks_ = 0;
  DriveStatus last_told_status_ = DriveStatus::idle;
  Figures told_;
  std::string unheard_;
  ros::WallTime heard_ = ros::WallTime::now();  // last time that the commands had a subscriber, or the start
  diagnostic_updater::Updater updater_;
};

}  // namespace jackal_aic
