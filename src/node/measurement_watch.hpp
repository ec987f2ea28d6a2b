#pragma once

/// @file
/// Which channels of the measurements count: what was lost, what the fault detection excludes, and whether the robot
/// may drive on what remains.

#include <cstdint>
#include <optional>
#include <string>

#include "jackal_aic/drive_gate.hpp"
#include "jackal_aic/fault_monitor.hpp"
#include "jackal_aic/loss_policy.hpp"
#include "jackal_aic/stop_cause.hpp"
#include "node_parameters.hpp"

namespace jackal_aic {

/// Judges every sample before the controller sees it. Without a plant model nothing is predicted, so that only lost
/// sources count as lost.
class MeasurementWatch {
 public:
  explicit MeasurementWatch(const NodeParameters& parameters);

  /// Lets time pass under a command [rad/s] that the motors really have. @param duration [s].
  void advance(const WheelCommand& command, double duration);

  /// Excludes channels of a sample that are lost, outliers or faulty, or read what no robot does: more than
  /// watchdog.belief_bound times the limits, or more than 10 g. @param now [s].
  void judge(Observation& observation, double now);

  /// Takes back causes that the loss policy tolerates, and adds that too little is left to drive on. @param at_rest the
  /// robot stands and is not to move: whether a wheel or a sensor is good again shows only on the move.
  void applyPolicy(StopCauses& causes, double now, bool at_rest);

  /// True if no IMU data come, as of the last applyPolicy(): wheel speeds have no partner then.
  bool imuSilent() const { return imu_silent_; }

  /// True if no wheel speeds come, as of the last applyPolicy().
  bool wheelsSilent() const { return wheels_silent_; }

  /// What is lost or faulty, in a few words; empty if nothing is.
  std::string reason() const;

  /// Faults detected since the start.
  std::uint32_t detected() const { return detected_; }

  /// Forgets measurements and faults.
  void reset();

  /// As reset(), and waits for the first measurements again: what has not come yet is not lost.
  void restart();

  /// After a time without action steps (a stall, a clock that jumped forward), in which the motors may have stopped by
  /// themselves: forgets, and trusts every sample until the robot does what it is told again. @param now [s].
  void forgiveStall(double now);

  /// True for as long as forgiveStall() has every sample trusted: what the motors do is not yet what they are told.
  bool trustsBlindly(double now) const { return now < stalled_until_; }

 private:
  bool starting(const StopCauses& causes, double now);
  void noteSources(const StopCauses& causes);
  void tell(const std::string& before);
  bool blind() const;         // although both sources speak
  bool wheelsRepeat() const;  // both encoders at once: the source, on which its own deadline decides
  void excludeImpossible(Observation& observation);
  ChannelValidity remaining() const;
  LossTolerance tolerance() const;

  LossPolicyParameters policy_;
  double largest_wheel_speed_;  // that a sound encoder can read [rad/s]
  double largest_yaw_rate_;     // that a sound gyro can read [rad/s]
  bool predictive_;
  bool on_box_;
  std::optional<FaultMonitor> monitor_;
  bool imu_silent_ = false;
  bool wheels_silent_ = false;
  bool imu_lost_ = false;     // silent or frozen
  bool wheels_lost_ = false;  // silent or frozen
  struct {
    int yaw_rate = 0, wheel_left = 0, wheel_right = 0;
  } excluded_;                  // samples in a row in which a channel read what no robot does
  bool started_ = false;        // measurements have come, or are overdue
  double first_source_ = 0.0;   // time at which a source spoke first [s]
  int blind_samples_ = 0;       // in a row of which too few channels count
  int wheels_repeating_ = 0;    // samples in a row for which both encoders have been frozen
  double last_sight_ = 0.0;     // time at which two of yaw rate and wheels counted [s]
  double stalled_until_ = 0.0;  // end of the time after a stall [s]
  const char* loss_ = "";
  std::uint32_t detected_ = 0;
};

}  // namespace jackal_aic
