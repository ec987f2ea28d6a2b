#pragma once

/// @file
/// What the fault monitor finds in the simulated robot, and how fast: every fault in every motion, and ordinary driving
/// without one. For the report and the tests.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "monitored_loop.hpp"

namespace jackal_aic::sim {

/// When the faults of detectionCases() begin [s].
inline constexpr double kFaultTime = 3.0;

/// Longest time in which a fault has to be found [s].
inline constexpr double kDetectionBar = 0.3;

/// A sensor that is faulty from kFaultTime on. @param side of an encoder; @param value see SensorFault.
Faults sensorFault(SensorFaultKind kind, Side side = Side::left, double value = 0.0);

/// A fault in a motion.
struct DetectionCase {
  std::string controller;
  std::string plant;   ///< box or ground
  std::string motion;  ///< a word
  SetPoint set_point;  ///< from kRestTime on
  std::string fault;   ///< a word
  Faults faults;
  std::string expected;  ///< FaultReport::reason() that names it
};

/// Every fault in every motion, on the ground for each structure of the controller and on the box.
std::vector<DetectionCase> detectionCases();

/// Runs a case until the fault is found, or a second after its onset. @throws ParameterError if something was found
/// before.
std::optional<Detection> runCase(const PackageFiles& files, const DetectionCase& detection_case);

/// Ordinary driving under some condition.
struct OrdinaryCase {
  std::string controller;
  std::string plant;
  std::string condition;  ///< a word
  Overrides overrides;
  double duration;  ///< [s]
};

/// Ten minutes of ordinary driving under each condition: friction, slope, payload, noise, lost samples.
std::vector<OrdinaryCase> ordinaryCases();

/// Steps, turns in place, arcs and square waves in random order.
SetPointProfile ordinaryDriving(std::uint64_t seed, double duration);

/// False alarms of a run without a fault.
struct Alarms {
  std::size_t samples;   ///< of the sensors
  std::size_t outliers;  ///< samples of which a channel was excluded
  std::string fault;     ///< reason and time of the first fault that was reported; empty if none was
  std::size_t faults;    ///< how often a fault began
};

/// Counts the false alarms of a run, sample by sample.
class AlarmCounter {
 public:
  void add(const MonitoredSample& sample);
  const Alarms& alarms() const { return alarms_; }

 private:
  Alarms alarms_{0, 0, "", 0};
  std::string reason_;  // of the present fault
};

/// Runs ordinary driving. @param duration instead of the case's own [s].
Alarms runOrdinary(const PackageFiles& files, const OrdinaryCase& ordinary_case, double duration);

/// Runs everything and writes detection.csv and alarms.csv into a directory. @param jobs threads; 0: one per core.
void writeDetectionTables(const PackageFiles& files, const std::string& directory, unsigned jobs);

}  // namespace jackal_aic::sim
