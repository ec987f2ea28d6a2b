#pragma once

/// @file
/// Estimators for sensors whose noise has a memory: the model of drive_train.hpp with the last samples of each
/// channel's noise n as states beside it,
///
///     y = H x + n_k,    n_k = c' (n_(k-1), .., n_(k-p)) + fresh noise,
///
/// c and the variance of the fresh noise such that the noise has the covariance R of a model of it (Yule and Walker).
/// They differ in that model: noise that is known, smoothness and precision learned by the free energy
/// (smoothness_learning.hpp), and coloured noise that is adapted until the innovations are white.

#include <Eigen/Core>
#include <functional>
#include <memory>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/predictive/predictive_parameters.hpp"
#include "jackal_aic/predictive/smoothness_learning.hpp"

namespace jackal_aic::sim {

/// Noise of one channel whose smooth part has the autocorrelation exp(-|t|/T), of first order: AR(1) at equal steps.
struct ExponentialNoise {
  double white_variance = 1e-3;   ///< N [unit^2]
  double variance = 0.0;          ///< of the part with a memory [unit^2]
  double correlation_time = 0.0;  ///< T [s]; 0: it is white, too

  /// R as SmoothNoise::covariance().
  SmoothNoise::WindowMatrix covariance(double step) const;
};

/// What a measurement tells of a channel's noise.
struct NoiseEvidence {
  SmoothNoise::WindowMatrix moments;  ///< E[n n'] of the last samples, as they are believed now [unit^2]
  double innovation = 0.0;            ///< measured minus predicted [unit]
  double innovation_variance = 1.0;   ///< as it was predicted [unit^2]
  double step = 0.0;                  ///< since the last measurement [s]
};

/// What is believed of the noise of a channel.
class NoiseModel {
 public:
  virtual ~NoiseModel() = default;

  /// Covariance R of its last samples, this far apart [s].
  virtual SmoothNoise::WindowMatrix covariance(double step) const = 0;

  /// Learns from a measurement.
  virtual void learn(const NoiseEvidence&) {}

  /// Standard deviation of the part with a memory [unit], and its smoothness s or correlation time [s].
  virtual Eigen::Vector2d learned() const = 0;
};

/// Noise that is known.
template <class Noise>
class KnownNoise : public NoiseModel {
 public:
  explicit KnownNoise(const Noise& noise) : noise_(noise) {}
  SmoothNoise::WindowMatrix covariance(double step) const override { return noise_.covariance(step); }
  Eigen::Vector2d learned() const override { return Eigen::Vector2d::Zero(); }

 private:
  Noise noise_;
};

/// Smoothness and precision learned together by the free energy.
class LearnedSmoothNoise : public NoiseModel {
 public:
  /// @param start what is believed first; @param memory as SmoothnessLearning [s].
  LearnedSmoothNoise(const SmoothNoise& start, double memory) : learning_(start, memory) {}
  SmoothNoise::WindowMatrix covariance(double step) const override { return learning_.noise().covariance(step); }
  void learn(const NoiseEvidence& evidence) override { learning_.learn(evidence.moments, evidence.step); }
  Eigen::Vector2d learned() const override;

 private:
  SmoothnessLearning learning_;
};

/// Innovation-whitening adaptive Kalman filter: a noise of first order beside the white one, of which coefficient and
/// variance are adapted until the innovations are white and as large as predicted (Mehra 1970; Almuhaihi and Bernstein,
/// "An adaptive Kalman filter that learns the coloring dynamics of the process noise", 2026, do so for the process
/// noise). With the normalised innovation e and the part g of its variance that the noise with a memory has:
///
///     phi <- phi + (h/T) e_k e_(k-1) / g,    ln Sigma <- ln Sigma + (h/T) (e_k^2 - 1) / g.
class WhitenedNoise : public NoiseModel {
 public:
  /// @param start what is believed first; @param memory T [s]; @param step for which phi is the coefficient [s].
  WhitenedNoise(const ExponentialNoise& start, double memory, double step);
  SmoothNoise::WindowMatrix covariance(double step) const override { return noise_.covariance(step); }
  void learn(const NoiseEvidence& evidence) override;
  Eigen::Vector2d learned() const override;

