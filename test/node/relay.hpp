#pragma once

/// @file
/// A relay of one topic inside a test, which may alter or swallow what passes: for sensors that lie or fall silent.

#include <ros/ros.h>

#include <functional>
#include <string>

namespace jackal_aic::test {

/// Hands on what a source says, altered by the test.
template <class Message>
class Relay {
 public:
  /// @param from, to topics.
  Relay(ros::NodeHandle& node, const std::string& from, const std::string& to)
      : publisher_(node.advertise<Message>(to, 50)),
        subscriber_(node.subscribe(from, 50, &Relay::pass, this, ros::TransportHints().tcpNoDelay())) {}

  /// Changes a message on its way; false swallows it. Empty: as it is.
  std::function<bool(Message&)> alter;

  /// Repeats the values of the next message from now on, with fresh stamps.
  void freeze() {
    alter = [held = Message(), any = false](Message& message) mutable {
      const auto header = message.header;
      if (!any) held = message;
      any = true;
      message = held;
      message.header = header;
      return true;
    };
  }

  /// Hands on nothing from now on.
  void silence() {
    alter = [](Message&) { return false; };
  }

  /// Whether its output has a subscriber.
  bool heard() const { return last_ > 0.0 && publisher_.getNumSubscribers() > 0; }

  /// Stamp of the message that it handed on last [s].
  double last() const { return last_; }

 private:
  void pass(const Message& original) {
    Message message = original;
    if (alter && !alter(message)) return;
    last_ = message.header.stamp.toSec();
    publisher_.publish(message);
  }

  ros::Publisher publisher_;
  ros::Subscriber subscriber_;
  double last_ = 0.0;
};

}  // namespace jackal_aic::test
