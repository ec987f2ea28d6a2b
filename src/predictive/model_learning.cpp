#include "jackal_aic/predictive/model_learning.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kSteadyPath = 0.02;   // rad/s; largest change of the path in an action period of a steady drive
constexpr double kSettled = 0.5;       // s; after the dead time, until nothing is left of an acceleration
constexpr double kTrackSettled = 4.0;  // slip memories; after the dead time, until the effective track is learned
constexpr double kStraight = 0.5;      // rad/s; largest difference of the wheel speeds on a straight line
constexpr double kMoving = 0.5;        // rad/s; least wheel speed of a robot that moves

SlipLearning slipLearning(const PredictiveParameters& p, double range) {
  return {p.gyro_variance,       p.accelerometer_variance, p.slip_time_constant,
          p.yaw_delay_deviation, p.slip_excitation,        range};
}

SlipState configuredSlip(const GeometryParameters& geometry, const PlantModel& model) {
  return {geometryOf(model, geometry).effective_track, geometry.slip_factor};
}

SensorPrecisions sensorPrecisions(const PredictiveParameters& p) {
  return {{p.wheel_variance, p.wheel_variance, p.gyro_variance, p.accelerometer_variance}, p.precision_time_constant};
}

WheelDifference difference(const Observation& y, const WheelBelief& left, const WheelBelief& right) {
  const double difference = right.speed() - left.speed(), mean = 0.5 * (left.speed() + right.speed());
  return {difference,
          right.speedVariance() + left.speedVariance(),
          right.acceleration() - left.acceleration(),
          y.wheel_right - y.wheel_left - difference,
          mean,
          0.5 * (y.wheel_left + y.wheel_right) - mean};
}

}  // namespace

ModelLearning::ModelLearning(const PredictiveParameters& parameters, const GeometryParameters& geometry,
                             const PlantModel& model)
    : parameters_(parameters),
      wheel_radius_(geometry.wheel_radius),
      track_range_(geometry.track_range),
      dead_time_(model.dead_time),
      on_box_(model.on_box),
      slip_(configuredSlip(geometry, model), geometry.wheel_radius, slipLearning(parameters, geometry.track_range)),
      precisions_(sensorPrecisions(parameters)) {}

void ModelLearning::takeOver(const SlipBelief& learned) {
  slip_ = learned;
  slip_.setLearning(slipLearning(parameters_, track_range_));
  slip_.forgetMotion();
}

void ModelLearning::restart(const WheelBelief& left, const WheelBelief& right) {
  steady_time_ = 0.0;
  precisions_.start(left, right);
}

void ModelLearning::predict(const WheelBelief& left, const WheelBelief& right) {
  if (parameters_.learn_precision) precisions_.predict(left, right);
}

void ModelLearning::observe(const Observation& y, const WheelBelief& left, const WheelBelief& right, double step) {
  if (on_box_) return;  // neither gyro nor accelerometer notices the wheels
  const bool wheels = y.valid.wheel_left && y.valid.wheel_right;
  if (frozen_ || !wheels || !y.valid.acceleration) slip_.missAcceleration(step);
  if (frozen_ || !wheels) return;
  if (parameters_.learn_track && y.valid.yaw_rate && !shaken_)
    slip_.learnTrack(y.yaw_rate, difference(y, left, right), step);
  if (!y.valid.acceleration) return;
  slip_.observeAcceleration(y.acceleration_x, y.wheel_left, y.wheel_right, step);
  if (parameters_.learn_slip_factor) slip_.learnAlpha();
}

void ModelLearning::correct(const Observation& y, const WheelBelief& left, const WheelBelief& right, double step) {
  if (!parameters_.learn_precision) return;
  if (!y.valid.all()) return restart(left, right);  // a belief that lacks a channel is off by more than the noise
  precisions_.correct(left, right);
  if (steady(left, right, step)) learnPrecisions(y, left, right, step);
}

void ModelLearning::watchPath(const WheelVector& path) {
  steady_time_ += 1.0 / parameters_.action_rate;
  if ((path - path_).cwiseAbs().maxCoeff() > kSteadyPath) steady_time_ = 0.0;
  path_ = path;
}

bool ModelLearning::steady(const WheelBelief& left, const WheelBelief& right, double step) const {
  return steady_time_ > kSettled + dead_time_ && step > 0.0 &&
         std::max(std::abs(left.speed()), std::abs(right.speed())) > kMoving;
}

void ModelLearning::learnPrecisions(const Observation& y, const WheelBelief& left, const WheelBelief& right,
                                    double step) {
  const double slope = on_box_ ? 0.0 : slip_.yawPerDifference(left.speed(), right.speed());
  const double turn = on_box_ ? 0.0 : slip_.yawRate(left.speed(), right.speed());
  const double rolling = on_box_ ? 0.0 : wheel_radius_ * slip_.slipFactor();
  precisions_.learnWheels(step);
  if (steady_time_ > kTrackSettled * parameters_.slip_time_constant + dead_time_) {
    precisions_.learnGyro(y.yaw_rate - turn, slope, slip_.trackGain(), step);
  }
  if (std::abs(right.speed() - left.speed()) < kStraight) {
    precisions_.learnAccelerometer(y.acceleration_x - slip_.accelerometerOffset(), rolling, step);
  }
  const SensorVariances learned = precisions_.variances();
  slip_.setVariances(learned.gyro, learned.accelerometer);
}

void ModelLearning::setParameters(const PredictiveParameters& parameters, const WheelBelief& left,
                                  const WheelBelief& right) {
  parameters_ = parameters;
  slip_.setLearning(slipLearning(parameters, track_range_));
  precisions_ = sensorPrecisions(parameters);
  restart(left, right);
}

}  // namespace jackal_aic
