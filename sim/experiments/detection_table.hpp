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

/// On what is driven.
enum class World {
  simple,  ///< the calibrated plants, box and ground
  real     ///< plant_real.yaml, or everything in which it may differ drawn: see drawReality()
};

/// When the faults of detectionCases() begin [s].
inline constexpr double kFaultTime = 3.0;

/// A sensor that is faulty from kFaultTime on; see SensorFaults.
Faults sensorFault(FaultKind kind, FaultChannel channel, double amount = 0.0);

/// A fault in a motion.
struct DetectionCase {
  std::string controller;
  std::string plant;   ///< box, ground or real
  std::string motion;  ///< a word
  SetPoint set_point;  ///< from kRestTime on
  std::string fault;   ///< a word
  Faults faults;
  std::string expected;  ///< FaultReport::reason() that names it
};

/// Every fault in every motion, for each structure of the controller; on the ground and on the box, or on the real
/// plant.
std::vector<DetectionCase> detectionCases(World world = World::simple);

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

/// Ten minutes of ordinary driving under each condition: friction, slope, payload, noise, lost samples; in the real
/// world of both structures of the controller as it is.
std::vector<OrdinaryCase> ordinaryCases(World world = World::simple);

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
void writeDetectionTables(const PackageFiles& files, const std::string& directory, unsigned jobs,
                          World world = World::simple);

}  // namespace jackal_aic::sim
