#pragma once

/// @file
/// What users drive: steps, turns, arcs and stops on a simulated robot, at the worst phase of the timers, with encoders
/// that have steps, late samples, and a robot that is not quite its model. Gains are judged by the worst of it.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "parameters/node_parameters.hpp"
#include "plant_file.hpp"
#include "stop_figures.hpp"

namespace jackal_aic {

/// From rest to a set point and back to rest, on one robot.
struct Trial {
  SetPoint set_point;
  sim::PlantParameters plant;  ///< robot that is driven
  double phase = 0.0;          ///< age of the newest measurement when the action is computed [s]
  sim::StopBars bars;
  std::string name;                                    ///< in words, e.g. "box, 0.5 m/s, limit x 0.5"
  bool nominal = false;                                ///< the robot as it is
  std::optional<double> rolling_track = std::nullopt;  ///< effective track of a robot without masses that takes its
                                                       ///< place (JackalPlant::rolling()) [m]
};

/// By which effective track a simulated robot turns on an arc of 0.5 m/s and about 0.7 rad/s [m]. None where motors
/// yield: there the torques of rigid bodies make the difference.
std::optional<double> rollingTrack(const sim::PlantParameters& plant, const std::string& urdf);

/// Every trial of a robot: the robot as it is at 0.1..2 m/s, 0.5..2 rad/s and on arcs over the phase; its spread (dead
/// time, lag, gain, acceleration limit) at the worst end of the phase; and coarse encoders with late samples.
/// @param robot in words; @param overshoot_pct bar of the robot as it is; half as much again is that of its spread.
std::vector<Trial> allTrials(const sim::PlantParameters& plant, const std::string& robot, double overshoot_pct);

/// The few of them by which a search judges first, on this robot: steps to `speed` [m/s] at both ends of the phase, a
/// turn, a fast step on a slower motor, and coarse encoders.
std::vector<Trial> searchedTrials(const sim::PlantParameters& plant, const std::string& robot, double overshoot_pct,
                                  double speed);

/// Trials drawn at random: set point, phase, encoder step (0..0.1 rad/s) and noise, lateness of samples (up to 10 ms)
/// and spread of the robot. Equal seeds give equal trials.
std::vector<Trial> drawnTrials(const sim::PlantParameters& plant, const std::string& robot, double overshoot_pct,
                               int count, std::uint64_t seed);

/// The trials of a robot at the corners of the confidence box of its model (confidenceBox()); none if that has no box.
std::vector<Trial> boxTrials(const PlantFile& plant, const std::string& robot, double overshoot_pct);

/// A controller and its configuration of the robot.
struct TrialController {
  Gains controller;
  GeometryParameters geometry;
  LimitParameters limits;
  PlantModel model;
};

/// Drives a trial. A controller that learns how the robot turns drives an arc twice, and is judged by the second time.
/// @param urdf of the simulated robot.
sim::StopFigures drive(const Trial& trial, const TrialController& controller, const std::string& urdf);

}  // namespace jackal_aic
