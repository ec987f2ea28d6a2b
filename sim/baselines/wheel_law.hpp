#pragma once

/// @file
/// What the baselines of control have in common: one law per wheel, and a path that the drive train can follow.
///
/// Every law but the model predictive one is a regulator around the predictive controller's own path
/// (drive_train_reference.hpp): the input w* that takes the model along the path is fed forward, and the law answers
/// the deviation of the measured speed y from the speed w_e that the model expects of it,
///
///     u = w* / gain + v,    v = law(y - w_e).
///
/// So a step on a robot that is its model is the same for all of them, and what they differ in is what they do about
/// disturbances. Below the acceleration limit the deviation moves by the same drive train with the input v.

#include <memory>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/predictive/drive_train_reference.hpp"

namespace jackal_aic::sim {

/// Control of one wheel, at first at rest. The order of calls in an action period is predict() every WheelLaw::kStep,
/// correct() with a sample, act(), and hold() or overrule() if another command than that is driven.
class WheelLaw {
 public:
  static constexpr double kStep = DriveTrain::kStep;  ///< of predict() [s]
  static constexpr double kPeriod = 0.02;             ///< of samples and actions [s]

  virtual ~WheelLaw() = default;

  /// Starts at a speed [rad/s] that its command has been driving for long.
  virtual void reset(double speed) = 0;

  /// A step passes in which the command is applied.
  virtual void predict() = 0;

  /// Takes a measured speed [rad/s].
  virtual void correct(double measurement) = 0;

  /// The command [rad/s] for the next period towards a wanted speed [rad/s].
  virtual double act(double wanted) = 0;

  /// This is driven of the last command [rad/s].
  virtual void hold(double applied) = 0;

  /// This is driven in the next period, whatever is wanted [rad/s].
  virtual void overrule(double applied) = 0;

  virtual double command() const = 0;  ///< now driven [rad/s]

 protected:
  WheelLaw() = default;
  WheelLaw(const WheelLaw&) = default;
  WheelLaw& operator=(const WheelLaw&) = default;
};

/// Answers a deviation e [rad/s] of the wheel's speed with a command v [rad/s].
class Regulator {
 public:
  virtual ~Regulator() = default;

  /// Forgets everything: no deviation, and no command under way.
  virtual void reset() = 0;

  /// A step of WheelLaw::kStep passes in which v is applied.
  virtual void predict(double /*v*/) {}

  /// Takes the deviation e of a sample.
  virtual void correct(double e) = 0;

  /// v for the next action period.
  virtual double act() = 0;
};

/// A regulator around a path.
class PathFollower : public WheelLaw {
 public:
  /// @param model drive train; @param wheel_radius r [m]; @param reference_time of the path [s].
  PathFollower(const PlantModel& model, double wheel_radius, double reference_time,
               std::unique_ptr<Regulator> regulator);

  void reset(double speed) override;
  void predict() override;
  void correct(double measurement) override { regulator_->correct(measurement - expected_.speed()); }
  double act(double wanted) override;
  void hold(double applied) override;
  void overrule(double applied) override;
  double command() const override { return forward_ + feedback_; }

 private:
  double gain_;
  DriveTrainReference path_;
  DriveTrainPrediction expected_;  // w_e
  std::unique_ptr<Regulator> regulator_;
  double forward_ = 0.0;   // w*/gain
  double feedback_ = 0.0;  // v
};

}  // namespace jackal_aic::sim
