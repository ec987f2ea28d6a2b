#pragma once

/// @file
/// Precision of noise in generalised coordinates.
///
/// Noise that is smooth has derivatives, and these are not independent of each other. With the Gaussian autocorrelation
/// rho(t) = exp(-t^2 / (4 s^2)), s its smoothness, the derivatives of unit noise have the covariance
///
///     V_ij = (-1)^i rho^(i+j)(0),    rho^(2k)(0) = (-1)^k (2k - 1)!! / (2 s^2)^k,    odd derivatives 0
///
/// (Friston et al. 2008, "DEM: a variational treatment of dynamic systems"; Meera & Wisse 2022; spm_DEM_R), and a
/// channel of variance Sigma the precision V^-1 / Sigma over its orders. V_ij is of the size s^-(i+j): V is inverted in
/// the coordinates s^i x^(i), in which it does not depend on s.

#include <Eigen/Core>

#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Square matrix over the orders 0..p, on the stack.
using OrderMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxOrders + 1, kMaxOrders + 1>;

/// V^-1, (p+1) x (p+1): precision of unit noise and its derivatives [s^(i+j)]; the identity for smoothness 0, which
/// stands for orders that are independent. @param orders highest order p, 0..5; @param smoothness s [s].
OrderMatrix noisePrecision(int orders, double smoothness);

}  // namespace jackal_aic
