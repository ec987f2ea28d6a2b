#pragma once

/// @file
/// Belief about whether the body follows its wheels, and about its forward speed where it does not.
///
/// The wheels say what the speed is, v_w = r alpha (w_L + w_R)/2, as long as the tyres grip; the accelerometer says how
/// it changes. A point of the body sees the centripetal acceleration beside dx_dot/dt,
///
///     a = a_x + theta_dot y_dot = a_x - l theta_dot^2 - b,    y_dot = -l theta_dot,
///
/// because the robot turns about a centre that lies l ahead of the IMU; b is what the accelerometer shows of a robot
/// that keeps its speed. Three hypotheses on x_dot:
///
///     rolls    x_dot = v_w
///     slides   x_dot is the integral of a since the tyres gripped last: friction alone moves the body
///     stands   x_dot = 0 although the wheels turn: something holds it
///
/// Over a window of W the wheels changed their speed by Delta v_w and the body by Delta v, the integral of a. Rolling
/// is given up when the prediction error D = Delta v_w - Delta v is more than noise, vibration and late sensors make
/// it, and comes of the wheels (Delta v_w has its sign, and the body did not go against it) or of a collision (within
/// W_c, and it stops the body): a slope, which an IMU without attitude takes for an acceleration, does neither. Tyres
/// that slide accelerate the body, unless something holds it; so one that neither accelerates nor brakes has come to
/// roll, or stands, whichever is nearer to the integral; one that turns does not stand.
///
/// What is farther from its wheels than friction or a collision can have brought it is no body that slides: b has
/// jumped, and is taken from what was measured since.
///
/// An attitude filter that takes accelerations for tilt hides them, a_x = dx_dot/dt - w: what it calls gravity, w,
/// follows the acceleration that it leaves,
///
///     dw/dt = g a            complementary and Mahony: g is the gain [1/s]
///     dw/dt = g sign(a)      Madgwick: g is twice gravity times the gain [m/s^3]
///
/// g is learned for each kind from wheels that roll, by recursive least squares of D on the integral of w/g, with a
/// prior. The better kind is believed if it explains D better than no filter does; rolling is given up only if no g of
/// either kind that is within three standard deviations explains D.
///
/// An instrument of the belief about the speed alone: wheels and commands do not depend on it.

#include <array>
#include <cstddef>
#include <optional>

namespace jackal_aic {

/// What the body does relative to its wheels.
enum class Traction {
  rolls,   ///< it follows its wheels
  slides,  ///< its tyres slide: wheels spin up or are locked
  stands   ///< it stands although its wheels turn
};

/// Belief about the forward speed of the body beside that of its wheels. Does not allocate.
class TractionBelief {
 public:
  /// Longest time that one acceleration stands for [s]; after a longer one the wheels are believed.
  static constexpr double kLongestStep = 0.15;

  /// @param turning_centre l, how far the centre of turning lies ahead of the IMU [m].
  explicit TractionBelief(double turning_centre) : turning_centre_(turning_centre) {}

  /// Lets a step [s] pass: between two measurements a body that slides goes on with the last acceleration,
  /// as far as tyres can be the cause of it.
  void predict(double step);

  /// Takes a forward acceleration free of gravity, the mean since the last one [m/s^2], of variance [(m/s^2)^2].
  /// @param wheels v_w now [m/s]; @param yaw_rate theta_dot [rad/s]; @param step since the last measurement [s].
  void correct(double wheels, double acceleration, double variance, double yaw_rate, double step);

  /// No acceleration was measured, or none that counts, for a step [s]. @param wheels v_w now [m/s].
  void miss(double wheels, double step);

  /// Goes on with another centre of turning [m].
  void setTurningCentre(double turning_centre) { turning_centre_ = turning_centre; }

  /// Wheels that are measured anew only once in a time [s] are late by up to that.
  void setWheelsHold(double hold) { hold_ = hold; }

  /// Begins anew with the next measurement; what was learned of the accelerometer stays.
  void restart();

