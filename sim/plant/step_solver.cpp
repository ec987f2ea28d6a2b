#include "step_solver.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace jackal_aic::sim {
namespace {

template <int RowCount, int ColumnCount>
using RowMajor = Eigen::Matrix<double, RowCount, ColumnCount, Eigen::RowMajor>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kAxle = 4;                   // component of a twist about the axle
constexpr int kPatience = 3;               // exchanges in a row that do not reduce the number of wrong bounds
constexpr int kMostChanges = 60;           // of an active set
constexpr double kForceTolerance = 1e-10;  // by which a force may miss its bound, relative
constexpr double kSpeedTolerance = 1e-13;  // by which a velocity may miss its inequality [m/s or rad/s]

/// Velocity of a body at a point.
Twist velocityAt(const Eigen::Vector3d& point, const Twist& velocity) {
  Twist there = velocity;
  there.head<3>() += velocity.tail<3>().cross(point);
  return there;
}

/// X' F: forces in the frame of a wheel at its hinge, transformed to the chassis' frame (rotation R) and centre of
/// mass.
template <int Columns>
RowMajor<6, Columns> onChassis(const Eigen::Matrix3d& R, const Eigen::Vector3d& hinge, const RowMajor<6, Columns>& F) {
  RowMajor<6, Columns> moved;
  moved.template topRows<3>() = R.transpose().lazyProduct(F.template topRows<3>());
  moved.template bottomRows<3>() = R.transpose().lazyProduct(F.template bottomRows<3>());
  moved.row(3) += hinge.y() * moved.row(2) - hinge.z() * moved.row(1);
  moved.row(4) += hinge.z() * moved.row(0) - hinge.x() * moved.row(2);
  moved.row(5) += hinge.x() * moved.row(1) - hinge.y() * moved.row(0);
  return moved;
}

RowMajor<6, 6> massOf(const RigidBody& body) {
  RowMajor<6, 6> mass = RowMajor<6, 6>::Zero();
  mass.diagonal().head<3>().setConstant(body.mass);
  mass.bottomRightCorner<3, 3>() = body.inertia;
  return mass;
}

}  // namespace

StepSolver::StepSolver(const RobotModel& model, double hinge_softness, double step)
    : step_(step), chassis_mass_(massOf(model.chassis) / step) {
  for (std::size_t i = 0; i < hinged_.size(); ++i) {
    const WheelModel& wheel = model.wheels[i];
    HingedWheel& hinged = hinged_[i];
    hinged.in_wheel = wheel.hub - wheel.body.centre;
    hinged.in_chassis = wheel.hub - model.chassis.centre;
    const Matrix6 W = step * massOf(wheel.body).inverse();
    Matrix6 H = Matrix6::Identity();
    for (int k = 0; k < 6; ++k) H.col(k) = velocityAt(hinged.in_wheel, Twist::Unit(k));
    // N = (H W H' + C)⁻¹ in the hinge's rows, which leave the axle out
    Matrix6 P = H * W * H.transpose();
    P.diagonal().array() += hinge_softness;
    P.row(kAxle).setZero();
    P.col(kAxle).setZero();
    P(kAxle, kAxle) = 1.0;
    hinged.N = P.inverse();
    hinged.N(kAxle, kAxle) = 0.0;
    hinged.B = hinged.N * H * W;
    hinged.W = W - W * H.transpose() * hinged.B;
  }
}