 private:
  ExponentialNoise noise_;
  double memory_, step_;
  double last_ = 0.0;  // normalised innovation
};

/// n states, of which the first is measured, and the last samples of the measurement's noise.
template <int n>
class BeliefWithNoise {
 public:
  static constexpr int kWindow = SmoothNoise::kOrders + 1;
  using State = Eigen::Matrix<double, n, 1>;
  using StateMatrix = Eigen::Matrix<double, n, n>;

  /// Starts at a state that is known as well as this, with noise of which nothing is known but its model.
  void start(const State& state, const StateMatrix& covariance, const NoiseModel& noise, double step);

  State& state() { return state_; }              ///< x, which moves as its own model says
  const State& state() const { return state_; }  ///< likewise

  /// The covariance moves with the state. @param J transition; @param fluctuation variances that it adds.
  void predict(const StateMatrix& J, const State& fluctuation);

  /// Takes a measurement made a step [s] after the last one. @returns what it tells of the noise.
  NoiseEvidence correct(double measurement, const NoiseModel& noise, double step);

 private:
  static constexpr int kAll = n + kWindow;
  State state_ = State::Zero();
  SmoothNoise::Window noise_ = SmoothNoise::Window::Zero();
  Eigen::Matrix<double, kAll, kAll> P_ = Eigen::Matrix<double, kAll, kAll>::Zero();
};

/// Makes the model of a channel's noise. @param wheel encoder or gyro.
using NoiseModelFactory = std::function<std::unique_ptr<NoiseModel>(bool wheel)>;

/// Believes the motion of a robot from the commands that drive it and from sensors whose noise has a memory. What it
/// trusts beside (fluctuations, deviation of the dead time, delay of the yaw) is that of the predictive controller.
///
/// It learns of the noise while the robot drives steadily. The fluctuations are chosen for how fast a disturbance is
/// followed and are larger than what disturbs a robot that drives steadily (precision_learning.hpp): a belief with
/// them takes slow noise for motion. So beside each belief goes a second one that has a hundredth of them, begins where
/// the first one is when the drive becomes steady, and tells of the noise.
class ColouredNoiseFilter {
 public:
  static constexpr double kStep = DriveTrain::kStep;  ///< of the prediction [s]

  /// At rest. @param parameters trust in the model; @param geometry r and alpha; @param model drive train, with its
  /// effective track; @param noise of the sensors.
  ColouredNoiseFilter(const PredictiveParameters& parameters, const GeometryParameters& geometry,
                      const PlantModel& model, const NoiseModelFactory& noise);

  /// Moves the estimate by one step during which the command [rad/s] is applied.
  void predict(const WheelCommand& command);

  /// Takes a measurement made now.
  void correct(const Observation& observation);

  /// Estimated body velocity (base_link).
  BodyVector velocity() const;

  const NoiseModel& wheelNoise() const { return *left_.channel.noise; }  ///< of the left encoder
  const NoiseModel& gyroNoise() const { return *yaw_.noise; }            ///< of the gyro

 private:
  /// What is believed, the same while it drives steadily, and the noise of its sensor.
  template <int n>
  struct Channel {
    std::unique_ptr<NoiseModel> noise;
    BeliefWithNoise<n> belief = {}, steady = {};
  };
  struct Wheel {
    CommandsUnderWay commands;
    Channel<3> channel;
    double acceleration = 0.0;  // of the last step [rad/s^2]
  };

  void start(const Observation& observation);
  void predict(Wheel& wheel, double command);
  void correct(Wheel& wheel, double measured, double step);
  template <int n>
  void correct(Channel<n>& channel, double measured, double step);
  bool steady() const;

  PredictiveParameters parameters_;
  DriveTrain drive_train_;
  DeadZone dead_zone_;
  SkidSteerKinematics kinematics_;
  bool on_box_;
  Wheel left_, right_;
  Channel<1> yaw_;
  double unfollowed_ = 0.0;                 // yaw rate that the body may not have yet [rad/s]
  Eigen::Vector2d acceleration_{0.0, 0.0};  // of both wheels, over some periods [rad/s^2]
  double steady_time_ = 0.0;                // [s]
  double stamp_ = 0.0;                      // of the last measurement [s]
  bool started_ = false;
};

}  // namespace jackal_aic::sim
