#pragma once

/// @file
/// The least that a tick of the exact belief update has to do, written by hand: what the belief tick is measured by.
///
///     x <- Phi_x x + u_x    of the forward speed,    w <- Phi_w w + u_w    of the yaw rate
///
/// with (p+1) x (p+1) blocks of Phi and what measurement and set point add (Gamma b) as constants, in plain arrays of
/// a size that the compiler knows. The lateral speed, which nothing measures, is left out.

#include <cstddef>

#include "jackal_aic/aic/belief_update.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic::benchmark {

/// Two numbers on which one instruction of every x86-64 and ARMv8 works: the compiler would not find them by itself.
using Pair = double __attribute__((vector_size(16)));

/// One motion's orders 0..n-1 under x <- Phi x + u; n is even.
template <std::size_t n>
struct BoundBlock {
  static_assert(n % 2 == 0, "an odd number of orders does not fill its pairs");

  Pair columns[n][n / 2]{};  ///< of Phi
  Pair input[n / 2]{};       ///< u
  Pair x[n / 2]{};           ///< present state

  double order(std::size_t i) const { return x[i / 2][i % 2]; }  ///< element i of x

  /// Takes a motion's block of an update and of a belief. @param added Gamma b, as a generalised body velocity.
  void fill(const BeliefUpdate<GenerativeModel>& update, const GeneralizedBody& added, const GeneralizedBody& belief,
            BodyChannel motion) {
    for (std::size_t j = 0; j < n; ++j) {
      input[j / 2][j % 2] = added(motion, j);
      x[j / 2][j % 2] = belief(motion, j);
      for (std::size_t i = 0; i < n; ++i) {
        columns[j][i / 2][i % 2] = update.transition()(kBodySize * i + motion, kBodySize * j + motion);
      }
    }
  }

  /// x <- Phi x + u.
  void step() {
    Pair next[n / 2];
    for (std::size_t i = 0; i < n / 2; ++i) next[i] = input[i];
    for (std::size_t j = 0; j < n; ++j) {
      const Pair x_j{x[j / 2][j % 2], x[j / 2][j % 2]};
      for (std::size_t i = 0; i < n / 2; ++i) next[i] += columns[j][i] * x_j;
    }
    for (std::size_t i = 0; i < n / 2; ++i) x[i] = next[i];
  }
};

/// Both blocks of a belief with n orders.
template <std::size_t n>
struct LowerBound {
  BoundBlock<n> forward;   ///< x_dot and its derivatives
  BoundBlock<n> yaw_rate;  ///< theta_dot and its derivatives

  /// Does what an update does to a belief with measurement and set point held.
  void fill(const BeliefUpdate<GenerativeModel>& update, const GeneralizedSensor& measurement,
            const GeneralizedBody& set_point, const GeneralizedBody& belief) {
    GeneralizedBody added = GeneralizedBody::Zero(kBodySize, n);
    update.step(added, measurement, set_point);  // Γ b is what becomes of a belief of zero
    forward.fill(update, added, belief, kForward);
    yaw_rate.fill(update, added, belief, kYaw);
  }

  /// One tick; no part of its caller, as ours is none.
  __attribute__((noinline)) void step() {
    forward.step();
    yaw_rate.step();
  }
};

}  // namespace jackal_aic::benchmark