bool StepSolver::solve(const SteppedChassis& chassis, const std::array<SteppedWheel, 4>& wheels) {
  // With the wheels and their hinges eliminated, of v+ = v + B (c - H v + X V) + W T' λ, the chassis and the rows have
  //     -(M / h + X' N X) V + Z λ = -M / h V₀ + X' N (c - H v)
  //     Z' V + (T W T' + C) λ = c - T (v + B (c - H v))
  // with Z' = T B X, and the motor's axle on the chassis.
  Matrix6 K = -chassis_mass_;
  Twist momentum = -chassis_mass_.lazyProduct(chassis.velocity);
  std::array<SteppedWheel::Jacobian, 4> pushed;
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    const SteppedWheel& wheel = wheels[i];
    const HingedWheel& hinged = hinged_[i];
    const Twist lacking = wheel.closing - velocityAt(hinged.in_wheel, wheel.velocity);
    wheels_[i] = wheel.velocity + hinged.B.transpose().lazyProduct(lacking);
    pushed[i] = hinged.W.lazyProduct(wheel.jacobian);
    SteppedWheel::Jacobian Z = onChassis<4>(wheel.chassis, hinged.in_chassis, hinged.B.lazyProduct(wheel.jacobian));
    Z.col(0).tail<3>() -= wheel.chassis.row(1);
    RowMajor<4, 4> A = wheel.jacobian.transpose().lazyProduct(pushed[i]);
    A.diagonal() += wheel.softness;
    const int first = place(i, 0), tangents = place(i, 2);
    A_.block<2, 2>(first, first) = A.topLeftCorner<2, 2>();
    A_.block<2, 2>(first, tangents) = A.topRightCorner<2, 2>();
    A_.block<2, 2>(tangents, tangents) = A.bottomRightCorner<2, 2>();
    A_.block<2, 6>(first, kChassis) = Z.leftCols<2>().transpose();
    A_.block<6, 2>(kChassis, tangents) = Z.rightCols<2>();
    const auto put = [&](const SteppedWheel::Row& of_wheel, Unknowns& all) {
      all.segment<2>(first) = of_wheel.head<2>();
      all.segment<2>(tangents) = of_wheel.tail<2>();
    };
    put(wheel.target - wheel.jacobian.transpose().lazyProduct(wheels_[i]), b_);
    put(wheel.low, low_);
    put(wheel.high, high_);
    if (chassis.told) continue;
    const Matrix6 NX = onChassis<6>(wheel.chassis, hinged.in_chassis, hinged.N).transpose();
    K -= onChassis<6>(wheel.chassis, hinged.in_chassis, NX);
    momentum += NX.transpose().lazyProduct(lacking);
  }
  A_.block<6, 6>(kChassis, kChassis) = K;
  b_.segment<6>(kChassis) = momentum;
  low_.segment<6>(kChassis) = chassis.told ? chassis.velocity : Twist::Constant(-kInfinity);
  high_.segment<6>(kChassis) = chassis.told ? chassis.velocity : Twist::Constant(kInfinity);
  if (!exchange()) return false;

  chassis_ = unknowns_.segment<6>(kChassis);
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    const HingedWheel& hinged = hinged_[i];
    const Twist hinge = velocityAt(hinged.in_chassis, chassis_);
    Twist moved;
    moved << wheels[i].chassis * hinge.head<3>(), wheels[i].chassis * hinge.tail<3>();
    const SteppedWheel::Row forces(force(i, 0), force(i, 1), force(i, 2), force(i, 3));
    wheels_[i] += hinged.B.transpose().lazyProduct(moved) + pushed[i].lazyProduct(forces);
  }
  return true;
}

/// Block principal pivoting: all unknowns that are on the wrong side of their bound change it at a time, as long as
/// that leaves fewer of them.
bool StepSolver::exchange() {
  for (int i = 0; i < kUnknowns; ++i) {
    State& state = state_[i];
    if (low_(i) == high_(i)) state = State::low;
    if (std::isinf(state == State::low ? low_(i) : high_(i))) state = State::free;
  }
  int fewest = kUnknowns;
  for (int patience = kPatience; patience > 0; --patience) {
    solveFree();
    int wrong = 0;
    for (int i = 0; i < kUnknowns; ++i) {
      const State better = wanted(i);
      if (better != state_[i]) ++wrong;
      state_[i] = better;
    }
    if (wrong == 0) return unknowns_.allFinite();
    if (wrong < fewest) patience = kPatience;
    fewest = std::min(fewest, wrong);
  }
  return descend();
}

/// Active set method, which goes round in no circle: from forces within their bounds towards the best with those at a
/// bound kept there, as far as the next bound; at the best, the one that pulls most at its bound is let go.
bool StepSolver::descend() {
  Unknowns within = unknowns_.cwiseMax(low_).cwiseMin(high_);
  for (int i = 0; i < kUnknowns; ++i) {
    if (low_(i) == high_(i)) continue;
    state_[i] = within(i) == low_(i) ? State::low : within(i) == high_(i) ? State::high : State::free;
  }
  for (int change = 0; change < kMostChanges; ++change) {
    solveFree();
    int next = -1;
    double share = 1.0;  // of the way
    for (int i = 0; i < kUnknowns; ++i) {
      if (state_[i] != State::free || wanted(i) == State::free) continue;
      const double bound = wanted(i) == State::low ? low_(i) : high_(i);
      const double to_bound = (bound - within(i)) / (unknowns_(i) - within(i));
      if (to_bound >= share) continue;
      share = to_bound;
      next = i;
    }
    within += share * (unknowns_ - within);
    if (next >= 0) {
      state_[next] = wanted(next);
      continue;
    }
    for (int i = 0; i < kUnknowns; ++i) {
      if (wanted(i) != state_[i] && (next < 0 || std::abs(excess(i)) > std::abs(excess(next)))) next = i;
    }
    if (next < 0) return unknowns_.allFinite();
    state_[next] = State::free;
  }
  return false;
}

