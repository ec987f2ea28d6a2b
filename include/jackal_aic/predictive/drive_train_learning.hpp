#pragma once

/// @file
/// Learning of the drive train's dead time delta and lag T from how the wheels follow their commands.
///
/// Whenever the commands change, a drive train of the model (drive_train.hpp) without dead time, which no measurement
/// corrects, goes through the same change from the same steady state; what it did a time delta ago is what wheels with
/// that dead time do now, for every delta at once. With it go the sensitivities psi of its speed w to
///
///     theta = (T, lambda, gamma, o),
///
/// lambda and gamma the motor's acceleration limit and gain in multiples of the model's and o an offset against the
/// command, which else would pass for a delay. Measured speed y, w and psi pass the same washout filter s/(s + 1/T_w),
/// so that what is off for long, a slope or the tyres, counts for nothing. For each delta of a grid
///
///     F(delta, theta) = 1/2 sum_k (y_k - w(t_k - delta) - psi(t_k - delta)' (theta - theta_0))^2 / Sigma
///                       + 1/2 (theta - theta_1)' Pi_0 (theta - theta_1) + 1/2 (delta - delta_0)^2 / sigma_delta^2
///
/// is the free energy, of which the sums are kept; theta_1 is theta_0 but for the lag, which is as it was told. Once
/// the commands have settled, its minimum along theta and then along delta is sought, with the variance Sigma of what
/// it leaves: theta by a Gauss-Newton step, around which the next change is linearised, delta between the points of the
/// grid by a parabola, whose curvature is its precision. Older changes count 0.7 of the next. No step and no dead time
/// is taken from a change that the model does not explain, or that lies farther from theta_0 than what was believed of
/// it; one in which the largest accelerations, measured and predicted, are apart teaches lambda alone. The model takes
/// over what is beyond doubt, of dead time and lag alone: acceleration limit and disturbance have beliefs of their own
/// (wheel_belief.hpp). Commands that do not change teach nothing.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// How late a drive train is.
struct DriveTrainTiming {
  double dead_time = 0.0;  ///< delta, from a command until the motors follow it [s]
  double lag = 0.0;        ///< T, time constant of the wheel speed [s]
};

/// Longest dead time and lag that are learned [s].
inline constexpr DriveTrainTiming kLongestTiming{0.4, 0.5};

/// Lists the fields of DriveTrainTiming with unit and range.
template <class Visitor>
void describeFields(Visitor& v, DriveTrainTiming& p) {
  v.field("dead_time", p.dead_time, {0.0, kLongestTiming.dead_time}, "s", Presence::required);
  v.field("lag", p.lag, {0.0, kLongestTiming.lag}, "s", Presence::required);
}

/// Learning of dead time and lag, the same for both sides. Nothing here allocates.
class DriveTrainLearning {
 public:
  /// @param model to start from; @param wheel_radius r [m]; @param wheel_variance Sigma_y of a measured wheel speed,
  /// the least of Sigma [(rad/s)^2].
  DriveTrainLearning(const PlantModel& model, double wheel_radius, double wheel_variance);

  /// Goes on by DriveTrain::kStep. @param given effective commands of now [rad/s]; @param speed believed [rad/s].
  void predict(const WheelVector& given, const WheelVector& speed);

  /// Takes measured wheel speeds [rad/s]. @param step since the last ones [s]. Returns the timing to go on with, if it
  /// is another one now.
  std::optional<DriveTrainTiming> correct(const WheelVector& measured, double step);

  /// What the commands or the wheels did of late is not to be learned from.
  void forgetMotion();

  /// Goes on from another timing, which is believed as a configured one.
  void setTiming(const DriveTrainTiming& timing);

  /// That the model has now.
  const DriveTrainTiming& timing() const { return timing_; }

 private:
  static constexpr int kParameters = 4;
  static constexpr int kTicks = 5;                             // inner steps of a step of the prediction
  static constexpr double kStep = kTicks * DriveTrain::kStep;  // s; of the prediction, and between the dead times
  static constexpr int kGrid = static_cast<int>(kLongestTiming.dead_time / kStep) + 2;
  static constexpr std::size_t kHistory = 128;           // steps, more than the longest dead time, a power of two
  static constexpr double kSettled = 0.6;                // s; after the dead time, until nothing is left of a change
  using Vector = Eigen::Matrix<double, kParameters, 1>;  // along theta
  using Matrix = Eigen::Matrix<double, kParameters, kParameters>;
  using Speeds = Eigen::Matrix<double, 1, 1 + kParameters>;  // w and its derivatives by theta

