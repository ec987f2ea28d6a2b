#pragma once

/// @file
/// Belief about whether the body follows its wheels, and about its forward speed while it does not.
///
/// The wheels measure the speed v_w = r alpha (w_L + w_R)/2 as long as the tyres grip; the accelerometer measures its
/// change. The robot turns about a centre that lies l ahead of the IMU, and the body changes its speed by
///
///     Delta v = integral of (a - b + f_1 w_1 + f_2 w_2),    a = a_x - l theta_dot^2
///
/// with errors of the accelerometer that are slow states: b is its offset, gravity on a slope included, and f w is what
/// an attitude filter takes for tilt. A Madgwick filter follows dv_w/dt by so many m/s^3, w_1, and a Mahony or
/// complementary one within a time, w_2. Shares f between 0 and 1 make filters of other gains. All are learned together
/// by recursive least squares with a prior, from windows in which the body rolls or stands. A window is judged by what
/// was learned before it. f counts once it differs from zero; if it leaves errors of three standard deviations, there
/// is no such filter, and the tyres slid.
///
/// Three hypotheses on x_dot:
///
///     rolls    x_dot = v_w
///     slides   x_dot is the integral of its change: friction moves the body
///     stands   x_dot = 0 although the wheels turn: an obstacle holds it
///
/// Over a window of time t, rolling predicts e = Delta v_w - Delta v to be normal, of mean 0 and variance
///
///     S = c R + sigma_0^2 + (tau dv_w/dt)^2 + (kappa Delta v_w)^2
///         + sigma_l^2 (theta_dot^2 + (integral of theta_dot^2)^2) + p^T P p + D,    p = (t, -integral of w)
///
/// R is the variance of the integral by noise: a part grows with the time at rest; another, vibration, has a deviation
/// that grows with the speed, so its part with the integral of v_w^2. Both are learned. P is the covariance of b and f.
/// A window begins when the body rolled, which D doubts: the square by which e then exceeded what S explained. So
/// wheels that are late and catch up are no slide.
///
/// Wheels that lose the body predict that e lies between 0 and Delta v_w, a collision that the body stops at once. One
/// of the two is believed if it explains an e beyond three standard deviations, and better than an accelerometer
/// mounted the wrong way round, e = 2 Delta v_w; what rolling taught of that counts. An e that nothing explains is a
/// jump of b: it lasts, or two slides one after the other end with a body faster than wheels and obstacles can make it.
///
/// A body that left its wheels rolls once it passes their speed; once it keeps its speed it rolls or stands, whichever
/// is nearer to the integral. A body that turns does not stand.
///
/// Only the belief about the speed uses this; the beliefs about the wheels and the commands do not.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>

#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {

/// Motion of the body relative to its wheels.
enum class Traction {
  rolls,   ///< it follows its wheels
  slides,  ///< its tyres slide: wheels spin up or are locked
  stands   ///< it stands although its wheels turn
};

/// Belief about the forward speed of the body, separate from that of its wheels. Does not allocate.
class TractionBelief {
 public:
  /// @param turning_centre l, distance of the turning centre ahead of the IMU [m].
  explicit TractionBelief(double turning_centre) : turning_centre_(turning_centre) {}

  /// Advances by a step [s]: between two measurements a sliding body keeps its last acceleration, at most 1 g.
  void predict(double step);

  /// Takes a forward acceleration free of gravity, the mean since the last one [m/s^2], of variance [(m/s^2)^2].
  /// @param wheels v_w now [m/s]; @param yaw_rate theta_dot [rad/s]; @param step since the last measurement [s].
  void correct(double wheels, double acceleration, double variance, double yaw_rate, double step);

  /// A step [s] without a valid acceleration; after thresholds::kGap without one the body is believed to roll.
  void miss(double step);

  /// Sets another turning centre [m].
  void setTurningCentre(double turning_centre) { turning_centre_ = turning_centre; }

  /// Interval between fresh wheel speeds [s], which are late by up to it.
  void setWheelsHold(double hold) { hold_ = hold; }

  /// Believes that the body rolls and starts with the next measurement; what was learned of the accelerometer stays.
  void restart();

  /// x_dot [m/s]. @param wheels v_w now [m/s].
  double speed(double wheels) const { return traction_ == Traction::rolls ? wheels : speed_; }

  Traction traction() const { return traction_; }  ///< the hypothesis believed
  double variance() const { return variance_; }    ///< of x_dot - v_w, by the accelerometer's noise [(m/s)^2]

 private:
  /// Errors of the accelerometer (b, f_1, f_2), by least squares with priors of mean 0.
  struct Errors {
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    double misfit = 0.0;  // of f: squared errors that it leaves / their variance, weighted as its information

