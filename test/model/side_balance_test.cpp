#include "jackal_aic/model/side_balance.hpp"

#include <gtest/gtest.h>

namespace jackal_aic {
namespace {

const WheelVector kModel(5.0, 5.0);  // commands on a straight line, of a robot like its model [rad/s]

/// Measures for a second. @param left, right wheel speeds; @param yaw_rate of the body [rad/s].
SideBalance measured(double left, double right, double yaw_rate, ChannelValidity channels = {}, bool on_box = false) {
  SideBalance sides(GeometryParameters{}, !on_box);
  for (int k = 0; k < 50; ++k) sides.observe({0.02 * k, yaw_rate, left, right}, channels);
  return sides;
}

TEST(SideBalance, GyroContradictsWheels) {
  ChannelValidity no_gyro, no_wheel;
  no_gyro.yaw_rate = no_wheel.wheel_left = false;
  const struct {
    const char* name;
    SideBalance sides;
    bool contradicted;
  } cases[] = {
      {"standing", measured(0.0, 0.0, 0.0), false},
      {"straight with the veer of its tyres", measured(5.0, 5.1, 0.03), false},
      {"left encoder reads too little", measured(3.5, 5.0, 0.0), true},
      {"left encoder reads nothing", measured(0.0, 5.0, 0.0), true},
      {"body turns, wheels do not", measured(5.0, 5.0, -0.2), true},
      {"turn", measured(-5.0, 5.0, 1.7), false},
      {"turn on slippery ground", measured(-5.0, 5.0, 1.0), false},
      {"turn, reversed gyro", measured(-5.0, 5.0, -1.7), true},
      {"a gyro that does not count", measured(5.0, 5.0, 1.0, no_gyro), false},
      {"a wheel that does not count", measured(5.0, 5.0, 1.0, no_wheel), false},
      {"on a box", measured(-5.0, 5.0, 0.0, {}, true), false},
  };
  for (const auto& c : cases) EXPECT_EQ(c.sides.contradicted(), c.contradicted) << c.name;
  SideBalance sides = measured(0.0, 5.0, 0.0);
  sides.reset();
  EXPECT_FALSE(sides.contradicted()) << "the measurements are forgotten";
}

TEST(SideBalance, SidesStayTogether) {
  const SideBalance agreed = measured(5.0, 5.0, 0.0), contradicted = measured(3.5, 5.0, 0.0);
  const WheelVector apart = agreed.bound(kModel, {5.0, 8.0}, kModel);
  EXPECT_NEAR(apart.sum(), 13.0, 1e-9) << "what both need stays";
  EXPECT_GT(apart(1) / apart(0), 1.1) << "a weak motor";
  EXPECT_LT(apart(1) / apart(0), 1.25);
  EXPECT_TRUE(agreed.bound(kModel, {5.0, 5.3}, kModel).isApprox(WheelVector(5.0, 5.3))) << "within the bound";

  const WheelVector held = contradicted.bound(kModel, {8.0, 5.0}, kModel);
  EXPECT_TRUE(held.isApprox(WheelVector(6.5, 6.5))) << held.transpose();
  const WheelVector kept = contradicted.bound({5.5, 5.0}, {8.0, 5.0}, kModel);
  EXPECT_NEAR(kept(0) / kept(1), 1.1, 1e-9) << "as before the contradiction";
  EXPECT_TRUE(contradicted.bound({5.5, 5.0}, {5.2, 5.0}, kModel).isApprox(WheelVector(5.2, 5.0))) << "decreases";

  const WheelVector earlier_arc(3.0, 7.0), commands(4.8, 5.2);
  EXPECT_TRUE(agreed.bound(kModel, commands, earlier_arc).isApprox(commands)) << "its excess persists";
}

TEST(SideBalance, NoBoundForASideThatStands) {
  const SideBalance contradicted = measured(3.5, 5.0, 0.0);
  for (const WheelVector& goal : {WheelVector(0.0, 5.0), WheelVector(5.0, 0.3)})
    EXPECT_EQ(contradicted.bound(goal, {8.0, 5.0}, goal), WheelVector(8.0, 5.0));
  EXPECT_EQ(contradicted.bound(kModel, {-8.0, 5.0}, kModel), WheelVector(-8.0, 5.0)) << "against the goal: a brake";
}

}  // namespace
}  // namespace jackal_aic
