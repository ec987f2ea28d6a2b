#pragma once

/// @file
/// Fit of a drive train of one lag and acceleration limit to the wheels' motion, for every dead time at once.
///
/// A drive train of the model (drive_train.hpp) without dead time runs through the commands, uncorrected. Its speed a
/// time delta ago is the present speed of a wheel with the dead time delta. Gain share gamma and offset o are linear
/// below the limit, so the run also has the sensitivities psi of its speed w to theta = (gamma, o). Measured speed y, w
/// and psi pass the same washout filter s/(s + 1/T_w), so that constant errors, of a slope or the tyres, do not count.
/// For each delta of a grid it keeps the sums over the measurements of
///
///     1/2 (y_k - w(t_k - delta) - psi(t_k - delta)' (theta - theta_0))^2,    theta_0 = (gamma_0, 0)

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Sums over measurements for one dead time, of residuals epsilon at theta_0.
struct DriveTrainSums {
  Eigen::Matrix2d curvature = Eigen::Matrix2d::Zero();  ///< sum of psi psi'
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();      ///< sum of psi epsilon
  double squares = 0.0;                                 ///< sum of epsilon^2

  /// Adds other sums with a weight.
  void add(const DriveTrainSums& other, double weight);

  /// The sums around another gamma_0, by a change.
  DriveTrainSums around(double change) const;

  /// The sums with gamma marginalised: least squares along it.
  DriveTrainSums withoutGain() const;
};

/// A run of a drive train through commands, and its sums. Only the constructor allocates.
class DriveTrainFit {
 public:
  static constexpr double kStep = 0.005;           ///< of the run [s]
  static constexpr double kSpacing = 2.0 * kStep;  ///< between two dead times of the grid [s]
  static constexpr int kGrid = 41;                 ///< number of dead times, up to 0.4 s
  static constexpr double kWashout = 0.3;          ///< T_w [s]
  using Sums = std::array<DriveTrainSums, kGrid>;  ///< by dead time

  /// @param lag T [s]; @param limit of the wheel's acceleration [rad/s^2].
  DriveTrainFit(const PlantModel& model, double lag, double limit);

  /// Runs on from a steady motion under these effective commands [rad/s]; the sums stay.
  void restart(const WheelVector& given);

  /// Continues as another run of the same lag did so far, with its sums. @param limit of this run [rad/s^2].
  void become(const DriveTrainFit& other, double limit);

  /// Runs with another gain share gamma_0, and changes run and sums to first order.
  void setGain(double gain);

  /// Advances by kStep. @param given mean effective commands in it [rad/s].
  void step(const WheelVector& given);

  /// Adds filtered measured speeds y [rad/s]. @param weight of each; @param part elapsed part of the next step.
  void observe(const WheelVector& filtered, const WheelVector& weight, double part);

  Sums present;  ///< over the measurements of the present motion
  Sums memory;   ///< of earlier motions, each over its variance

 private:
  static constexpr std::size_t kHistory = 128;  // steps, more than the longest dead time, a power of two
  using Speeds = Eigen::Matrix<double, 1, 3>;   // w and its derivatives by theta

  struct Wheel {
    Speeds speed = Speeds::Zero();                                                // w
    Speeds correction = Speeds::Zero();                                           // z
    Speeds filtered = Speeds::Zero();                                             // speed behind the washout filter
    std::vector<Speeds> history = std::vector<Speeds>(kHistory, Speeds::Zero());  // of filtered
  };

  Speeds input(double given) const;

  double model_gain_, integral_;  // of the model
  double gain_ = 1.0;             // gamma_0
  double lag_;                    // T [s]
  double limit_;                  // of dw/dt [rad/s^2]
  double rest_;                   // of a difference of speed after a step, e^(-h/T)
  std::size_t newest_ = 0;        // of the histories
  std::array<Wheel, 2> wheels_;
};

}  // namespace jackal_aic
