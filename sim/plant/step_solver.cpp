#include "step_solver.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic::sim {
namespace {

template <int RowCount, int ColumnCount>
using RowMajor = Eigen::Matrix<double, RowCount, ColumnCount, Eigen::RowMajor>;
using Matrix6 = RowMajor<6, 6>;
using HingeRows = RowMajor<5, 6>;
using FreeRows = RowMajor<4, 6>;
using Hinge = Eigen::Matrix<double, 5, 1>;

constexpr int kMostExchanges = 20;
constexpr double kForceTolerance = 1e-10;  // by which a force may miss its bound, relative
constexpr double kSpeedTolerance = 1e-13;  // by which a velocity may miss its inequality [m/s or rad/s]

/// A ← L of A = L L', with the inverse of its diagonal; what is above it is of no use. Whole rows of fixed length,
/// which do not wait for each other, take a fraction of the time of a general factorisation.
template <int Size>
void factorise(RowMajor<Size, Size>& A, int size = Size) {
  RowMajor<1, Size> column = RowMajor<1, Size>::Zero();
  for (int k = 0; k < size; ++k) {
    A(k, k) = 1.0 / std::sqrt(A(k, k));
    column(k) = 0.0;
    for (int i = k + 1; i < size; ++i) column(i) = A(i, k) *= A(k, k);
    for (int i = k + 1; i < size; ++i) A.row(i) -= A(i, k) * column;
  }
}

/// B ← L⁻¹ B
template <int Size, int Columns>
void forward(const RowMajor<Size, Size>& L, RowMajor<Size, Columns>& B) {
  for (int i = 0; i < Size; ++i) {
    for (int j = 0; j < i; ++j) B.row(i) -= L(i, j) * B.row(j);
    B.row(i) *= L(i, i);
  }
}

/// b ← L⁻¹ b
template <int Size, class Vector>
void forward(const RowMajor<Size, Size>& L, Vector& b, int size = Size) {
  for (int j = 0; j < size; ++j) {
    b(j) *= L(j, j);
    for (int i = j + 1; i < size; ++i) b(i) -= L(i, j) * b(j);
  }
}

/// b ← L'⁻¹ b
template <int Size, class Vector>
void backward(const RowMajor<Size, Size>& L, Vector& b, int size = Size) {
  for (int i = size - 1; i >= 0; --i) {
    b(i) *= L(i, i);
    for (int j = 0; j < i; ++j) b(j) -= L(i, j) * b(i);
  }
}

Eigen::Matrix3d cross(const Eigen::Vector3d& a) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return matrix;
}

/// Relative velocity of a hinge at a point of a body, and about two axes.
HingeRows hingeRows(const Eigen::Vector3d& hinge, const std::array<Eigen::Vector3d, 2>& across) {
  HingeRows rows = HingeRows::Zero();
  rows.topLeftCorner<3, 3>().setIdentity();
  rows.topRightCorner<3, 3>() = -cross(hinge);
  rows.bottomRightCorner<2, 3>() << across[0].transpose(), across[1].transpose();
  return rows;
}

Matrix6 massOf(const SteppedBody& body) {
  Matrix6 mass = Matrix6::Zero();
  mass.diagonal().head<3>().setConstant(body.mass);
  mass.bottomRightCorner<3, 3>() = body.inertia;
  return mass;
}

Matrix6 inverseMassOf(const SteppedBody& body) {
  Matrix6 inverse = Matrix6::Zero();
  inverse.diagonal().head<3>().setConstant(1.0 / body.mass);
  inverse.bottomRightCorner<3, 3>() = body.inverse_inertia;
  return inverse;
}

/// Rows J of a wheel's hinge and T of its own, of which only the roots by P = h J W J' + C of the hinge are needed.
struct HingedWheel {
  HingedWheel(const SteppedWheel& wheel, double softness, double h)
      : J(hingeRows(wheel.hinge_in_wheel, wheel.across)), W(inverseMassOf(wheel.body)) {
    for (std::size_t k = 0; k < 4; ++k) T.row(static_cast<Eigen::Index>(k)) = wheel.rows[k].of_wheel.transpose();
    const HingeRows JW = J.lazyProduct(W);
    P = h * JW.lazyProduct(J.transpose());
    P.diagonal().array() += softness;
    factorise(P);
    G = -hingeRows(wheel.hinge_in_chassis, wheel.across);
    forward(P, G);
    JWT = JW.lazyProduct(T.transpose());
    forward(P, JWT);
    lacking = wheel.target - J.lazyProduct(wheel.body.velocity);
    forward(P, lacking);
  }

  /// v+ [m/s, rad/s]. @param force of the rows T; @param chassis its v+.
  Twist after(const Twist& velocity, const Eigen::Vector4d& force, const Twist& chassis, double h) const {
    Hinge of_hinge = lacking - h * JWT.lazyProduct(force) - G.lazyProduct(chassis);
    backward(P, of_hinge);
    const Twist push = T.transpose().lazyProduct(force) + J.transpose().lazyProduct(of_hinge);
    return velocity + h * W.lazyProduct(push);
  }

  HingeRows J;
  Matrix6 W;
  FreeRows T;
  RowMajor<5, 5> P;    // its factor
  HingeRows G;         // P⁻¹ᐟ² G, the hinge's rows of the chassis
  RowMajor<5, 4> JWT;  // P⁻¹ᐟ² J W T'
  Hinge lacking;       // P⁻¹ᐟ² (c - J v)
};

}  // namespace

