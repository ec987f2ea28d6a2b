#pragma once

/// @file
/// The closed loop without ROS: plant and controller in steps of 1 ms. Only the seed of the plant is random, so equal
/// setups give equal samples.

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "jackal_plant.hpp"

namespace jackal_aic::sim {

/// Rounding of times that are multiples of a step [s].
inline constexpr double kTimeTolerance = 1e-9;

/// Set points over time. Each set point holds from its time on; the robot rests before the first.
struct SetPointProfile {
  /// A set point and the time from which it holds.
  struct Change {
    double time;         ///< [s]
    SetPoint set_point;  ///< base_link
  };
  std::vector<Change> changes;  ///< in order of time
  double duration = 0.0;        ///< end of the last [s]

  /// Set point at a time [s], kTimeTolerance allowed.
  SetPoint at(double time) const;

  /// Steps of the plant from the begin of the run to its end.
  std::int64_t plantSteps() const;
};

/// Time at rest before the first step [s].
inline constexpr double kRestTime = 0.5;

/// Phase of the loop's timers. YAML prefix `loop`.
struct LoopParameters {
  double phase = 0.0;  ///< age of the newest measurement when the action is computed [s], in steps of the plant
};

/// Lists the fields of LoopParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, LoopParameters& p) {
  v.field("phase", p.phase, {0.0, 1.0}, "s", Presence::optional);
}

/// Settings of a drive loop that always drives: without deadlines, watchdog and fault detection. It tolerates every
/// loss that the controller can handle. The caller sets controller, geometry, limits and model.
DriveParameters uninterrupted();

/// One step of the closed loop.
struct LoopStep {
  double time;                                    ///< [s]
  SetPoint set_point;                             ///< in force
  const std::optional<Observation>& observation;  ///< that the controller took in this step
  WheelCommand command;                           ///< last command [rad/s]
};

/// Hooks into a run, in the order of a step: changes of robot and sensors, recording. An empty function does nothing.
struct LoopHooks {
  std::function<void(double now)> disturb = {};  ///< acts on the robot
  /// Sample that the loop receives in place of the sensors'; empty: unchanged.
  std::function<Observation(const PlantMeasurement& sample, double now)> measure = {};
  std::function<void(const LoopStep& step)> sensed = {};  ///< after a sample, before the action
  std::function<void(const LoopStep& step)> done = {};    ///< after the action
};

/// Runs a drive loop on a plant along a profile from rest, the only place where both meet without ROS.
/// @param loop its phase is the lead of the plant and the sensors' clock over profile and controller.
void driveClosedLoop(JackalPlant& plant, DriveLoop& drive, const SetPointProfile& profile, const LoopHooks& hooks,
                     const LoopParameters& loop = {});

/// Reported body velocity of a run (base_link): the true one. On the box, where the chassis cannot move, that of the
/// wheels without slip (eq. 3-1), as the thesis plots it.
BodyVector reportedVelocity(const PlantTruth& truth, Support support, const SkidSteerKinematics& kinematics);

}  // namespace jackal_aic::sim
