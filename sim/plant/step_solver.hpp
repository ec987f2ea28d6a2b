#pragma once

/// @file
/// The equations that the Open Dynamics Engine solves in a step, for a chassis with hinged wheels.

#include <Eigen/Core>
#include <array>
#include <cstddef>

namespace jackal_aic::sim {

using Twist = Eigen::Matrix<double, 6, 1>;  ///< velocity of a centre of mass [m/s], then angular velocity [rad/s]

/// A body as a step finds it; vectors in the ground frame.
struct SteppedBody {
  double mass;                               ///< [kg]; 0: moves as it is told
  Eigen::Matrix3d inertia, inverse_inertia;  ///< about its centre of mass [kg m^2]
  Twist velocity;                            ///< that it would have after the step without joints and contacts
};

/// A condition on velocities, jacobian . v + softness * force = target, as long as the force is within its bounds.
struct StepRow {
  Twist of_wheel = Twist::Zero(), of_chassis = Twist::Zero();  ///< jacobian
  double target = 0.0;
  double softness = 0.0;         ///< ODE's constraint force mixing
  double low = 0.0, high = 0.0;  ///< bounds of the force [N or N m]; both 0: the row is not there
};

/// A wheel and its hinge.
struct SteppedWheel {
  SteppedBody body;
  Eigen::Vector3d hinge_in_wheel, hinge_in_chassis;  ///< hinge, from either centre of mass [m]
  std::array<Eigen::Vector3d, 2> across;             ///< unit vectors across the axle, about which nothing turns
  Eigen::Matrix<double, 5, 1> target;  ///< of the hinge's rows: relative velocity there and about `across`
  std::array<StepRow, 4> rows;         ///< motor, and the contact along its normal and its two tangents
};

/// Finds the forces of joints and contacts in a step, and what they make of the velocities:
///
///     M (v+ - v) = h J' lambda,    J v+ + C lambda = c,    low <= lambda <= high
///
/// with the opposite inequality in the place of the equation at a bound. ODE factorises all rows of all joints at a
/// time. They form a tree: each wheel's own five rows of the hinge are eliminated with the wheel, then the chassis,
/// which leaves the four rows per wheel that have bounds or softness; which of these are at a bound is guessed from the
/// last step and exchanged until it is right, so that the solution is the one that ODE finds.
class StepSolver {
 public:
  /// @param hinge_softness ODE's constraint force mixing of the hinges.
  explicit StepSolver(double hinge_softness) : hinge_softness_(hinge_softness) {}

  /// Solves a step [s]. @returns false if it does not find which rows are at a bound.
  bool solve(const SteppedBody& chassis, const std::array<SteppedWheel, 4>& wheels, double step);

  const Twist& chassis() const { return chassis_; }                       ///< v+
  const Twist& wheel(std::size_t index) const { return wheels_[index]; }  ///< v+

  /// lambda of a row.
  double force(std::size_t wheel, std::size_t row) const { return force_(static_cast<Eigen::Index>(4 * wheel + row)); }

 private:
  static constexpr int kRows = 16;
  using Rows = Eigen::Matrix<double, kRows, 1>;
  using Square = Eigen::Matrix<double, kRows, kRows, Eigen::RowMajor>;
  enum class State : unsigned char { free, low, high };

  bool exchange(const Square& A, const Rows& b, const Rows& low, const Rows& high);
  void solveFree(const Square& A, const Rows& b);

  double hinge_softness_;
  Twist chassis_ = Twist::Zero();
  std::array<Twist, 4> wheels_{};
  Rows force_ = Rows::Zero();
  std::array<State, kRows> state_{};  // of the last step
};

}  // namespace jackal_aic::sim
