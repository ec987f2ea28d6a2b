#pragma once

/// @file
/// A linear robot under a sampled controller, followed through the events of one common period. Internal to the core.

#include <Eigen/Core>
#include <cstdint>
#include <map>

#include "jackal_aic/certificate/loop_clock.hpp"
#include "jackal_aic/certificate/margins.hpp"
#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/plant_model.hpp"

namespace jackal_aic {

/// States of a loop, a trajectory in every column: those of the controller, the action, the commands under way, wheel
/// speed and correction of the velocity loop.
class LoopTrajectories {
 public:
  virtual ~LoopTrajectories() = default;

  /// Map of the states over one common period.
  Eigen::MatrixXd afterOnePeriod();

 protected:
  /// @param robot with its gain already changed; @param controller_rows states of the controller; @param
  /// least_commands past commands that the controller asks for beside the action.
  LoopTrajectories(const LoopClock& clock, const PlantModel& robot, const LoopChange& change, double longest_phase,
                   int controller_rows, int least_commands);

  virtual void measure() = 0;            ///< the sensor takes a sample of the wheel
  virtual void predict(std::int64_t) {}  ///< an inner step of the belief ends now [ns]
  virtual void believe() = 0;            ///< a belief update
  virtual void act() = 0;                ///< the action changes; the commands under way have moved on by one

  std::int64_t phase() const { return phase_; }  ///< [ns]
  int actionRow() const { return controller_rows_; }
  int commandRow(int back) const { return actionRow() + back; }  ///< of the command sent `back` action steps ago
  int wheelRow() const { return actionRow() + past_commands_ + 1; }

  Eigen::MatrixXd states_;

 private:
  void drive(std::int64_t time);
  void send();
  void happen(LoopEvent event, std::int64_t now);

  const LoopClock& clock_;
  PlantModel robot_;
  int controller_rows_;
  std::int64_t phase_;
  int whole_periods_;       // of the robot's dead time, in action periods
  std::int64_t remainder_;  // of the robot's dead time [ns]
  int past_commands_;       // kept beside the action
  bool arrived_ = false;    // the newer of the two commands of this action period acts
  std::map<std::int64_t, DriveTrainResponse> responses_;
};

}  // namespace jackal_aic
