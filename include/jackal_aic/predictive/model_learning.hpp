#pragma once

/// @file
/// What the controller learns about its generative model while it drives, beside the state of the robot:
///
///     observe   effective track and slip (slip_belief.hpp), from a measurement against the beliefs that have not
///               taken it yet
///     correct   precision of each sensor (precision_learning.hpp), from what is left of the measurement after they
///               have

#include "jackal_aic/model/geometry.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/model/wheel_belief.hpp"
#include "jackal_aic/predictive/precision_learning.hpp"
#include "jackal_aic/predictive/predictive_parameters.hpp"
#include "jackal_aic/predictive/slip_belief.hpp"

namespace jackal_aic {

/// Learning of the parameters of the generative model. Nothing here allocates.
class ModelLearning {
 public:
  /// Begins with what is configured.
  ModelLearning(const PredictiveParameters& parameters, const GeometryParameters& geometry, const PlantModel& model);

  /// The beliefs start anew from a measurement: the robot is taken to move unsteadily.
  void restart(const WheelBelief& left, const WheelBelief& right);

  /// The beliefs have moved by one inner step.
  void predict(const WheelBelief& left, const WheelBelief& right);

  /// A measurement came that the beliefs have not taken yet. @param step since the last one [s].
  void observe(const Observation& y, const WheelBelief& left, const WheelBelief& right, double step);

  /// The beliefs have taken a measurement. @param step since the last one [s].
  void correct(const Observation& y, const WheelBelief& left, const WheelBelief& right, double step);

  /// Where the reference models are, once in an action period [rad/s]: what moves drives unsteadily.
  void watchPath(const WheelVector& path);

  /// Goes on with other gains; effective track and slip stay as learned, the precisions begin anew.
  void setParameters(const PredictiveParameters& parameters, const WheelBelief& left, const WheelBelief& right);

  /// How the body follows the wheels.
  const SlipBelief& slip() const { return slip_; }

  /// Goes on with what was learned of the slip before a time of which nothing is known.
  void takeOver(const SlipBelief& learned);

  /// Goes on with another dead time of the drive train [s].
  void setDeadTime(double dead_time) { dead_time_ = dead_time; }

  /// Goes on from these, as SlipBelief::setState().
  void setSlip(const SlipState& state) { slip_.setState(state); }

  /// Variance of the believed slip factor; 0 if it is not learned.
  double slipFactorVariance() const { return parameters_.learn_slip_factor ? slip_.alphaVariance() : 0.0; }

  /// Variance of each channel, learned or configured.
  SensorVariances variances() const { return precisions_.variances(); }

  /// Stops (true) or resumes learning of effective track and slip.
  void freeze(bool frozen) { frozen_ = frozen; }
  bool frozen() const { return frozen_; }  ///< learning of effective track and slip was stopped

  /// Gyro or an encoder was found faulty: as SlipBelief::withdraw().
  void withdraw() { slip_.withdraw(); }

  /// A jolt of the ground shakes the robot (true): until it is over, how the body turns against its wheels is no slip.
  void setShaken(bool shaken) { shaken_ = shaken; }

 private:
  bool steady(const WheelBelief& left, const WheelBelief& right, double step) const;
  void learnPrecisions(const Observation& y, const WheelBelief& left, const WheelBelief& right, double step);

  PredictiveParameters parameters_;
  double wheel_radius_;  // m
  double track_range_;
  double dead_time_;  // s
  bool on_box_;
  SlipBelief slip_;
  SensorPrecisions precisions_;
  WheelVector path_ = WheelVector::Zero();  // at the last action [rad/s]
  double steady_time_ = 0.0;                // since it last moved [s]
  bool frozen_ = false;
  bool shaken_ = false;
};

}  // namespace jackal_aic
