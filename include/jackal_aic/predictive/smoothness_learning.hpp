#pragma once

/// @file
/// Smoothness and precision of a channel's noise, learned together by the gradient of the free energy.
///
/// Noise that has a memory, as vibration has, is not told from motion by its variance alone. After the DEM observer
/// with an estimated smoothness (Anil Meera and Wisse, "Free energy principle for the noise smoothness estimation of
/// linear systems with colored noise", 2022) a channel is taken to have smooth noise of variance Sigma and Gaussian
/// autocorrelation beside the white noise N of its sensor. What generalised coordinates hold of it up to order p are,
/// sampled at a step h, differences of the last p+1 samples n = (n_k, .., n_(k-p)), of which the covariance is
///
///     R_ij = Sigma exp(-((i - j) h)^2 / (4 s^2)) + N delta_ij.
///
/// Differences are a linear map T of the samples, so T R T' / Sigma takes the place of V(s) (coloured_noise.hpp), which
/// it becomes for a step much shorter than s and N = 0; in between, where derivatives do not exist and V(s) would find
/// white noise to have s = h/2, it stays right. The free energy of what is believed of the noise, q(n) with mean n^ and
/// covariance P, depends on theta = (ln Sigma, ln s) by
///
///     F = 1/2 tr(R^-1 E[n n']) + 1/2 ln|R|,    E[n n'] = n^ n^' + P,
///     dF/dtheta_a = 1/2 tr(R^-1 dR_a) - 1/2 tr(R^-1 E[n n'] R^-1 dR_a),
///
/// and every measurement moves theta down the natural gradient, with forgetting over a time T:
///
///     theta <- theta - (h/T) I^-1 dF/dtheta,    I_ab = 1/2 tr(R^-1 dR_a R^-1 dR_b).

#include <Eigen/Core>

namespace jackal_aic {

/// Noise of one channel.
struct SmoothNoise {
  static constexpr int kOrders = 3;  ///< p, highest generalised order; p+1 samples are looked at

  /// Over the last p+1 samples, newest first.
  using Window = Eigen::Matrix<double, kOrders + 1, 1>;
  using WindowMatrix = Eigen::Matrix<double, kOrders + 1, kOrders + 1>;  ///< likewise

  double white_variance = 1e-3;  ///< N, of the part without memory, above 0 [unit^2]
  double variance = 0.0;         ///< Sigma, of the smooth part [unit^2]
  double smoothness = 0.0;       ///< s of the smooth part [s]; 0: it is white, too

  /// R of samples this far apart [s].
  WindowMatrix covariance(double step) const;
};

/// Learns variance and smoothness of a channel's smooth noise. Does not allocate.
class SmoothnessLearning {
 public:
  static constexpr double kLeast = 0.25;  ///< least smoothness in steps, which is as good as white
  static constexpr double kMost = 0.5;    ///< largest smoothness [s]

  /// @param start what is believed first, of which the white part stays; a variance of 0 counts as a hundredth of it.
  /// @param memory T, over which is averaged [s].
  SmoothnessLearning(const SmoothNoise& start, double memory);

  /// One step of the gradient. @param moments E[n n'] of the last samples [unit^2]; @param step between them [s].
  void learn(const SmoothNoise::WindowMatrix& moments, double step);

  const SmoothNoise& noise() const { return noise_; }  ///< as it is believed

 private:
  SmoothNoise noise_;
  double memory_;
};

}  // namespace jackal_aic