  /// Believes the wheels, v_w [m/s]; what was learned of the accelerometer stays.
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

  /// What changed from a time in the past until now.
  struct Change {
    double time, wheels, body, variance, turning;
    std::array<double, 2> hidden;
    double unfiltered;                              // D if no filter is there
    double error() const { return wheels - body; }  // D
  };

  /// An attitude filter of one kind.
  struct AttitudeFilter {
    double gain_deviation;     // of the prior of g
    double tilt = 0.0;         // w/g
    double information = 0.0;  // sum of (integral of w/g)^2/sigma^2
    double evidence = 0.0;     // sum of D (integral of w/g)/sigma^2
    double misfit = 0.0;       // mean of (D left)^2/sigma^2

    double variance() const { return 1.0 / (information + 1.0 / (gain_deviation * gain_deviation)); }  // of g
    double gain() const { return variance() * evidence; }                                              // g
  };

  /// A mean of a that is being taken.
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
  bool turnsOn() const;
  double leastToCome(const Change& change) const;
  bool comesToItsWheels(const Change& change) const;
  void stand(double step);
  void beginToRoll();
  void beginToSlide(double speed, const Change& surprise);
  void beginToStand();
  void forgetPast();

  static constexpr double kMahony = 0.75;     // 1/s, standard deviation of g
  static constexpr double kMadgwick = 2.0;    // m/s^3; that of a gain of 0.1
  static constexpr double kNever = 1e9;       // s
  static constexpr double kSpacing = 0.0199;  // s between two remembered
  static constexpr std::size_t kRemembered = 64;

  double turning_centre_;
  double hold_ = 0.0;              // of the wheels' speeds [s]
  double offset_ = 0.0;            // b [m/s^2]
  bool offset_known_ = false;      // something was learned of b
  double quick_ = 0.0;             // variance of means of a, by what successive ones differ by [(m/s^2)^2]
  double slow_ = 1e-9;             // likewise, by what every third differ by [(m/s^2)^2]
  double vibration_rate_ = 0.0;    // of the variance of the integral of a, by vibration, per second [(m/s)^2/s]
  double variance_rate_ = 0.0;     // likewise, by all noise, now [(m/s)^2/s]
  double factor_ = 1.0;            // lambda, of the variance of its integral
  double latest_ = 0.0;            // a [m/s^2]
  Mean mean_;                      // since the last of these:
  std::array<double, 8> means_{};  // the last means of a, a ring [m/s^2]
  std::size_t newest_mean_ = 0;    // of them
  std::array<AttitudeFilter, 2> filters_{{{kMahony}, {kMadgwick}}};
  double misfit_ = 0.0;     // of a without a filter
  double jolt_ = 0.0;       // fastest change of the body lately [m/s]
  double fastest_ = 0.0;    // acceleration of the wheels lately, for sensors that are late [m/s^2]
  double missed_ = kNever;  // since the last acceleration [s]
  double repeated_ = 0.0;   // variance by which the integral is unsure until then [(m/s)^2]
  double listened_ = 0.0;   // to accelerations [s]
  double measured_ = 0.0;   // the last acceleration, as it came [m/s^2]
  Past now_;
  std::array<Past, kRemembered> past_;
  std::size_t newest_ = 0, remembered_ = 0;
  Traction traction_ = Traction::rolls;
  double surprise_ = 0.0;         // for how long rolling had been contradicted when it began to slide [s]
  double sliding_ = 0.0;          // for how long [s]
  double gap_at_first_ = 0.0;     // x_dot - v_w when it began to slide [m/s]
  double wheels_away_ = 0.0;      // by which the wheels changed their speed since then, to and fro [m/s]
  double turning_before_ = 0.0;   // integral of theta_dot^2 when it began to slide
  double hidden_ = 0.0;           // for how long vibration would have hidden that it was let go [s]
  double speed_ = 0.0;            // x_dot [m/s]
  double corrected_speed_ = 0.0;  // at the last measurement [m/s]
  double variance_ = 0.0;
};

}  // namespace jackal_aic
