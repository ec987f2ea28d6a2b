#pragma once

/// @file
/// Decides which channels of the measurements count, and whether the robot may drive on them:
///
///     health of each source -> channels that are left -> loss policy -> causes to stop

#include <cstdint>
#include <limits>
#include <optional>

#include "jackal_aic/faults/fault_monitor.hpp"
#include "jackal_aic/model/imu_at_rest.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/safety/input_source.hpp"
#include "jackal_aic/safety/loss_policy.hpp"
#include "jackal_aic/safety/stop_cause.hpp"

namespace jackal_aic {

/// Health of all measurements.
struct SensorHealth {
  SourceHealth wheels;    ///< of the encoders
  SourceHealth imu;       ///< of gyro and accelerometer
  bool unpaired = false;  ///< no pair of both was taken for longer than their deadlines allow
};

/// Settings of the watch.
struct MeasurementWatchParameters {
  LossPolicyParameters on_loss;           ///< reaction to lost sensors
  bool open_loop = false;                 ///< no loss stops the open-loop baseline, which uses no channel
  std::optional<FaultParameters> faults;  ///< of the fault detection, which needs a plant model; empty: none
  GeometryParameters geometry;            ///< of the robot
  std::optional<PlantModel> plant_model;  ///< model of its motors
  double largest_wheel_speed = 127.5;     ///< limit of a plausible encoder [rad/s]
  double largest_yaw_rate = 20.0;         ///< limit of a plausible gyro [rad/s]
};

/// Checks every sample before the controller. Without fault detection it excludes only lost sources and impossible
/// readings. Time decreases only by restart(). After construction nothing allocates or throws.
class MeasurementWatch {
 public:
  explicit MeasurementWatch(const MeasurementWatchParameters& parameters);

  /// Advances by a time under the real command of the motors [rad/s]; empty if unknown. @param duration [s].
  void advance(const std::optional<WheelCommand>& command, double duration);

  /// Calibrates a sample with the IMU's bias at rest. Excludes lost, outlying and faulty channels, and impossible
  /// readings: above the largest wheel speed or yaw rate, or 10 g. @param health of the sources now; @param now [s].
  void judge(Observation& observation, const SensorHealth& health, double now);

  /// Causes to stop by the measurements. @param health of the sources now; @param now [s];
  /// @param at_rest the robot stands with a zero set point: recovery of wheels and sensors shows only on the move.
  StopCauses causes(const SensorHealth& health, double now, bool at_rest);

  /// Finding of the fault detection, else a remark on IMU or robot.
  Fault fault() const;

  /// Number of a remark on the wheels or the turn, see text(Fault, double); 1 without one.
  double share() const;

  /// Calibration of the IMU at rest.
  const ImuAtRest& imuAtRest() const { return imu_at_rest_; }

  /// The loss at the last causes(), unless a separate cause names it.
  Loss loss() const { return loss_; }

  /// True once measurements have arrived, or are overdue.
  bool started() const { return started_; }

  /// Faults detected since the start.
  std::uint32_t detected() const { return detected_; }

  /// Verdict of the fault detection; empty without it.
  const FaultReport* report() const { return monitor_ ? &monitor_->report() : nullptr; }

  /// Forgets measurements and faults.
  void reset();

  /// After time ran back: as restartAfterStall(), because the motors may have stopped or not, and waits for first
  /// measurements again: until they come no source is lost. @param now [s].
  void restart(double now);

  /// Forgets what was learned about encoders and IMU, for another robot. To be called after restart().
  void resetSensors();

  /// For a time without action steps (a stall, a clock that jumped forward), in which the motors may have stopped.
  /// Resets the motion, and accepts every sample until the robot follows its commands again. @param now [s].
  void restartAfterStall(double now);

  /// True while restartAfterStall() accepts every sample, because the motors do not follow their commands yet.
  bool recoversFromStall(double now) const { return now < stalled_until_; }

 private:
  void resetLosses();
  bool starting(const SensorHealth& health, double now);
  void resetReturnedSources(const SensorHealth& health);
  bool tooFewCount() const;   // although both sources send
  bool wheelsRepeat() const;  // both encoders at once: the source, on which its own deadline decides
  ChannelValidity excludeImpossible(Observation& observation, double step);
  ChannelValidity remaining(const SensorHealth& health) const;

  MeasurementWatchParameters parameters_;
  std::optional<FaultMonitor> monitor_;
  ImuAtRest imu_at_rest_;
  bool imu_was_lost_ = false;
  bool wheels_were_lost_ = false;
  struct {
    double yaw_rate = 0.0, wheel_left = 0.0, wheel_right = 0.0;
  } excluded_;                                              // time for which a channel was missing or impossible [s]
  bool started_ = false;                                    // measurements have come, or are overdue
  double first_source_ = 0.0;                               // time of the first message of a source [s]
  double blind_ = 0.0;                                      // for how long too few channels count [s]
  double wheels_repeating_ = 0.0;                           // for how long both encoders have been frozen [s]
  double stamp_ = std::numeric_limits<double>::infinity();  // of the last sample [s]
  double last_sight_ = 0.0;                                 // time at which two of yaw rate and wheels counted [s]
  double stalled_until_ = 0.0;                              // end of the time after a stall [s]
  Loss loss_ = Loss::none;
  std::uint32_t detected_ = 0;
};

}  // namespace jackal_aic
