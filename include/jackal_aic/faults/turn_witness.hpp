#pragma once

/// @file
/// Three witnesses of the turn: the encoders, the gyro and the commands. Two that agree convict the third.
///
/// A pair of wheel speeds allows the yaw rates between r (w_R - w_L)/(b_hat f) and f r (w_R - w_L)/b_hat, f the range
/// of the track. What the gyro reads beyond that is an error e. Two of three hypotheses put the commanded speed in the
/// place of a wrong encoder's:
///
///     as measured,   left encoder wrong,   right encoder wrong
///
/// Both sides have the same motors: where the other wheel is on its way with a part of what its commands ask for, so is
/// this one. Each hypothesis has the mean of e^2 over kFollowing as its evidence. An encoder is wrong if its hypothesis
/// explains the gyro for kSureSamples, and the encoders as they are measured do not. This finds an encoder whose scale
/// is wrong from its first message: alone it could be a weak motor, but a weak motor turns the robot. While the wheels
/// accelerate by more than tyres grip, the body turns on as it did, and says nothing about them.

#include <array>

#include "jackal_aic/model/robot_range.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Speed of a wheel, measured and by its commands.
struct CommandedWheel {
  double measured;  ///< speed [rad/s]
  double nominal;   ///< of its model, by its commands [rad/s]
  Range reachable;  ///< of any drive train that it may have [rad/s]
};

/// Evidence for a wrong encoder. Does not allocate.
class TurnWitness {
 public:
  static constexpr double kSureSamples = 20.0;  ///< of the encoders, until an encoder is convicted
  static constexpr double kLeastError = 0.04;   ///< root mean square of a contradiction [rad/s]
  static constexpr double kExplained = 0.25;    ///< part of the evidence that a right hypothesis leaves at most
  static constexpr double kAlike = 0.15;        ///< by which unlike motors may differ, relative
  static constexpr double kAlikeSpeed = 0.1;    ///< and in addition [rad/s]
  static constexpr double kMoving = 0.3;        ///< of a wheel that shows how far the motors are on their way [rad/s]

  /// @param rolling_radius r alpha [m]; @param track b_hat [m]; @param range f.
  TurnWitness(double rolling_radius, double track, double range)
      : radius_(rolling_radius), slope_(rolling_radius / track), range_(range) {}

  /// Takes a sample. @param yaw_rate of the gyro, without bias [rad/s]; @param hold for which an encoder holds its
  /// value [s]; @param step since the last sample [s].
  void update(double yaw_rate, const CommandedWheel& left, const CommandedWheel& right, double hold, double step);

  /// No gyro, or no encoders, to compare.
  void reset() {
    evidence_ = {};
    left_ = right_ = 0.0;
  }

  bool leftWrong() const { return left_ > kSureSamples; }    ///< the left encoder is wrong
  bool rightWrong() const { return right_ > kSureSamples; }  ///< the right encoder is wrong

  /// The commands explain the gyro better than the encoders do, so the gyro is in order.
  bool clearsGyro() const { return contradiction() && (explains(kLeft) || explains(kRight)); }

 private:
  enum Hypothesis { kAsMeasured, kLeft, kRight, kHypotheses };

  double error(double yaw_rate, double left, double right) const;
  void watchTurn(double asked, double hold, double step);
  bool slides(const WheelVector& measured, double hold, double step);
  bool explains(Hypothesis hypothesis) const { return evidence_[hypothesis] < kExplained * evidence_[kAsMeasured]; }
  bool contradiction() const { return evidence_[kAsMeasured] > kLeastError * kLeastError; }

  double radius_, slope_, range_;
  std::array<double, kHypotheses> evidence_{};  // mean squares [(rad/s)^2]
  double asked_ = 0.0;                          // turn by the commands [rad/s]
  double late_ = 0.0;                           // by which it changed within kFollowing and a hold [rad/s]
  WheelVector measured_ = WheelVector::Zero();  // speeds of the wheels [rad/s]
  double sliding_ = 0.0;                        // time for which the body may slide on [s]
  double left_ = 0.0, right_ = 0.0;             // samples for which the evidence is against an encoder
};

}  // namespace jackal_aic
