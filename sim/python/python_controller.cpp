#include "python_controller.hpp"

#include <fmt/format.h>

#include <cmath>

namespace jackal_aic::python {

PythonController::PythonController(py::object self) : self_(std::move(self)) {
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

PythonController::~PythonController() {
  py::gil_scoped_acquire gil;
  self_ = py::object();
}

bool PythonController::setSetPoint(const SetPoint& set_point) {
  if (!set_point.vector().allFinite()) return false;
  set_point_ = set_point;
  return true;
}

SampleVerdict PythonController::observe(const Observation& observation) {
  if (!observation.finite()) return SampleVerdict::not_finite;
  if (started_ && observation.stamp <= observation_.stamp) return SampleVerdict::stale;
  observation_ = observation;
  if (started_) return SampleVerdict::accepted;
  started_ = true;
  return SampleVerdict::restarted;
}

WheelCommand PythonController::updateAction() {
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

void PythonController::reset() {
  started_ = false;
  to_reset_ = true;
  action_ = {};
  believed_.reset();
}

std::unique_ptr<VelocityController> controllerOf(const DriveParameters& parameters, const py::object& own) {
  if (own.is_none()) return makeController(parameters, Divergence::allowed);
  return std::make_unique<PythonController>(own);
}

}  // namespace jackal_aic::python
