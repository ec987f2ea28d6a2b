#pragma once

/// @file
/// Accelerations of an IMU with a clock of its own, handed on with the samples of another sensor.
///
/// Between two samples of the other sensor, which are h apart, come any number of IMU samples a_i, each for the time
/// since the one before, D together: none or four where both travel over a network. Whoever integrates what is handed
/// on over h is to get the change of velocity that the IMU saw, or a collision counts for a half or twice of what it
/// was:
///
///     a h = mean(a_i) D + b (h - D)
///
/// The mean weighs them alike: an IMU has an even clock, and stamps that jitter. b is the usual acceleration, of the
/// last T, which holds for the time that h has more or less than the IMU samples. What is too much of it in one sample
/// lacks in the next, because over a while the h add up to what the D do.
///
/// IMU samples that come at once, after a stall, wait for the sample of the other sensor that has their stamps.

#include <Eigen/Core>
#include <array>
#include <cstddef>

namespace jackal_aic {

/// Pairs accelerations with samples of another sensor. Nothing here allocates.
class AccelerationPairing {
 public:
  /// Takes an IMU sample. @param acceleration [m/s^2]; @param stamp of it [s].
  void add(const Eigen::Vector3d& acceleration, double stamp);

  /// The acceleration for a sample of the other sensor [m/s^2], of which the velocity changed since the one before. To
  /// be called after the first add(). @param stamp of the sample [s].
  Eigen::Vector3d take(double stamp);

  /// Begins anew.
  void reset() { *this = AccelerationPairing(); }

 private:
  static constexpr std::size_t kMostWaiting = 64;

  struct Sample {
    Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  // [m/s^2]
    double stamp = 0.0;                                      // [s]
  };

  void count(const Sample& sample);

  std::array<Sample, kMostWaiting> waiting_{};        // a ring
  std::size_t first_ = 0;                             // waiting, of all samples so far
  std::size_t end_ = 0;                               // samples so far
  Eigen::Vector3d usual_ = Eigen::Vector3d::Zero();   // b [m/s^2]
  Eigen::Vector3d newest_ = Eigen::Vector3d::Zero();  // a_i [m/s^2]
  Eigen::Array3i repeats_ = Eigen::Array3i::Zero();   // of a_i to the bit
  Eigen::Vector3d mean_ = Eigen::Vector3d::Zero();    // of those since the last take() [m/s^2]
  int count_ = 0;                                     // of them
  double stamp_ = 0.0;                                // of the newest [s]
  double last_stamp_ = 0.0;                           // of the newest at the last take() [s]
  double taken_ = 0.0;                                // stamp of the last take() [s]
  bool started_ = false;
  bool taken_once_ = false;
};

}  // namespace jackal_aic
