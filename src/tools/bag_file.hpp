#pragma once

/// @file
/// Reading a bag. The bag library trusts the lengths in a file.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <exception>
#include <string>
#include <vector>

#include "jackal_aic/config/text.hpp"

namespace jackal_aic {

/// Reason why a path is no bag: a directory, or a pipe or device, which would block or never end. Empty for a file or a
/// missing one. Bounds the memory of this process by the size of the file: a wrong length is then a failed allocation,
/// not a busy machine.
std::string prepareToRead(const std::string& path);

/// One line with the path of a bag and the reason in an exception of the bag library.
std::string unreadableBag(const std::string& path, const std::exception& error);

/// Calls `work` with a bag. @throws Error, as `work`, if it cannot be read.
template <class Error, class Work>
void withBag(const std::string& path, const Work& work) {
  if (const std::string refusal = prepareToRead(path); !refusal.empty()) throw Error(refusal);
  try {
    work(rosbag::Bag(path, rosbag::bagmode::Read));
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(unreadableBag(path, error));
  }
}

/// Finds messages of one of the types on a topic. @throws Error naming the topics with that type if there are none,
/// or the type of the topic if it is another one.
template <class Error>
void requireTopic(const rosbag::Bag& bag, const std::string& topic, const std::vector<std::string>& types) {
  std::vector<std::string> others;
  bool found = false;
  rosbag::View all(bag);
  for (const rosbag::ConnectionInfo* connection : all.getConnections()) {
    const bool fits = std::find(types.begin(), types.end(), connection->datatype) != types.end();
    if (connection->topic == topic && !fits) {
      throw Error(fmt::format("{}: {} has type {}, expected {}", bag.getFileName(), topic, quoted(connection->datatype),
                              fmt::join(types, " or ")));
    }
    found = found || connection->topic == topic;
    if (fits) others.push_back(connection->topic);
  }
  if (found) return;
  throw Error(fmt::format("{}: no messages on {} ({}); of that type it has {}", bag.getFileName(), topic,
                          fmt::join(types, " or "),
                          others.empty() ? "none" : shortened(fmt::format("{}", fmt::join(others, ", ")))));
}

/// Calls take(message, instance) for each message of a type on a topic, in the order of recording.
template <class Message, class Take>
void forEach(const rosbag::Bag& bag, const std::string& topic, Take take) {
  for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery(topic))) {
    if (const auto message = instance.instantiate<Message>()) take(message, instance);
  }
}

/// Adds the transforms on a topic of a bag to a buffer, where they hold at any time.
inline void readFrames(const rosbag::Bag& bag, const std::string& topic, tf2::BufferCore& frames) {
  forEach<tf2_msgs::TFMessage>(bag, topic, [&](const auto& message, const auto&) {
    for (const auto& transform : message->transforms) frames.setTransform(transform, "", true);
  });
}

}  // namespace jackal_aic
