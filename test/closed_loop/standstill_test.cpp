// At a set point of zero the command becomes exactly zero, and the next start is as fast as without it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "drives.hpp"
#include "linear_plant.hpp"
#include "loop_setup.hpp"
#include "predictive_loop.hpp"
#include "step_response.hpp"
#include "stepped_loop.hpp"

namespace jackal_aic::sim {
namespace {

TEST(Standstill, CommandIsAndStaysExactlyZeroAfterAStop) {
  for (const auto& [step, noise] :
       {std::pair(0.0, 0.03), std::pair(0.0, 0.0), std::pair(0.06, 0.03), std::pair(0.06, 0.003)}) {
    for (const SetPoint set_point : {SetPoint{0.5, 0.0, 0.0}, SetPoint{0.0, 0.0, 1.0}, SetPoint{1.5, 0.0, 0.5}}) {
      PlantParameters robot = PredictiveLoop::ground();
      robot.encoder_step = step;
      robot.encoder_noise = noise;
      PredictiveLoop loop({}, PredictiveLoop::preset(), robot);
      loop.drive(set_point, 3.0);
      // Between two steps of an encoder without noise a wheel creeps unseen; the rest of that fades.
      loop.drive({}, step > 10.0 * noise ? 7.0 : 3.0);
      for (int i = 0; i < 30; ++i) {
        loop.drive({}, 1.0);
        EXPECT_EQ(loop.controller.action(), WheelCommand{})
            << "step " << step << ", noise " << noise << ", " << i << " s";
      }
    }
  }
}

class StandstillOfAPreset : public ::testing::TestWithParam<const char*> {};

TEST_P(StandstillOfAPreset, CommandIsAndStaysExactlyZeroAfterAStop) {
  AssessedProfile profile;
  profile.changes = {{kRestTime, {0.5, 0.0, 0.5}}, {3.0, {}}, {20.0, {0.5, 0.0, 0.0}}};
  profile.duration = 22.0;
  profile.assessed.reset();
  // Motors with a dead zone that the controller does not know: that command is released slowly.
  const Overrides dead_zone{{"plant.wheel_offset", "0.5"}, {"plant.wheel_breakaway", "0.5"}};
  for (const auto& [plant, changes] : {std::pair("ground", Overrides{}), std::pair("box", Overrides{}),
                                       std::pair("ground", dead_zone), std::pair("real", Overrides{})}) {
    const auto samples = runSetup(loadSetup(files(), GetParam(), plant, changes), profile).samples;
    for (const Sample& s : samples) {
      if (s.time > 8.0 && s.time < 19.99) {
        ASSERT_EQ(s.command, WheelCommand{}) << plant << ", " << s.time << " s";
      }
      if (s.time > 20.05) {
        ASSERT_NE(s.command.left, 0.0) << plant << ": it starts at once";
      }
    }
    EXPECT_NEAR(samples.back().velocity, 0.5, 0.03);
  }
}

INSTANTIATE_TEST_SUITE_P(Presets, StandstillOfAPreset, ::testing::Values("standard", "improved", "tuned", "predictive"),
                         [](const auto& info) { return info.param; });

/// Wheels that turn without a command, by a disturbance of their velocity loop.
class PushedWheels : public LinearPlant {
 public:
  PushedWheels(const PlantModel& model, double push) : LinearPlant(model, {}), push_(push) { command({}); }

  void command(const WheelCommand& wanted) {
    wanted_ = wanted;
    LinearPlant::command({wanted.left + push_, wanted.right + push_});
  }
  const WheelCommand& wanted() const { return wanted_; }  ///< last command

 private:
  double push_;  // [rad/s]
  WheelCommand wanted_;
};

TEST(Standstill, DisturbanceOfTheWheelsIsCompensated) {
  const PlantModel model;
  for (const double push : {0.1, -0.3}) {
    SteppedLoop loop(PushedWheels(model, push), PredictiveController(PredictiveLoop::preset(), {}, model));
    double travel = 0.0, tried = 0.0;
    int reversals = 0;
    bool stood = false;
    for (int k = 0; k < 60000; ++k) {
      loop.step();
      if (k > 20000) travel += 0.001 * loop.plant.observation().wheel_left;
      if (k > 2000 && k <= 20000) tried += 0.001 * loop.plant.observation().wheel_left;
      const bool stands = loop.plant.wanted() == WheelCommand{};
      reversals += stands != stood;
      stood = stands;
    }
    EXPECT_NEAR(loop.plant.wanted().left, -push, 0.01);
    EXPECT_LT(std::abs(travel), 0.05) << "rad in 40 s";
    EXPECT_LT(std::abs(tried), 0.1) << "rad, by which it rolls as the command is released";
    EXPECT_LE(reversals, 4) << "it holds or it stands";
  }
}

TEST(Standstill, StartIsAsFastAsWithoutStandstill) {
  PredictiveLoop stood, restless;
  stood.drive({}, 5.0);
  ASSERT_EQ(stood.controller.action(), WheelCommand{});
  restless.drive({1e-4, 0.0, 0.0}, 5.0);
  ASSERT_FALSE(restless.controller.action() == WheelCommand{});
  for (const double time : {0.1, 0.2, 0.3, 0.4, 0.5}) {
    stood.drive({0.5, 0.0, 0.0}, 0.1);
    restless.drive({0.5, 0.0, 0.0}, 0.1);
    EXPECT_NEAR(stood.speed(), restless.speed(), 0.01) << time;
  }
}

}  // namespace
}  // namespace jackal_aic::sim