  /// The largest acceleration over a few measurements.
  struct FastestChange {
    std::array<double, 4> speeds{};  // the last ones, the oldest first [rad/s]
    std::array<double, 4> steps{};   // from each to the next, and from the last to that which comes [s]
    double fastest = 0.0;            // [rad/s^2]

    void start(double speed) {
      speeds.fill(speed);
      steps.fill(0.0);
      fastest = 0.0;
    }
    void add(double speed, double step) {
      steps.back() = step;
      const double time = std::accumulate(steps.begin(), steps.end(), 0.0);
      if (steps.front() > 0.0) fastest = std::max(fastest, std::abs(speed - speeds.front()) / time);
      std::rotate(speeds.begin(), speeds.begin() + 1, speeds.end());
      std::rotate(steps.begin(), steps.begin() + 1, steps.end());
      speeds.back() = speed;
    }
  };

  /// A wheel that does what the drive train does without its dead time, and how that depends on theta.
  struct Prediction {
    Speeds speed = Speeds::Zero();         // w
    Speeds correction = Speeds::Zero();    // z
    Speeds filtered = Speeds::Zero();      // speed behind the washout filter
    std::array<Speeds, kHistory> history;  // of filtered
    double steady = 0.0;                   // w - gain v before the commands changed [rad/s]
    double measured = 0.0;                 // y, the last one [rad/s]
    double measured_filtered = 0.0;
    FastestChange measured_lately;
    FastestChange predicted_lately;
    bool limited = false;  // was the speed by the acceleration limit
  };

  /// Sums over measurements for one dead time.
  struct Sums {
    Matrix curvature = Matrix::Zero();  // psi psi'
    Vector slope = Vector::Zero();      // psi eps
    double squares = 0.0;               // eps^2

    Sums over(double variance) const { return {curvature / variance, slope / variance, squares / variance}; }
    void add(const Sums& other) {
      curvature += other.curvature;
      slope += other.slope;
      squares += other.squares;
    }
  };

  /// Minimum of F along theta for one dead time.
  struct Minimum {
    Vector change;       // of theta
    double free_energy;  // without the prior of delta
  };

  enum class State { unknown, settled, changing };

  bool settles() const { return settled_time_ >= kSettled + timing_.dead_time; }
  void start(const WheelVector& speed);
  void start(Prediction& wheel, double given, double speed) const;
  void step(Prediction& wheel, double given) const;
  void observe(Prediction& wheel, double measured, double step);
  Vector deviations() const;
  Minimum minimum(const Sums& sums) const;
  double freeEnergy(int i) const;
  int best() const;
  double leastSquares(double variance) const;
  bool learnLimit();
  std::optional<DriveTrainTiming> learn();
  std::optional<DriveTrainTiming> learnTiming();
  bool takeOver(const DriveTrainTiming& timing, double dead_time_variance, double lag_variance);
  void relinearise(const Vector& change);
  void linearise();
  void forgetChange();

  PlantModel model_;
  double radius_;
  double wheel_variance_;
  DriveTrainTiming timing_;
  double lag_ = 0.0;          // T [s]
  double told_lag_ = 0.0;     // T that was told [s]
  double limit_share_ = 1.0;  // lambda
  double gain_share_ = 1.0;   // gamma
  double offset_ = 0.0;       // o [rad/s]
  double rest_ = 0.0;         // of a difference of speed after a step, e^(-h/T)
  double limit_ = 0.0;        // L of dw/dt, with lambda [rad/s^2]

  State state_ = State::unknown;
  WheelVector resting_ = WheelVector::Zero();  // commands about which they are settled [rad/s]
  double changing_time_ = 0.0;                 // since the commands began to change, or something was last learned [s]
  double settled_time_ = 0.0;                  // since they last did [s]
  std::size_t newest_ = 0;                     // of the histories
  WheelVector given_ = WheelVector::Zero();    // sum of the commands since the last step of the prediction [rad/s]
  int ticks_ = 0;                              // inner steps since then
  Prediction left_;
  Prediction right_;
  std::array<Sums, kGrid> sums_;    // since the commands began to change, or something was last learned
  double samples_ = 0.0;            // in them
  double motion_ = 0.0;             // y^2 of them, behind the washout filter
  std::array<Sums, kGrid> memory_;  // of earlier changes, over the Sigma of each
};

}  // namespace jackal_aic
