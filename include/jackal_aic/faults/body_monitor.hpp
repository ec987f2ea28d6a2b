#pragma once

/// @file
/// Gyro, accelerometer and body, by hypotheses whose evidence is compared.
///
/// Each hypothesis is the same model with one thing changed (Hypothesis). Per sample of step T, with the rate r_h at
/// which h begins, its mean time tau_h and the densities p of what begins and of what stays:
///
///     alpha_h <- r_h T alpha_healthy p_begins,h(y) + (1 - T/tau_h) alpha_h p_stays,h(y),   then normalised
///
/// Each belief of the model learns by the probability that its sensor is healthy. A verdict v is reported once its risk
///
///     sum_h cost(v, h) alpha_h < kWaiting (time for which P(no fault) < 1 - kDoubt)
///
/// From then on its sensor does not count. It counts again after recovery_time of ln odds > kSure that it is healthy.

#include <array>
#include <cstddef>
#include <string>

#include "jackal_aic/faults/acceleration_axis.hpp"
#include "jackal_aic/faults/channel_monitor.hpp"
#include "jackal_aic/faults/fault_parameters.hpp"
#include "jackal_aic/faults/offset.hpp"
#include "jackal_aic/faults/repetition.hpp"
#include "jackal_aic/faults/yaw_prediction.hpp"
#include "jackal_aic/model/robot_range.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic::faults {

/// What may be the case with gyro, accelerometer and body. All up to kMoved are no faults.
enum Hypothesis {
  kHealthy,
  kSlides,        ///< the body does not turn as its wheels do, and its yaw rate changes as fast as a body can
  kStruck,        ///< a sill or a kerb throws the body round, and its tyres take it back
  kOtherGround,   ///< another slip, which began as a slide
  kGyroGlitch,    ///< an offset of the gyro that ends by itself
  kMoved,         ///< somebody moves a robot that is to stand
  kGyroFrozen,    ///< it repeats its value
  kGyroOffset,    ///< a constant beyond largest_bias
  kGyroShifted,   ///< the same, which slip and ground may explain for a while
  kGyroReversed,  ///< it reads the turn with the wrong sign
  kAccelerometerFrozen,
  kAccelerometerOffset,
  kUpsideDown,  ///< gravity from below, the turn with the wrong sign
  kHypotheses
};

/// A hypothesis and its probability.
struct Suspicion {
  Hypothesis hypothesis = kHealthy;
  double probability = 0.0;

  /// "healthy, 0.98", or "perhaps: gyro offset, 0.60".
  std::string text() const;
};

/// The hypothesis in words: "gyro offset".
const char* text(Hypothesis hypothesis);

/// What the wheels say of the body at a sample.
struct WheelMotion {
  Normal difference;      ///< x = r alpha (w_R - w_L) [m/s]
  Normal forward;         ///< v [m/s]
  bool turn = false;      ///< a wheel turns: the noise differs from that at rest
  bool trusted = true;    ///< no wheel is suspect, so that they judge the gyro
  bool to_stand = false;  ///< commanded to stand
  bool pushed = false;    ///< turned from outside
};

/// Compares the hypotheses sample by sample. Does not allocate after construction.
class BodyMonitor {
 public:
  /// @param effective_track b_hat at the start [m]; @param on_box the body does not follow its wheels.
  BodyMonitor(const FaultParameters& parameters, double effective_track, bool on_box);

  /// Lets a step pass [s]. @param forward_rate dv/dt of the wheels' predictions; @param possible what it may also be,
  /// as the drive train is uncertain; @param difference_rate dx/dt [m/s^2].
  void predict(double forward_rate, const Range& possible, double difference_rate, double step);

  /// Weighs a sample. @param step since the last one [s].
  void check(const Observation& observation, const WheelMotion& wheels, double step);

  ChannelState gyro() const { return stateOf(gyro_, gyro_outlier_ && !shaken() ? 1.0 : gyroFaulty()); }  ///< verdict
  ChannelState accelerometer() const { return stateOf(accelerometer_, accelerometerFaulty()); }          ///< verdict
  Hypothesis gyroFault() const { return gyro_.fault; }                    ///< kHealthy while it counts
  Hypothesis accelerometerFault() const { return accelerometer_.fault; }  ///< kHealthy while it counts
  double probability(Hypothesis h) const { return alpha_[h]; }            ///< alpha_h
  double gyroFaulty() const;                                              ///< probability that the gyro is faulty
  double accelerometerFaulty() const;             ///< probability that the accelerometer is faulty
  Suspicion mostLikely() const;                   ///< a fault found before, else the most likely hypothesis
  bool moved() const { return said_ == kMoved; }  ///< the robot is moved
  bool shaken() const;                            ///< the ground has just shaken the robot

  /// Yaw rate against the wheels, theta_dot - (s x + beta) [rad/s].
  double yawError(double yaw_rate, double x, double v) const { return yaw_rate - yaw_.mean(x, v); }

