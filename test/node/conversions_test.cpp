// Between ROS messages and the types of the core; no master.

#include <gtest/gtest.h>
#include <jackal_msgs/DriveFeedback.h>
#include <jackal_msgs/Feedback.h>
#include <jackal_msgs/Status.h>
#include <ros/message_traits.h>

#include <cmath>
#include <limits>
#include <tuple>

#include "inputs/sensors.hpp"
#include "inputs/set_points.hpp"
#include "outputs/commands.hpp"
#include "outputs/odometry_output.hpp"
#include "outputs/state_output.hpp"

namespace jackal_aic {
namespace {

const std::vector<std::string> kLeft{"front_left_wheel", "rear_left_wheel"};
const double kNaN = std::numeric_limits<double>::quiet_NaN();

sensor_msgs::JointState joints(const std::vector<std::string>& names, const std::vector<double>& velocities) {
  sensor_msgs::JointState message;
  message.name = names;
  message.velocity = velocities;
  return message;
}

sensor_msgs::Imu imu(const Eigen::Vector3d& turn, const Eigen::Vector3d& force) {
  sensor_msgs::Imu message;
  auto &w = message.angular_velocity, &a = message.linear_acceleration;
  std::tie(w.x, w.y, w.z, a.x, a.y, a.z) = std::tuple(turn.x(), turn.y(), turn.z(), force.x(), force.y(), force.z());
  return message;
}

/// What a sensor at rest reports whose frame is turned by `attitude` against the level, and that attitude.
sensor_msgs::Imu atRest(const Eigen::Quaterniond& attitude) {
  sensor_msgs::Imu message = imu({0.0, 0.0, 0.0}, attitude.conjugate() * Eigen::Vector3d(0.0, 0.0, 9.81));
  auto& q = message.orientation;
  std::tie(q.w, q.x, q.y, q.z) = std::tuple(attitude.w(), attitude.x(), attitude.y(), attitude.z());
  return message;
}

/// A robot that drives up a slope of 5 degrees: nose up is a negative turn about y.
Eigen::Quaterniond uphill() {
  return Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()) *
                            Eigen::AngleAxisd(-5.0 * M_PI / 180.0, Eigen::Vector3d::UnitY()));
}

TEST(MeanVelocity, GoesByNameAndRefusesWhatIsMissingOrNotFinite) {
  const auto message = joints({"rear_right_wheel", "mast", "front_left_wheel", "front_right_wheel", "rear_left_wheel"},
                              {7.0, 99.0, 1.0, 5.0, 3.0});
  const auto mean = wheelObservation(message, RobotNames{});
  ASSERT_TRUE(mean);
  EXPECT_DOUBLE_EQ(mean->wheel_left, 2.0);
  EXPECT_DOUBLE_EQ(mean->wheel_right, 6.0);
  EXPECT_DOUBLE_EQ(wheelObservation(joints({"rear_left_wheel", "rear_right_wheel"}, {4.0, 5.0}), {})->wheel_left, 4.0);
  EXPECT_TRUE(mentionsAny(message, kLeft));
  EXPECT_FALSE(mentionsAny(joints({"mast"}, {4.0}), kLeft));
  const std::vector<std::string> all{"front_left_wheel", "rear_left_wheel", "front_right_wheel", "rear_right_wheel"};
  for (const auto& bad : {joints({"rear_left_wheel"}, {4.0}), joints(all, {1.0, 1.0, 1.0}), joints(all, {}),
                          joints(all, {1.0, kNaN, 1.0, 1.0}), joints(all, {1.7e308, 1.7e308, 1.0, 1.0})}) {
    EXPECT_FALSE(wheelObservation(bad, {}));
  }
}

/// Yaw rate and accelerations of a message; empty if it is refused.
std::optional<Eigen::Vector4d> planarMotion(const sensor_msgs::Imu& message, const Eigen::Quaterniond& rotation) {
  const auto y = imuObservation(message, rotation);
  if (!y) return std::nullopt;
  return Eigen::Vector4d(y->yaw_rate, y->acceleration_x, y->acceleration_y, *y->acceleration_z);
}

TEST(PlanarMotion, RotatesIntoTheBaseFrameAndRefusesWhatIsNotFinite) {
  const Eigen::Quaterniond none = Eigen::Quaterniond::Identity();
  const std::pair<Eigen::Quaterniond, Eigen::Vector4d> rows[] = {
      {none, {0.3, 1.0, 2.0, 9.8}},
      {Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX())), {-0.3, 1.0, -2.0, -9.8}},
      {Eigen::Quaterniond(Eigen::AngleAxisd(M_PI_2, Eigen::Vector3d::UnitZ())), {0.3, -2.0, 1.0, 9.8}}};
  for (const auto& [mounting, motion] : rows) {
    EXPECT_TRUE(planarMotion(imu({0.1, 0.2, 0.3}, {1.0, 2.0, 9.8}), mounting)->isApprox(motion)) << motion.transpose();
  }
  EXPECT_FALSE(planarMotion(imu({0.0, 0.0, kNaN}, {0.0, 0.0, 9.8}), none));
  EXPECT_FALSE(planarMotion(imu({0.0, 0.0, 0.0}, {kNaN, 0.0, 9.8}), none));
}

