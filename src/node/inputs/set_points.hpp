#pragma once

/// @file
/// Set points: geometry_msgs/Twist on a topic, and TwistStamped on the topic of the same name with `_stamped`.

#include <geometry_msgs/Twist.h>
#include <geometry_msgs/TwistStamped.h>
#include <ros/message_event.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "jackal_aic/safety/drive_input.hpp"

namespace jackal_aic {

/// Set point of a Twist (linear.x, angular.z), which is not finite if any component is not. A skid-steer robot cannot
/// follow the other components: they are left out.
SetPoint setPoint(const geometry_msgs::Twist& message);

SetPointInput setPointInput(const geometry_msgs::Twist& message);         ///< without a stamp; warns of linear.y
SetPointInput setPointInput(const geometry_msgs::TwistStamped& message);  ///< a stamp of zero is unset

/// Subscribes to both topics, and reports stamps of another clock. All calls in the thread of the callbacks.
class SetPointSource {
 public:
  using Take = std::function<void(const SetPointInput&)>;

  /// @param topic of the Twist, in the namespace of `node`; @param queue messages that may wait; @param take called
  /// with each.
  SetPointSource(ros::NodeHandle& node, const std::string& topic, std::uint32_t queue, Take take);

  SetPointSource(const SetPointSource&) = delete;
  SetPointSource& operator=(const SetPointSource&) = delete;

  /// @throws ParameterError if a topic is one of our commands, which would return as set points.
  void requireForeign(const std::vector<std::string>& ours) const;

  std::string topic() const { return plain_.getTopic(); }  ///< of the Twist, as resolved and remapped

  std::vector<ros::Subscriber> subscribers() const { return {plain_, stamped_}; }  ///< of Twist and TwistStamped

  /// The nodes that sent set points at the same time, with the topic; empty for a single one.
  std::string rivals() const;

 private:
  struct Sender {
    std::string name;
    ros::WallTime time;  // of its last message
  };

  template <class Message>
  void receive(const ros::MessageEvent<const Message>& event);

  Take take_;
  Sender sender_;  // of the last message
  Sender other_;   // the last one of another node
  ros::Subscriber plain_;
  ros::Subscriber stamped_;
};

}  // namespace jackal_aic