  /// Clears the motion that was predicted before the first sample.
  void start();

  /// Starts again: faults are forgotten, what was learned of the sensors and of the gyro's sign is not.
  void restart();

 private:
  /// A sensor that was found faulty.
  struct Excluded {
    Hypothesis fault = kHealthy;
    double odds = 0.0;  // ln of the odds that it is healthy again, lately
    double good = 0.0;  // time for which they are [s]

    explicit operator bool() const { return fault != kHealthy; }
    double probability() const { return probabilityOf(-odds); }  // that it is faulty
    void weigh(double healthy, double faulty, double step, double recovery_time);
  };
  /// ln of the density of a sample if a hypothesis stays true, and if it begins with this sample.
  struct Evidence {
    double stays = 0.0, begins = 0.0;
  };
  using Densities = std::array<Evidence, kHypotheses>;
  /// Of the gyro's sample.
  struct GyroEvidence {
    Densities of{};
    double reversed = 0.0;  // stays reversed, if each sample is evidence of its own
  };
  /// Of the accelerometer's sample.
  struct AccelerationEvidence : AxisEvidence {
    double upside_down = 0.0;
  };
  using Probabilities = std::array<double, kHypotheses>;

  static ChannelState stateOf(const Excluded& sensor, double faulty) {
    return sensor ? ChannelState::faulty : faulty > 0.5 ? ChannelState::outlier : ChannelState::ok;
  }
  struct GyroSample;
  GyroEvidence weighGyro(double yaw_rate, const WheelMotion& wheels, double step);
  void weighMotion(const GyroSample& y, const WheelMotion& wheels, double step, Densities& g);
  double turnAgainst(const GyroSample& y) const;
  void weighOffset(const GyroSample& y, Evidence& g);
  void weighShift(const GyroSample& y, const WheelMotion& wheels, double step, Densities& g);
  void weighReversal(const GyroSample& y, const WheelMotion& wheels, double step, GyroEvidence& g);
  void weighRepetition(const GyroSample& y, bool moving, GyroEvidence& g);
  AccelerationEvidence weighAcceleration(const Observation& y, const WheelMotion& wheels, double step);
  GyroEvidence judgeGyro(double yaw_rate, const WheelMotion& wheels, double step);
  AccelerationEvidence judgeAcceleration(const Observation& y, const WheelMotion& wheels, double step);
  void compare(Densities p, const AccelerationEvidence& a, bool to_stand, double step);
  double measuredAnew(double yaw_rate) const;
  void learnGyro(double yaw_rate, const WheelMotion& wheels, double step);
  void learnAcceleration(bool vertical, double step);
  void weighSign(const GyroEvidence& g, double step);
  void judgeExcludedGyro(double yaw_rate, const GyroEvidence& g, double step);
  void judgeExcludedAccelerometer(const AccelerationEvidence& a, double step);
  void filter(const Densities& p, bool to_stand, double step);
  Suspicion likeliest(Hypothesis first) const;
  double follows() const;
  double noFault() const;
  void decide(double step);
  void exclude(Hypothesis verdict);
  void forget();

  FaultParameters parameters_;
  bool on_box_;
  YawPrediction yaw_, mirrored_;   // mirrored_: of a gyro that reads the turn with the wrong sign
  YawPrediction shifted_, begun_;  // of a shifted gyro, since before or with this sample
  AccelerationAxis forward_, vertical_;
  Offset gyro_offset_, slip_offset_;
  Repetition gyro_repetition_;
  double jolts_;          // usual share of samples in which the accelerometer is jolted
  double sign_;           // ln of the odds that the gyro reads a turn with the right sign
  double against_ = 0.0;  // ln of the odds that a gyro with an offset reads it with the wrong one instead
  Probabilities alpha_{}, fresh_{};
  Excluded gyro_, accelerometer_;
  Hypothesis said_ = kHealthy;
  double suspicious_ = 0.0, good_ = 0.0;  // time for which a fault is likely, or is not any more [s]

  // Since the last sample.
  double difference_change_ = 0.0, forward_change_ = 0.0;  // [m/s]
  double lowest_ = 0.0, highest_ = 0.0, rate_ = 0.0;       // dv/dt [m/s^2]

  // Of the last sample.
  double yaw_rate_ = 0.0, gyro_error_ = 0.0, gyro_variance_ = 1.0;  // [rad/s]
  Normal gyro_begins_;     // error by which an offset of the gyro begins [rad/s]
  bool compared_ = false;  // with its prediction
  Repetition::Kind gyro_kind_ = Repetition::rest;
  bool gyro_outlier_ = false;  // no hypothesis but that of outliers explains it
  bool turning_ = false;       // so fast that it shows the sign of the gyro
  double predicted_ = 0.0;     // yaw rate when the gyro's value was new [rad/s]
  double since_jolt_ = 1.0;    // [s]
};

}  // namespace jackal_aic::faults
