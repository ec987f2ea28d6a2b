#pragma once

/// @file
/// Resamples the accelerations of an IMU with its own clock to the samples of another sensor.
///
/// Between two samples of the other sensor, h apart, any number of IMU samples a_i arrive; over a network none or four.
/// Each covers the time since the last one, D in total. The integral of the resampled acceleration over h has to be the
/// change of velocity that the IMU measured, or a collision counts half or twice:
///
///     a h = mean(a_i) D + b (h - D)
///
/// The mean has equal weights, because an IMU has an even clock and stamps that jitter. b is the usual acceleration of
/// the last T; it fills the difference between h and D. Its errors cancel between successive samples, because the sums
/// of h and D agree over time.
///
/// IMU samples that arrive at once after a stall wait for the sample of the other sensor with their stamps.

#include <Eigen/Core>
#include <array>
#include <cstddef>

namespace jackal_aic {

/// Pairs accelerations with samples of another sensor. Nothing here allocates.
class AccelerationPairing {
 public:
  /// Takes an IMU sample. @param acceleration [m/s^2]; @param stamp of it [s].
  void add(const Eigen::Vector3d& acceleration, double stamp);

  /// Mean acceleration since the last sample of the other sensor [m/s^2]. To be called after the first add(). @param
  /// stamp of the sample [s].
  Eigen::Vector3d take(double stamp);

  /// Forgets all samples.
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
  Eigen::Array3i repeats_ = Eigen::Array3i::Zero();   // number of equal a_i in a row
  Eigen::Vector3d mean_ = Eigen::Vector3d::Zero();    // of those since the last take() [m/s^2]
  int count_ = 0;                                     // of them
  double stamp_ = 0.0;                                // of the newest [s]
  double last_stamp_ = 0.0;                           // of the newest at the last take() [s]
  double taken_ = 0.0;                                // stamp of the last take() [s]
  bool started_ = false;
  bool taken_once_ = false;
};

}  // namespace jackal_aic
