#include <fmt/format.h>

#include <cmath>

#include "bindings.hpp"

namespace jackal_aic::python {
namespace {

/// Drives by the method act(set_point, observation) of a Python object (class jackal_aic.VelocityController).
class PythonController : public VelocityController {
 public:
  /// @throws ParameterError if it is another kind of object, or its rate is not in [1, 1000] Hz or no
  /// divisor of 1000 Hz.
  explicit PythonController(py::object self) : self_(std::move(self)) {
    const auto name = self_.attr("__class__").attr("__name__").cast<std::string>();
    for (const char* attribute : {"act", "rate", "reset"}) {
      if (py::hasattr(self_, attribute)) continue;
      throw ParameterError("controller = " + name +
                           ": must be a VelocityController (or a name, a YAML file, Parameters)");
    }
    const double rate = self_.attr("rate").cast<double>();
    if (!(rate >= 1.0 && rate <= 1000.0) || std::fmod(1000.0, rate) != 0.0) {
      throw ParameterError(fmt::format("{}.rate = {:g} Hz: must be in [1, 1000] and divide 1000", name, rate));
    }
    step_ = 1.0 / rate;
  }

  ~PythonController() override {
    py::gil_scoped_acquire gil;
    self_ = py::object();
  }

  bool setSetPoint(const SetPoint& set_point) override {
    if (!set_point.vector().allFinite()) return false;
    set_point_ = set_point;
    return true;
  }

  SampleVerdict observe(const Observation& observation) override {
    if (!observation.finite()) return SampleVerdict::not_finite;
    if (started_ && observation.stamp <= observation_.stamp) return SampleVerdict::stale;
    observation_ = observation;
    if (started_) return SampleVerdict::accepted;
    started_ = true;
    return SampleVerdict::restarted;
  }

  void updateBelief() override {}

  /// Calls act() under the GIL with the last set point and observation. @throws ParameterError if the result is not
  /// finite; what act() raises.
  WheelCommand updateAction() override {
    if (!started_) return action_;
    py::gil_scoped_acquire gil;
    if (to_reset_) self_.attr("reset")();
    to_reset_ = false;
    self_.attr("applied") = pairOf(action_);
    const auto [left, right] = self_.attr("act")(set_point_, observation_).cast<WheelPair>();
    if (!std::isfinite(left) || !std::isfinite(right)) {
      throw ParameterError(fmt::format("act() = ({:g}, {:g}) rad/s: must be finite", left, right));
    }
    const py::object believed = self_.attr("believed");
    if (!believed.is_none()) {
      const auto [forward, yaw_rate] = believed.cast<WheelPair>();
      believed_ = BodyVector(forward, 0.0, yaw_rate);
    }
    return action_ = {left, right};
  }

  void hold(const WheelCommand& applied) override { action_ = applied; }
  void overrule(const WheelCommand& applied) override { action_ = applied; }
  void restart() override { reset(); }

  /// The object's reset() is called before the next act().
  void reset() override {
    started_ = false;
    to_reset_ = true;
    action_ = {};
    believed_.reset();
  }

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

}  // namespace

std::unique_ptr<VelocityController> controllerOf(const DriveParameters& parameters, const py::object& own) {
  if (own.is_none()) return makeController(parameters, Divergence::allowed);
  return std::make_unique<PythonController>(own);
}

}  // namespace jackal_aic::python
