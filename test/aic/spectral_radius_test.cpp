#include "jackal_aic/aic/spectral_radius.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <random>

namespace jackal_aic {
namespace {

/// 0.9 and, further inside, 0.5 and 0.2 with couplings that make it far from normal, seen in units that differ by
/// `ratio`.
Eigen::MatrixXd inOtherUnits(double ratio) {
  Eigen::Matrix3d map;
  map << 0.9, 3.0, -2.0,  //
      0.0, 0.5, 4.0,      //
      0.0, 0.0, 0.2;
  const Eigen::Matrix3d mixed = (Eigen::Matrix3d() << 1.0, 0.5, 0.25, -0.5, 1.0, 0.5, 0.25, -0.25, 1.0).finished();
  const Eigen::Vector3d units(1.0, ratio, ratio * ratio);
  return units.asDiagonal() * (mixed * map * mixed.inverse()) * units.cwiseInverse().asDiagonal();
}

TEST(SpectralRadius, DoesNotDependOnTheUnitsOfTheStates) {
  for (const double ratio : {1.0, 1e3, 1e-5, 1e8, 1e30}) {
    EXPECT_NEAR(spectralRadius(inOtherUnits(ratio)), 0.9, 1e-10) << ratio;
  }
}

TEST(SpectralRadius, IsTheLargestEigenvalue) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 3000; ++i) {
    const int size = 1 + i % 30;
    Eigen::MatrixXd map = Eigen::MatrixXd::NullaryExpr(size, size, [&] { return normal(random); });
    if (i % 2 == 0) map.bottomRows(size / 2).setZero();
    if (i % 2 == 0 && size > 3) map.diagonal(-1).tail(size / 2).setOnes();  // a chain of delays
    const double largest = map.eigenvalues().cwiseAbs().maxCoeff();
    ASSERT_NEAR(spectralRadius(map), largest, 1e-9 * largest) << size;
  }
}

TEST(SpectralRadius, OfRepeatedEigenvaluesIsNotSplitByRounding) {
  Eigen::Matrix3d map;
  map << 1.0, 1.0, 0.0,  //
      0.0, 1.0, 1.0,     //
      0.0, 0.0, 1.0;
  EXPECT_NEAR(spectralRadius(map), 1.0, 1e-12);
  EXPECT_GE(spectralRadius(map), 1.0);
}

TEST(SpectralRadius, OfZeroIsZeroAndOfNonFiniteMapsInfinite) {
  EXPECT_EQ(spectralRadius(Eigen::MatrixXd::Zero(4, 4)), 0.0);
  Eigen::MatrixXd map = Eigen::MatrixXd::Identity(3, 3);
  EXPECT_NEAR(spectralRadius(1e300 * map), 1e300, 1e288);
  map(0, 1) = std::nan("");
  EXPECT_EQ(spectralRadius(map), HUGE_VAL);
  map(0, 1) = HUGE_VAL;
  EXPECT_EQ(spectralRadius(map), HUGE_VAL);
}

}  // namespace
}  // namespace jackal_aic
