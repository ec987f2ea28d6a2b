#pragma once

/// @file
/// What the closed loop without ROS can drive a plant with: one interface, one adapter per controller.

#include <cstdint>
#include <memory>
#include <optional>

#include "differential_drive.hpp"
#include "jackal_aic/active_inference_controller.hpp"
#include "jackal_aic/command_limiter.hpp"
#include "jackal_aic/gate_parameters.hpp"
#include "jackal_aic/parameters.hpp"
#include "jackal_aic/predictive_controller.hpp"
#include "jackal_aic/types.hpp"
#include "jackal_aic/velocity_controller.hpp"

namespace jackal_aic::sim {

/// What a controller learned about its robot.
struct Learned {
  SlipState slip;             ///< effective track and slip
  SensorVariances variances;  ///< of the measurements
};

/// A controller of the body velocity that is served by simulated time.
class TimedController {
 public:
  virtual ~TimedController() = default;

  /// Desired body velocity (base_link) from now on.
  virtual void setSetPoint(const SetPoint& set_point) = 0;

  /// Takes a sample of the sensors.
  virtual void observe(const Observation& observation) = 0;

  /// Runs every step that is due at this time [s] (never decreasing). Returns the wheel speeds to drive if a command is
  /// due, within the limits of the robot.
  virtual std::optional<WheelCommand> advance(double now) = 0;

  /// Believed body velocity; empty if the controller has no belief.
  virtual std::optional<BodyVector> belief() const = 0;

  /// What it learned; empty if it does not learn.
  virtual std::optional<Learned> learned() const { return std::nullopt; }
};

/// Counts the steps of a fixed rate that simulated time has reached.
class StepCounter {
 public:
  explicit StepCounter(double rate) : rate_(rate) {}

  /// True as long as a step is due at this time [s]; counts it as done. The first step is due one period after time 0.
  bool due(double now);

 private:
  double rate_;
  std::int64_t done_ = 0;
};

/// Settings of the thesis' controller as the node has them.
struct ActiveInferenceSetup {
  ControllerParameters controller;
  GeometryParameters geometry;
  LimitParameters limits;
  std::optional<PlantModel> model;  ///< what the motors can follow; without it the thesis' action as printed
};

/// Settings of the predictive controller.
struct PredictiveSetup {
  PredictiveParameters controller;
  GeometryParameters geometry;
  LimitParameters limits;
  PlantModel model;  ///< drive train as the controller believes it
};

/// An active inference controller with the node's order of steps (belief first, then action) and its limits, at
/// which the action is held.
class LimitedController : public TimedController {
 public:
  /// @param geometry r and b_hat for the limits of the body velocity.
  LimitedController(std::unique_ptr<VelocityController> controller, const LimitParameters& limits,
                    const GeometryParameters& geometry);

  void setSetPoint(const SetPoint& set_point) override {
    if (controller_->setSetPoint(set_point)) set_point_ = set_point;
  }
  void observe(const Observation& observation) override { controller_->observe(observation); }
  std::optional<WheelCommand> advance(double now) override;
  std::optional<BodyVector> belief() const override { return controller_->believedVelocity(); }

 protected:
  /// What it was built with.
  const VelocityController& controller() const { return *controller_; }

 private:
  std::unique_ptr<VelocityController> controller_;
  CommandLimiter limiter_;
  SetPoint set_point_;
  StepCounter belief_clock_;
  int belief_steps_ = 0;
};

/// The predictive controller likewise.
class LimitedPredictiveController : public LimitedController {
 public:
  /// @throws ParameterError if the rates are invalid.
  explicit LimitedPredictiveController(const PredictiveSetup& setup);

  std::optional<Learned> learned() const override;
};

/// The controller of a setup. A belief update that diverges is run as it is, because the thesis shows such cases.
/// @throws ParameterError if a rate or a list of variances is invalid.
std::unique_ptr<TimedController> makeTimedController(const ActiveInferenceSetup& setup);

/// The controller of a setup. @throws ParameterError if the rates are invalid.
std::unique_ptr<TimedController> makeTimedController(const PredictiveSetup& setup);

/// The open-loop differential drive baseline.
class TimedDifferentialDrive : public TimedController {
 public:
  explicit TimedDifferentialDrive(const DifferentialDriveParameters& parameters)
      : drive_(parameters), clock_(parameters.rate) {}

  void setSetPoint(const SetPoint& set_point) override { drive_.setSetPoint(set_point); }
  void observe(const Observation&) override {}
  std::optional<WheelCommand> advance(double now) override;
  std::optional<BodyVector> belief() const override { return std::nullopt; }

 private:
  DifferentialDrive drive_;
  StepCounter clock_;
};

/// The baseline with these settings.
std::unique_ptr<TimedController> makeTimedController(const DifferentialDriveParameters& parameters);

}  // namespace jackal_aic::sim