bool StepSolver::solve(const SteppedBody& chassis, const std::array<SteppedWheel, 4>& wheels, double step) {
  const double h = step;
  const bool told = chassis.mass == 0.0;
  std::array<HingedWheel, 4> hinged{
      HingedWheel(wheels[0], hinge_softness_, h), HingedWheel(wheels[1], hinge_softness_, h),
      HingedWheel(wheels[2], hinge_softness_, h), HingedWheel(wheels[3], hinge_softness_, h)};
  // K = M + h G' P⁻¹ G: the robot's mass without the wheels' turning
  Matrix6 K = massOf(chassis);
  Twist velocity = chassis.velocity;
  if (!told) {
    velocity = K.lazyProduct(chassis.velocity);
    for (const HingedWheel& wheel : hinged) {
      K += h * wheel.G.transpose().lazyProduct(wheel.G);
      velocity += h * wheel.G.transpose().lazyProduct(wheel.lacking);
    }
    factorise(K);
    forward(K, velocity);
    backward(K, velocity);
  }

  RowMajor<6, kRows> of_chassis;  // K⁻¹ᐟ² T'
  Square A = Square::Zero();
  Rows b, low, high;
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    const auto first = static_cast<Eigen::Index>(4 * i);
    const HingedWheel& wheel = hinged[i];
    FreeRows on_chassis;
    for (std::size_t k = 0; k < 4; ++k) {
      const StepRow& row = wheels[i].rows[k];
      const auto index = static_cast<Eigen::Index>(k);
      on_chassis.row(index) = row.of_chassis.transpose();
      b(first + index) = row.target;
      low(first + index) = row.low;
      high(first + index) = row.high;
      A(first + index, first + index) = row.softness;
    }
    on_chassis -= h * wheel.JWT.transpose().lazyProduct(wheel.G);
    of_chassis.middleCols<4>(first) = on_chassis.transpose();
    const FreeRows TW = wheel.T.lazyProduct(wheel.W);
    A.block<4, 4>(first, first) +=
        h * (TW.lazyProduct(wheel.T.transpose()) - h * wheel.JWT.transpose().lazyProduct(wheel.JWT));
    b.segment<4>(first) -= wheel.T.lazyProduct(wheels[i].body.velocity) +
                           h * wheel.JWT.transpose().lazyProduct(wheel.lacking) + on_chassis.lazyProduct(velocity);
  }
  if (!told) {
    forward(K, of_chassis);
    for (int i = 0; i < kRows; ++i) {
      for (int k = 0; k < 6; ++k) A.row(i) += (h * of_chassis(k, i)) * of_chassis.row(k);
    }
  }
  if (!exchange(A, b, low, high)) return false;

  chassis_ = velocity;
  if (!told) {
    Twist push = h * of_chassis.lazyProduct(force_);
    backward(K, push);
    chassis_ += push;
  }
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    const auto first = static_cast<Eigen::Index>(4 * i);
    wheels_[i] = hinged[i].after(wheels[i].body.velocity, force_.segment<4>(first), chassis_, h);
  }
  return true;
}

/// Block principal pivoting: all rows that are on the wrong side of their bound change it at a time.
bool StepSolver::exchange(const Square& A, const Rows& b, const Rows& low, const Rows& high) {
  for (int i = 0; i < kRows; ++i) {
    if (low(i) == high(i)) state_[static_cast<std::size_t>(i)] = State::low;
  }
  for (int round = 0; round < kMostExchanges; ++round) {
    for (int i = 0; i < kRows; ++i) {
      const State state = state_[static_cast<std::size_t>(i)];
      if (state != State::free) force_(i) = state == State::low ? low(i) : high(i);
    }
    solveFree(A, b);
    const Rows excess = A.lazyProduct(force_) - b;
    bool right = true;
    for (int i = 0; i < kRows; ++i) {
      State& state = state_[static_cast<std::size_t>(i)];
      if (low(i) == high(i)) continue;
      State wanted = state;
      if (state == State::free && force_(i) < low(i) - kForceTolerance * std::abs(low(i))) wanted = State::low;
      if (state == State::free && force_(i) > high(i) + kForceTolerance * std::abs(high(i))) wanted = State::high;
      if (state == State::low && excess(i) < -kSpeedTolerance) wanted = State::free;
      if (state == State::high && excess(i) > kSpeedTolerance) wanted = State::free;
      right = right && wanted == state;
      state = wanted;
    }
    if (right) return force_.allFinite();
  }
  return false;
}

/// Forces of the rows that are at no bound, those of the others given.
void StepSolver::solveFree(const Square& A, const Rows& b) {
  std::array<int, kRows> free{};
  int count = 0;
  Rows given = force_;
  for (int i = 0; i < kRows; ++i) {
    if (state_[static_cast<std::size_t>(i)] != State::free) continue;
    free[static_cast<std::size_t>(count++)] = i;
    given(i) = 0.0;
  }
  const Rows others = given.isZero(0.0) ? b : Rows(b - A.lazyProduct(given));
  Square of_free = Square::Zero();
  Rows rest;
  for (int row = 0; row < count; ++row) {
    const int i = free[static_cast<std::size_t>(row)];
    rest(row) = others(i);
    for (int column = 0; column <= row; ++column) of_free(row, column) = A(i, free[static_cast<std::size_t>(column)]);
  }
  factorise(of_free, count);
  forward(of_free, rest, count);
  backward(of_free, rest, count);
  for (int row = 0; row < count; ++row) force_(free[static_cast<std::size_t>(row)]) = rest(row);
}

}  // namespace jackal_aic::sim
