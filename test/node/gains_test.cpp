// Changing gains while the robot drives.

#include <dynamic_reconfigure/ConfigDescription.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <rosgraph_msgs/Log.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <thread>

#include "service_call.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

using Gains = std::map<std::string, double>;

class GainsTest : public testing::Test {
 protected:
  GainsTest() {
    log_ = node_.subscribe<rosgraph_msgs::Log>("/rosout", 100, [this](const rosgraph_msgs::LogConstPtr& line) {
      if (line->name == "/controller") logged_ += line->msg + "\n";
    });
  }

  void SetUp() override {
    ASSERT_TRUE(robot_.waitUntilReady());
    // Nothing but a line of its log tells that this test hears the controller.
    for (int i = 1; logged_.empty(); ++i) {
      ASSERT_LT(i, 100) << "the controller's log cannot be heard";
      request({{"kappa_a", 8.0 + 0.001 * (i % 2)}});
      robot_.run(0.1);
    }
    request({{"kappa_a", 8.0}});
    robot_.run(0.5);
    logged_.clear();
  }

  /// Asks for gains; returns those that the controller answers with.
  Gains request(const Gains& wanted) {
    dynamic_reconfigure::Reconfigure call;
    for (const auto& [name, value] : wanted) {
      dynamic_reconfigure::DoubleParameter parameter;
      parameter.name = name;
      parameter.value = value;
      call.request.config.doubles.push_back(parameter);
    }
    EXPECT_TRUE(sim::callService("/controller/controller/set_parameters", call, ros::Duration(30.0)));
    Gains answer;
    for (const auto& parameter : call.response.config.doubles) answer[parameter.name] = parameter.value;
    return answer;
  }

  void expectLogged(const std::string& words) {
    robot_.waitFor([&] { return logged_.find(words) != std::string::npos; }, "'" + words + "' in the log", 20.0);
  }

  ros::NodeHandle node_;
  SimulatedRobot robot_;
  ros::Subscriber log_;
  std::string logged_;
};

TEST_F(GainsTest, StableOnesTakeOverWithoutAJump) {
  robot_.command(0.5, 0.0);
  robot_.run(3.0);
  robot_.clear();
  const Gains answer = request({{"kappa_a", 5.0}, {"tau", 0.003}});
  EXPECT_EQ(answer.at("kappa_a"), 5.0);
  EXPECT_EQ(answer.at("tau"), 0.003);
  EXPECT_EQ(answer.at("kappa_mu"), 0.1);
  robot_.run(1.0);
  EXPECT_LT(robot_.largestCommandStep(), 0.1) << "of 5.1 rad/s";
  EXPECT_NEAR(robot_.truth().forward.back(), 0.5, 0.02);
  expectLogged("Changed: tau = 0.003 kappa_a = 5");
  request({{"kappa_a", 8.0}, {"tau", 0.001}});
}

TEST_F(GainsTest, CertifyingDoesNotHoldTheLoop) {
  robot_.command(0.5, 0.0);
  robot_.run(2.0);
  std::atomic<int> actions{0};
  const auto states =
      node_.subscribe<ControllerState>("jackal_AIC/state", 1000, [&](const ControllerStateConstPtr&) { ++actions; });
  constexpr int kRequests = 40;
  std::atomic<bool> done{false};
  int meanwhile = 0;  // actions while requests were waiting for their answers
  std::thread requests([&] {
    for (int i = 0; i < kRequests; ++i) {
      const int before = actions;
      request({{"kappa_a", 60.0}});
      meanwhile += actions - before;
      ros::WallDuration(0.1).sleep();
    }
    done = true;
  });
  robot_.waitFor([&] { return done.load(); }, "answers");
  requests.join();
  ROS_INFO("%d actions while %d requests waited", meanwhile, kRequests);
  // A request that were certified in the thread of the actions would see one action at most: before it begins.
  EXPECT_GT(meanwhile, kRequests);
}

TEST_F(GainsTest, UnstableOnesAreRefusedWithTheReason) {
  robot_.command(0.5, 0.0);
  robot_.run(3.0);
  robot_.clear();
  EXPECT_EQ(request({{"kappa_a", 60.0}}).at("kappa_a"), 8.0);
  expectLogged("kappa_a = 60 is too large: stable below");
  EXPECT_EQ(request({{"kappa_a", 0.0}, {"tau", 0.002}}).at("kappa_a"), 8.0);
  expectLogged("kappa_a = 0 never corrects the action: raise it");
  double held = 0.0;
  ASSERT_TRUE(ros::param::get("/controller/controller/kappa_a", held));
  EXPECT_EQ(held, 8.0);
  robot_.run(2.0);
  EXPECT_NEAR(robot_.truth().forward.back(), 0.5, 0.02) << "the running gains stay";
  EXPECT_LT(robot_.largestCommandStep(), 0.1);
}

TEST_F(GainsTest, ThinMarginIsWarnedAbout) {
  EXPECT_EQ(request({{"kappa_a", 25.0}}).at("kappa_a"), 25.0);
  expectLogged("Stable, but with a thin margin (below 1.5 or 0.03 s)");
  request({{"kappa_a", 8.0}});
}

TEST_F(GainsTest, OutOfRangeIsRefusedAndNamed) {
  EXPECT_EQ(request({{"kappa_a", -1.0}}).at("kappa_a"), 8.0) << "not clamped to 0, which is in range";
  expectLogged("Refused kappa_a = -1 (stays 8): controller.kappa_a = -1");
  const Gains answer = request({{"kappa_a", 5.0}, {"tau", 11.0}});
  EXPECT_EQ(answer.at("kappa_a"), 8.0) << "of two that were asked for, either both change or none";
  EXPECT_EQ(answer.at("tau"), 0.001);
  expectLogged("Refused tau = 11 (stays 0.001), kappa_a = 5 (stays 8): controller.tau = 11");
}

TEST_F(GainsTest, ClientsAreShownTheRanges) {
  const auto shown = ros::topic::waitForMessage<dynamic_reconfigure::ConfigDescription>(
      "/controller/controller/parameter_descriptions", ros::Duration(30.0));
  ASSERT_TRUE(shown);
  ASSERT_EQ(shown->min.doubles.size(), 3u);
  EXPECT_EQ(shown->min.doubles[0].name, "tau");
  EXPECT_EQ(shown->min.doubles[0].value, 1e-5);
  EXPECT_EQ(shown->max.doubles[0].value, 10.0);
  EXPECT_EQ(shown->max.doubles[2].value, 1e4) << "of kappa_a";
}

TEST_F(GainsTest, NotANumberIsRefused) {
  EXPECT_EQ(request({{"kappa_a", std::numeric_limits<double>::quiet_NaN()}}).at("kappa_a"), 8.0);
  EXPECT_EQ(request({{"tau", std::numeric_limits<double>::quiet_NaN()}}).at("tau"), 0.001);
  expectLogged("controller.tau = nan");
}

}  // namespace
}  // namespace jackal_aic::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "gains_test");
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
