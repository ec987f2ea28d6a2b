#include "set_point_source.hpp"

#include <ros/console.h>

#include <utility>

namespace jackal_aic {
namespace {

constexpr double kRenewalPeriod = 0.5;  // s of wall time

}  // namespace

SetPointSource::SetPointSource(const ros::NodeHandle& node, const std::string& topic, std::uint32_t queue, Take take)
    : node_(node), name_(topic), queue_(queue), take_(std::move(take)) {
  subscribe();
  timer_ = node_.createWallTimer(ros::WallDuration(kRenewalPeriod), [this](const ros::WallTimerEvent&) { renew(); });
}

void SetPointSource::subscribe() {
  subscriber_ = node_.subscribe(name_, queue_, &SetPointSource::onMessage, this, ros::TransportHints().tcpNoDelay());
  typed_ = wrong_ = false;
}

// A subscription of any type keeps that of its first publisher for good: once that is gone, or was none for a set
// point, a new one takes another.
void SetPointSource::renew() {
  typed_ = typed_ || publishers() > 0;
  if (!typed_ || (!wrong_ && publishers() > 0)) return;
  subscriber_.shutdown();
  subscribe();
}

void SetPointSource::onMessage(const topic_tools::ShapeShifter& message) {
  const std::optional<ReceivedSetPoint> received = receivedSetPoint(message);
  typed_ = true;
  wrong_ = !received;
  if (received) return take_(*received);
  ROS_ERROR_THROTTLE(5.0, "Set points on %s are of type %s: it has to be geometry_msgs/Twist or TwistStamped",
                     topic().c_str(), message.getDataType().c_str());
}

}  // namespace jackal_aic
