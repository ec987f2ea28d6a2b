#include "fixed_frames.hpp"

#include <ros/console.h>
#include <tf2/exceptions.h>

#include <algorithm>

#include "jackal_aic/config/text.hpp"
#include "jackal_aic/model/gravity.hpp"

namespace jackal_aic {
namespace {

/// A frame's name as tf2 takes it: those of older drivers begin with a slash, and robot_state_publisher puts one more
/// behind a tf_prefix that ends with one.
std::string frameName(const std::string& name) {
  std::string plain;
  for (const char c : name) {
    if (c != '/' || (!plain.empty() && plain.back() != '/')) plain += c;
  }
  if (!plain.empty() && plain.back() == '/') plain.pop_back();
  return plain;
}

}  // namespace

std::string FixedFrames::add(const geometry_msgs::TransformStamped& transform) {
  geometry_msgs::TransformStamped named = transform;
  named.header.frame_id = frameName(transform.header.frame_id);
  named.child_frame_id = frameName(transform.child_frame_id);
  const auto refused = [&](const char* why) {
    return "transform of frame " + jackal_aic::quoted(named.child_frame_id) + why;
  };
  if (named.child_frame_id.empty() || named.header.frame_id.empty()) return refused(" with a frame that has no name");
  if (std::max(named.child_frame_id.size(), named.header.frame_id.size()) > kLongestName) {
    return refused(" with a name that is too long");
  }
  if (named.child_frame_id == named.header.frame_id) return refused(" to itself");
  const auto& t = transform.transform.translation;
  const auto& q = transform.transform.rotation;
  if (!Eigen::Vector3d(t.x, t.y, t.z).allFinite()) return refused(" that is not finite");
  if (!unitAttitude({q.w, q.x, q.y, q.z})) return refused(", whose rotation is no unit quaternion");
  const std::string& parent = named.header.frame_id;
  const std::size_t unknown = 2 - names_.count(named.child_frame_id) - names_.count(parent);
  if (unknown > 0 && names_.size() + unknown > kMostFrames) return refused(", which is one too many");
  if (!frames_.setTransform(named, "", true)) return refused(" that tf2 does not take");
  names_.insert({named.child_frame_id, parent});
  return "";
}

std::optional<Eigen::Quaterniond> FixedFrames::rotation(const std::string& base, const std::string& frame) const {
  const std::string to = frameName(base), from = frameName(frame);
  if (to == from) return Eigen::Quaterniond::Identity();
  try {
    const auto q = frames_.lookupTransform(to, from, ros::Time(0)).transform.rotation;
    return Eigen::Quaterniond(q.w, q.x, q.y, q.z);
  } catch (const tf2::TransformException&) {
    return std::nullopt;
  }
}

FrameListener::FrameListener(ros::NodeHandle node, FixedFrames& frames)
    : frames_(frames),
      moving_(node.subscribe("/tf", 100, &FrameListener::take, this)),
      fixed_(node.subscribe("/tf_static", 100, &FrameListener::take, this)) {}

void FrameListener::take(const tf2_msgs::TFMessage& message) {
  for (const geometry_msgs::TransformStamped& transform : message.transforms) {
    const std::string refusal = frames_.add(transform);
    if (refusal.empty() || told_.size() == kMostTold || !told_.insert(refusal).second) continue;
    ROS_WARN("Rejected %s. Told once", refusal.c_str());
  }
}

}  // namespace jackal_aic
