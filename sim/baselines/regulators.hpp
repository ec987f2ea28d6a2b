#pragma once

/// @file
/// Published regulators of a plant with dead time, each around the path of PathFollower: deviation e of the wheel's
/// speed in, command v out. T is the action period, theta the dead time of the model, g its gain.

#include <Eigen/Core>
#include <memory>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "kalman_filter.hpp"
#include "wheel_law.hpp"

namespace jackal_aic::sim {

/// Gains of a PID controller in parallel form, on the deviation.
struct PidGains {
  double proportional = 0.0;
  double integral = 0.0;    ///< [1/s]
  double derivative = 0.0;  ///< [s]
};

/// The gains of Skogestad's rules (SIMC, 2003) for the drive train without its velocity loop's integral, with the lag
/// tau_1 and the effective dead time theta + T/2 of the hold, and tau_c as tuning:
///
///     K = tau_1 / (g (tau_c + theta)),   tau_I = min(tau_1, 4 (tau_c + theta)),   tau_D = theta/3,
///
/// the last by Grimholt and Skogestad (2018), in series; without derivative the gains are those of SIMC PI.
PidGains simcGains(const PlantModel& model, double tau_c, bool derivative);

/// v = -(k_p e + k_i int e dt + k_d de/dt), de/dt the difference of two samples.
class Pid : public Regulator {
 public:
  explicit Pid(const PidGains& gains) : gains_(gains) {}
  void reset() override { integral_ = last_ = deviation_ = 0.0; }
  void correct(double e) override { deviation_ = e; }
  double act() override;

 private:
  PidGains gains_;
  double integral_ = 0.0;
  double last_ = 0.0;       // e of the last action
  double deviation_ = 0.0;  // e
};

/// A PI controller with the predictor of Smith (1957): it is given what the deviation will be without further
/// disturbances, e - w_theta + w_0, where w_theta and w_0 are the model's answers to v with and without dead time.
class SmithPredictor : public Regulator {
 public:
  SmithPredictor(const PlantModel& model, double wheel_radius, const PidGains& gains);
  void reset() override;
  void predict(double v) override;
  void correct(double e) override;
  double act() override;

 private:
  Pid pi_;
  DriveTrainPrediction delayed_, prompt_;
  double deviation_ = 0.0;  // e
};

/// Weights of the regulator that is optimal for quadratic cost and Gaussian noise.
struct LqgWeights {
  WheelBeliefParameters noise;  ///< variances of encoder, speed and disturbance; nothing else of it
  double speed = 1.0;           ///< of the squared deviation of the speed at each action
  double command = 1.0;         ///< of the square of g v + d
};

/// Gain K of the linear quadratic regulator for x(k+1) = A x + B r, the least sum of x' Q x + R r^2:
///
///     K = (R + B' P B)^-1 B' P A,   P = A' P A - A' P B K + Q.
///
/// @throws ParameterError as predictionCovariance().
Eigen::RowVectorXd regulatorGain(const Eigen::MatrixXd& transition, const Eigen::VectorXd& input,
                                 const Eigen::MatrixXd& state_weight, double input_weight);

/// LQG for a plant with dead time. The commands under way are states of the augmented plant, and the best estimate of
/// the state on which the command of now acts is what the model makes of the filter's estimate under them: with
/// K of the plant without dead time,
///
///     v = -(d + K (w, z)(t + theta)) / g,
///
/// which is the regulator of the augmented plant (test: its gain on every state and command under way).
class Lqg : public Regulator {
 public:
  Lqg(const PlantModel& model, double wheel_radius, const LqgWeights& weights);
  void reset() override { filter_.reset(0.0); }
  void predict(double v) override { filter_.predict(v); }
  void correct(double e) override { filter_.correct(e); }
  double act() override;

  const Eigen::RowVector2d& gain() const { return gain_; }  ///< K

 private:
  double command_gain_;  // g
  WheelKalmanFilter filter_;
  Eigen::RowVector2d gain_;
};

/// Tuning of the linear active disturbance rejection controller.
struct AdrcTuning {
  double controller_bandwidth = 10.0;  ///< omega_c [rad/s]
  double observer_bandwidth = 30.0;    ///< omega_o [rad/s]
  double input_gain = 30.0;            ///< b_0 [1/s]
};

/// Linear active disturbance rejection of first order (Gao 2003) with its extended state observer fed with the command
/// after the dead time (Zhao and Gao 2014):
///
///     dw/dt = f + b_0 v(t - theta),  df/dt = 0,     v = -(omega_c w + f) / b_0,
///
/// and both observer poles at e^(-omega_o T): L = (1 - beta^2, (1 - beta)^2 / T), beta = e^(-omega_o T).
class Adrc : public Regulator {
 public:
  Adrc(const PlantModel& model, const AdrcTuning& tuning);
  void reset() override;
  void predict(double v) override;
  void correct(double e) override;
  double act() override;

 private:
  AdrcTuning tuning_;
  CommandsUnderWay commands_;
  double speed_ = 0.0;        // w
  double disturbance_ = 0.0;  // f
};

/// Precisions of the published active inference with input delay.
struct DelayedInferenceGains {
  double prediction_share = 0.5;  ///< Sigma_mu / (Sigma_mu + Sigma_y): how much of a sample's error is believed, (0, 1)
  double proportional = 1.0;      ///< of the preferred control on the predicted state
  double integral = 10.0;         ///< and on the error that is sensed [1/s]
};

/// Delayed feedback active inference (Ji et al., CDC 2023; Entropy 26(11):990, 2024) for one wheel: with the state
/// mu_p that the model predicts from before and the commands under way,
///
///     F = 1/2 (mu - mu_p)^2/Sigma_mu + 1/2 (e - mu)^2/Sigma_y + 1/2 (v - v_p)^2/Sigma_v,
///     v_p = -(k_p mu(t + theta) + k_i int e dt),
///
/// a proportional-integral preference on the predicted state. Belief and command descend F to its minimum. What the
/// papers say of a quadrotor is here said of a wheel; their integral is taken of the sensed error, because a predicted
/// state without a disturbance has a steady-state error.
class DelayedInference : public Regulator {
 public:
  DelayedInference(const PlantModel& model, double wheel_radius, const DelayedInferenceGains& gains);
  void reset() override;
  void predict(double v) override;
  void correct(double e) override;
  double act() override;

 private:
  DelayedInferenceGains gains_;
  DriveTrain drive_train_;
  CommandsUnderWay commands_;
  Eigen::Vector3d on_arrival_ = Eigen::Vector3d::UnitX();  // what becomes of a change of mu in a dead time
  Eigen::Vector3d belief_ = Eigen::Vector3d::Zero();       // (mu, z, 0)
  Eigen::Vector3d predicted_ = Eigen::Vector3d::Zero();    // likewise, a dead time ahead
  double integral_ = 0.0;                                  // of e
  double deviation_ = 0.0;                                 // e
};

}  // namespace jackal_aic::sim