    Eigen::Matrix3d covariance() const;
    bool isRefuted() const;                     // no filter explains what the accelerometer measures
    bool isFilterPresent() const;               // f differs from 0
    double offset() const { return value(0); }  // b [m/s^2]
    double tilt(const Eigen::Vector2d& w) const { return value.tail<2>().dot(w); }  // f w, or its integral
    double believedTilt(const Eigen::Vector2d& w) const { return isFilterPresent() ? tilt(w) : 0.0; }  // most are true
  };

  /// Integrals up to a time, or their changes over a window.
  struct Integrals {
    double time = 0.0;                               // [s]
    double wheels = 0.0;                             // v_w [m/s]
    double body = 0.0;                               // of a [m/s]
    double rested = 0.0;                             // time at rest [s]
    double driven = 0.0;                             // of v_w^2 in motion [m^2/s]
    double turned = 0.0;                             // of theta_dot^2 [rad^2/s]
    Eigen::Vector2d tilt = Eigen::Vector2d::Zero();  // of w [m/s]
    Errors errors;                                   // learned until that time, or the beginning of the window
    Traction motion = Traction::rolls;               // then, or at the beginning; slides if rolling does not explain e
    double doubt = 0.0;                              // D, that it rolled then [(m/s)^2]

    /// Derivatives of body by b and f.
    Eigen::Vector3d errorsPart() const { return {time, -tilt(0), -tilt(1)}; }

    Integrals operator-(const Integrals& then) const;
  };

  Integrals since(double time, std::optional<Traction> motion = std::nullopt) const;
  void remember();
  void learnNoise(double least);
  void learn(const Integrals& window, double step);
  double change(const Integrals& window) const;                                           // Delta v [m/s]
  double error(const Integrals& window) const { return window.wheels - change(window); }  // e [m/s]
  double noise(const Integrals& window) const;
  double noiseVariance(const Integrals& window) const;
  bool keeps(double change, const Integrals& window) const;
  double modelVariance(const Integrals& window) const;
  double variance(const Integrals& window) const;
  bool explains(const Integrals& window) const;
  bool isReversed(const Integrals& window, double miss) const;
  bool spins(const Integrals& window) const;
  bool struck(const Integrals& window) const;
  bool turns() const;
  bool possible(double speed, const Integrals& window) const;
  void learnJump(const Integrals& window);
  void roll(double step);
  void leave(double speed, const Integrals& window);
  void slide();
  void stand(double step);
  void become(Traction traction, double speed);

  static constexpr double kSpacing = 0.0199;  // time between two remembered integrals [s]
  static constexpr std::size_t kRemembered = 64;
  static constexpr double kFirstNoise = 0.001;  // before it is learned

  double turning_centre_;
  double hold_ = 0.0;  // of the wheels' speeds [s]

  // Learned of the accelerometer.
  double noise_at_rest_ = kFirstNoise;    // [(m/s)^2/s]
  double noise_in_motion_ = kFirstNoise;  // per v_w^2 [1/s]
  double proof_ = 0.0;  // ln of the likelihood ratio: the accelerometer is mounted right, or the wrong way round
  Integrals block_;     // from which noise is learned
  double last_gap_ = 0.0, last_body_ = 0.0;  // accelerations of the one before, of wheels less body and body [m/s^2]
  double last_rate_ = 0.0;                   // the noise by the two before [(m/s)^2/s]

  // The motion.
  double missed_ = thresholds::kGap;                // since the last acceleration [s]
  double measured_ = 0.0;                           // the last acceleration, as it came [m/s^2]
  double latest_ = 0.0;                             // dx_dot/dt [m/s^2]
  Eigen::Vector2d tilt_ = Eigen::Vector2d::Zero();  // w [m/s^2]
  double fastest_ = 0.0;                            // largest recent acceleration of the wheels [m/s^2]
  double jolt_ = 0.0;                               // largest recent change of the body within a jolt [m/s]
  Integrals now_;
  std::array<Integrals, kRemembered> past_;
  std::size_t newest_ = 0, remembered_ = 0;

  Traction traction_ = Traction::rolls;
  bool unexplained_ = false;      // no hypothesis explains e
  bool impossible_ = false;       // the last slide was, and nothing was explained since
  Integrals left_;                // when the body left its wheels
  Integrals noticed_;             // when that was noticed
  double speed_ = 0.0;            // x_dot [m/s]
  double corrected_speed_ = 0.0;  // at the last measurement [m/s]
  double variance_ = 0.0;
};

}  // namespace jackal_aic