TEST(PlanarMotion, AttitudeTakesGravityOutHoweverTheSensorIsMounted) {
  for (const Eigen::Quaterniond& mounting :
       {Eigen::Quaterniond::Identity(), Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX())),
        Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1.0, 2.0, -1.0).normalized()))}) {
    const auto motion = planarMotion(atRest(uphill() * mounting), mounting);
    EXPECT_NEAR(motion->segment<2>(1).norm(), 0.0, 1e-12);
    EXPECT_NEAR((*motion)(3), 9.81 * std::cos(5.0 * M_PI / 180.0), 1e-12);
    EXPECT_TRUE(imuObservation(atRest(uphill() * mounting), mounting)->level);
  }
  sensor_msgs::Imu driving = atRest(uphill());
  driving.linear_acceleration.x += 0.3;
  EXPECT_NEAR((*planarMotion(driving, Eigen::Quaterniond::Identity()))(1), 0.3, 1e-12);
  sensor_msgs::Imu no_estimate = atRest(uphill()), unset = no_estimate, not_finite = no_estimate, fixed = no_estimate;
  no_estimate.orientation_covariance[0] = -1.0;
  unset.orientation = geometry_msgs::Quaternion();
  not_finite.orientation.x = kNaN;
  fixed.orientation = geometry_msgs::Quaternion();
  fixed.orientation.w = 1.0;
  for (const auto& message : {no_estimate, unset, not_finite, fixed}) {  // 9.81 sin(5 deg)
    EXPECT_NEAR((*planarMotion(message, Eigen::Quaterniond::Identity()))(1), 0.855, 1e-3) << "gravity stays";
    EXPECT_FALSE(imuObservation(message, Eigen::Quaterniond::Identity())->level);
  }
}

TEST(SetPointOfTwist, TakesForwardSpeedAndYawRate) {
  geometry_msgs::Twist twist;
  twist.linear.x = 0.5;
  twist.linear.y = 0.3;
  twist.angular.z = -0.4;
  const SetPoint wanted = setPoint(twist);
  EXPECT_EQ(wanted.forward, 0.5);
  EXPECT_EQ(wanted.lateral, 0.0) << "a skid-steer robot cannot go sideways";
  EXPECT_EQ(wanted.yaw_rate, -0.4);
  twist.angular.x = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(setPoint(twist).vector().allFinite()) << "a message that is broken anywhere is not trusted";
}

/// A drive loop whose robot turns to the left.
template <class Gains>
DriveLoop turning(const Gains& gains) {
  DriveParameters parameters;
  parameters.controller = gains;
  parameters.plant_model = PlantModel{};
  DriveLoop loop(parameters, makeController(parameters));
  loop.setSetPoint({0.5, 0.0, 0.2}, 1.0);
  loop.observe({1.0, 0.3, 2.0, 4.0, 0.0, 0.0}, 1.0);
  loop.advance(1.0);
  loop.observe({1.02, 0.2, 2.2, 4.1, 0.0, 0.0}, 1.02);
  loop.updateBelief(1.02);
  return loop;
}

ControllerState messageOf(const DriveLoop& loop, const DriveLoopStatus& status, const Surroundings& around = {}) {
  ControllerState message;
  fillState(loop, ros::Time(1.02), message);
  addRemarks(status, around, "base_link", message);
  return message;
}

ControllerState messageOf(const DriveLoop& loop) { return messageOf(loop, loop.status()); }

TEST(StateMessage, CarriesBeliefAndErrorsOfAllOrders) {
  const DriveLoop loop = turning(ControllerParameters{});
  const auto& controller = dynamic_cast<const ActiveInferenceController&>(loop.controller());
  const ControllerState message = messageOf(loop);
  EXPECT_EQ(message.structure, ControllerState::THESIS);
  const auto orders = [](const auto& rows, int row) {
    return std::vector<double>{rows(row, 0), rows(row, 1), rows(row, 2), rows(row, 3)};
  };
  EXPECT_EQ(message.belief_forward, orders(controller.belief(), kForward));
  EXPECT_EQ(message.belief_yaw_rate, orders(controller.belief(), kYaw));
  EXPECT_EQ(message.sensory_error_wheel_left, orders(controller.errors().sensory, kWheelLeft));
  EXPECT_EQ(message.sensory_error_wheel_right, orders(controller.errors().sensory, kWheelRight));
  EXPECT_EQ(message.state_error_yaw_rate, orders(controller.errors().state, kYaw));
  EXPECT_EQ(message.free_energy, controller.freeEnergy());
  EXPECT_EQ(message.effective_track, GeometryParameters{}.effective_track);
}

