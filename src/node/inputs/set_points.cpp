#include "inputs/set_points.hpp"

#include <ros/console.h>
#include <ros/time.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "jackal_aic/config/parameter_map.hpp"
#include "process/wall_times.hpp"

namespace jackal_aic {
namespace {

constexpr double kSameClock = 1.0;  // s; a larger difference is another clock, not a delay

// Without this line "too old" would suggest the network, not the sender's clock.
void warnOfAnotherClock(const std::string& topic, double stamp) {
  const double ahead = stamp - ros::Time::now().toSec();
  if (std::abs(ahead) < kSameClock) return;
  ROS_WARN_THROTTLE(10.0, "Set points on %s are stamped %.0f s %s this node's clock: they count as too old",
                    topic.c_str(), std::abs(ahead), ahead > 0.0 ? "ahead of" : "behind");
}

template <class Message, class Callback>
ros::Subscriber subscribe(ros::NodeHandle& node, const std::string& topic, std::uint32_t queue, Callback callback) {
  const boost::function<void(const ros::MessageEvent<const Message>&)> function = std::move(callback);
  return node.subscribe<Message>(topic, queue, function, ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
}

}  // namespace

SetPoint setPoint(const geometry_msgs::Twist& message) {
  const auto& v = message.linear;
  const auto& w = message.angular;
  const bool finite = std::isfinite(v.x + v.y + v.z + w.x + w.y + w.z);
  return {finite ? v.x : std::numeric_limits<double>::quiet_NaN(), 0.0, w.z};
}

SetPointInput setPointInput(const geometry_msgs::Twist& message) {
  if (message.linear.y != 0.0) {
    ROS_WARN_ONCE("Set points with linear.y: ignored, because a skid-steer robot cannot drive sideways. Told once");
  }
  return {setPoint(message), std::nullopt};
}

SetPointInput setPointInput(const geometry_msgs::TwistStamped& message) {
  SetPointInput input = setPointInput(message.twist);
  if (!message.header.stamp.isZero()) input.stamp = message.header.stamp.toSec();
  return input;
}

SetPointSource::SetPointSource(ros::NodeHandle& node, const std::string& topic, std::uint32_t queue, Take take)
    : take_(std::move(take)) {
  const auto receive = [this](const auto& event) { SetPointSource::receive(event); };
  plain_ = subscribe<geometry_msgs::Twist>(node, topic, queue, receive);
  stamped_ = subscribe<geometry_msgs::TwistStamped>(node, topic + "_stamped", queue, receive);
}

void SetPointSource::requireForeign(const std::vector<std::string>& ours) const {
  for (const std::string& topic : {plain_.getTopic(), stamped_.getTopic()}) {
    if (std::find(ours.begin(), ours.end(), topic) == ours.end()) continue;
    throw ParameterError("set points are remapped to " + topic +
                         ", where this node's own commands would come back as set points; take another output, or "
                         "another topic");
  }
}

std::string SetPointSource::rivals() const {
  const ros::WallTime since = ros::WallTime::now() - ros::WallDuration(kCheckPeriod);
  if (other_.time < since || sender_.time < since) return "";
  const auto [first, second] = std::minmax(other_.name, sender_.name);  // the two send by turns
  return first + " and " + second + " on " + topic();
}

template <class Message>
void SetPointSource::receive(const ros::MessageEvent<const Message>& event) {
  if (event.getPublisherName() != sender_.name) other_ = sender_;
  sender_ = {event.getPublisherName(), ros::WallTime::now()};
  const SetPointInput input = setPointInput(*event.getConstMessage());
  if (input.stamp) warnOfAnotherClock(stamped_.getTopic(), *input.stamp);
  take_(input);
}

}  // namespace jackal_aic
