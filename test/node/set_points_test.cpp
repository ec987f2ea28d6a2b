// Who may send set points, and as what.

#include <geometry_msgs/TwistStamped.h>
#include <jackal_aic/ControllerState.h>
#include <rosgraph_msgs/Log.h>

#include "other_node.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

class SetPointsTest : public testing::Test {
 protected:
  SetPointsTest() {
    log_ = node_.subscribe<rosgraph_msgs::Log>(
        "/rosout", 100, [this](const rosgraph_msgs::LogConstPtr& message) { logged_ += message->msg + "\n"; });
  }
  void SetUp() override {
    ASSERT_TRUE(robot_.waitFor([this] { return !robot_.states().empty() && !robot_.truth().time.empty(); }, "state"));
  }

  const ControllerState& state() const { return robot_.states().back(); }
  bool drives() const {
    return state().status == ControllerState::DRIVING && state().driven_by == ControllerState::BY_US;
  }

  ros::NodeHandle node_;
  ros::Subscriber log_;
  std::string logged_;
  SimulatedRobot robot_;
};

// The robot's own publisher is on jackal_AIC/set_point, which the controller does not know here.

TEST_F(SetPointsTest, TwistAndTwistStampedAreObeyedAndAnOldOneIsNot) {
  robot_.run(1.0);
  ros::Publisher wanted = node_.advertise<geometry_msgs::TwistStamped>("/wanted_stamped", 1);
  robot_.waitFor([&] { return wanted.getNumSubscribers() > 0; }, "the controller");
  geometry_msgs::TwistStamped message;
  message.twist.linear.x = 0.3;
  const auto send = [&](double age) {
    message.header.stamp = ros::Time::now() - ros::Duration(age);
    wanted.publish(message);
    robot_.run(0.05);
  };
  for (int i = 0; i < 20; ++i) send(0.0);
  EXPECT_TRUE(drives()) << state().reason;
  EXPECT_EQ(state().set_point_forward, 0.3);
  for (int i = 0; i < 40; ++i) send(1.0);
  EXPECT_EQ(state().status, ControllerState::STOPPED);
  EXPECT_EQ(state().driven_by, ControllerState::BY_NOBODY);
  EXPECT_EQ(state().reason, "set point too old");
}

TEST_F(SetPointsTest, AClockOfAnotherIsTold) {
  ros::Publisher wanted = node_.advertise<geometry_msgs::TwistStamped>("/wanted_stamped", 1);
  robot_.waitFor([&] { return wanted.getNumSubscribers() > 0; }, "the controller");
  geometry_msgs::TwistStamped message;
  message.twist.linear.x = 0.3;
  const auto sendUntilTold = [&](double ahead, const std::string& said) {
    const auto told = [&] {
      message.header.stamp = ros::Time::now() + ros::Duration(ahead);
      wanted.publish(message);
      return logged_.find(said) != std::string::npos;
    };
    robot_.waitFor(told, said, 30.0);
    EXPECT_FALSE(drives());
  };
  sendUntilTold(1000.0, "Set points on /wanted_stamped are stamped 1000 s ahead of this node's clock");
  sendUntilTold(-3.0, "Set points on /wanted_stamped are stamped 3 s behind this node's clock");
}

TEST_F(SetPointsTest, TwoNodesAreRefusedWithTheirNames) {
  robot_.run(1.0);
  const std::string publish =
      "rostopic pub -r 20 /wanted geometry_msgs/Twist '{linear: {x: 0.2}}' >/dev/null 2>&1 __name:=";
  const OtherNode first(publish + "first_driver");
  robot_.waitFor([this] { return drives(); }, "to drive by the first", 30.0);
  {
    const OtherNode second(publish + "second_driver");
    const std::string why = "more than one node publishes set points";
    const auto stopped = [&] {
      return state().status == ControllerState::STOPPED && state().reason.find(why) != std::string::npos;
    };
    robot_.waitFor(stopped, "to stop between the two", 30.0);
    EXPECT_EQ(state().driven_by, ControllerState::BY_NOBODY);
    for (const char* name : {"/first_driver", "/second_driver", "/wanted"}) {
      EXPECT_NE(state().reason.find(name), std::string::npos) << state().reason;
    }
  }
  robot_.waitFor([this] { return drives(); }, "to drive by the first alone", 30.0);
}

TEST_F(SetPointsTest, ALatchedOneThatIsPublishedOnceDoesNotDriveForEver) {
  robot_.run(1.0);
  ros::Publisher latched = node_.advertise<geometry_msgs::Twist>("/wanted", 1, true);
  geometry_msgs::Twist forward;
  forward.linear.x = 0.3;
  latched.publish(forward);
  robot_.waitFor([this] { return drives(); }, "to drive", 10.0);
  const double begin = ros::Time::now().toSec();
  const auto stopped = [this] { return state().status == ControllerState::STOPPED; };
  robot_.waitFor(stopped, "to stop", 10.0);
  EXPECT_EQ(state().reason, "set point too old");
  EXPECT_LT(state().header.stamp.toSec() - begin, 1.0) << "deadlines.set_point, and the time to brake";
  robot_.clear();
  robot_.run(10.0);
  for (const ControllerState& told : robot_.states()) {
    ASSERT_EQ(told.status, ControllerState::STOPPED) << told.header.stamp;
    ASSERT_EQ(told.command_left, 0.0) << told.header.stamp;
  }
}

}  // namespace
}  // namespace jackal_aic::test