/// Correct state of an unknown for the solution with the present ones.
StepSolver::State StepSolver::wanted(int i) const {
  if (low_(i) == high_(i)) return state_[i];
  if (state_[i] == State::free) {
    if (unknowns_(i) < low_(i) - kForceTolerance * std::abs(low_(i))) return State::low;
    if (unknowns_(i) > high_(i) + kForceTolerance * std::abs(high_(i))) return State::high;
    return State::free;
  }
  return (state_[i] == State::low ? -excess(i) : excess(i)) > kSpeedTolerance ? State::free : state_[i];
}

/// A x - b of a row.
double StepSolver::excess(int i) const {
  return A_.col(i).head(i).dot(unknowns_.head(i)) + A_.row(i).tail(kUnknowns - i).dot(unknowns_.tail(kUnknowns - i)) -
         b_(i);
}

/// Unknowns that are free, those of the others given by their bounds.
void StepSolver::solveFree() {
  Unknowns given = Unknowns::Zero();
  Mask free;
  unknowns_ = b_;
  for (int i = 0; i < kUnknowns; ++i) {
    free(i) = state_[i] == State::free;
    if (free(i)) continue;
    given(i) = state_[i] == State::low ? low_(i) : high_(i);
    if (given(i) == 0.0) continue;
    unknowns_.head(i) -= given(i) * A_.col(i).head(i);
    unknowns_.tail(kUnknowns - i) -= given(i) * A_.row(i).tail(kUnknowns - i).transpose();
  }
  Square U;
  solveRows<0>(A_, free, U, unknowns_);
  unknowns_ += given;
}

/// b ← x of A x = b in the free unknowns, with zeros for the others. A is symmetric and quasi-definite, so that no
/// pivots are needed; its upper triangle is read. U becomes its factor, A = U' D⁻¹ U, with D⁻¹ on the diagonal. Rows of
/// fixed length, four of the same, stay in registers and take a fraction of the time of a general factorisation.
template <int First>
void StepSolver::solveRows(const Square& A, const Mask& free, Square& U, Unknowns& b) {
  constexpr int kWidth = kUnknowns - First, kRows = std::min(4, kWidth), kRest = kWidth - kRows;
  for (int i = First; i < First + kRows; ++i) {
    if (!free(i)) {
      U.row(i).template tail<kWidth>().setZero();
      b(i) = 0.0;
      continue;
    }
    RowMajor<1, kWidth> row = A.row(i).template tail<kWidth>();
    double rest = b(i);
    const auto eliminate = [&](int begin, int end) {
      for (int k = begin; k < end; ++k) {
        const double share = U(k, i) * U(k, k);
        row -= share * U.row(k).template tail<kWidth>();
        rest -= share * b(k);
      }
    };
    // Before the chassis there is nothing between wheels.
    const int own = i % kTangents / 2 * 2;
    if (i < kChassis) eliminate(own, i);
    if (i >= kChassis && i < kTangents) eliminate(0, kChassis);
    if (i >= kTangents) eliminate(own, own + 2);
    eliminate(kChassis, i);
    U.row(i).template tail<kWidth>() = row;
    U(i, i) = 1.0 / row(i - First);
    b(i) = rest;
  }
  if constexpr (kRest > 0) solveRows<First + kRows>(A, free, U, b);
  for (int i = First + kRows - 1; i >= First; --i) {
    double rest = b(i);
    if constexpr (kRest > 0) rest -= U.row(i).template tail<kRest>().dot(b.template tail<kRest>());
    for (int j = i + 1; j < First + kRows; ++j) rest -= U(i, j) * b(j);
    b(i) = rest * U(i, i);
  }
}

}  // namespace jackal_aic::sim
