#pragma once

/// @file
/// Belief about whether the body follows its wheels, and about its forward speed while it slides.
///
/// The wheels measure the speed v_w = r alpha (w_L + w_R)/2 as long as the tyres grip; the accelerometer measures its
/// change. A point of the body feels dx_dot/dt and the centripetal acceleration,
///
///     a = a_x + theta_dot y_dot = a_x - l theta_dot^2 - b,    y_dot = -l theta_dot,
///
/// because the robot turns about a centre that lies l ahead of the IMU; b is the accelerometer's reading at constant
/// speed. Three hypotheses on x_dot:
///
///     rolls    x_dot = v_w
///     slides   x_dot is the integral of a since the tyres gripped last: friction moves the body
///     stands   x_dot = 0 although the wheels turn: an obstacle holds it
///
/// Over a window of W the wheels changed their speed by Delta v_w and the body by Delta v, the integral of a. Rolling
/// ends when the prediction error D = Delta v_w - Delta v exceeds noise, vibration and the error of late sensors, and
/// has one of two causes. The wheels cause it if Delta v_w has the sign of D and the body did not move against it. A
/// collision causes it within W_c and stops the body. A slope, which looks like an acceleration without attitude, has
/// neither cause. Sliding tyres accelerate the body, unless an obstacle holds it. So a body that neither accelerates
/// nor brakes rolls or stands, whichever is nearer to the integral; a turning body does not stand.
///
/// A gap to the wheels that neither friction nor a collision explains shows that b has jumped; b is estimated again.
///
/// An attitude filter that takes accelerations for tilt hides them, a_x = dx_dot/dt - w: its error of gravity, w,
/// follows the remaining acceleration,
///
///     dw/dt = g a            complementary and Mahony: g is the gain [1/s]
///     dw/dt = g sign(a)      Madgwick: g is twice gravity times the gain [m/s^3]
///
/// g is learned for each kind while the wheels roll: recursive least squares of D on the integral of w/g, with a prior.
/// The better kind is used if it explains D better than no filter; rolling ends only if no g of either kind within
/// three standard deviations explains D.
///
/// Only the belief about the speed uses this; the beliefs about the wheels and the commands do not.

