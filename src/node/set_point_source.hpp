#pragma once

/// @file
/// Set points from a topic on which they may come as geometry_msgs/Twist or as TwistStamped.

#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/wall_timer.h>
#include <topic_tools/shape_shifter.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "conversions.hpp"

namespace jackal_aic {

/// Subscribes to one topic with any type, and reports a type that no set point has, and stamps by another clock.
class SetPointSource {
 public:
  using Take = std::function<void(const ReceivedSetPoint&)>;
  using Types = std::function<std::vector<std::string>()>;

  /// @param topic in the namespace of `node`; @param queue messages that may wait; @param take called with each;
  /// @param living tells the types of the publishers that live, as GraphWatch::loneTypes(): one that crashed does not
  /// keep those of another type from being heard.
  SetPointSource(const ros::NodeHandle& node, const std::string& topic, std::uint32_t queue, Take take, Types living);

  SetPointSource(const SetPointSource&) = delete;
  SetPointSource& operator=(const SetPointSource&) = delete;

  /// @throws ParameterError if the topic is one of ours: our own commands would come back as set points.
  void requireForeign(const std::vector<std::string>& ours) const;

  std::string topic() const { return subscriber_.getTopic(); }                 ///< as resolved and remapped
  std::uint32_t publishers() const { return subscriber_.getNumPublishers(); }  ///< connected

 private:
  void subscribe();
  void renew();
  bool boundToTheDead() const;
  void onMessage(const topic_tools::ShapeShifter& message);
  void tellOfAnotherClock(double stamp) const;

  ros::NodeHandle node_;
  std::string name_;
  std::uint32_t queue_;
  Take take_;
  Types living_;
  ros::Subscriber subscriber_;
  bool typed_ = false;  // the subscription has taken a publisher's type
  bool wrong_ = false;  // which no set point has
  std::string type_;    // of the last message; empty before the first of a subscription
  ros::WallTime arrival_;
  ros::WallTimer timer_;
};

}  // namespace jackal_aic
