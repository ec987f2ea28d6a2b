#pragma once

/// @file
/// A controller alone on a plant, with the timing that the certificates describe.

#include <cmath>
#include <cstdint>
#include <utility>

#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Rates of a loop [Hz] and the time by which its sensor is ahead of its action [s].
struct LoopRates {
  double sensor = 50.0;
  double belief = 1000.0;
  double action = 50.0;
  double phase = 0.0;
};

/// Plant, sensor, belief, action, in this order, in steps of 1 ms. Not a DriveLoop: what is tested with it is the map
/// of the controller itself, whose growth the gate, the limits and the fault monitor would bound.
template <class Plant, class Controller>
class SteppedLoop {
 public:
  SteppedLoop(Plant plant, Controller controller, const LoopRates& rates = {})
      : plant(std::move(plant)),
        controller(std::move(controller)),
        sensor_(steps(1.0 / rates.sensor)),
        belief_(steps(1.0 / rates.belief)),
        action_(steps(1.0 / rates.action)),
        phase_(steps(rates.phase)) {}

  /// One step of 1 ms.
  void step() {
    plant.step();
    ++now_;
    if ((now_ + phase_) % sensor_ == 0) controller.observe(plant.observation());
    if (now_ % belief_ == 0) controller.updateBelief();
    if (now_ % action_ == 0) plant.command(controller.updateAction());
  }

  Plant plant;
  Controller controller;

 private:
  static std::int64_t steps(double time) { return std::llround(1000.0 * time); }

  std::int64_t sensor_, belief_, action_, phase_;
  std::int64_t now_ = 0;
};

}  // namespace jackal_aic
