#include "terrain.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace jackal_aic::sim {
namespace {

TEST(Terrain, HeightHasTheStatedDeviationAndStartsLevel) {
  PlantParameters parameters;
  parameters.roughness = 0.02;
  const Terrain terrain(parameters);
  double squares = 0.0;
  constexpr int kSide = 150;
  for (int i = 0; i < kSide; ++i) {
    for (int k = 0; k < kSide; ++k) squares += std::pow(terrain.surface(5.0 + 0.31 * i, 5.0 + 0.29 * k).height, 2);
  }
  EXPECT_NEAR(std::sqrt(squares) / kSide, 0.02, 0.003);
  EXPECT_LT(std::abs(terrain.surface(0.2, 0.2).height), 0.004);
  parameters.seed = 2;
  EXPECT_NE(Terrain(parameters).surface(5.0, 5.0).height, terrain.surface(5.0, 5.0).height);
}

TEST(Terrain, NormalIsThatOfTheHeight) {
  PlantParameters parameters;
  parameters.roughness = 0.02;
  parameters.ramp = 5.7;
  parameters.ramp_start = 1.0;
  parameters.ramp_length = 2.0;
  const Terrain terrain(parameters);
  const double h = 1e-6;
  for (const double x : {0.1, 0.7, 1.2, 2.0, 3.2, 9.0}) {
    for (const double y : {-0.8, 0.3, 4.0}) {
      const double slope_x = (terrain.surface(x + h, y).height - terrain.surface(x - h, y).height) / (2.0 * h);
      const double slope_y = (terrain.surface(x, y + h).height - terrain.surface(x, y - h).height) / (2.0 * h);
      EXPECT_TRUE(terrain.surface(x, y).normal.isApprox(Eigen::Vector3d(-slope_x, -slope_y, 1.0).normalized(), 1e-7))
          << x << " " << y;
    }
  }
}

TEST(Terrain, AKerbIsTouchedAtItsFaceOrItsEdge) {
  PlantParameters parameters;
  parameters.kerb_distance = 1.0;
  parameters.kerb_height = 0.5;
  const auto face = Terrain(parameters).kerb({0.91, 0.2, 0.098}, 0.098);
  ASSERT_TRUE(face);
  EXPECT_NEAR(face->depth, 0.008, 1e-12);
  EXPECT_TRUE(face->normal.isApprox(Eigen::Vector3d(-1.0, 0.0, 0.0)));
  parameters.kerb_height = 0.038;
  const auto edge = Terrain(parameters).kerb({0.92, 0.2, 0.098}, 0.098);
  ASSERT_TRUE(edge);
  EXPECT_NEAR(edge->depth, -0.002, 1e-12) << "not yet";
  EXPECT_TRUE(edge->normal.isApprox(Eigen::Vector3d(-0.8, 0.0, 0.6)));
}

}  // namespace
}  // namespace jackal_aic::sim
