#pragma once

/// @file
/// A controller written in Python as a VelocityController of C++.

#include "bindings.hpp"

namespace jackal_aic::python {

/// Drives by the method act(set_point, observation) of a Python object (class jackal_aic.VelocityController).
class PythonController : public VelocityController {
 public:
  /// @throws ParameterError if it is another kind of object, or its rate is not in [1, 1000] Hz or no
  /// divisor of 1000 Hz.
  explicit PythonController(py::object self);
  ~PythonController() override;

  bool setSetPoint(const SetPoint& set_point) override;
  SampleVerdict observe(const Observation& observation) override;
  void updateBelief() override {}

  /// Calls act() under the GIL with the last set point and observation. @throws ParameterError if the result is not
  /// finite; what act() raises.
  WheelCommand updateAction() override;

  void hold(const WheelCommand& applied) override { action_ = applied; }
  void overrule(const WheelCommand& applied) override { action_ = applied; }
  void restart() override { reset(); }

  /// The object's reset() is called before the next act().
  void reset() override;

  bool hasBelief() const override { return believed_.has_value(); }
  BodyVector believedVelocity() const override { return believed_.value_or(BodyVector::Zero()); }
  WheelCommand action() const override { return action_; }
  double freeEnergy() const override { return 0.0; }
  double beliefStep() const override { return step_; }
  int beliefStepsPerAction() const override { return 1; }

 private:
  py::object self_;
  double step_;  // s
  SetPoint set_point_;
  Observation observation_;
  WheelCommand action_;
  std::optional<BodyVector> believed_;
  bool started_ = false;
  bool to_reset_ = true;
};

}  // namespace jackal_aic::python