TEST(StateMessage, CarriesWhatThePredictiveControllerBelieves) {
  const DriveLoop loop = turning(PredictiveParameters{});
  const PredictiveController& controller = *loop.predictive();
  const ControllerState message = messageOf(loop);
  EXPECT_EQ(message.structure, ControllerState::PREDICTIVE);
  EXPECT_EQ(message.belief_forward, std::vector<double>{controller.believedVelocity()(kForward)});
  EXPECT_EQ(message.belief_yaw_rate, std::vector<double>{controller.believedVelocity()(kYaw)});
  EXPECT_TRUE(message.state_error_forward.empty());
  EXPECT_EQ(message.sensory_error_wheel_left, std::vector<double>{controller.sensoryErrors()(kWheelLeft)});
  EXPECT_EQ(message.sensory_error_wheel_right, std::vector<double>{controller.sensoryErrors()(kWheelRight)});
  EXPECT_EQ(message.wheel_belief_left, controller.left().speed());
  EXPECT_EQ(message.wheel_belief_right, controller.right().speed());
  EXPECT_EQ(message.disturbance_right, controller.right().disturbance());
  EXPECT_EQ(message.effective_track, controller.effectiveTrack());
  EXPECT_GT(message.wheel_belief_right, message.wheel_belief_left);
}

TEST(StateMessage, SaysWhoDrivesAndWhyNot) {
  DriveParameters parameters;
  parameters.controller = DifferentialDriveParameters{};
  DriveLoop loop(parameters, makeController(parameters));
  loop.release();
  loop.setSetPoint({0.5, 0.0, 0.0}, 1.0);
  for (int k = 0; k <= 5; ++k) loop.advance(1.0 + 0.02 * k);
  ASSERT_GT(loop.command().left, 0.0);
  EXPECT_TRUE(messageOf(loop).belief_forward.empty()) << "the baseline has none";
  const std::string absent = "no subscriber on /cmd_vel";
  using State = ControllerState;
  DriveLoopStatus status = loop.status();
  const std::tuple<Surroundings, std::uint8_t, std::string, std::string> rows[] = {
      {{}, State::BY_US, "", "driven by this controller"},
      {{"", absent}, State::BY_NOBODY, absent, "not driven"},
      {{"", "", true}, State::BY_ANOTHER, "", "driven by another node"}};
  for (const auto& [around, driven_by, reason, summary] : rows) {
    const ControllerState message = messageOf(loop, status, around);
    EXPECT_EQ(message.driven_by, driven_by) << summary;
    EXPECT_EQ(message.reason, reason);
    EXPECT_EQ(message.summary, "thesis, driving, " + summary);
  }
  EXPECT_EQ(messageOf(loop).hypothesis, "") << "without fault detection";
  status.suspicion = {faults::kGyroOffset, 0.6};
  status.loss = Loss::yaw_rate;
  const ControllerState message = messageOf(loop, status, {"", absent, false, 3});
  EXPECT_EQ(message.rejected_measurements, 3u);
  EXPECT_EQ(message.reason, "yaw rate lost; " + absent);
  EXPECT_EQ(message.hypothesis, "gyro offset");
  EXPECT_EQ(message.hypothesis_probability, 0.6);
  status.handed_over = true;
  EXPECT_EQ(messageOf(loop, status).driven_by, State::BY_ANOTHER);
}

// The sums of Clearpath's own package: with them a robot's nodes and ours accept each other's messages.
TEST(JackalMsgs, AreWireCompatibleWithTheRobots) {
  using namespace ros::message_traits;
  EXPECT_STREQ(MD5Sum<jackal_msgs::Drive>::value(), "601cf097cd47c174590c366c6ddd5fb3");
  EXPECT_STREQ(MD5Sum<jackal_msgs::DriveFeedback>::value(), "8dd0b7a3cfa20cfc5c054ddd9763609b");
  EXPECT_STREQ(MD5Sum<jackal_msgs::Feedback>::value(), "3bdabb0ef46338ee5672d1b82220ab49");
  EXPECT_STREQ(MD5Sum<jackal_msgs::Status>::value(), "c851ebcf9a6e20b196bc7894e285b4f6");
}

}  // namespace
}  // namespace jackal_aic
