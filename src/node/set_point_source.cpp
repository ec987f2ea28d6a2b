#include "set_point_source.hpp"

#include <ros/console.h>
#include <ros/time.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic {
namespace {

constexpr double kRenewalPeriod = 0.5;  // s of wall time
constexpr double kSilence = 1.0;        // s of wall time, after which a publisher may have crashed
constexpr double kSameClock = 1.0;      // s; more no network delays
constexpr double kTellPeriod = 5.0;     // s

}  // namespace

SetPointSource::SetPointSource(const ros::NodeHandle& node, const std::string& topic, std::uint32_t queue, Take take,
                               Types living)
    : node_(node), name_(topic), queue_(queue), take_(std::move(take)), living_(std::move(living)) {
  subscribe();
  timer_ = node_.createWallTimer(ros::WallDuration(kRenewalPeriod), [this](const ros::WallTimerEvent&) { renew(); });
}

void SetPointSource::requireForeign(const std::vector<std::string>& ours) const {
  if (std::find(ours.begin(), ours.end(), topic()) == ours.end()) return;
  throw ParameterError(name_ + " is remapped to " + topic() +
                       ", where this node's own commands would come back as set points; take another output, or "
                       "another topic");
}

void SetPointSource::subscribe() {
  subscriber_ = node_.subscribe(name_, queue_, &SetPointSource::onMessage, this, ros::TransportHints().tcpNoDelay());
  typed_ = wrong_ = false;
  type_.clear();
}

// A subscription of any type keeps that of its first publisher for good: once that is gone, or was none for a set
// point, a new one takes another.
void SetPointSource::renew() {
  typed_ = typed_ || publishers() > 0;
  if (!typed_ || (!wrong_ && publishers() > 0 && !boundToTheDead())) return;
  subscriber_.shutdown();
  subscribe();
}

/// The link of a publisher that crashed counts, and binds the subscription to its type, while the master lists it. A
/// living publisher of that type stays, however long it has been silent: a latched set point must not come twice.
bool SetPointSource::boundToTheDead() const {
  if (type_.empty() || (ros::WallTime::now() - arrival_).toSec() < kSilence) return false;
  const std::vector<std::string> types = living_();
  const auto may_be_heard = [this](const std::string& type) { return type.empty() || type == type_; };
  return !types.empty() && std::none_of(types.begin(), types.end(), may_be_heard);
}

void SetPointSource::onMessage(const topic_tools::ShapeShifter& message) {
  const std::optional<ReceivedSetPoint> received = receivedSetPoint(message);
  typed_ = true;
  wrong_ = !received;
  type_ = message.getDataType();
  arrival_ = ros::WallTime::now();
  if (received) {
    if (received->stamp) tellOfAnotherClock(*received->stamp);
    return take_(*received);
  }
  ROS_ERROR_THROTTLE(kTellPeriod, "Set points on %s are of type %s: it has to be geometry_msgs/Twist or TwistStamped",
                     topic().c_str(), message.getDataType().c_str());
}

// "Too old" alone would suggest the network as the cause instead of the sender's clock.
void SetPointSource::tellOfAnotherClock(double stamp) const {
  const double ahead = stamp - ros::Time::now().toSec();
  if (std::abs(ahead) < kSameClock) return;
  ROS_WARN_THROTTLE(kTellPeriod, "Set points on %s are stamped %.0f s %s this node's clock: they count as too old",
                    topic().c_str(), std::abs(ahead), ahead > 0.0 ? "ahead of" : "behind");
}

}  // namespace jackal_aic
