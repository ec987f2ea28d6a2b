#pragma once

/// @file
/// The ticks that are measured, each set up as it runs on a robot that drives: the gains of config/, on the simulated
/// robot's model and geometry. Calling one is one tick.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <memory>
#include <optional>

#include "jackal_aic/aic/active_inference_controller.hpp"
#include "jackal_aic/aic/belief_update.hpp"
#include "jackal_aic/faults/fault_monitor.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "lower_bound.hpp"
#include "transcription.hpp"

namespace jackal_aic::benchmark {

/// Settings of `improved` with the exact integrator and 1 kHz, of order p = 3 or 5 (variances doubled per order).
DriveParameters improvedParameters(int orders);

/// Settings of `predictive` on the simulated ground.
DriveParameters predictiveParameters();

/// Samples of a robot that drives an arc at 0.5 m/s, 0.2 rad/s with the sensors' noise: the same in every run.
class Samples {
 public:
  /// @param period from one sample to the next [s].
  Samples(const GeometryParameters& geometry, double period);

  /// The next sample.
  const Observation& next();

 private:
  static constexpr std::size_t kSamples = 64;
  std::array<Observation, kSamples> samples_;
  double period_;
  double stamp_ = 1.0;
  std::size_t index_ = 0;
};

/// Belief tick of the thesis' controller: exact integrator, between two measurements.
class BeliefTick {
 public:
  explicit BeliefTick(int orders);
  void operator()() { controller_->updateBelief(); }

 private:
  std::unique_ptr<VelocityController> controller_;
};

/// The same by hand (lower_bound.hpp). @tparam orders p.
template <int orders>
class BoundTick {
 public:
  BoundTick();
  void operator()() { bound_.step(); }

 private:
  LowerBound<orders + 1> bound_;
};

/// The same transcribed from the thesis (transcription.hpp), with the Euler step, which costs less than the exact one.
class TranscriptionTick {
 public:
  explicit TranscriptionTick(int orders);
  void operator()() { transcription_.step(belief_, measurement_, set_point_); }

 private:
  Transcription transcription_;
  Eigen::VectorXd belief_, measurement_, set_point_;
};

/// Belief tick of the predictive controller. @tparam sampled a new measurement comes with every tick; else once a
/// second: after half a minute without any, what fades has come to numbers that some processors are slow with.
template <bool sampled>
class PredictiveTick {
 public:
  PredictiveTick();
  void operator()() {
    if (sampled || ++tick_ % 1000 == 0) controller_.observe(samples_.next());
    controller_.updateBelief();
  }

 private:
  PredictiveController controller_;
  Samples samples_;
  std::size_t tick_ = 0;
};

/// Fault monitor: 1 ms of driving, with a command that changes every 20 ms.
class MonitorAdvanceTick {
 public:
  MonitorAdvanceTick();
  void operator()() {
    if (++tick_ % 20 == 0) command_ = commands_[tick_ / 20 % commands_.size()];
    monitor_.advance(command_, 0.001);
  }

 protected:
  GeometryParameters geometry_;
  FaultMonitor monitor_;

 private:
  std::array<WheelCommand, 32> commands_;
  std::optional<WheelCommand> command_;
  std::size_t tick_ = 0;
};

/// Fault monitor: a sample every 20 ms, of a robot that has driven for a second.
class MonitorCheckTick : protected MonitorAdvanceTick {
 public:
  MonitorCheckTick();
  void operator()() { monitor_.check(samples_.next()); }
  const FaultReport& report() const { return monitor_.report(); }  ///< of the last sample

 private:
  Samples samples_;
};

/// Fault monitor: 20 ms of driving and their sample, with everything that one leaves to the other.
class MonitorPeriodTick : MonitorCheckTick {
 public:
  void operator()() {
    for (int k = 0; k < 20; ++k) MonitorAdvanceTick::operator()();
    MonitorCheckTick::operator()();
  }
};

/// Calls visit(name, make) for each tick; make() sets it up.
template <class Visitor>
void forEachTick(Visitor&& visit) {
  visit("belief_p3", [] { return BeliefTick(3); });
  visit("belief_p3_bound", [] { return BoundTick<3>(); });
  visit("belief_p3_transcription", [] { return TranscriptionTick(3); });
  visit("belief_p5", [] { return BeliefTick(5); });
  visit("belief_p5_bound", [] { return BoundTick<5>(); });
  visit("belief_p5_transcription", [] { return TranscriptionTick(5); });
  visit("predictive", [] { return PredictiveTick<false>(); });
  visit("predictive_sample", [] { return PredictiveTick<true>(); });
  visit("monitor_advance", [] { return MonitorAdvanceTick(); });
  visit("monitor_check", [] { return MonitorCheckTick(); });
  visit("monitor_period", [] { return MonitorPeriodTick(); });
}

}  // namespace jackal_aic::benchmark