#include <array>
#include <cstddef>
#include <optional>

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
  /// Longest time covered by one acceleration [s]; after a longer one the speed is that of the wheels.
  static constexpr double kLongestStep = 0.15;

  /// @param turning_centre l, distance of the turning centre ahead of the IMU [m].
  explicit TractionBelief(double turning_centre) : turning_centre_(turning_centre) {}

  /// Advances by a step [s]: between two measurements a sliding body keeps its last acceleration, at most 1 g.
  void predict(double step);

  /// Takes a forward acceleration free of gravity, the mean since the last one [m/s^2], of variance [(m/s^2)^2].
  /// @param wheels v_w now [m/s]; @param yaw_rate theta_dot [rad/s]; @param step since the last measurement [s].
  void correct(double wheels, double acceleration, double variance, double yaw_rate, double step);

  /// A step [s] without a valid acceleration. @param wheels v_w now [m/s].
  void miss(double wheels, double step);

  /// Sets another turning centre [m].
  void setTurningCentre(double turning_centre) { turning_centre_ = turning_centre; }

  /// Interval between fresh wheel speeds [s], which are late by up to it.
  void setWheelsHold(double hold) { hold_ = hold; }

  /// Starts again with the next measurement; what was learned about the accelerometer stays.
  void restart();

  /// Sets the speed to v_w [m/s]; what was learned about the accelerometer stays.
  void reset(double wheels);

  /// x_dot [m/s]. @param wheels v_w now [m/s].
  double speed(double wheels) const { return traction_ == Traction::rolls ? wheels : speed_; }

  Traction traction() const { return traction_; }  ///< the hypothesis believed
  double variance() const { return variance_; }    ///< of x_dot - v_w, by the accelerometer's noise [(m/s)^2]

 private:
  /// Integrals from the start up to a time.
  struct Past {
    double time = 0.0;               // [s]
    double wheels = 0.0;             // v_w [m/s]
    double body = 0.0;               // integral of a [m/s]
    double variance = 0.0;           // of it [(m/s)^2]
    double turning = 0.0;            // integral of theta_dot^2 [rad^2/s]
    std::array<double, 2> hidden{};  // integral of w/g, for each kind of filter
  };

  /// Changes from a past time until now.
  struct Change {
    double time, wheels, body, variance, turning;
    std::array<double, 2> hidden;
    double unfiltered;                              // D without a filter
    double error() const { return wheels - body; }  // D
  };

  /// An attitude filter of one kind.
  struct AttitudeFilter {
    double gain_deviation;     // of the prior of g
    double tilt = 0.0;         // w/g
    double information = 0.0;  // sum of (integral of w/g)^2/sigma^2
    double evidence = 0.0;     // sum of D (integral of w/g)/sigma^2
    double misfit = 0.0;       // mean of the squared residual of D / sigma^2

    double variance() const { return 1.0 / (information + 1.0 / (gain_deviation * gain_deviation)); }  // of g
    double gain() const { return variance() * evidence; }                                              // g
  };

  /// A mean of a in progress.
  struct Mean {
    double change = 0.0;  // integral of a [m/s]
    double time = 0.0;    // [s]
  };

  const Past& within(double time) const;
  Change since(double time) const;
  Change sinceOldest() const;
  Change sinceThen(const Past& then) const;
  std::size_t oldest() const;
  void remember();
  void learnNoise(double acceleration, double variance, double step);
  void learnVibration(Mean mean, double variance);
  double unseenChange() const;
  double unknownOffset(double time) const;
  double bound(const Change& change) const;
  bool surprises(const Change& change) const;
  std::optional<std::size_t> filter() const;
  double hidden(const std::array<double, 2>& by_gain) const;
  bool hiddenByFilter(const Change& window) const;
  void learnFilters(const Change& window, double step);
  std::optional<Change> collision() const;
  std::optional<Change> againstRolling(const Change& window) const;
  void roll(double step);
  void learnOffset(const Change& window, double step);
  bool possible(double gap) const;
  void learnJumpOfOffset();
  void slide(double gap_before, double acceleration, double step);
  bool stillTurning() const;
  double leastToCome(const Change& change) const;
  bool comesToItsWheels(const Change& change) const;
  void stand(double step);
  void switchToRoll();
  void switchToSlide(double speed, const Change& surprise);
  void switchToStand();
  void resetPast();

  static constexpr double kMahony = 0.75;     // 1/s, standard deviation of g
  static constexpr double kMadgwick = 2.0;    // m/s^3; that of a gain of 0.1
  static constexpr double kNever = 1e9;       // s
  static constexpr double kSpacing = 0.0199;  // time between two remembered states [s]
  static constexpr std::size_t kRemembered = 64;

  double turning_centre_;
  double hold_ = 0.0;              // of the wheels' speeds [s]
  double offset_ = 0.0;            // b [m/s^2]
  bool offset_known_ = false;      // b has been learned
  double quick_ = 0.0;             // variance of means of a, by the differences of successive ones [(m/s^2)^2]
  double slow_ = 1e-9;             // variance of means of a, by the differences of every third [(m/s^2)^2]
  double vibration_rate_ = 0.0;    // of the variance of the integral of a, by vibration, per second [(m/s)^2/s]
  double variance_rate_ = 0.0;     // of the variance of the integral of a, by all noise [(m/s)^2/s]
  double factor_ = 1.0;            // lambda, of the variance of its integral
  double latest_ = 0.0;            // a [m/s^2]
  Mean mean_;                      // since the last of these:
  std::array<double, 8> means_{};  // the last means of a, a ring [m/s^2]
  std::size_t newest_mean_ = 0;    // of them
  std::array<AttitudeFilter, 2> filters_{{{kMahony}, {kMadgwick}}};
  double misfit_ = 0.0;     // of a without a filter
  double jolt_ = 0.0;       // largest recent change of the body within kJoltTime [m/s]
  double fastest_ = 0.0;    // largest recent acceleration of the wheels, for late sensors [m/s^2]
  double missed_ = kNever;  // since the last acceleration [s]
  double repeated_ = 0.0;   // variance of the integral by repeated accelerations [(m/s)^2]
  double listened_ = 0.0;   // duration of the accelerations so far [s]
  double measured_ = 0.0;   // the last acceleration, as it came [m/s^2]
  Past now_;
  std::array<Past, kRemembered> past_;
  std::size_t newest_ = 0, remembered_ = 0;
  Traction traction_ = Traction::rolls;
  double surprise_ = 0.0;         // length of the window that contradicted rolling [s]
  double sliding_ = 0.0;          // duration of the slide [s]
  double gap_at_first_ = 0.0;     // x_dot - v_w when it began to slide [m/s]
  double wheels_away_ = 0.0;      // total variation of the wheel speed since then [m/s]
  double turning_before_ = 0.0;   // integral of theta_dot^2 when it began to slide
  double hidden_ = 0.0;           // time in which vibration would have hidden a release [s]
  double speed_ = 0.0;            // x_dot [m/s]
  double corrected_speed_ = 0.0;  // at the last measurement [m/s]
  double variance_ = 0.0;
};

}  // namespace jackal_aic
