#pragma once

/// @file
/// Parts of the Python module jackal_aic._core and what they share.

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>
#include <utility>

#include "jackal_aic/safety/drive_loop.hpp"
#include "loop_setup.hpp"
#include "package_files.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic::python {

namespace py = pybind11;

/// Configuration of a controller and its drive loop, read and checked as by the node.
using Parameters = NodeParameters;

/// Settings of a loop that alone drives the motors, in any output mode.
DriveParameters driveParameters(const Parameters& parameters);

/// "thesis", "predictive" or "diff_drive".
const char* structureOf(const DriveParameters& parameters);

/// Wheel speeds (left, right) [rad/s].
using WheelPair = std::pair<double, double>;

/// A command as a Python tuple.
inline WheelPair pairOf(const WheelCommand& command) { return {command.left, command.right}; }

/// Keys and values as text. @throws ParameterError for a value of an unsupported type.
sim::Overrides overridesOf(const py::dict& overrides);

/// Fields of a parameter struct by name.
py::dict dictOf(const std::vector<Field>& fields);

/// A plant model with other values of some of its keys. @throws ParameterError.
PlantModel changed(const PlantModel& model, const py::dict& changes);

/// The controller of a drive loop: one of Python unless it is None, else one of C++.
std::unique_ptr<VelocityController> controllerOf(const DriveParameters& parameters, const py::object& own);

/// Word of a verdict on a sample.
const char* wordOf(SampleVerdict verdict);

/// The channels that count: of "left", "right", "gyro", "acceleration".
py::tuple channelsOf(const ChannelValidity& valid);

/// Each function adds a part of the module.
void bindParameters(py::module& m);
void bindControllers(py::module& m);
void bindLoop(py::module& m);
void bindAnalysis(py::module& m);
void bindSimulation(py::module& m);

}  // namespace jackal_aic::python
