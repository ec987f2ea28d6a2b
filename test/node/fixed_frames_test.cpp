// How frames are mounted to each other, out of transforms that anybody may publish; no master.

#include "fixed_frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace jackal_aic {
namespace {

/// An IMU on its side: its y axis points down.
geometry_msgs::TransformStamped onItsSide(const std::string& base = "base_link",
                                          const std::string& frame = "imu_link") {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = base;
  transform.child_frame_id = frame;
  transform.transform.rotation.w = std::sqrt(0.5);
  transform.transform.rotation.x = -std::sqrt(0.5);
  return transform;
}

/// How a yaw rate that the IMU on its side sees about its y axis turns the robot; NaN if its mounting is not known.
double yawOf(const FixedFrames& frames, const std::string& frame = "imu_link") {
  const auto rotation = frames.rotation("base_link", frame);
  return rotation ? (*rotation * Eigen::Vector3d::UnitY()).z() : std::numeric_limits<double>::quiet_NaN();
}

TEST(FixedFrames, RelatesFramesOverOthers) {
  FixedFrames frames;
  EXPECT_FALSE(frames.rotation("base_link", "imu_link"));
  EXPECT_EQ(frames.add(onItsSide("mid_mount")), "");
  auto upright = onItsSide("base_link", "mid_mount");
  upright.transform.rotation.w = 1.0;
  upright.transform.rotation.x = 0.0;
  EXPECT_EQ(frames.add(upright), "");
  EXPECT_NEAR(yawOf(frames), -1.0, 1e-12);
  EXPECT_NEAR(yawOf(frames, "/imu_link"), -1.0, 1e-12) << "as older drivers write it";
  EXPECT_TRUE(frames.rotation("base_link", "base_link")) << "needs no transform";
  EXPECT_FALSE(frames.rotation("base_link", "")) << "no frame";
}

TEST(FixedFrames, AreTheSameWithTheSlashesOfAPrefixThatEndsWithOne) {
  FixedFrames frames;
  EXPECT_EQ(frames.add(onItsSide("robot1//base_link", "robot1//imu_link")), "");
  for (const char* imu : {"robot1/imu_link", "/robot1/imu_link", "robot1//imu_link", "//robot1///imu_link/"}) {
    EXPECT_TRUE(frames.rotation("robot1/base_link", imu)) << imu;
  }
  EXPECT_FALSE(frames.rotation("robot1/base_link", "robot1imu_link"));
  EXPECT_EQ(frames.add(onItsSide("base_link", "base_link/")), "transform of frame 'base_link' to itself");
}

/// tf2's own history throws at these stamps, which ended the process of whoever listened.
TEST(FixedFrames, AreKeptAtAnyStamp) {
  FixedFrames frames;
  auto transform = onItsSide();
  for (const ros::Time& stamp : {ros::Time(4294967295u, 999999999u), ros::Time(0, 1), ros::Time(), ros::Time(1e9)}) {
    transform.header.stamp = stamp;
    EXPECT_EQ(frames.add(transform), "");
    EXPECT_NEAR(yawOf(frames), -1.0, 1e-12);
  }
}

TEST(FixedFrames, WhatRelatesNothingIsRefusedAndLeavesWhatWasKnown) {
  FixedFrames frames;
  ASSERT_EQ(frames.add(onItsSide()), "");
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  auto nowhere = onItsSide();
  nowhere.transform.translation.x = kNaN;
  EXPECT_EQ(frames.add(nowhere), "transform of frame 'imu_link' that is not finite");
  for (const double w : {kNaN, 0.0, 5.0, 1e308}) {
    auto turned = onItsSide();
    turned.transform.rotation.w = w;
    EXPECT_EQ(frames.add(turned), "transform of frame 'imu_link', whose rotation is no unit quaternion") << w;
  }
  EXPECT_EQ(frames.add(onItsSide("imu_link", "/imu_link")), "transform of frame 'imu_link' to itself");
  EXPECT_EQ(frames.add(onItsSide("", "imu_link")), "transform of frame 'imu_link' with a frame that has no name");
  EXPECT_EQ(frames.add(onItsSide("base_link", "//")), "transform of frame '' with a frame that has no name");
  EXPECT_NEAR(yawOf(frames), -1.0, 1e-12);
}

TEST(FixedFrames, FramesThatHangOnEachOtherRelateToNothing) {
  FixedFrames frames;
  EXPECT_EQ(frames.add(onItsSide("b", "a")), "");
  EXPECT_EQ(frames.add(onItsSide("a", "b")), "");
  EXPECT_FALSE(frames.rotation("base_link", "a"));
}

/// A publisher of ever new names takes no memory beyond a bound, and what is known stays.
TEST(FixedFrames, AreBoundedInNumberAndName) {
  FixedFrames frames;
  ASSERT_EQ(frames.add(onItsSide()), "");
  for (std::size_t i = 2; i < FixedFrames::kMostFrames; ++i) {
    ASSERT_EQ(frames.add(onItsSide("base_link", "frame_" + std::to_string(i))), "") << i;
  }
  EXPECT_EQ(frames.add(onItsSide("base_link", "one_more")), "transform of frame 'one_more', which is one too many");
  EXPECT_FALSE(frames.rotation("base_link", "one_more"));
  EXPECT_EQ(frames.add(onItsSide("another_base")), "transform of frame 'imu_link', which is one too many");
  auto upright = onItsSide();
  upright.transform.rotation.w = 1.0;
  upright.transform.rotation.x = 0.0;
  EXPECT_EQ(frames.add(upright), "") << "a frame that is known";
  EXPECT_NEAR(yawOf(frames), 0.0, 1e-12);
  EXPECT_NE(FixedFrames().add(onItsSide("base_link", std::string(FixedFrames::kLongestName + 1, 'x'))), "");
}

/// Whatever a name holds: one line of a log, and no long one.
TEST(FixedFrames, ARefusalIsOneShortLine) {
  FixedFrames frames;
  const std::string name = "\n\x1b[31m[FATAL] forged" + std::string(100000, 'x');
  const std::string refusal = frames.add(onItsSide(name, name));
  EXPECT_LT(refusal.size(), 200u);
  EXPECT_EQ(refusal.find_first_of("\n\x1b"), std::string::npos) << refusal;
}

}  // namespace
}  // namespace jackal_aic
