#pragma once

/// @file
/// The equations that the Open Dynamics Engine solves in a step, for a chassis with hinged wheels.

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "robot_model.hpp"

namespace jackal_aic::sim {

/// Velocity of a body's centre of mass [m/s], then its angular velocity [rad/s], both in the frame of the body.
using Twist = Eigen::Matrix<double, 6, 1>;

/// The chassis at the begin of a step.
struct SteppedChassis {
  bool told;       ///< true: its motion is given, forces have no effect
  Twist velocity;  ///< that it would have after the step without joints and contacts
};

/// A wheel at the begin of a step, in its own frame. Its rows, of the motor and of the contact along its normal and its
/// two tangents, are conditions on velocities, jacobian . v + softness * force = target, as long as the force is within
/// its bounds.
struct SteppedWheel {
  using Row = Eigen::Vector4d;  ///< a number for each row
  using Jacobian = Eigen::Matrix<double, 6, 4, Eigen::RowMajor>;

  Eigen::Matrix3d chassis;  ///< rotation of the chassis in the frame of the wheel
  Twist velocity;           ///< that it would have after the step without joints and contacts
  Twist closing;            ///< at the hinge, relative to the chassis: what closes it; about the axle of no use

  Jacobian jacobian = Jacobian::Zero();       ///< transposed; the motor, about the axle, +y, turns the chassis back
  Row target = Row::Zero();                   ///< [m/s or rad/s]
  Row softness = Row::Zero();                 ///< ODE's constraint force mixing
  Row low = Row::Zero(), high = Row::Zero();  ///< bounds of the force [N or N m]; both 0: the row is not there
};

/// Finds the forces of joints and contacts in a step h, and the velocities after it:
///
///     M (v+ - v) = h J' lambda,    J v+ + C lambda = c,    low <= lambda <= high
///
/// with the opposite inequality in the place of the equation at a bound. ODE factorises all rows of all joints at once.
/// They form a tree: the five hinge rows of each wheel are eliminated with the wheel, by matrices that are constant in
/// the wheel's frame (Featherstone's articulated-body inertia). This leaves the chassis and the four rows per wheel
/// with bounds or softness. The set of rows at a bound starts from the last step and is exchanged until it is right, so
/// that the solution equals ODE's.
class StepSolver {
 public:
  /// @param hinge_softness ODE's constraint force mixing of the hinges; @param step h [s].
  StepSolver(const RobotModel& model, double hinge_softness, double step);

  /// Solves a step. @returns false if it does not find the rows at a bound.
  bool solve(const SteppedChassis& chassis, const std::array<SteppedWheel, 4>& wheels);

  const Twist& chassis() const { return chassis_; }                       ///< v+
  const Twist& wheel(std::size_t index) const { return wheels_[index]; }  ///< v+

  /// lambda of a row.
  double force(std::size_t wheel, int row) const { return unknowns_(place(wheel, row)); }

  double step() const { return step_; }  ///< h [s]

 private:
  // The unknowns in the order of their elimination, from the leaves of the tree: lambda of each wheel's motor and
  // normal, v+ of the chassis, lambda of each wheel's tangents. These come last because wheels that stick hold more
  // than the robot's degrees of freedom: of themselves, their equations are nearly singular.
  static constexpr int kChassis = 8, kTangents = 14, kUnknowns = 22;
  using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
  using Mask = Eigen::Array<bool, kUnknowns, 1>;
  using Square = Eigen::Matrix<double, kUnknowns, kUnknowns, Eigen::RowMajor>;
  using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
  enum class State : unsigned char { free, low, high };

  /// A wheel on its hinge.
  struct HingedWheel {
    Eigen::Vector3d in_wheel, in_chassis;  // hinge, from either centre of mass [m]
    Matrix6 N;                             // force on the hinge per velocity that it lacks
    Matrix6 B;                             // change of the wheel's velocity by that force, transposed
    Matrix6 W;                             // velocity of the wheel per force on it while the chassis rests
  };

  // Of a row among the unknowns.
  static constexpr int place(std::size_t wheel, int row) {
    return 2 * static_cast<int>(wheel) + (row < 2 ? row : kTangents + row - 2);
  }
  bool exchange();
  bool descend();
  State wanted(int i) const;
  double excess(int i) const;
  void solveFree();
  template <int First>
  static void solveRows(const Square& A, const Mask& free, Square& U, Unknowns& b);

  double step_;
  Matrix6 chassis_mass_;  // M / h
  std::array<HingedWheel, 4> hinged_{};
  Twist chassis_ = Twist::Zero();
  std::array<Twist, 4> wheels_{};
  Square A_ = Square::Zero();             // of A x = b, upper triangle; between rows of two wheels there is nothing
  Unknowns b_, low_, high_;               // and bounds of x
  Unknowns unknowns_ = Unknowns::Zero();  // x
  std::array<State, kUnknowns> state_{};  // of the last step
};

}  // namespace jackal_aic::sim
