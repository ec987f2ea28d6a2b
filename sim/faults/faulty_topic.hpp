#pragma once

/// @file
/// A FaultyChannel between two ROS topics.

#include <ros/node_handle.h>

#include <string>
#include <vector>

#include "faulty_channel.hpp"

namespace jackal_aic::sim {

/// Passes messages on to a topic, with faults. The owner gives the time and calls release() as it passes.
template <class Message>
class FaultyTopic {
 public:
  /// @param topic where the messages go.
  FaultyTopic(ros::NodeHandle& node, const std::string& topic)
      : publisher_(node.advertise<Message>(topic, kQueueSize)) {}

  /// Whether the topic has a subscriber.
  bool heard() const { return publisher_.getNumSubscribers() > 0; }

  /// As FaultyChannel::arm; messages still waiting are forgotten.
  void arm(const std::vector<InjectedFault>& faults, double onset, std::uint64_t seed) {
    channel_.arm(faults, onset, seed);
    queue_.clear();
  }

  /// Takes a message at a time [s] and sends what is due.
  void pass(double now, const Message& message) {
    queue_.add(channel_.pass(now, message));
    release(now);
  }

  /// Sends what is due.
  void release(double now) {
    for (const Message& message : queue_.takeDue(now)) publisher_.publish(message);
  }

 private:
  static constexpr std::uint32_t kQueueSize = 50;  // a second of 50 Hz messages

  FaultyChannel<Message> channel_;
  ReleaseQueue<Message> queue_;
  ros::Publisher publisher_;
};

}  // namespace jackal_aic::sim
