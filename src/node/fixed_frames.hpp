#pragma once

/// @file
/// How frames are mounted to each other, as /tf and /tf_static say.

#include <geometry_msgs/TransformStamped.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>

namespace jackal_aic {

/// Frames that do not move against each other. Of a transform the last one that came counts, with any stamp: the
/// history that tf2 keeps of frames that move does not survive a stamp at the end of time.
class FixedFrames {
 public:
  static constexpr std::size_t kMostFrames = 1000;  ///< bound of what is kept, as any node may publish on /tf
  static constexpr std::size_t kLongestName = 256;  ///< [characters]

  /// Takes a transform. Returns why it is refused, which leaves what was known: frames without a name, with one of more
  /// than kLongestName characters or of the same one, a number that is not finite, an invalid rotation, a frame
  /// beyond the kMostFrames first ones; empty if it was taken.
  std::string add(const geometry_msgs::TransformStamped& transform);

  /// Turns vectors of `frame` into those of `base`; std::nullopt if no transforms relate the two.
  std::optional<Eigen::Quaterniond> rotation(const std::string& base, const std::string& frame) const;

 private:
  tf2::BufferCore frames_;
  std::set<std::string> names_;  // that tf2 keeps
};

/// Keeps the transforms of the topics /tf and /tf_static. Tells of one that is refused once: a driver without positions
/// has robot_state_publisher send it for ever.
class FrameListener {
 public:
  /// Listens in the callback queue of `node`. @param frames have to outlive the listener.
  FrameListener(ros::NodeHandle node, FixedFrames& frames);

 private:
  void take(const tf2_msgs::TFMessage& message);

  static constexpr std::size_t kMostTold = 20;

  FixedFrames& frames_;
  std::set<std::string> told_;  // refusals
  ros::Subscriber moving_;
  ros::Subscriber fixed_;
};

}  // namespace jackal_aic
